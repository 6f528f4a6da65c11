"""Following a drive, scan by scan."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from firstfix.amcl.config import AmclConfig
from firstfix.core.errors import InputError
from firstfix.core.grid import OccupancyGrid
from firstfix.core.pose_error import PoseError
from firstfix.core.recording import Recording
from firstfix.core.se2 import SE2
from firstfix.lab.experiments.drive import plan_drive
from firstfix.lab.experiments.drive_tracking import (
    GIVEN_START,
    TRUE_START,
    TrackedScan,
    check_start,
    follow_drive,
    make_tracker,
    spread,
)

CONFIG = AmclConfig()


def follow(
    grid: OccupancyGrid, recording: Recording, start: SE2 | None = None, seed: int = 0
) -> list[TrackedScan]:
    covariance = TRUE_START if start is None else GIVEN_START
    tracker, rng = make_tracker(grid, CONFIG), np.random.default_rng(seed)
    return [*follow_drive(plan_drive(recording, start), tracker, CONFIG, covariance, rng)]


def errors(tracked: list[TrackedScan]) -> list[PoseError]:
    assert all(scan.sight.truth is not None for scan in tracked)
    return [
        PoseError.between(scan.T_map_base, scan.sight.truth)
        for scan in tracked
        if scan.sight.truth is not None
    ]


def test_a_drive_is_tracked_to_its_end(hall_plan: OccupancyGrid, driven: Recording) -> None:
    tracked = follow(hall_plan, driven)
    assert [scan.sight.index for scan in tracked] == list(range(len(driven)))
    assert max(error.metres for error in errors(tracked)) < 0.15
    assert max(error.radians for error in errors(tracked)) < math.radians(6.0)
    assert all(scan.cpu_s >= 0.0 and 0.0 <= scan.elsewhere <= 1.0 for scan in tracked)
    assert {scan.covariance.shape for scan in tracked} == {(3, 3)}


def test_a_laser_behind_helps_one_that_is_covered(
    hall_plan: OccupancyGrid, driven: Recording
) -> None:
    covered = replace(driven.scans[0], ranges=np.full(len(driven.scans[0]), np.nan, np.float32))
    front = tuple(replace(covered, stamp=scan.stamp, sensor="front") for scan in driven.scans)
    pairs = zip(front, driven.scans, strict=True)
    two = replace(
        driven,
        scans=tuple(scan for pair in pairs for scan in pair),
        truth=None if driven.truth is None else np.repeat(driven.truth, 2, axis=0),
        sensors=np.tile([0, 1], len(driven)),
    )
    assert [e.metres for e in errors(follow(hall_plan, two))] == pytest.approx(
        [e.metres for e in errors(follow(hall_plan, driven))], abs=0.15
    )


def test_between_updates_odometry_moves_the_pose(
    hall_plan: OccupancyGrid, driven: Recording
) -> None:
    tracked = follow(hall_plan, driven)
    updated = [scan.updated for scan in tracked]
    assert updated[0]
    assert 10 < sum(updated) < len(tracked) / 2
    for before, after in pairwise(tracked):
        if not after.updated:
            assert after.T_map_odom == before.T_map_odom
            assert after.particles == before.particles
        assert (after.T_map_odom @ after.sight.T_odom_base).distance_to(after.T_map_base) < 1e-9


def test_a_start_a_step_away_is_drawn_to_the_truth(
    hall_plan: OccupancyGrid, driven: Recording
) -> None:
    tracked = follow(hall_plan, driven, SE2(1.9, 1.2, 0.2))
    assert errors(tracked)[-1].metres < 0.15


def test_a_new_run_begins_at_its_own_place(hall_plan: OccupancyGrid, driven: Recording) -> None:
    there, back = list(range(5)), list(range(40, 45))
    chosen = there + back
    assert driven.truth is not None
    broken = replace(
        driven,
        scans=tuple(driven.scans[i] for i in chosen),
        truth=driven.truth[chosen],
        runs=np.array([7] * 5 + [8] * 5),
    )
    tracked = follow(hall_plan, broken)
    assert [i for i, scan in enumerate(tracked) if scan.updated and not scan.sight.same_run] == [
        0,
        5,
    ]
    assert max(error.metres for error in errors(tracked)) < 0.15


def test_one_seed_is_one_track(hall_plan: OccupancyGrid, driven: Recording) -> None:
    poses = [
        [scan.T_map_base for scan in follow(hall_plan, driven, seed=seed)] for seed in (3, 3, 4)
    ]
    assert poses[0] == poses[1] != poses[2]


def test_a_spread_is_of_metres_and_degrees() -> None:
    np.testing.assert_allclose(spread(0.5, 180.0), np.diag([0.25, 0.25, math.pi**2]))


def test_a_start_outside_the_map_is_refused(hall_plan: OccupancyGrid) -> None:
    check_start(hall_plan, SE2(-0.4, 7.4, 0.0))
    with pytest.raises(InputError, match=r"x -0\.50 to 9\.50 m, y -0\.50 to 7\.50 m"):
        check_start(hall_plan, SE2(9.6, 3.0, 0.0))
    turned = replace(hall_plan, T_map_grid=SE2(0.0, 0.0, math.pi / 2))
    with pytest.raises(InputError, match=r"x -8\.00 to 0\.00 m, y 0\.00 to 10\.00 m"):
        check_start(turned, SE2(3.0, 3.0, 0.0))
