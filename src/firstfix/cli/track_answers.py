"""A tracked drive for people and for programs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np

from firstfix.cli.answers import pose_text
from firstfix.cli.start import Start
from firstfix.core.se2 import SE2
from firstfix.core.trajectory import Trajectory
from firstfix.lab.experiments.drive import Drive
from firstfix.lab.metrics.outcome import FOUND
from firstfix.lab.metrics.track_metrics import RPE_PIECE_M, ErrorFigures, TrackFigures

if TYPE_CHECKING:
    from firstfix.lab.experiments.drive_tracking import TrackedScan


def track_json(
    start: Start, drive: Drive, tracked: Sequence[TrackedScan], figures: TrackFigures
) -> dict[str, Any]:
    """Put a tracked drive into the document that ``track --json`` writes (docs/json.md)."""
    first, last = tracked[0], tracked[-1]
    return {
        "start": {
            "origin": start.origin.value,
            "pose": drive.begin_at.as_array().tolist(),
            "stamp": first.sight.scan.stamp,
        },
        "end": {
            "pose": last.T_map_base.as_array().tolist(),
            "covariance": last.covariance.tolist(),
            "elsewhere": last.elsewhere,
            "stamp": last.sight.scan.stamp,
        },
        "skipped": drive.skipped,
        "restarts": sum(scan.sight.begin_at is not None for scan in tracked) - 1,
        **asdict(figures),
    }


def track_text(tracked: Sequence[TrackedScan], figures: TrackFigures) -> str:
    """Put a tracked drive into lines for a person."""
    last = tracked[-1]
    sigma = np.sqrt(np.clip(np.diagonal(last.covariance), 0.0, None))
    cpu = f"{figures.cpu_update_ms:.2f} ms an update, 95 % up to {figures.cpu_update_ms_p95:.2f} ms"
    lines = [
        f"scans        {figures.scans}, {figures.updates} of them used for an update",
        f"drive        {figures.way_m:.1f} m by odometry in {figures.duration_s:.1f} s",
        f"end          {pose_text(last.T_map_base)}",
        f"σ            {pose_text(SE2.from_array(sigma))}",
        f"elsewhere    {last.elsewhere:.1%} of the belief",
        f"particles    {figures.particles_mean:.0f} on average",
        f"CPU          {cpu}",
    ]
    if figures.ape is not None:
        within = f"within {FOUND.metres:g} m and {math.degrees(FOUND.radians):.0f}°"
        lines += [
            f"kept         {figures.kept:.1%} of {figures.n} scans {within} of the truth",
            f"APE          {_errors_text(figures.ape)}",
        ]
    if figures.rpe is not None:
        lines.append(f"RPE          {_errors_text(figures.rpe)}, over {RPE_PIECE_M:g} m of way")
    return "\n".join(lines)


def track_title(figures: TrackFigures) -> str:
    """Put a tracked drive into one line above its picture."""
    words = f"{figures.scans} scans, {figures.way_m:.0f} m, {figures.updates} updates"
    if figures.ape is None:
        return words
    return f"{words}; error {figures.ape.rmse_m:.3f} m RMSE, at most {figures.ape.max_m:.2f} m"


def trajectory_of(tracked: Sequence[TrackedScan]) -> Trajectory:
    """Return the tracked poses, ``T_map_base`` at every scan."""
    stamps = np.array([scan.sight.scan.stamp for scan in tracked])
    return Trajectory(stamps, np.array([scan.T_map_base.as_array() for scan in tracked]))


def _errors_text(errors: ErrorFigures) -> str:
    rows = (
        ("RMSE", errors.rmse_m, errors.rmse_deg),
        ("median", errors.median_m, errors.median_deg),
        ("at most", errors.max_m, errors.max_deg),
    )
    return ", ".join(f"{word} {metres:.3f} m {degrees:.2f}°" for word, metres, degrees in rows)
