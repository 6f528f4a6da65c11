"""Every Python block of README and docs runs as printed.

The blocks of a page run in their order, in one namespace, in a folder that has the files they load.
A block that needs what a test cannot have stands below a comment ``<!-- not run: why -->``; it is
compiled only.
"""

import re
from dataclasses import dataclass
from itertools import chain
from pathlib import Path

import pytest

import firstfix as ff

ROOT = Path(__file__).resolve().parents[2]
BLOCK = re.compile(r"^(<!-- not run: .+ -->\n+)?```python\n(.*?)^```$", re.MULTILINE | re.DOTALL)
# test_docs.py runs these together with the commands of the page.
FOLLOWED = {ROOT / "docs" / "tutorial.md"}
SCANS = 40


@dataclass
class Block:
    """A block of code of a page, compiled with its place in the page."""

    page: Path
    line: int
    code: str
    is_run: bool

    def compiled(self) -> object:
        """Return code whose tracebacks show the line of the page."""
        return compile("\n" * self.line + self.code, str(self.page), "exec")


def blocks_of(page: Path) -> list[Block]:
    text = page.read_text(encoding="utf-8")
    return [
        Block(page, text.count("\n", 0, found.start(2)), found[2], found[1] is None)
        for found in BLOCK.finditer(text)
    ]


PAGES = {
    str(page.relative_to(ROOT)): blocks
    for page in sorted([*(ROOT / "docs").rglob("*.md"), *ROOT.glob("*.md")])
    if (blocks := blocks_of(page))
}


@pytest.fixture(scope="module")
def drive() -> tuple[ff.OccupancyGrid, ff.Recording]:
    """Give an office and the first seconds of a drive in it."""
    grid, recording = ff.simulate_drive("office", seed=1)
    return grid, ff.Recording(recording.scans[:SCANS], recording.odometry)


@pytest.fixture
def folder(
    drive: tuple[ff.OccupancyGrid, ff.Recording], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Path:
    """Give the files under the names of the pages, in the working directory."""
    grid, recording = drive
    for name in ("map", "office"):
        ff.save_map(grid, tmp_path / f"{name}.yaml")
    for name in ("scans", "drive"):
        ff.save_recording(recording, tmp_path / f"{name}.npz")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def run(blocks: list[Block]) -> None:
    namespace = {"__name__": "__main__"}
    for block in blocks:
        code = block.compiled()
        if block.is_run:
            exec(code, namespace)  # noqa: S102 - our own pages


@pytest.mark.slow
@pytest.mark.parametrize("page", [page for page in PAGES if ROOT / page not in FOLLOWED])
def test_the_blocks_of_a_page_run(page: str, folder: Path) -> None:
    run(PAGES[page])


@pytest.mark.slow
def test_the_readme_prints_the_pose(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    first = PAGES["README.md"][0]
    assert len([line for line in first.code.splitlines() if line.strip()]) <= 10
    run([first])
    assert re.fullmatch(
        r"UNIQUE \(\d+\.\d\d, \d+\.\d\d\) m -?\d+\.\d° ±\d\.\d cm, p 1\.00\n",
        capsys.readouterr().out,
    )
    assert (folder / "place.png").stat().st_size > 0


def test_blocks_are_found_and_few_are_not_run() -> None:
    assert {"README.md", "docs/tutorial.md", "docs/howto/product.md"} <= set(PAGES)
    assert [page for page, blocks in PAGES.items() for b in blocks if not b.is_run] == [
        "docs/ros.md"
    ]
    fences = sum(
        page.read_text(encoding="utf-8").count("```python")
        for page in [*(ROOT / "docs").rglob("*.md"), *ROOT.glob("*.md")]
    )
    assert sum(map(len, PAGES.values())) == fences


@pytest.mark.parametrize(
    "block", [*chain(*PAGES.values())], ids=lambda b: f"{b.page.stem}:{b.line}"
)
def test_users_import_from_the_package_alone(block: Block) -> None:
    assert not re.search(r"^\s*(from|import) firstfix\.", block.code, re.MULTILINE)
    for name in re.findall(r"\bff\.(\w+)", block.code):
        assert name in ff.__all__


@pytest.mark.slow
@pytest.mark.shared
def test_the_loop_of_the_product_page_tracks_a_real_bag(
    shared: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    (block,) = PAGES["docs/howto/product.md"]
    grid = str(shared / "cases" / "olin_mac1_9_23" / "map.yaml")
    bag = str(shared / "bags" / "olin_ros2")
    block = Block(
        block.page,
        block.line,
        block.code.replace("office.yaml", grid).replace("drive.npz", bag),
        True,
    )
    run([block])
    assert capsys.readouterr().out.startswith("LOCALIZED")
