"""A tracked drive in figures, against numbers worked out by hand."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.lab.experiments.drive import Sight
from firstfix.lab.experiments.drive_tracking import TrackedScan
from firstfix.lab.metrics.track_metrics import relative_errors, summarize_track


def seen(i: int, pose: SE2, truth: SE2 | None, *, updated: bool = True) -> TrackedScan:
    scan = LaserScan(np.ones(3), 0.0, 0.1, 0.1, 10.0, stamp=10.0 + i)
    odometry = SE2(0.5 * i, 0.0, 0.0)
    return TrackedScan(
        sight=Sight(i, scan, odometry, truth, pose if i == 0 else None, i > 0),
        T_map_base=pose,
        covariance=np.eye(3),
        T_map_odom=SE2.identity(),
        updated=updated,
        particles=100 * (i + 1),
        elsewhere=0.0,
        cpu_s=1e-3 * (i + 1),
    )


def straight(n: int, step_m: float, drift: SE2 | None = None) -> list[TrackedScan]:
    """A track that drifts by one more ``drift`` with every scan."""
    tracked, off = [], SE2.identity()
    for i in range(n):
        truth = SE2(step_m * i, 0.0, 0.0)
        tracked.append(seen(i, truth @ off, truth))
        off = off @ (drift or SE2.identity())
    return tracked


def test_figures_by_hand() -> None:
    tracked = [
        seen(0, SE2(0.0, 0.0, 0.0), SE2(0.0, 0.3, 0.0)),
        seen(1, SE2(1.0, 0.0, 0.1), SE2(1.0, 0.4, 0.2), updated=False),
        seen(2, SE2(2.0, 0.0, math.pi), SE2(2.0, 0.0, -math.pi + 0.5)),
        seen(3, SE2(3.0, 0.0, 0.0), None),
    ]
    figures = summarize_track(tracked)
    assert (figures.scans, figures.updates, figures.n) == (4, 3, 3)
    assert figures.duration_s == pytest.approx(3.0)
    assert figures.way_m == pytest.approx(1.5)
    assert figures.particles_mean == pytest.approx((100 + 300 + 400) / 3)
    assert figures.cpu_update_ms == pytest.approx(3.0)
    assert figures.kept == pytest.approx(2 / 3)
    assert figures.ape is not None
    assert figures.ape.rmse_m == pytest.approx(math.sqrt(0.25 / 3))
    assert figures.ape.median_m == pytest.approx(0.3)
    assert figures.ape.max_m == pytest.approx(0.4)
    assert figures.ape.max_deg == pytest.approx(math.degrees(0.5))


def test_without_truth_nothing_is_compared() -> None:
    figures = summarize_track(
        [replace(s, sight=replace(s.sight, truth=None)) for s in straight(3, 1.0)]
    )
    assert (figures.n, figures.kept, figures.ape, figures.rpe) == (0, None, None, None)


def test_a_gap_is_neither_way_nor_time() -> None:
    tracked = straight(4, 1.0)
    tracked[2] = replace(tracked[2], sight=replace(tracked[2].sight, same_run=False))
    figures = summarize_track(tracked)
    assert figures.duration_s == pytest.approx(2.0)
    assert figures.way_m == pytest.approx(1.0)
    assert len(relative_errors(tracked)) == 2


def test_relative_errors_are_of_pieces_of_the_true_way() -> None:
    drift = SE2(0.01, 0.0, 0.0)
    errors = relative_errors(straight(11, 0.25, drift))
    assert len(errors) == 2  # of 2.5 m, in pieces of 1 m
    assert [error.metres for error in errors] == pytest.approx([0.04, 0.04])
    assert relative_errors(straight(3, 0.25)) == []


@given(st.floats(-5, 5), st.floats(-5, 5), st.floats(-3, 3))
def test_a_track_that_is_moved_as_a_whole_has_no_relative_error(
    x: float, y: float, yaw: float
) -> None:
    moved = [replace(s, T_map_base=SE2(x, y, yaw) @ s.T_map_base) for s in straight(9, 0.5)]
    for error in relative_errors(moved):
        assert error.metres < 1e-9
        assert error.radians < 1e-9
