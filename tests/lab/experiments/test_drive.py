"""Which scans of a recording are followed, and where each run begins."""

from dataclasses import replace

import numpy as np
import pytest

from firstfix.core.errors import ScanError
from firstfix.core.recording import Recording
from firstfix.core.se2 import SE2
from firstfix.core.trajectory import Trajectory
from firstfix.lab.experiments.drive import plan_drive

N = 6


@pytest.fixture
def log(driven: Recording) -> Recording:
    assert driven.odometry is not None
    assert driven.truth is not None
    odometry = Trajectory(driven.odometry.stamps[:N], driven.odometry.poses[:N])
    return replace(driven, scans=driven.scans[:N], truth=driven.truth[:N], odometry=odometry)


def begun(recording: Recording, start: SE2 | None = None) -> list[int]:
    return [
        sight.index for sight in plan_drive(recording, start).sights if sight.begin_at is not None
    ]


def test_a_log_of_one_run_begins_once_at_the_truth(log: Recording) -> None:
    drive = plan_drive(log, None)
    assert [sight.index for sight in drive.sights] == list(range(N))
    assert begun(log) == [0]
    assert drive.begin_at == SE2(1.5, 1.5, 0.0)
    assert (drive.skipped, drive.notes) == (0, ())


def test_a_start_that_is_given_counts_more_than_the_truth(log: Recording) -> None:
    assert plan_drive(log, SE2(1.0, 2.0, 3.0)).begin_at == SE2(1.0, 2.0, 3.0)


def test_every_run_restarts_where_its_truth_is_known(log: Recording) -> None:
    runs = replace(log, runs=np.array([0, 0, 1, 1, 2, 2]))
    drive = plan_drive(runs, None)
    assert begun(runs) == [0, 2, 4]
    assert [sight.same_run for sight in drive.sights] == [False, True] * 3
    assert drive.sights[2].begin_at == drive.sights[2].truth
    (note,) = drive.notes
    assert note.startswith("2 further run(s) of the log restart")


def test_a_run_without_truth_goes_on_over_the_gap(log: Recording) -> None:
    runs = replace(log, runs=np.array([0, 0, 1, 1, 2, 2]), truth=None)
    assert begun(runs, SE2.identity()) == [0]
    assert "2 further run(s) begin without a true pose" in plan_drive(runs, SE2.identity()).notes[0]
    assert log.truth is not None
    truth = log.truth.copy()
    truth[2] = np.nan
    partly = replace(log, runs=runs.runs, truth=truth)
    assert begun(partly) == [0, 4]


def test_scans_beyond_the_odometry_are_left_out_and_counted(log: Recording) -> None:
    assert log.odometry is not None
    short = Trajectory(log.odometry.stamps[1:-2], log.odometry.poses[1:-2])
    drive = plan_drive(replace(log, odometry=short), None)
    assert [sight.index for sight in drive.sights] == [1, 2, 3]
    assert drive.skipped == 3
    assert drive.notes == ("3 scan(s) have no odometry at their stamp and are left out",)


def test_scans_before_the_first_true_pose_are_left_out_unless_a_start_is_given(
    log: Recording,
) -> None:
    assert log.truth is not None
    truth = log.truth.copy()
    truth[:2] = np.nan
    late = replace(log, truth=truth)
    drive = plan_drive(late, None)
    assert [sight.index for sight in drive.sights] == [2, 3, 4, 5]
    assert (drive.skipped, len(drive.notes)) == (2, 1)
    given = plan_drive(late, SE2.identity())
    assert len(given.sights) == N
    assert given.sights[0].truth is None


def test_odometry_between_two_stamps_is_interpolated(log: Recording) -> None:
    assert log.odometry is not None
    sparse = Trajectory(log.odometry.stamps[::5], np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]))
    poses = [s.T_odom_base.x for s in plan_drive(replace(log, odometry=sparse), None).sights]
    np.testing.assert_allclose(poses, np.arange(N) / 5, atol=1e-9)


def test_a_log_without_odometry_is_refused_with_what_to_record(log: Recording) -> None:
    blind = replace(log, odometry=None, notes=("the sensor is fixed to nothing",))
    with pytest.raises(ScanError, match=r"\(the sensor is fixed to nothing\).*record /tf"):
        plan_drive(blind, None)


def test_clocks_that_never_meet_are_named(log: Recording) -> None:
    assert log.odometry is not None
    other = Trajectory(log.odometry.stamps + 1e9, log.odometry.poses)
    with pytest.raises(ScanError, match="by one clock"):
        plan_drive(replace(log, odometry=other), None)


@pytest.mark.parametrize("truth", [None, np.full((N, 3), np.nan)])
def test_without_a_start_there_must_be_truth(log: Recording, truth: np.ndarray | None) -> None:
    with pytest.raises(ScanError, match="firstfix locate"):
        plan_drive(replace(log, truth=truth), None)


def test_scans_of_one_time_are_one_sight_seen_from_its_first_sensor(log: Recording) -> None:
    assert log.odometry is not None
    later = log.scans[0].stamp + 0.2 * (log.scans[1].stamp - log.scans[0].stamp)
    rear = replace(log.scans[0], stamp=later, sensor="rear", T_base_laser=SE2(-0.3, 0.0, 3.0))
    scans = (log.scans[0], rear, *log.scans[1:])
    two = replace(log, scans=scans, truth=None, runs=None, sensors=np.array([0, 1] + [0] * (N - 1)))
    drive = plan_drive(two, SE2(1.5, 1.5, 0.0))
    assert [sight.index for sight in drive.sights] == [0, 2, 3, 4, 5, 6]
    assert drive.skipped == 0
    assert [len(sight.others) for sight in drive.sights] == [1, 1, 0, 0, 0, 0]  # 0.15 s apart
    then, now = log.odometry.at(later), drive.sights[0].T_odom_base
    (moved,) = drive.sights[0].others
    assert (now @ moved.T_base_laser).distance_to(then @ rear.T_base_laser) < 1e-9
