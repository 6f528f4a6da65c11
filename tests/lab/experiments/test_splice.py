"""Drives that are joined: odometry goes on, the truth jumps."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from firstfix.core.recording import Recording
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.core.trajectory import Trajectory
from firstfix.lab.experiments.splice import LONGEST_S, SHORTEST_S, Unfit, splice


def driven_for(seconds: float, period_s: float = 0.5) -> Recording:
    """A straight drive of 0.2 m/s; odometry has a frame of its own."""
    stamps = 1000.0 + np.arange(0.0, seconds + 1e-9, period_s)
    truth = np.column_stack([0.2 * (stamps - 1000.0), np.zeros((len(stamps), 2))])
    frame = SE2(3.0, -2.0, 1.0)
    counted = [(frame @ SE2.from_array(pose)).as_array() for pose in truth]
    scans = tuple(LaserScan(np.ones(3), 0.0, 0.1, 0.1, 10.0, stamp=s) for s in stamps.tolist())
    return Recording(scans, Trajectory(stamps, np.array(counted)), truth)


@pytest.fixture(scope="module")
def joined() -> Recording:
    drive = splice(driven_for(90.0), 4, np.random.default_rng(1))
    assert isinstance(drive, Recording)
    return drive


def test_there_are_as_many_seams_as_asked_for_and_pieces_of_20_to_30_s(joined: Recording) -> None:
    assert joined.runs is not None
    assert joined.runs[0] == 0
    assert set(np.diff(joined.runs)) == {0, 1}
    assert joined.runs[-1] == 4
    stamps = np.array([scan.stamp for scan in joined.scans])
    for piece in range(5):
        of_piece = stamps[joined.runs == piece]
        assert SHORTEST_S - 1.0 <= of_piece[-1] - of_piece[0] <= LONGEST_S


def test_time_goes_on_from_0_evenly(joined: Recording) -> None:
    stamps = [scan.stamp for scan in joined.scans]
    assert stamps[0] == 0.0
    np.testing.assert_allclose(np.diff(stamps), 0.5, atol=1e-9)
    assert joined.odometry is not None
    np.testing.assert_array_equal(joined.odometry.stamps, stamps)


def test_odometry_goes_on_over_a_seam_and_the_truth_jumps(joined: Recording) -> None:
    assert joined.odometry is not None
    assert joined.truth is not None
    assert joined.runs is not None
    odometry = [SE2.from_array(pose) for pose in joined.odometry.poses]
    truth = [SE2.from_array(pose) for pose in joined.truth]
    for i, (a, b) in enumerate(itertools.pairwise(range(len(joined)))):
        counted = (odometry[a].inverse() @ odometry[b]).as_array()
        moved = (truth[a].inverse() @ truth[b]).as_array()
        if joined.runs[a] == joined.runs[b]:
            np.testing.assert_allclose(counted, moved, atol=1e-9, err_msg=str(i))
        else:
            np.testing.assert_allclose(counted, 0.0, atol=1e-9)
            assert np.hypot(*moved[:2]) >= 0.5


def test_one_seed_makes_one_drive() -> None:
    drives = [splice(driven_for(90.0), 4, np.random.default_rng(seed)) for seed in (1, 1, 2)]
    first, again, other = [drive.truth for drive in drives if isinstance(drive, Recording)]
    assert first is not None
    np.testing.assert_array_equal(first, again)
    assert other is None or first.shape != other.shape or (first != other).any()


def test_a_gap_or_another_run_ends_a_piece() -> None:
    whole = driven_for(60.0)
    assert whole.odometry is not None
    runs = np.repeat([0, 1, 2, 3], [30, 31, 30, 30])
    assert isinstance(splice(whole, 1, np.random.default_rng(0)), Recording)
    in_runs = splice(replace(whole, runs=runs), 1, np.random.default_rng(0))
    assert isinstance(in_runs, Unfit)
    late = [scan.stamp + 20.0 * (i > 45) for i, scan in enumerate(whole.scans)]
    scans = tuple(replace(s, stamp=t) for s, t in zip(whole.scans, late, strict=True))
    odometry = Trajectory(np.array(late), whole.odometry.poses)
    drive = splice(replace(whole, scans=scans, odometry=odometry), 3, np.random.default_rng(0))
    assert isinstance(drive, Recording)
    assert max(np.diff([scan.stamp for scan in drive.scans])) == pytest.approx(0.5)


def test_a_drive_that_cannot_be_spliced_gives_the_reason() -> None:
    rng = np.random.default_rng(0)
    whole = driven_for(60.0)
    for drive, why in (
        (replace(whole, odometry=None), "no odometry"),
        (driven_for(15.0), "no drive of 20 s"),
        (driven_for(60.0, period_s=1.5), "at most 1 s apart"),
        (replace(whole, truth=None), "true poses"),
        (replace(whole, truth=np.zeros((len(whole), 3))), "far enough apart"),
    ):
        unfit = splice(drive, 2, rng)
        assert isinstance(unfit, Unfit)
        assert why in unfit.why
