"""End to end: one scan in, one honest answer out."""

from __future__ import annotations

import itertools
import math
from pathlib import Path

import numpy as np
import pytest

from firstfix.core.angles import FULL_TURN, angle_error
from firstfix.core.errors import MapError
from firstfix.core.estimate import LocateResult, Verdict
from firstfix.core.grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.global_localization.config import LocateConfig, Method
from firstfix.global_localization.scan_matcher import ScanMatcher
from firstfix.io.logs.load import load_recording
from firstfix.io.maps.map_server import load_map
from firstfix.lab.simulation.lidar import Lidar
from firstfix.lab.worlds.catalog import ROOM_PITCH, identical_rooms, random_free_pose

LIDAR = Lidar(beams=360, sigma_m=0.01)


@pytest.fixture(scope="module")
def rooms_locator() -> ScanMatcher:
    return ScanMatcher(identical_rooms(4))


# --- a building without identical rooms ---


@pytest.mark.parametrize("seed", range(25))
def test_any_place_of_the_office_is_found_and_published(seed, office_locator, found):
    rng = np.random.default_rng(seed)
    grid = office_locator.fields.grid
    truth = random_free_pose(grid, rng)
    result = office_locator.locate(LIDAR.scan(grid, truth, rng))
    assert result.verdict is Verdict.UNIQUE
    assert found(result, truth, 0.05, 0.5)


@pytest.mark.parametrize(
    ("degrees", "range_max", "verdict"),
    [
        (360.0, 8.0, Verdict.UNIQUE),
        (180.0, 12.0, Verdict.UNIQUE),
        (360.0, 3.5, Verdict.AMBIGUOUS),
        (120.0, 8.0, Verdict.AMBIGUOUS),
        (60.0, 5.0, Verdict.AMBIGUOUS),
    ],
)
def test_one_scan_of_a_sensor_that_sees_little_never_decides(
    degrees, range_max, verdict, office_locator
):
    lidar = Lidar(beams=180, fov=math.radians(degrees), range_max=range_max, sigma_m=0.01)
    rng, grid = np.random.default_rng(3), office_locator.fields.grid
    pose = random_free_pose(grid, rng)
    results = [
        office_locator.locate(lidar.scan(grid, pose @ SE2(0, 0, turn), rng)) for turn in range(6)
    ]
    assert verdict in [result.verdict for result in results]
    if verdict is Verdict.AMBIGUOUS:
        assert all(result.verdict is not Verdict.UNIQUE for result in results)


def test_what_a_result_promises(office_locator):
    rng = np.random.default_rng(100)
    grid = office_locator.fields.grid
    result = office_locator.locate(LIDAR.scan(grid, random_free_pose(grid, rng), rng))
    assert result.search.proven
    assert result.search.searched == 1.0
    assert result.elapsed_s > 0.0
    assert 2 <= len(result.hypotheses) <= office_locator.config.hypotheses
    probabilities = [h.probability for h in result.hypotheses]
    assert probabilities == sorted(probabilities, reverse=True)
    assert sum(probabilities) <= 1.0 + 1e-12
    scores = [h.score for h in result.hypotheses]
    assert scores == sorted(scores)
    for i, a in enumerate(result.hypotheses):
        np.testing.assert_allclose(a.covariance, a.covariance.T, atol=1e-12)
        assert (np.linalg.eigvalsh(a.covariance) > 0.0).all()
        for b in result.hypotheses[:i]:
            turn = math.degrees(angle_error(a.pose.yaw, b.pose.yaw))
            assert a.pose.distance_to(b.pose) > 0.5 or turn > 20.0


def test_people_around_the_robot(office_locator, found, with_pose):
    """A third of the beams end early, in blocks, as legs and bodies cut them."""
    grid = office_locator.fields.grid
    hits = 0
    for seed in range(10):
        rng = np.random.default_rng(seed)
        truth = random_free_pose(grid, rng)
        scan = LIDAR.scan(grid, truth, rng)
        ranges = scan.ranges.copy()
        for start in rng.integers(0, 360, 12):
            body = (start + np.arange(10)) % 360
            ranges[body] = np.minimum(ranges[body], rng.uniform(0.5, 2.0))
        result = office_locator.locate(with_pose(scan, ranges=ranges))
        right = found(result, truth, 0.5, 10.0)
        hits += right
        assert right or result.verdict is not Verdict.UNIQUE
    assert hits >= 9


