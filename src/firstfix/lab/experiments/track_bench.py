"""The dynamic stage over cases: each is followed from its true start and compared with the truth.

The JSON document::

    {"cases": [{"name", "sensor", "n", "updates", "ape_rmse_m", "ape_rmse_deg",
                "ape_median_m", "ape_max_m", "kept", "cpu_update_ms", "cpu_update_ms_p95",
                "particles_mean", "rss_mb", "rpe_rmse_m", "rpe_rmse_deg"}, ...],
     "total": {...the same keys..., "all_kept"}}
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from firstfix.amcl.config import AmclConfig
from firstfix.fields.map_fields import MapFields
from firstfix.lab.experiments.case import Case, known_truth
from firstfix.lab.experiments.drive import plan_drive
from firstfix.lab.experiments.drive_tracking import TRUE_START, follow_drive, make_tracker
from firstfix.lab.experiments.process_pool import peak_rss_mb
from firstfix.lab.metrics.metrics import mean_of_known
from firstfix.lab.metrics.track_metrics import TrackFigures, summarize_track
from firstfix.lab.reports.text import Row, columns_table
from firstfix.localizer.precompile import precompile

COUNTS = frozenset({"n", "updates"})

# Title, key in the document, format.
COLUMNS = (
    ("n", "n", ".0f"),
    ("updates", "updates", ".0f"),
    ("kept", "kept", ".1%"),
    ("APE m", "ape_rmse_m", ".3f"),
    ("APE °", "ape_rmse_deg", ".2f"),
    ("median m", "ape_median_m", ".3f"),
    ("max m", "ape_max_m", ".3f"),
    ("RPE m", "rpe_rmse_m", ".3f"),
    ("RPE °", "rpe_rmse_deg", ".2f"),
    ("CPU ms", "cpu_update_ms", ".3f"),
    ("p95 CPU ms", "cpu_update_ms_p95", ".3f"),
    ("particles", "particles_mean", ".0f"),
    ("RSS MB", "rss_mb", ".0f"),
)


@dataclass(frozen=True, slots=True)
class TrackRun:
    """The result of tracking one case.

    Parameters
    ----------
    case, sensor : str
        Its name, and the sensor that its scans are cut to.
    figures : TrackFigures or None
        None if the case has no odometry.
    notes : tuple of str
        What was left out of the case.
    rss_mb : float or None
        Peak resident memory of the process that did this and nothing else, MB.
    """

    case: str
    sensor: str
    figures: TrackFigures | None
    notes: tuple[str, ...]
    rss_mb: float | None


@dataclass(frozen=True, slots=True)
class TrackTask:
    """Follow a case with these settings; the seed is that of all randomness."""

    case: Case
    config: AmclConfig
    seed: int

    def __call__(self) -> TrackRun:
        """Run in this process; without figures if the case has no odometry.

        Raises
        ------
        InputError
            If the case cannot be loaded or has no true pose.
        """
        case, recording = self.case, self.case.recording()
        if recording.odometry is None:
            return TrackRun(case.name, case.sensor, None, ("no odometry",), peak_rss_mb())
        known_truth(case, recording)
        grid, drive = case.grid(), plan_drive(recording, None)
        precompile(self.config)
        tracker, rng = make_tracker(grid, self.config), np.random.default_rng(self.seed)
        fields = MapFields(grid)
        fields.compute("squares", "clearance")  # not part of the first scan's time
        tracked = follow_drive(drive, tracker, self.config, TRUE_START, rng, fields)
        figures = summarize_track([*tracked])
        return TrackRun(case.name, case.sensor, figures, drive.notes, peak_rss_mb())


def track_document(runs: Sequence[TrackRun]) -> dict[str, Any]:
    """Put the cases that were followed, at least one, into the document described above."""
    rows = [_row(run, run.figures) for run in runs if run.figures is not None]
    total: dict[str, Any] = {"name": "total", "sensor": "all"}
    for key in rows[0]:
        if key not in total:
            values = [row[key] for row in rows]
            total[key] = sum(values) if key in COUNTS else mean_of_known(values)
    total["all_kept"] = sum(row["kept"] == 1.0 for row in rows)
    return {"cases": rows, "total": total}


def track_table(document: Row) -> str:
    """Lay out cases and total of the document, in Markdown that is aligned in plain text too."""
    return columns_table(
        [*document["cases"], document["total"]], {"case": "name", "sensor": "sensor"}, COLUMNS
    )


def _row(run: TrackRun, figures: TrackFigures) -> dict[str, Any]:
    ape, rpe = figures.ape, figures.rpe
    return {
        "name": run.case,
        "sensor": run.sensor,
        "n": figures.n,
        "updates": figures.updates,
        "ape_rmse_m": ape and ape.rmse_m,
        "ape_rmse_deg": ape and ape.rmse_deg,
        "ape_median_m": ape and ape.median_m,
        "ape_max_m": ape and ape.max_m,
        "kept": figures.kept,
        "cpu_update_ms": figures.cpu_update_ms,
        "cpu_update_ms_p95": figures.cpu_update_ms_p95,
        "particles_mean": figures.particles_mean,
        "rss_mb": run.rss_mb,
        "rpe_rmse_m": rpe and rpe.rmse_m,
        "rpe_rmse_deg": rpe and rpe.rmse_deg,
    }
