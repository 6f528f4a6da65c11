"""Links of the docs have targets, generated pages are current, and the tutorial runs."""

from __future__ import annotations

import importlib.util
import os
import re
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
PAGES = sorted([*DOCS.rglob("*.md"), *ROOT.glob("*.md")])
PYTHON = re.compile(r"^```python\n(.*?)^```", re.MULTILINE | re.DOTALL)
COMMAND = re.compile(r"^    (firstfix .*)$", re.MULTILINE)
LINK = re.compile(r"\[[^\]]*\]\(([^)#]+)(?:#[^)]*)?\)")


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_have_targets(page):
    text = re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
    text = re.sub(r"`[^`]*`", "", text)
    for link in LINK.findall(text):
        if not link.startswith(("http://", "https://", "mailto:")):
            assert (page.parent / link).exists(), f"{page.name} links to {link}"


def script(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, DOCS / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_settings_are_those_of_the_dataclasses():
    written = (DOCS / "reference" / "settings.md").read_text(encoding="utf-8")
    assert written == script("make_settings").page(), "run: python docs/make_settings.py"


@pytest.mark.parametrize("page", ["README.md", "docs/index.md", "docs/experiments.md"])
def test_figures_are_those_of_the_one_file(page):
    pages = script("make_figures")
    text = (ROOT / page).read_text(encoding="utf-8")
    assert text == pages.current(ROOT / page), "run: python docs/make_figures.py"


def test_each_figure_has_a_sample_and_a_section():
    for row in script("make_figures").figures():
        page, _, anchor = row["link"].partition("#")
        headings = re.findall(
            r"^##+ (.*)$", (DOCS / page).read_text(encoding="utf-8"), re.MULTILINE
        )
        anchors = {re.sub(r"[^\w -]", "", h.lower()).replace(" ", "-") for h in headings}
        assert not anchor or anchor in anchors, row["link"]


def test_the_table_of_topics_is_current():
    page = (DOCS / "ros.md").read_text(encoding="utf-8")
    assert page == script("make_settings").with_tables(page), "run: python docs/make_settings.py"


def test_the_import_graph_is_current():
    graph = script("make_import_graph")
    page = graph.PAGE.read_text(encoding="utf-8")
    found = graph.imports()
    assert page == graph.page_with(found, page), "run: python docs/make_import_graph.py"
    for package in graph.PACKAGES:
        assert (package, graph.BOTTOM) in found


def test_every_page_is_in_the_table_of_contents():
    contents = (ROOT / "mkdocs.yml").read_text(encoding="utf-8")
    for page in DOCS.rglob("*.md"):
        name = page.relative_to(DOCS).as_posix()
        assert name in contents or name.startswith("decisions/"), f"mkdocs.yml does not name {name}"


@pytest.mark.slow
def test_the_tutorial_runs(tmp_path):
    """All its commands and programs run, in their order."""
    text = (DOCS / "tutorial.md").read_text(encoding="utf-8")
    steps = sorted(
        [(m.start(), "python", m.group(1)) for m in PYTHON.finditer(text)]
        + [(m.start(), "command", m.group(1)) for m in COMMAND.finditer(text)]
    )
    assert [kind for _, kind, _ in steps].count("command") >= 4
    for _, kind, code in steps:
        if kind == "python":
            run = [sys.executable, "-c", code]
        else:
            run = [sys.executable, "-m", *code.split()]
        done = subprocess.run(
            run, cwd=tmp_path, env=dict(os.environ), capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, f"{code}\n{done.stdout}\n{done.stderr}"
    for name in ("office.yaml", "drive.npz", "found.png", "track.png", "track.tum"):
        assert (tmp_path / name).stat().st_size > 0