@pytest.mark.parametrize("degrees", [180, 270])
def test_a_sensor_that_does_not_see_all_round(degrees, office_locator, found):
    grid = office_locator.fields.grid
    lidar = Lidar(beams=361, fov=math.radians(degrees), sigma_m=0.01, range_max=20.0)
    hits = 0
    for seed in range(10):
        rng = np.random.default_rng(seed)
        truth = random_free_pose(grid, rng, clearance_m=0.5)
        result = office_locator.locate(lidar.scan(grid, truth, rng))
        right = found(result, truth, 0.1, 1.0)
        hits += right
        assert right or result.verdict is not Verdict.UNIQUE
    assert hits >= 9


@pytest.mark.parametrize("range_max", [4.0, 8.0, 60.0])
def test_any_reach_of_the_sensor(range_max, office_locator, found):
    grid = office_locator.fields.grid
    lidar = Lidar(range_max=range_max, sigma_m=0.01)
    hits = 0
    for seed in range(5):
        rng = np.random.default_rng(seed)
        truth = random_free_pose(grid, rng)
        result = office_locator.locate(lidar.scan(grid, truth, rng))
        right = found(result, truth, 0.1, 1.0)
        hits += right
        assert right or result.verdict is not Verdict.UNIQUE
    assert hits >= 4


# --- a building of identical rooms ---


