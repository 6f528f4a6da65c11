"""``firstfix site``."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "robots"))  # site_lab

from site_lab import ROOMS, draw, save_rooms, scan_in

from firstfix.core.recording import Recording
from firstfix.core.se2 import SE2
from firstfix.io.logs.npz import save_recording
from firstfix.io.maps.map_server import save_map
from firstfix.site.site import Site

POSE = SE2(3.9, 1.7, 0.6)


@pytest.fixture(scope="module")
def floors(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("floors")
    save_map(draw(ROOMS["ground"]), save_rooms(folder) / "copy.yaml")
    scans = (scan_in("ground", POSE), scan_in("second", POSE, stamp=1.0))
    save_recording(Recording(scans=scans), folder / "scans.npz")
    return folder


@pytest.fixture(autouse=True)
def _own_cache(monkeypatch: pytest.MonkeyPatch, tmp_path_factory: pytest.TempPathFactory) -> None:
    folder = tmp_path_factory.getbasetemp() / "site-cache"
    monkeypatch.setenv("FIRSTFIX_CACHE_DIR", str(folder))


def test_locate_names_the_map(cli, floors: Path) -> None:
    ended = cli("site", "locate", floors, floors / "scans.npz", "--index", 1)
    assert ended.status == 0, ended.err
    assert ended.out.startswith("UNIQUE: ")
    assert "\nsecond " in ended.out


def test_locate_as_json_lists_the_same_place_in_the_copy(cli, floors: Path) -> None:
    pytest.importorskip("matplotlib")
    ended = cli("site", "locate", floors, floors / "scans.npz", "--json", "--plot", "x.png")
    assert ended.status == 0, ended.err
    answer = json.loads(ended.out)
    assert answer["verdict"] == "UNIQUE"
    others = [other["map_id"] for other in answer["hypotheses"][0]["also"]]
    assert sorted([answer["map_id"], *others]) == ["copy", "ground"]
    assert answer["pose"] == pytest.approx(list(POSE), abs=0.05)
    assert sum(answer["maps"].values()) + answer["elsewhere"] == pytest.approx(1.0)
    assert Path("x.png").stat().st_size > 1000


def test_a_zone_is_known_or_one_sentence(cli, floors: Path) -> None:
    hall = "{hall: [[3, 1], [5, 1], [5, 3], [3, 3]]}"
    Path("site.yaml").write_text(f"maps:\n  own: {{map: {floors}/ground, zones: {hall}}}\n")
    ended = cli("site", "locate", "site.yaml", floors / "scans.npz", "--zone", "hall")
    assert ended.status == 0, ended.err
    ended = cli("site", "locate", "site.yaml", floors / "scans.npz", "--zone", "attic")
    assert (ended.status, ended.err.count("\n")) == (2, 1)
    assert ended.err.startswith("firstfix: There is no zone 'attic' in this site.")


def test_a_broken_map_is_named_and_the_others_are_searched(cli, floors: Path) -> None:
    (Path("maps")).symlink_to(floors)
    Path("site.yaml").write_text("maps: {ground: maps/ground, gone: maps/gone.yaml}\n")
    ended = cli("site", "locate", "site.yaml", floors / "scans.npz")
    assert ended.status == 0
    assert "\nground " in ended.out
    assert ended.err.startswith("warning: The map gone cannot be used: ")


def test_check_writes_a_description_once(cli, tmp_path: Path) -> None:
    save_rooms(tmp_path)
    written = cli("site", "check", tmp_path, "--samples", 0, "--write")
    assert (written.status, "site: " in written.err) == (0, True), written
    assert list(Site.load(tmp_path).maps) == sorted(ROOMS)
    assert cli("site", "check", tmp_path, "--samples", 0, "--write").status == 2


def test_check_finds_copies_and_what_looks_alike(cli, floors: Path) -> None:
    pytest.importorskip("matplotlib")
    ended = cli("site", "check", floors, "--samples", 1, "--plot", "x.png")
    assert ended.status == 0, ended.err
    for line in (
        "maps          4 usable, 0 not",
        "copies        copy, ground",
        "right map     100",
    ):
        assert line in ended.out
    assert Path("x.png").stat().st_size > 1000
    ended = cli("site", "check", floors, "--samples", 0, "--json")
    found = json.loads(ended.out)
    assert [one["id"] for one in found["maps"]] == ["copy", "first", "ground", "second"]
    assert found["copies"] == [["copy", "ground"]]
    assert all(one["nbytes"] > 100_000 for one in found["maps"])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("locate", "nowhere", "scans.npz"), "There is no folder or file"),
        (("locate", "{floors}", "nowhere.npz"), "nowhere.npz"),
        (("locate", "{floors}", "{floors}/scans.npz", "--index", "2"), "no scan 2"),
        (("locate", "{floors}", "{floors}/scans.npz", "--plot", "x.txt"), "x.txt"),
        (("check", "{floors}", "--plot", "nowhere/x.png"), "nowhere"),
        (("check", "."), "There is no map in"),
    ],
)
def test_wrong_input_is_one_sentence(cli, floors: Path, arguments, message: str) -> None:
    ended = cli("site", *(text.format(floors=floors) for text in arguments))
    assert (ended.status, ended.out) == (2, "")
    assert ended.err.count("\n") == 1
    assert message in ended.err
