"""Every command of a page that ends by itself runs as printed.

Nodes, servers and the live page do not end; programs of others are not ours to run. Their names
and options are checked by test_commands.py and test_ros.py. The experiments take hours.
"""

import re
import shlex
import shutil
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import pytest

from firstfix.cli.app import run

ROOT = Path(__file__).resolve().parents[2]
# test_docs.py runs those of the tutorial together with its programs.
LEFT_OUT = {ROOT / "docs" / "experiments.md", ROOT / "docs" / "tutorial.md"}
ENDLESS = {"ros1", "ros2", "dds", "serve", "fleet"}
COMMAND = re.compile(r"^    firstfix (.*)$", re.MULTILINE)


def commands(page: Path) -> list[list[str]]:
    """Return the words of each command that ends."""
    text = page.read_text(encoding="utf-8")
    lines = (shlex.split(line, comments=True) for line in COMMAND.findall(text))
    return [w for w in lines if w[0] not in ENDLESS and w != ["demo"] and "--serve" not in w]


PAGES = {
    str(page.relative_to(ROOT)): found
    for page in sorted([*(ROOT / "docs").rglob("*.md"), *ROOT.glob("*.md")])
    if page not in LEFT_OUT and (found := commands(page))
}


@pytest.fixture
def folder(files: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Give a copy of the files as the working folder."""
    shutil.copytree(files, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    # A process for each case takes seconds to start; those have tests of their own.
    monkeypatch.setattr("firstfix.lab.experiments.benchmark.run_in_processes", run_here)
    return tmp_path


def run_here(
    tasks: Sequence[Callable[[], Any]], jobs: int, on_done: Callable[[int, Any], None]
) -> list[Any]:
    results = [task() for task in tasks]
    for i, result in enumerate(results):
        on_done(i, result)
    return results


def prepared(page: str, folder: Path) -> None:
    """Write what only this page needs."""
    text = (ROOT / page).read_text(encoding="utf-8")
    if page.endswith("compare.md"):
        (function,) = re.findall(r"^```python\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
        (folder / "my_module.py").write_text(function)
        rows = re.findall(r"^    (case,.*|office,.*)$", text, re.MULTILINE)
        (folder / "poses.csv").write_text("\n".join(rows) + "\n")
        for case in ("office", "hall"):
            arguments = ["case", "make", "map.yaml", "drive.bag", case, "--truth", "poses.tum"]
            assert run(arguments) == 0


@pytest.mark.slow
@pytest.mark.parametrize("page", PAGES)
def test_the_commands_of_a_page_run(page: str, folder: Path) -> None:
    prepared(page, folder)
    for words in PAGES[page]:
        arguments = [part for word in words for part in given(word)]
        if words[:2] == ["map", "check"]:
            arguments += ["--samples", "3"]  # quicker
        if words[0] == "case":
            (folder / "cases").mkdir()
        status = run(arguments)
        may_be_ambiguous = words[0] == "locate" or words[:2] == ["site", "locate"]
        assert status in ((0, 1) if may_be_ambiguous else (0,)), " ".join(words)
        if "--plot" in words:
            assert (folder / words[words.index("--plot") + 1]).stat().st_size > 0


def given(word: str) -> list[str]:
    """Return what stands for a word of the page."""
    return ["office", "hall"] if word == "CASES..." else [word]


def test_commands_are_found() -> None:
    assert {"docs/howto/bag.md", "docs/howto/compare.md", "docs/gallery.md"} <= set(PAGES)
    assert sum(map(len, PAGES.values())) > 25
