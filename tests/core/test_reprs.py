"""Values print as one line, whatever they hold."""

import numpy as np
import pytest

import firstfix as ff


@pytest.fixture(scope="module")
def matcher(hall_plan: ff.OccupancyGrid) -> ff.ScanMatcher:
    return ff.ScanMatcher(hall_plan)


GRID = "<OccupancyGrid 10.0 x 8.0 m, 200 x 160 cells of 0.05 m>"


def test_reprs_are_one_line(
    hall_plan: ff.OccupancyGrid, driven: ff.Recording, matcher: ff.ScanMatcher
) -> None:
    localizer = ff.Localizer()
    assert repr(hall_plan) == GRID
    assert repr(driven) == "<Recording 66 scans in 6.5 s, with odometry and ground truth>"
    assert repr(ff.Recording(driven.scans[:1])) == "<Recording 1 scans in 0.0 s>"
    assert repr(driven.odometry) == "<Trajectory 66 poses in 6.5 s>"
    assert repr(driven.scans[0]) == "<LaserScan 120 beams over 360°, 120 hits, stamp 100.000>"
    assert repr(matcher) == f"<ScanMatcher fast in {GRID}>"
    assert repr(localizer) == "<Localizer NO_MAP>"
    localizer.handle(ff.NewMap(0.0, hall_plan))
    assert repr(localizer) == f"<Localizer SEARCHING in {GRID}>"


def test_outputs_print_without_arrays() -> None:
    pose = ff.SE2(1.0, 2.0, 0.0)
    for output in (
        ff.InitialPose(0.0, pose, np.eye(3)),
        ff.TrackedPose(0.0, pose, np.eye(3), pose),
    ):
        assert "array" not in repr(output)
        assert "\n" not in repr(output)


def test_a_trajectory_may_be_empty() -> None:
    assert repr(ff.Trajectory(np.empty(0), np.empty((0, 3)))) == "<Trajectory 0 poses in 0.0 s>"
