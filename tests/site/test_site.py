"""One verdict over many maps."""

from __future__ import annotations

import pickle
from collections.abc import Sequence
from pathlib import Path
from typing import TypeVar

import numpy as np
import pytest
from site_lab import ROOMS, draw, save_rooms, scan_in

from firstfix.belief.prior import Near
from firstfix.core.errors import InputError
from firstfix.core.estimate import Verdict
from firstfix.core.se2 import SE2
from firstfix.fields.map_fields import MapFields
from firstfix.global_localization.beams import Beams
from firstfix.global_localization.look import look_into
from firstfix.global_localization.search import Candidates
from firstfix.io.maps.map_server import save_map
from firstfix.site import views
from firstfix.site.judge import judge_site
from firstfix.site.look import PROMISING
from firstfix.site.result import SiteResult
from firstfix.site.site import Site

T = TypeVar("T")
POSE = SE2(3.9, 1.7, 0.6)


def through_a_pipe(value: T) -> T:
    return pickle.loads(pickle.dumps(value))  # noqa: S301 - our own


@pytest.mark.parametrize("room", sorted(ROOMS))
def test_a_scan_is_located_in_its_map(site: Site, room: str) -> None:
    result = site.locate(scan_in(room, POSE))
    assert result.verdict is Verdict.UNIQUE
    assert result.best is not None
    assert result.map_id == room
    assert result.best.pose.distance_to(POSE) < 0.1
    assert result.map_probabilities[room] > 0.95
    total = sum(result.map_probabilities.values()) + result.elsewhere
    assert total == pytest.approx(1.0)


def test_the_stages_can_be_spread_over_processes(site: Site) -> None:
    scan = scan_in("first", POSE)
    query = through_a_pipe(site.query(scan))
    looked = [site.first_look(query, [name]) for name in site.map_ids]
    found = [site.search(query, [name]) for name in site.map_ids]
    spread = judge_site(query, *through_a_pipe((looked, found)))
    whole = site.locate(scan)
    assert (spread.verdict, spread.map_id) == (whole.verdict, "first")
    assert spread.best is not None
    assert whole.best is not None
    assert spread.best.pose == whole.best.pose


def test_several_scans_are_weighed_together(site: Site) -> None:
    starts = [POSE, SE2(4.3, 1.9, 0.6), SE2(4.7, 2.1, 0.8)]
    scans = [scan_in("second", pose, i, float(i)) for i, pose in enumerate(starts)]
    odometry = [POSE.inverse() @ pose for pose in starts]
    result = site.locate(scans, odometry)
    assert (result.verdict, result.map_id) == (Verdict.UNIQUE, "second")
    assert result.best is not None
    assert result.best.pose.distance_to(starts[-1]) < 0.1


def test_a_copy_of_a_map_is_no_rival(tmp_path: Path) -> None:
    save_rooms(tmp_path)
    save_map(draw(ROOMS["ground"]), tmp_path / "copy.yaml")
    result = Site.load(tmp_path).locate(scan_in("ground", POSE))
    assert result.verdict is Verdict.UNIQUE
    assert {result.map_id, result.same_places[0][0].map_id} == {"copy", "ground"}


def test_a_copy_on_another_floor_is_a_rival(tmp_path: Path) -> None:
    save_rooms(tmp_path)
    (tmp_path / "site.yaml").write_text(
        "maps:\n  low: {map: ground, floor: 0}\n  high: {map: ground, floor: 1}\n"
    )
    result = Site.load(tmp_path).locate(scan_in("ground", POSE))
    assert result.verdict is Verdict.AMBIGUOUS
    assert {h.map_id for h in result.hypotheses[:2]} == {"low", "high"}


def test_a_broken_map_is_named_and_the_others_load(tmp_path: Path) -> None:
    save_rooms(tmp_path)
    (tmp_path / "first" / "map.pgm").write_bytes(b"P5 nothing")
    site = Site.load(tmp_path)
    result = site.locate(scan_in("ground", POSE))
    assert (result.verdict, result.map_id) == (Verdict.UNIQUE, "ground")
    assert list(site.faults) == ["first"]
    assert "first" in result.faults[0]
    assert site.map_ids == ("ground", "second")


def test_a_map_that_is_not_in_the_site(site: Site) -> None:
    scan = scan_in("ground", POSE)
    with pytest.raises(InputError, match="no map 'attic'"):
        site.locate(scan, prior={"attic": None})
    with pytest.raises(InputError, match="no map 'attic'"):
        site.first_look(site.query(scan), ["attic"])


def test_prepared_maps_are_read_from_files_within_the_limit(folder: Path, tmp_path: Path) -> None:
    Site.load(folder, tmp_path).prepare()
    files = {file: file.stat().st_ino for file in tmp_path.iterdir()}
    small = Site.load(folder, tmp_path, memory_limit=1)
    result = small.locate(scan_in("second", POSE))
    assert (result.verdict, result.map_id) == (Verdict.UNIQUE, "second")
    assert {file: file.stat().st_ino for file in tmp_path.iterdir()} == files
    one = small.fields("first")
    assert small.fields("first") is one
    _ = small.fields("second")
    assert small.fields("first") is not one


