"""End to end: one scan in, one honest answer out."""

from __future__ import annotations

import math
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from firstfix.core.angles import FULL_TURN, angle_error
from firstfix.core.errors import MapError
from firstfix.core.estimate import LocateResult, Verdict
from firstfix.core.grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from firstfix.core.scan import LaserScan, Mounting
from firstfix.core.se2 import SE2
from firstfix.formats.map_server import load_map
from firstfix.formats.recording import load_recording
from firstfix.global_localization.config import LocateConfig, Method
from firstfix.global_localization.locate import Locator
from firstfix.sim.lidar import Lidar
from firstfix.sim.world import ROOM_PITCH, identical_rooms, office, random_free_pose

LIDAR = Lidar(beams=360, sigma_m=0.01)


@pytest.fixture(scope="module")
def office_locator() -> Locator:
    return Locator(office())


@pytest.fixture(scope="module")
def rooms_locator() -> Locator:
    return Locator(identical_rooms(4))


def errors(result: LocateResult, truth: SE2) -> tuple[float, float]:
    """Distance, m, and angle, degrees, of the best hypothesis to the truth."""
    best = result.best
    assert best is not None
    return best.pose.distance_to(truth), math.degrees(angle_error(best.pose.yaw, truth.yaw))


def found(result: LocateResult, truth: SE2, most_m: float, most_deg: float) -> bool:
    off_m, off_deg = errors(result, truth)
    return off_m < most_m and off_deg < most_deg


def told(result: LocateResult) -> tuple[object, ...]:
    """Everything but the time it took, to the last bit."""
    return (
        result.verdict,
        result.reason,
        result.search,
        [
            (h.pose, h.covariance.tolist(), h.score, h.probability, h.evidence)
            for h in result.hypotheses
        ],
    )


def with_pose(scan: LaserScan, **changes: object) -> LaserScan:
    settings = {
        name: getattr(scan, name)
        for name in ("ranges", "angle_min", "angle_increment", "range_min", "range_max")
    }
    return LaserScan(**{**settings, **changes})


# --- a building without two alike rooms ---


@pytest.mark.parametrize("seed", range(25))
def test_any_place_of_the_office_is_found_and_published(seed, office_locator):
    rng = np.random.default_rng(seed)
    grid = office_locator.fields.grid
    truth = random_free_pose(grid, rng)
    result = office_locator.locate(LIDAR.scan(grid, truth, rng))
    assert result.verdict is Verdict.UNIQUE
    assert found(result, truth, 0.05, 0.5)


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


def test_people_around_the_robot(office_locator):
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
def test_a_sensor_that_does_not_see_all_round(degrees, office_locator):
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
def test_any_reach_of_the_sensor(range_max, office_locator):
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


# --- a building of alike rooms ---


