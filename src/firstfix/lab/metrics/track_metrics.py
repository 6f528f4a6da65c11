"""How well a drive was followed, in figures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from firstfix.core.pose_error import PoseError
from firstfix.core.se2 import SE2
from firstfix.lab.experiments.drive_tracking import TrackedScan
from firstfix.lab.metrics.outcome import FOUND

# Relative errors are taken over pieces of this length of the true way, m: longer than the way from
# one update to the next, shorter than a room.
RPE_PIECE_M = 1.0


@dataclass(frozen=True, slots=True)
class ErrorFigures:
    """Many errors of poses: root mean square, median and greatest, in m and degrees."""

    rmse_m: float
    median_m: float
    max_m: float
    rmse_deg: float
    median_deg: float
    max_deg: float


@dataclass(frozen=True, slots=True)
class TrackFigures:
    """A tracked drive in figures.

    Parameters
    ----------
    scans, updates : int
        Scans followed, and how many of them were used for an update.
    duration_s, way_m : float
        Time and way by odometry from the first to the last scan, s and m; gaps between runs left
        out.
    particles_mean : float
        Mean number of particles after an update.
    cpu_update_ms, cpu_update_ms_p95 : float
        Processor time of an update, ms: median and 95th percentile.
    n : int
        Scans whose true pose is known.
    kept : float or None
        Share of these that were tracked within 0.5 m and 10° (`FOUND`).
    ape : ErrorFigures or None
        Absolute errors of pose at these scans. Nothing is aligned: both are in the map frame.
    rpe : ErrorFigures or None
        Relative errors: of the motion over each piece of `RPE_PIECE_M` of the true way.
    """

    scans: int
    updates: int
    duration_s: float
    way_m: float
    particles_mean: float
    cpu_update_ms: float
    cpu_update_ms_p95: float
    n: int
    kept: float | None
    ape: ErrorFigures | None
    rpe: ErrorFigures | None


def summarize_track(tracked: Sequence[TrackedScan]) -> TrackFigures:
    """Put a tracked drive, of at least one scan, into figures."""
    updates = [scan for scan in tracked if scan.updated]
    cpu_ms = [1e3 * scan.cpu_s for scan in updates]
    known = [(scan, scan.sight.truth) for scan in tracked if scan.sight.truth is not None]
    errors = [PoseError.between(scan.T_map_base, truth) for scan, truth in known]
    followed = [(a, b) for a, b in pairwise(tracked) if b.sight.same_run]
    return TrackFigures(
        scans=len(tracked),
        updates=len(updates),
        duration_s=sum(b.sight.scan.stamp - a.sight.scan.stamp for a, b in followed),
        way_m=sum(a.sight.T_odom_base.distance_to(b.sight.T_odom_base) for a, b in followed),
        particles_mean=float(np.mean([scan.particles for scan in updates])),
        cpu_update_ms=float(np.percentile(cpu_ms, 50)),
        cpu_update_ms_p95=float(np.percentile(cpu_ms, 95)),
        n=len(errors),
        kept=sum(error.is_within(FOUND) for error in errors) / len(errors) if errors else None,
        ape=_figures(errors),
        rpe=_figures(relative_errors(tracked)),
    )


def relative_errors(
    tracked: Sequence[TrackedScan], piece_m: float = RPE_PIECE_M
) -> list[PoseError]:
    """Compare motions with the true ones over pieces of the true path.

    A piece ends at the first scan that is at least ``piece_m`` (m, sum of the distances between
    true positions) after its start. No piece spans a gap between runs. Scans without a true pose
    are skipped.
    """
    errors: list[PoseError] = []
    start: tuple[SE2, SE2] | None = None
    last, way = SE2.identity(), 0.0
    for scan in tracked:
        if not scan.sight.same_run:
            start = None
        truth = scan.sight.truth
        if truth is None:
            continue
        if start is None:
            start, last, way = (scan.T_map_base, truth), truth, 0.0
            continue
        way += truth.distance_to(last)
        last = truth
        if way >= piece_m:
            moved = start[0].inverse() @ scan.T_map_base
            errors.append(PoseError.between(moved, start[1].inverse() @ truth))
            start, way = (scan.T_map_base, truth), 0.0
    return errors


def _figures(errors: Sequence[PoseError]) -> ErrorFigures | None:
    if not errors:
        return None
    metres = _rmse_median_max(np.array([error.metres for error in errors]))
    degrees = _rmse_median_max(np.degrees([error.radians for error in errors]))
    return ErrorFigures(*metres, *degrees)


def _rmse_median_max(values: NDArray[np.float64]) -> tuple[float, float, float]:
    rmse = float(np.sqrt(np.mean(np.square(values))))
    return rmse, float(np.median(values)), float(values.max())