def test_only_an_edited_map_is_prepared_again(tmp_path: Path) -> None:
    save_rooms(tmp_path / "maps")
    Site.load(tmp_path / "maps", tmp_path / "cache").prepare()
    before = set((tmp_path / "cache").iterdir())
    save_map(draw(ROOMS["second"][1:]), tmp_path / "maps" / "first" / "map.yaml")
    site = Site.load(tmp_path / "maps", tmp_path / "cache")
    site.prepare()
    assert len(set((tmp_path / "cache").iterdir()) - before) == len(before) / len(site.map_ids)


def test_a_damaged_file_is_built_again(folder: Path, tmp_path: Path) -> None:
    Site.load(folder, tmp_path).prepare()
    for file in tmp_path.iterdir():
        file.write_bytes(file.read_bytes()[:-9])
    result = Site.load(folder, tmp_path).locate(scan_in("first", POSE))
    assert (result.verdict, result.map_id) == (Verdict.UNIQUE, "first")


def test_an_edited_copy_shows_the_same_around_the_place(tmp_path: Path) -> None:
    save_rooms(tmp_path)
    edited = [*ROOMS["ground"], (2.0, 5.9, 2.3, 6.0)]
    save_map(draw(edited), tmp_path / "edited.yaml")
    result = Site.load(tmp_path).locate(scan_in("ground", POSE))
    assert result.verdict is Verdict.UNIQUE
    assert {result.map_id, result.same_places[0][0].map_id} == {"edited", "ground"}


WAY = [POSE, SE2(4.3, 1.9, 0.6), SE2(4.7, 2.1, 0.8)]


def asked(site: Site, room: str, way: list[SE2]) -> SiteResult:
    scans = [scan_in(room, pose, i, float(i)) for i, pose in enumerate(way)]
    return site.locate(scans, [way[0].inverse() @ pose for pose in way])


@pytest.mark.parametrize("way", [WAY[:1], WAY], ids=["one scan", "several"])
def test_a_near_copy_is_no_rival_unless_it_is_another_floor(tmp_path: Path, way: list[SE2]) -> None:
    # The robot is where a cupboard was when the map was drawn. The other map never had it.
    save_map(draw([*ROOMS["ground"], (2.2, 5.2, 3.2, 6.0)]), tmp_path / "own.yaml")
    save_map(draw(ROOMS["ground"]), tmp_path / "other.yaml")
    copies = asked(Site.load(tmp_path), "ground", way)
    assert copies.verdict is Verdict.UNIQUE
    assert {copies.map_id, copies.same_places[0][0].map_id} == {"own", "other"}
    (tmp_path / "site.yaml").write_text(
        "maps:\n  own: {map: own.yaml, floor: 0}\n  other: {map: other.yaml, floor: 1}\n"
    )
    floors = asked(Site.load(tmp_path), "ground", way)
    assert floors.verdict is Verdict.AMBIGUOUS, floors.reason
    assert not floors.same_places[0]


def test_maps_that_overlap_in_the_site_are_no_rivals(tmp_path: Path) -> None:
    save_rooms(tmp_path)
    # The same hall with much furniture of its own, turned by a right angle.
    (tmp_path / "site.yaml").write_text(
        "maps:\n  a: {map: ground, pose: [0, 0, 0]}\n  b: {map: ground, pose: [0, 0, 1.57]}\n"
    )
    result = Site.load(tmp_path).locate(scan_in("ground", POSE))
    assert result.verdict is Verdict.AMBIGUOUS  # the poses say that these are two halls
    (tmp_path / "site.yaml").write_text(
        "maps:\n  a: {map: ground, pose: [5, 0, 0]}\n  b: {map: ground, pose: [5, 0, 0]}\n"
    )
    assert Site.load(tmp_path).locate(scan_in("ground", POSE)).verdict is Verdict.UNIQUE


def test_each_view_of_a_sensor_that_sees_much_is_looked_for_once_in_all_maps(
    site: Site, monkeypatch: pytest.MonkeyPatch
) -> None:
    looks: list[int] = []

    def counted(beams: Beams, maps: Sequence[MapFields], shortlist: int) -> list[Candidates]:
        looks.append(len(maps))
        return look_into(beams, maps, shortlist)

    monkeypatch.setattr(views, "look_into", counted)
    starts = [POSE, SE2(4.3, 1.9, 0.6), SE2(4.7, 2.1, 0.8)]
    odometry = [POSE.inverse() @ pose for pose in starts]
    scans = [scan_in("second", pose, i, float(i)) for i, pose in enumerate(starts)]
    assert site.locate(scans, odometry).map_id == "second"
    assert looks == [len(ROOMS)] * 3
    scans = [scan_in("second", pose, i, float(i), **NARROW) for i, pose in enumerate(starts)]
    site.locate(scans, odometry)
    assert len(looks) == 3  # what fits everywhere is searched map by map