@pytest.mark.parametrize("n", range(2, 9))
def test_of_n_alike_rooms_all_are_listed_and_equally_likely(n):
    grid = identical_rooms(n)
    rng = np.random.default_rng(n)
    truth = SE2(2.0 + ROOM_PITCH * (n // 2), 2.5, rng.uniform(-np.pi, np.pi))
    result = ScanMatcher(grid).locate(LIDAR.scan(grid, truth, rng))
    assert result.verdict is Verdict.AMBIGUOUS
    assert f"{n} places" in result.reason
    first = result.hypotheses[:n]
    places = sorted(h.pose.x for h in first)
    np.testing.assert_allclose(places, 2.0 + ROOM_PITCH * np.arange(n), atol=0.05)
    for h in first:
        assert abs(h.pose.y - truth.y) < 0.05
        assert angle_error(h.pose.yaw, truth.yaw) < np.radians(0.5)
    probabilities = np.array([h.probability for h in first])
    assert np.ptp(probabilities) <= 0.1 * probabilities.max()
    assert probabilities.sum() > 0.8


def test_from_another_building_nothing_is_published(office_locator, rooms_locator):
    rng = np.random.default_rng(0)
    for here, there in ((office_locator, rooms_locator), (rooms_locator, office_locator)):
        for _ in range(10):
            grid = there.fields.grid
            scan = LIDAR.scan(grid, random_free_pose(grid, rng), rng)
            assert here.locate(scan).verdict is not Verdict.UNIQUE


# --- maps ---


@pytest.mark.parametrize("shape", [(1, 30), (2, 30), (30, 1), (9, 9)])
def test_free_space_too_narrow_for_a_position(shape):
    """An answer or a refusal, not a crash."""
    cells = np.full(shape, OCCUPIED, np.int8)
    cells[0] = FREE
    cells[0, 0] = OCCUPIED
    cells[-1, -1] = FREE
    scan = LaserScan(np.full(90, 1.0, np.float32), -np.pi, FULL_TURN / 90, 0.1, 12.0)
    try:
        matcher = ScanMatcher(OccupancyGrid(cells, 0.05))
    except MapError:
        return
    assert matcher.locate(scan).verdict is not Verdict.UNIQUE


@pytest.mark.parametrize("resolution", [0.01, 0.02, 0.05, 0.1, 0.125, 0.25])
def test_cells_of_any_size(resolution, draw_room, found):
    """One room, seen with exact walls, found in drawings from 1 to 25 cm a cell."""
    exact = draw_room(0.01)
    matcher = ScanMatcher(draw_room(resolution))
    for seed in range(4):
        rng = np.random.default_rng(seed)
        truth = random_free_pose(exact, rng)
        result = matcher.locate(LIDAR.scan(exact, truth, rng))
        assert found(result, truth, 0.5, 10.0)
        if resolution <= 0.05:
            assert found(result, truth, 0.05, 0.5)


@pytest.mark.parametrize("value", [FREE, UNKNOWN, OCCUPIED])
@pytest.mark.parametrize("method", Method)
def test_a_map_of_one_kind_is_no_map(value, method):
    with pytest.raises(MapError):
        ScanMatcher(OccupancyGrid(np.full((20, 30), value, np.int8), 0.05), method=method)


# --- limited search ---


@pytest.mark.parametrize("max_poses", [1, LocateConfig().max_poses])
def test_the_answer_does_not_depend_on_the_clock(
    office_locator, maps_cache, content_of, monkeypatch, max_poses
):
    grid, rng = office_locator.fields.grid, np.random.default_rng(0)
    matcher = ScanMatcher(grid, config=LocateConfig(max_poses=max_poses), cache_dir=maps_cache)
    scan = LIDAR.scan(grid, random_free_pose(grid, rng), rng)
    idle = content_of(matcher.locate(scan))
    hours = itertools.count(0.0, 3600.0)
    monkeypatch.setattr("time.perf_counter", lambda: next(hours))
    assert content_of(matcher.locate(scan)) == idle


def test_a_search_cut_short_is_never_unique(office_locator, maps_cache):
    grid = office_locator.fields.grid
    hurried = ScanMatcher(grid, config=LocateConfig(max_poses=1), cache_dir=maps_cache)
    for seed in range(5):
        rng = np.random.default_rng(seed)
        scan = LIDAR.scan(grid, random_free_pose(grid, rng), rng)
        result = hurried.locate(scan)
        assert not result.search.proven
        assert 0.0 < result.search.searched < 1.0
        assert result.verdict is not Verdict.UNIQUE
        assert "unsearched" in result.reason


# --- methods ---


@pytest.mark.parametrize("method", [Method.PAPER, Method.PAPER_BASIC])
def test_the_methods_of_the_paper_build_no_table_of_ranges(method, room, monkeypatch):
    def never(*_: object) -> None:
        raise AssertionError("a table of ranges was built")

    monkeypatch.setattr("firstfix.fields.map_fields.build_range_table", never)
    rng = np.random.default_rng(0)
    scan = LIDAR.scan(room.grid, random_free_pose(room.grid, rng), rng)
    ScanMatcher(room.grid, method=method).locate(scan)


@pytest.mark.parametrize("method", [Method.PAPER, Method.PAPER_BASIC])
def test_the_methods_of_the_paper(method, room, found):
    matcher = ScanMatcher(room.grid, method=method)
    for seed in range(3):
        rng = np.random.default_rng(seed)
        truth = random_free_pose(room.grid, rng)
        result = matcher.locate(LIDAR.scan(room.grid, truth, rng))
        assert result.verdict is Verdict.UNIQUE
        assert result.search.proven
        assert found(result, truth, 0.5, 16.0)


def test_settings_reach_the_search(office_locator, maps_cache, found):
    rng = np.random.default_rng(13)
    grid = office_locator.fields.grid
    truth = random_free_pose(grid, rng)
    scan = LIDAR.scan(grid, truth, rng)

    def locate(config: LocateConfig) -> LocateResult:
        return ScanMatcher(grid, config=config, cache_dir=maps_cache).locate(scan)

    few = locate(LocateConfig(hypotheses=2, shortlist=20))
    assert len(few.hypotheses) <= 2
    assert found(few, truth, 0.05, 0.5)
    never = locate(LocateConfig(unique_probability=1.0))
    assert never.verdict is not Verdict.UNIQUE


# --- recorded drives ---


@pytest.mark.shared
@pytest.mark.parametrize(("case", "every"), [("olin_mac1_9_23", 20), ("intel_lab", 40)])
def test_recorded_scans_are_found_where_they_were_taken(case: str, every: int, shared: Path, found):
    folder = shared / "cases" / case
    matcher = ScanMatcher(load_map(folder / "map.yaml"))
    recording = load_recording(folder / "scans.npz")
    assert recording.truth is not None
    tried = right = wrong_but_sure = 0
    for scan, pose in zip(recording.scans[::every], recording.truth[::every], strict=True):
        result = matcher.locate(scan)
        hit = result.best is not None and found(result, SE2.from_array(pose), 0.5, 10.0)
        tried += 1
        right += hit
        wrong_but_sure += result.verdict is Verdict.UNIQUE and not hit
    assert tried >= 5
    assert right >= 0.9 * tried
    assert wrong_but_sure == 0
