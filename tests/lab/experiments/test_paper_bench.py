"""Ways of starting: each starts at its pose, and continues as the filter does."""

import math

import numpy as np
import pytest

from firstfix.core.grid import OccupancyGrid
from firstfix.core.recording import Recording
from firstfix.core.se2 import SE2
from firstfix.core.trajectory import Trajectory
from firstfix.lab.experiments.drive import Drive, plan_drive
from firstfix.lab.experiments.paper_bench import (
    PAPER_WORLDS,
    at_home,
    attempt,
    follow_with_system,
    simulated_drive,
)
from firstfix.lab.metrics.outcome import is_found
from firstfix.lab.metrics.paper_trial import WORDS, Attempt, Start
from firstfix.lab.simulation.floor import Floor
from firstfix.lab.simulation.lidar import Lidar
from firstfix.lab.worlds.catalog import ROOM_PITCH, identical_rooms


@pytest.fixture(scope="module")
def hall_drive(driven: Recording) -> Drive:
    return plan_drive(driven, None)


@pytest.fixture(scope="module")
def attempts(hall_plan: OccupancyGrid, hall_drive: Drive) -> dict[Start, Attempt]:
    ways = [start for start in Start if start is not Start.SYSTEM]
    return {start: attempt(start, hall_drive, hall_plan, 0) for start in ways}


def test_every_way_has_words() -> None:
    assert list(WORDS) == list(Start)


def test_every_scan_has_a_belief(attempts: dict[Start, Attempt], driven: Recording) -> None:
    for tried in attempts.values():
        assert [belief.stamp for belief in tried.beliefs] == [s.stamp for s in driven.scans]
        assert all(belief.cpu_s >= 0.0 for belief in tried.beliefs)
        assert tried.prepare_s >= 0.0


@pytest.mark.parametrize("start", [Start.BY_HAND, Start.PAPER, Start.FAST])
def test_a_start_at_the_right_place_stays_right(
    attempts: dict[Start, Attempt], start: Start
) -> None:
    last = attempts[start].beliefs[-1]
    assert last.T_map_base is not None
    assert is_found(last.T_map_base, last.truth)
    assert last.sure


def test_the_default_pose_is_where_the_map_begins(attempts: dict[Start, Attempt]) -> None:
    first = attempts[Start.DEFAULT_POSE].beliefs[0].T_map_base
    assert first is not None
    assert first.distance_to(SE2.identity()) < 1.5


def test_a_uniform_belief_is_not_sure_at_first(attempts: dict[Start, Attempt]) -> None:
    tried = attempts[Start.UNIFORM]
    assert not tried.beliefs[0].sure
    assert 0 < len(tried.first_cloud) <= 400


def test_the_same_seed_gives_the_same_beliefs(
    hall_plan: OccupancyGrid, hall_drive: Drive, attempts: dict[Start, Attempt]
) -> None:
    again = attempt(Start.UNIFORM, hall_drive, hall_plan, 0)
    poses = [belief.T_map_base for belief in again.beliefs]
    assert poses == [belief.T_map_base for belief in attempts[Start.UNIFORM].beliefs]


def test_where_places_are_alike_the_default_method_gives_no_pose() -> None:
    grid, lidar, rng = identical_rooms(2), Lidar(beams=180), np.random.default_rng(0)
    truth = [SE2(2.0 + 0.3 * i, 1.5, 0.0) for i in range(3)]
    scans = tuple(lidar.scan(grid, pose, rng, float(i)) for i, pose in enumerate(truth))
    rows = np.array([pose.as_array() for pose in truth])
    recording = Recording(scans, Trajectory(np.arange(3.0), rows), rows)
    drive = plan_drive(recording, None)
    silent = attempt(Start.FAST, drive, grid, 0)
    assert all(belief.T_map_base is None and not belief.sure for belief in silent.beliefs)
    assert len(silent.last_cloud) == 0
    spoken = attempt(Start.PAPER, drive, grid, 0).beliefs[-1].T_map_base
    assert spoken is not None
    assert math.remainder(spoken.x - truth[-1].x, ROOM_PITCH) == pytest.approx(0.0, abs=0.3)


def test_the_origin_of_every_world_is_a_place_where_a_robot_can_be() -> None:
    for draw in PAPER_WORLDS.values():
        assert Floor(at_home(draw())).room_at(0.0, 0.0) > 0.18


def test_the_system_tracks_a_drive(hall_plan: OccupancyGrid, driven: Recording) -> None:
    lived = follow_with_system(driven, hall_plan)
    assert lived.start is Start.SYSTEM
    assert [belief.stamp for belief in lived.beliefs] == [scan.stamp for scan in driven.scans]
    last = lived.beliefs[-1]
    assert last.T_map_base is not None
    assert is_found(last.T_map_base, last.truth)
    assert len(lived.last_cloud) > 0


def test_a_drive_is_as_long_as_asked_for_and_repeats(hall_plan: OccupancyGrid) -> None:
    once, again = (simulated_drive(hall_plan, 3, 4.0) for _ in range(2))
    assert len(once) == 40
    assert once.truth is not None
    assert again.truth is not None
    np.testing.assert_array_equal(once.truth, again.truth)
