"""Wrong input: exit 2, one line on stderr, nothing on stdout, never a traceback."""

import sys
from pathlib import Path

import numpy as np
import pytest

Files = tuple[Path, Path]


def spoil_scan(unique: Files, folder: Path, **changes: object) -> Path:
    with np.load(unique[1]) as log:
        kept = dict(log) | changes
    path = folder / "spoilt.npz"
    np.savez(path, **{k: v for k, v in kept.items() if v is not None})
    return path


def test_a_map_that_is_not_there(cli, unique: Files) -> None:
    cli("locate", "nowhere.yaml", unique[1]).assert_refused("nowhere.yaml")


def test_a_log_that_is_not_there(cli, unique: Files) -> None:
    cli("locate", unique[0], "nowhere.npz").assert_refused("nowhere.npz")


def test_a_map_that_is_none(cli, unique: Files, tmp_path: Path) -> None:
    (tmp_path / "cat.yaml").write_text("image: cat.png\nresolution: purr\n\norigin: [0, 0, 0]\n")
    cli("locate", "cat.yaml", unique[1]).assert_refused()
    cli("map", "check", "cat.yaml").assert_refused()
    cli("map", "show", "cat.yaml").assert_refused()
    cli("demo", "--world", "cat.yaml").assert_refused()


def test_an_image_cut_short(cli, unique: Files, tmp_path: Path) -> None:
    text = unique[0].read_text()
    (tmp_path / "map.yaml").write_text(text)
    for image in unique[0].parent.glob("*.pgm"):
        (tmp_path / image.name).write_bytes(image.read_bytes()[:200])
    cli("locate", "map.yaml", unique[1]).assert_refused()


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04 no archive", b"\x00" * 100])
def test_a_log_that_is_none(cli, unique: Files, tmp_path: Path, content: bytes) -> None:
    (tmp_path / "log.npz").write_bytes(content)
    cli("locate", unique[0], "log.npz").assert_refused()


@pytest.mark.parametrize(
    "changes",
    [
        {"ranges": np.empty((0, 180), np.float32)},
        {"ranges": np.array("far")},
        {"angle_increment": 0.0},
        {"angle_increment": np.nan},
        {"range_max": -1.0},
        {"ranges": None},
    ],
)
def test_scans_that_are_none(cli, unique: Files, tmp_path: Path, changes: dict) -> None:
    cli("locate", unique[0], spoil_scan(unique, tmp_path, **changes)).assert_refused()


@pytest.mark.parametrize("index", [3, 10**12])
def test_an_index_past_the_end(cli, unique: Files, index: int) -> None:
    ended = cli("locate", *unique, "--index", index)
    ended.assert_refused(f"index {index}", "3 scans, 0 to 2")


def test_a_map_with_nothing_in_it(cli, unique: Files, tmp_path: Path) -> None:
    text = "image: blank.pgm\nresolution: 0.05\norigin: [0, 0, 0]\nnegate: 0\n"
    text += "occupied_thresh: 0.65\nfree_thresh: 0.196\n"
    (tmp_path / "blank.yaml").write_text(text)
    for grey in (205, 254):
        (tmp_path / "blank.pgm").write_bytes(b"P5 40 40 255\n" + bytes([grey]) * 1600)
        cli("locate", "blank.yaml", unique[1]).assert_refused()


def test_options_that_contradict_each_other(cli, unique: Files) -> None:
    cli("locate", *unique, "--all", "--index", 1).assert_refused("--index")
    cli("locate", *unique, "--all", "--plot", "a.png").assert_refused("--plot")


@pytest.mark.parametrize("name", ["place.jpeg", "place"])
def test_a_picture_of_an_unknown_format(cli, unique: Files, name: str) -> None:
    cli("locate", *unique, "--plot", name).assert_refused(name)
    cli("demo", "--plot", name).assert_refused(name)
    cli("map", "show", unique[0], "--plot", name).assert_refused(name)


def test_the_folder_of_a_picture_must_exist(cli, unique: Files) -> None:
    for command in (("locate", *unique), ("demo",), ("map", "show", unique[0])):
        cli(*command, "--plot", "missing/a.png").assert_refused("no such folder: missing")
    assert not Path("missing").exists()


def test_a_picture_without_matplotlib(cli, unique: Files, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    cli("locate", *unique, "--plot", "a.png").assert_refused("firstfix[plot]")
    cli("bench", unique[0].parent, "--report", "out").assert_refused("firstfix[plot]")
    cli("map", "show", unique[0]).assert_refused("firstfix[plot]")


def test_a_world_that_is_none(cli) -> None:
    cli("demo", "--world", "atlantis").assert_refused("office, rooms", "atlantis")


def test_cases_that_are_none(cli, tmp_path: Path) -> None:
    cli("bench", "nowhere").assert_refused("nowhere (no such folder)")
    cli("bench", tmp_path).assert_refused("a case")


@pytest.mark.parametrize("meta", ["{", "[1]", "\xff"])
def test_a_case_with_broken_words(cli, unique: Files, tmp_path: Path, meta: str) -> None:
    folder = tmp_path / "case"
    folder.mkdir()
    for file in unique[0].parent.iterdir():
        (folder / file.name).write_bytes(file.read_bytes())
    (folder / "meta.json").write_text(meta, encoding="latin-1")
    cli("bench", folder).assert_refused("meta.json")


def test_figures_that_cannot_be_written(cli, unique: Files, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    cli("bench", unique[0].parent, "--out", "file/bench.json").assert_refused("file/bench.json")
    cli("bench", unique[0].parent, "--report", "file/report").assert_refused("file/report")


@pytest.mark.usefixtures("in_this_process")
def test_a_case_without_truth(cli, unique: Files, tmp_path: Path) -> None:
    folder = tmp_path / "case"
    folder.mkdir()
    for file in unique[0].parent.iterdir():
        (folder / file.name).write_bytes(file.read_bytes())
    (folder / "scans.npz").unlink()
    spoil_scan(unique, folder, true_pose=None).rename(folder / "scans.npz")
    (tmp_path / "bench.json").write_text("earlier figures")
    cli("bench", folder, "--out", "bench.json").assert_refused("true poses")
    assert (tmp_path / "bench.json").read_text() == "earlier figures"


@pytest.mark.parametrize(
    "arguments",
    [
        ["locate"],
        ["locate", "a", "b", "--index", "-1"],
        ["locate", "a", "b", "--method", "magic"],
        ["bench"],
        ["bench", "a", "--jobs", "0"],
        ["map", "check", "a", "--fov", "400"],
        ["map", "check", "a", "--fov", "nan"],
        ["map", "check", "a", "--samples", "-1"],
        ["map", "show", "a", "--range", "0"],
        ["fly"],
        ["--colour"],
    ],
)
def test_a_wrong_command_line_ends_with_2(cli, arguments: list[str]) -> None:
    ended = cli(*arguments)
    assert ended.status == 2
    assert "Traceback" not in ended.err
    assert ended.err