@pytest.mark.parametrize("n", range(2, 9))
def test_of_n_alike_rooms_all_are_listed_and_equally_likely(n):
    grid = identical_rooms(n)
    rng = np.random.default_rng(n)
    truth = SE2(2.0 + ROOM_PITCH * (n // 2), 2.5, rng.uniform(-np.pi, np.pi))
    result = Locator(grid).locate(LIDAR.scan(grid, truth, rng))
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


# --- frames ---


@pytest.mark.parametrize("origin", [SE2(12.5, -7.25, 0.0), SE2(-3.0, 40.0, 1.0), SE2(0, 0, 3.14)])
@pytest.mark.parametrize("method", [Method.FAST, Method.PAPER])
def test_where_the_map_lies_moves_the_answer_and_nothing_else(origin, method):
    grid = identical_rooms(1)
    moved = OccupancyGrid(grid.cells, grid.resolution, origin @ grid.T_map_grid)
    rng = np.random.default_rng(3)
    scan = LIDAR.scan(grid, random_free_pose(grid, rng), rng)
    here = Locator(grid, method=method).locate(scan)
    there = Locator(moved, method=method).locate(scan)
    assert (here.verdict, here.reason, here.search) == (there.verdict, there.reason, there.search)
    R = origin.rotation_jacobian()
    for a, b in zip(here.hypotheses, there.hypotheses, strict=True):
        expected = origin @ a.pose
        assert expected.distance_to(b.pose) < 1e-9
        assert angle_error(expected.yaw, b.pose.yaw) < 1e-9
        np.testing.assert_allclose(R @ a.covariance @ R.T, b.covariance, rtol=1e-6, atol=1e-12)
        assert (a.score, a.probability, a.evidence) == (b.score, b.probability, b.evidence)


@pytest.mark.parametrize("method", [Method.FAST, Method.PAPER])
def test_where_the_sensor_sits_moves_the_base_and_nothing_else(method):
    grid = identical_rooms(1)
    rng = np.random.default_rng(4)
    scan = LIDAR.scan(grid, random_free_pose(grid, rng), rng)
    T_base_laser = SE2(0.3, -0.2, 2.2)
    locator = Locator(grid, method=method)
    laser, base = (locator.locate(s) for s in (scan, with_pose(scan, T_base_laser=T_base_laser)))
    assert laser.verdict is base.verdict
    for a, b in zip(laser.hypotheses, base.hypotheses, strict=True):
        on_robot = b.pose @ T_base_laser
        assert a.pose.distance_to(on_robot) < 1e-9
        assert angle_error(a.pose.yaw, on_robot.yaw) < 1e-9
        assert (a.score, a.probability, a.evidence) == (b.score, b.probability, b.evidence)


def test_upside_down_with_mirrored_bearings_is_the_same_scan(office_locator):
    rng = np.random.default_rng(5)
    grid = office_locator.fields.grid
    scan = LIDAR.scan(grid, random_free_pose(grid, rng), rng)
    hanging = with_pose(
        scan,
        angle_min=-scan.angle_min,
        angle_increment=-scan.angle_increment,
        mounting=Mounting.UPSIDE_DOWN,
    )
    assert told(office_locator.locate(hanging)) == told(office_locator.locate(scan))


@pytest.mark.parametrize("mounting", Mounting)
def test_a_sensor_anywhere_on_the_robot(mounting, office_locator):
    grid = office_locator.fields.grid
    lidar = Lidar(sigma_m=0.01, T_base_laser=SE2(0.2, -0.1, 2.0), mounting=mounting)
    for seed in range(4):
        rng = np.random.default_rng(seed)
        truth = random_free_pose(grid, rng, clearance_m=0.5)
        assert found(office_locator.locate(lidar.scan(grid, truth, rng)), truth, 0.05, 0.5)


def test_bearings_from_0_to_a_full_turn_are_as_good_as_from_minus_half(office_locator):
    rng = np.random.default_rng(6)
    grid = office_locator.fields.grid
    truth = random_free_pose(grid, rng)
    scan = LIDAR.scan(grid, truth, rng)
    rolled = with_pose(scan, ranges=np.roll(scan.ranges, -180), angle_min=0.0)
    turned = with_pose(scan, angle_min=scan.angle_min + FULL_TURN)
    for same in (rolled, turned):
        assert found(office_locator.locate(same), truth, 0.05, 0.5)


# --- one input, one output ---


def test_twice_and_from_many_threads_it_is_the_same(office_locator):
    grid = office_locator.fields.grid
    rng = np.random.default_rng(7)
    scans = [LIDAR.scan(grid, random_free_pose(grid, rng), rng) for _ in range(8)]
    alone = [told(office_locator.locate(scan)) for scan in scans]
    assert [told(office_locator.locate(scan)) for scan in scans] == alone
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(office_locator.locate, scans * 2))
    assert [told(result) for result in together] == alone * 2


def test_threads_may_share_a_locator_from_the_first_scan_on(room):
    """Nothing is prepared late in a way that two threads could disturb."""
    rng = np.random.default_rng(8)
    scan = LIDAR.scan(room.grid, random_free_pose(room.grid, rng), rng)
    fresh = Locator(room.grid)
    with ThreadPoolExecutor(4) as pool:
        results = [told(result) for result in pool.map(fresh.locate, [scan] * 4)]
    assert results == [told(Locator(room.grid).locate(scan))] * 4


PROGRAM = """
import numpy as np
from firstfix.global_localization.locate import Locator
from firstfix.sim.lidar import Lidar
from firstfix.sim.world import identical_rooms, random_free_pose
grid = identical_rooms(2)
rng = np.random.default_rng(9)
result = Locator(grid).locate(Lidar().scan(grid, random_free_pose(grid, rng), rng))
for h in result.hypotheses:
    print([float(x).hex() for x in (*h.pose.as_array(), *h.covariance.ravel(), h.score)])
"""


@pytest.mark.slow
def test_the_number_of_threads_does_not_matter():
    def run(threads: int) -> str:
        settings = ("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS")
        environment = {**os.environ, **dict.fromkeys(settings, str(threads))}
        return subprocess.run(
            [sys.executable, "-c", PROGRAM], env=environment, check=True, capture_output=True
        ).stdout.decode()

    assert run(1) == run(2) != ""


def test_the_scan_is_not_changed(office_locator):
    ranges = np.random.default_rng(10).uniform(0.5, 5.0, 90).astype(np.float32)
    scan = LaserScan(ranges.copy(), -2.0, 0.04, 0.1, 12.0)
    office_locator.locate(scan)
    assert scan.ranges.tolist() == ranges.tolist()


def test_a_cache_changes_nothing(room, tmp_path):
    rng = np.random.default_rng(11)
    scan = LIDAR.scan(room.grid, random_free_pose(room.grid, rng), rng)
    fresh = told(Locator(room.grid).locate(scan))
    for _ in range(2):
        assert told(Locator(room.grid, cache_dir=tmp_path).locate(scan)) == fresh


# --- scans that say little, or much ---

SILENT = {
    "NaN": math.nan,
    "zero": 0.0,
    "negative": -1.0,
    "too near": 0.01,
    "minus infinity": -math.inf,
    "no return": math.inf,
    "at the limit": 12.0,
}


@pytest.mark.parametrize("reading", SILENT.values(), ids=SILENT.keys())
@pytest.mark.parametrize("method", Method)
def test_a_scan_without_a_hit_matches_nothing_and_says_so(reading, method, draw_room):
    locator = Locator(draw_room(0.25), method=method)
    scan = LaserScan(np.full(360, reading, np.float32), -np.pi, FULL_TURN / 360, 0.1, 12.0)
    result = locator.locate(scan)
    assert result.verdict is Verdict.NO_MATCH
    assert "only 0 of 360 beams" in result.reason
    assert result.best is None
    assert not result.search.proven


@pytest.mark.parametrize("n", [1, 2, 7])
def test_a_handful_of_beams_is_too_few(n, office_locator):
    result = office_locator.locate(LaserScan(np.full(n, 2.0), 0.0, 0.5, 0.1, 12.0))
    assert result.verdict is Verdict.NO_MATCH
    assert f"only {n} of {n} beams" in result.reason


@pytest.mark.parametrize("n", [8, 20])
def test_few_beams_are_never_sure_of_a_wrong_place(n, office_locator):
    grid = office_locator.fields.grid
    for seed in range(10):
        rng = np.random.default_rng(seed)
        truth = random_free_pose(grid, rng)
        result = office_locator.locate(Lidar(beams=n, sigma_m=0.01).scan(grid, truth, rng))
        assert result.verdict is not Verdict.UNIQUE or found(result, truth, 0.5, 10.0)


@pytest.mark.parametrize("n", [100, 2_000, 100_000])
def test_any_number_of_beams(n, office_locator):
    rng = np.random.default_rng(12)
    grid = office_locator.fields.grid
    truth = random_free_pose(grid, rng)
    result = office_locator.locate(Lidar(beams=n, sigma_m=0.01).scan(grid, truth, rng))
    assert result.verdict is Verdict.UNIQUE
    assert found(result, truth, 0.05, 0.5)


def test_ranges_far_beyond_the_map_are_no_trouble(room):
    ranges = np.full(90, 1.5, np.float32)
    ranges[::9] = [200.0, 1e4, 1e9, 1e30, 3e38] * 2
    scan = LaserScan(ranges, -np.pi, FULL_TURN / 90, 0.1, math.inf)
    assert Locator(room.grid).locate(scan).verdict is not Verdict.UNIQUE


def test_the_paper_takes_ranges_far_beyond_the_map_as_well(room):
    ranges = np.full(90, 1.5, np.float32)
    ranges[7] = 3e38
    scan = LaserScan(ranges, -np.pi, FULL_TURN / 90, 0.1, math.inf)
    assert Locator(room.grid, method=Method.PAPER).locate(scan).hypotheses


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
        locator = Locator(OccupancyGrid(cells, 0.05))
    except MapError:
        return
    assert locator.locate(scan).verdict is not Verdict.UNIQUE


@pytest.mark.parametrize("resolution", [0.01, 0.02, 0.05, 0.1, 0.125, 0.25])
def test_cells_of_any_size(resolution, draw_room):
    """One room, seen with exact walls, found in drawings from 1 to 25 cm a cell."""
    exact = draw_room(0.01)
    locator = Locator(draw_room(resolution))
    for seed in range(4):
        rng = np.random.default_rng(seed)
        truth = random_free_pose(exact, rng)
        result = locator.locate(LIDAR.scan(exact, truth, rng))
        assert found(result, truth, 0.5, 10.0)
        if resolution <= 0.05:
            assert found(result, truth, 0.05, 0.5)


@pytest.mark.parametrize("value", [FREE, UNKNOWN, OCCUPIED])
@pytest.mark.parametrize("method", Method)
def test_a_map_of_one_kind_is_no_map(value, method):
    with pytest.raises(MapError):
        Locator(OccupancyGrid(np.full((20, 30), value, np.int8), 0.05), method=method)


# --- time ---


def test_without_time_it_never_publishes(office_locator):
    grid = office_locator.fields.grid
    hurried = Locator(grid, config=LocateConfig(budget_s=0.0))
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
def test_the_methods_of_the_paper(method, room):
    locator = Locator(room.grid, method=method)
    for seed in range(3):
        rng = np.random.default_rng(seed)
        truth = random_free_pose(room.grid, rng)
        result = locator.locate(LIDAR.scan(room.grid, truth, rng))
        assert result.verdict is Verdict.UNIQUE
        assert result.search.proven
        assert found(result, truth, 0.5, 16.0)


def test_settings_reach_the_search(office_locator):
    rng = np.random.default_rng(13)
    grid = office_locator.fields.grid
    truth = random_free_pose(grid, rng)
    scan = LIDAR.scan(grid, truth, rng)
    few = Locator(grid, config=LocateConfig(hypotheses=2, shortlist=20)).locate(scan)
    assert len(few.hypotheses) <= 2
    assert found(few, truth, 0.05, 0.5)
    never = Locator(grid, config=LocateConfig(unique_probability=1.0)).locate(scan)
    assert never.verdict is not Verdict.UNIQUE


# --- recorded drives ---


@pytest.mark.shared
@pytest.mark.parametrize(("case", "every"), [("olin_mac1_9_23", 20), ("intel_lab", 40)])
def test_recorded_scans_are_found_where_they_were_taken(case: str, every: int, shared: Path):
    folder = shared / "cases" / case
    locator = Locator(load_map(folder / "map.yaml"))
    recording = load_recording(folder / "scans.npz")
    assert recording.truth is not None
    tried = right = wrong_but_sure = 0
    for scan, pose in zip(recording.scans[::every], recording.truth[::every], strict=True):
        result = locator.locate(scan)
        hit = result.best is not None and found(result, SE2.from_array(pose), 0.5, 10.0)
        tried += 1
        right += hit
        wrong_but_sure += result.verdict is Verdict.UNIQUE and not hit
    assert tried >= 5
    assert right >= 0.9 * tried
    assert wrong_but_sure == 0