def test_several_views_decide_in_a_site_of_many_maps(tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    save_rooms(tmp_path)
    for i in range(PROMISING):
        corners = rng.uniform((0.0, 0.0), (7.0, 5.0), (3, 2))
        boxes = [(x, y, x + 0.8, y + 0.6) for x, y in corners.tolist()]
        save_map(draw(boxes), tmp_path / f"other_{i}.yaml")
    starts = [POSE, SE2(4.3, 1.9, 0.6), SE2(4.7, 2.1, 0.8)]
    scans = [scan_in("second", pose, i, float(i)) for i, pose in enumerate(starts)]
    result = Site.load(tmp_path).locate(scans, [POSE.inverse() @ pose for pose in starts])
    assert (result.verdict, result.map_id) == (Verdict.UNIQUE, "second"), result.reason
    assert result.elsewhere > 0.01  # the looks may have lost the place


NARROW = {"beams": 61, "fov": 1.2, "range_max": 4.0, "sigma_m": 0.01}


def test_one_scan_of_a_sensor_that_sees_little_is_never_enough(site: Site) -> None:
    starts = [POSE, SE2(3.9, 1.7, 1.4), SE2(3.9, 1.7, 2.2)]
    scans = [scan_in("second", pose, i, float(i), **NARROW) for i, pose in enumerate(starts)]
    one = site.locate(scans[0])
    assert one.verdict is not Verdict.UNIQUE
    several = site.locate(scans, [POSE.inverse() @ pose for pose in starts])
    assert (several.verdict, several.map_id) == (Verdict.UNIQUE, "second"), several.reason


def test_a_prior_names_the_map_and_is_overruled_by_the_scan(site: Site) -> None:
    scan = scan_in("ground", POSE)
    right = site.locate(scan, prior={"ground": Near(POSE, 1.0), "first": None})
    assert (right.verdict, right.map_id) == (Verdict.UNIQUE, "ground")
    wrong = site.locate(scan, prior={"first": None})
    assert wrong.verdict is not Verdict.UNIQUE or wrong.map_id == "ground"
    with pytest.raises(InputError, match="names maps"):
        site.locate(scan, prior=Near(POSE, 1.0))  # type: ignore[arg-type]


def test_a_zone_of_the_site_is_a_prior(tmp_path: Path) -> None:
    save_rooms(tmp_path)
    scan = scan_in("ground", POSE)
    with pytest.raises(InputError, match="No map of this site has zones"):
        Site.load(tmp_path).zone("lobby")
    here = "[[3, 1], [5, 1], [5, 2.4], [3, 2.4]]"
    there = "[[5.2, 3.2], [7.8, 3.2], [7.8, 5.8], [5.2, 5.8]]"
    (tmp_path / "site.yaml").write_text(
        f"maps:\n  low: {{map: ground, floor: 0, zones: {{lobby: {here}, stairs: {there}}}}}\n"
        f"  high: {{map: ground, floor: 1, zones: {{stairs: {here}}}}}\n"
    )
    site = Site.load(tmp_path)
    assert site.locate(scan).verdict is Verdict.AMBIGUOUS
    assert set(site.zone("stairs")) == {"low", "high"}
    for zone, floor in (("lobby", "low"), ("stairs", "high")):
        result = site.locate(scan, prior=site.zone(zone))
        assert (result.verdict, result.map_id) == (Verdict.UNIQUE, floor), result.reason
    with pytest.raises(InputError, match=r"no zone 'attic' in this site. Choose one of lobby, st"):
        site.zone("attic")


def test_the_preparation_says_which_map_of_how_many(
    folder: Path, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level("INFO", "firstfix.site")
    done: list[str] = []
    Site.load(folder).prepare(done.append)
    assert sorted(done) == sorted(ROOMS)
    assert caplog.messages[-1] == f"map 3 of 3 is prepared: {done[-1]}"


def test_too_few_hits_match_nothing(site: Site) -> None:
    blocked = scan_in("ground", POSE, range_max=0.2)
    result = site.locate(blocked)
    assert (result.verdict, result.hypotheses) == (Verdict.NO_MATCH, ())
    assert "too few beams" in str(result)
    assert result.to_dict()["pose"] is None
    twice = site.locate([blocked, scan_in("ground", POSE, range_max=0.2, stamp=1.0)])
    assert twice.verdict is Verdict.NO_MATCH


def test_a_site_without_a_usable_map_says_so(tmp_path: Path) -> None:
    save_rooms(tmp_path)
    for room in ROOMS:
        (tmp_path / room / "map.pgm").unlink()
    result = Site.load(tmp_path).locate(scan_in("ground", POSE))
    assert result.verdict is Verdict.NO_MATCH
    assert "no map of the site" in result.reason
    assert len(result.faults) == len(ROOMS)
