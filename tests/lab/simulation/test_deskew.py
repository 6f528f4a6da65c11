"""Straightened scans of a simulated sensor are as good as those of one that looks at once."""

from __future__ import annotations

import math

import numpy as np

from firstfix.core.deskew import straighten
from firstfix.core.se2 import SE2
from firstfix.global_localization.scan_matcher import ScanMatcher
from firstfix.lab.simulation.floor import Floor
from firstfix.lab.simulation.lidar import Lidar
from firstfix.lab.simulation.sweep import sweep
from firstfix.lab.worlds.drawing import Drawing

PERIOD_S = 0.1
# 1 m/s and 45 degrees a second.
MOTION = SE2(1.0 * PERIOD_S, 0.0, math.radians(45.0) * PERIOD_S)
TO_LAST_BEAM = SE2(359 / 360 * MOTION.x, 0.0, 359 / 360 * MOTION.yaw)
LIDAR = Lidar(beams=360, sigma_m=0.01, T_base_laser=SE2(0.2, 0.0, 0.0))


def test_error_at_speed_is_within_20_percent_of_that_at_rest():
    plan = Drawing(8.0, 6.0, 0.05, 0.5)
    plan.room(0.0, 0.0, 8.0, 6.0)
    plan.solid(0.1, 4.0, 2.0, 5.9)
    plan.solid(4.5, 2.5, 5.0, 3.0)
    plan.solid(6.5, 0.1, 7.9, 0.5)
    matcher = ScanMatcher(plan.grid())
    floor = Floor(matcher.fields.grid)
    errors: dict[str, list[float]] = {"at rest": [], "skewed": [], "straightened": []}
    places = [
        (x, y, yaw) for x in (2.5, 4.0, 6.0) for y in (1.2, 4.4) for yaw in (0.3, 1.9, 3.5, 5.1)
    ]
    for seed, truth in enumerate(SE2(*place) for place in places):
        at_rest = sweep(LIDAR, floor, truth, np.random.default_rng(seed))
        skewed = sweep(
            LIDAR, floor, truth, np.random.default_rng(seed), T_map_base_after=truth @ MOTION
        )
        straight = straighten(skewed, TO_LAST_BEAM)
        for name, scan in zip(errors, (at_rest, skewed, straight), strict=True):
            errors[name].append(matcher.locate(scan).best.pose.distance_to(truth))
    rms = {name: float(np.sqrt(np.mean(np.square(e)))) for name, e in errors.items()}
    assert rms["straightened"] <= 1.2 * rms["at rest"], rms
    assert rms["skewed"] > 3.0 * rms["straightened"], rms
