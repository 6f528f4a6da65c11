"""How should the beams of a scan be combined? Track drives with several rules, side by side.

The filter is the same in all columns, and so are seed, start and settings (Nav2's defaults); only
the likelihood of a scan differs: the product over beams, scaled to 8, 15, 30 or 60 effective
beams (firstfix: 15), or one plus the sum of cubes (AMCL). A line has, for
each: APE RMSE (m), share of scans kept (0.5 m, 10 degrees), and share of updates whose truth lies
within the 3-sigma ellipsoid of the estimate, which a consistent estimate contains in 97 %.

    python benchmarks/effective_beams.py ../shared/cases/*/ [--seeds 2]
"""

from __future__ import annotations

import argparse
from pathlib import Path
from unittest import mock

import numpy as np
from numpy.typing import NDArray

from firstfix.amcl import sensor as sensor_module
from firstfix.amcl import tracker as track_module
from firstfix.amcl.beam_selection import SelectedBeams
from firstfix.amcl.config import AmclConfig
from firstfix.amcl.likelihood_field import LikelihoodField
from firstfix.amcl.particles import Particles
from firstfix.amcl.sensor import Sensor
from firstfix.core.angles import wrap
from firstfix.core.grid import OccupancyGrid
from firstfix.core.se2 import SE2
from firstfix.io.logs.load import load_recording
from firstfix.io.maps.map_server import load_map
from firstfix.lab.experiments.drive import Drive, plan_drive
from firstfix.lab.experiments.drive_tracking import TRUE_START, follow_drive

EFFECTIVE_BEAMS = (8, 15, 30, 60)
CHI2_3SIGMA = 14.16


class SumOfCubes(LikelihoodField):
    """AMCL's likelihood_field: one plus the sum of the cubes of the beams' likelihoods."""

    def log_likelihood(
        self, particles: Particles, beams: SelectedBeams
    ) -> tuple[NDArray[np.float64], int]:
        """Judge every particle by a scan, as `LikelihoodField` does."""
        sums = np.ones(len(particles))
        for i in range(len(beams.hits)):
            one = SelectedBeams(
                beams.bearings[i : i + 1],
                np.zeros(1),
                beams.hits[i : i + 1],
                beams.T_base_laser,
                beams.range_max,
                1,
            )
            sums += np.exp(3.0 * super().log_likelihood(particles, one)[0])
        return np.log(sums), len(beams.hits)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folders", type=Path, nargs="+", help="folders with map.yaml, scans.npz")
    parser.add_argument("--seeds", type=int, default=1)
    arguments = parser.parse_args()
    names = [f"{n} effective beams" for n in EFFECTIVE_BEAMS] + ["sum of cubes"]
    print(f"{'case':24s}" + "".join(f"{name:>24s}" for name in names))
    for folder in arguments.folders:
        recording = load_recording(folder / "scans.npz")
        if recording.odometry is None or recording.truth is None:
            continue
        grid, drive = load_map(folder / "map.yaml"), plan_drive(recording, None)
        for seed in range(arguments.seeds):
            cells = [judged(grid, drive, LikelihoodField, n, seed) for n in EFFECTIVE_BEAMS]
            cells.append(judged(grid, drive, SumOfCubes, None, seed))
            print(f"{folder.name:24s}" + "".join(f"{cell:>24s}" for cell in cells), flush=True)


def judged(
    grid: OccupancyGrid,
    drive: Drive,
    model: type[LikelihoodField],
    effective_beams: int | None,
    seed: int,
) -> str:
    config = AmclConfig()
    sensor: Sensor = model(grid, config)
    tracker = track_module.Tracker(sensor, config, lambda _, n, __: np.empty((n, 3)))
    # As many effective beams as beams: no tempering, for AMCL's way of combining them.
    count = effective_beams or config.max_beams
    errors, headings, inside = [], [], []
    with mock.patch.object(sensor_module, "EFFECTIVE_BEAMS", count):
        rng = np.random.default_rng(seed)
        for tracked in follow_drive(drive, tracker, config, TRUE_START, rng):
            truth = tracked.sight.truth
            if truth is None:
                continue
            off = difference(tracked.T_map_base, truth)
            errors.append(np.hypot(off[0], off[1]))
            headings.append(abs(off[2]))
            if tracked.updated:
                nees = off @ np.linalg.solve(tracked.covariance + 1e-12 * np.eye(3), off)
                inside.append(nees < CHI2_3SIGMA)
    kept = np.mean((np.array(errors) < 0.5) & (np.array(headings) < np.radians(10.0)))
    rmse = np.sqrt(np.mean(np.square(errors)))
    return f"{rmse:.3f} {kept:.3f} {np.mean(inside):.3f}"


def difference(pose: SE2, truth: SE2) -> NDArray[np.float64]:
    off = pose.as_array() - truth.as_array()
    off[2] = wrap(float(off[2]))
    return off


if __name__ == "__main__":
    main()
