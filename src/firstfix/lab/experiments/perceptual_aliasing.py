"""Perceptual aliasing: which places of a map look alike to a sensor."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np

from firstfix.core.estimate import Hypothesis, LocateResult, Verdict
from firstfix.core.grid import OccupancyGrid
from firstfix.core.pose_error import PoseError
from firstfix.core.se2 import SE2
from firstfix.fields.cache import cache_folder
from firstfix.global_localization.config import LocateConfig
from firstfix.global_localization.scan_matcher import ScanMatcher
from firstfix.global_localization.searchable import check_searchable
from firstfix.lab.metrics.outcome import FOUND
from firstfix.lab.simulation.lidar import Lidar
from firstfix.lab.worlds.catalog import random_free_poses

# A rival less likely than this is not what made the verdict AMBIGUOUS.
PLAUSIBLE = 0.05

# Surveyed walls and a good sensor: what still looks alike is a property of the map.
_SIGMA_M = 0.01


class Look(Enum):
    """Which places fit a scan.

    The verdict is not used: one scan of a sensor that sees little is never UNIQUE.
    """

    FOUND = "one place, right"
    AMBIGUOUS = "several places"
    LOST = "no place"
    MISTAKEN = "one place, wrong"


@dataclass(frozen=True, eq=False, slots=True)
class Place:
    """A place of the map, and the answer to a scan from it.

    Parameters
    ----------
    pose : SE2
        ``T_map_base`` of the scan.
    look : Look
        The result.
    double : Hypothesis or None
        The most likely other place, if it is plausible.
    needs_second_view : bool
        True if one place fits, but one scan of this sensor is not enough to publish it.
    """

    pose: SE2
    look: Look
    double: Hypothesis | None
    needs_second_view: bool = False


def sensor(beams: int, fov_deg: float, range_m: float) -> Lidar:
    """Return a sensor without dropouts and nearly without noise."""
    return Lidar(beams=beams, fov=math.radians(fov_deg), range_max=range_m, sigma_m=_SIGMA_M)


def survey(
    grid: OccupancyGrid, lidar: Lidar, samples: int, seed: int, done: Callable[[str], None]
) -> list[Place]:
    """Locate simulated scans from random places; ``done`` takes each result in words.

    Raises
    ------
    MapError
        If nothing can be located in the map.
    """
    check_searchable(grid)
    rng = np.random.default_rng(seed)
    poses = random_free_poses(grid, rng, samples)
    matcher = ScanMatcher(grid, cache_dir=cache_folder())
    places = []
    for pose in poses:
        places.append(look_from(pose, matcher.locate(lidar.scan(grid, pose, rng))))
        done(places[-1].look.value)
    return places


def look_from(pose: SE2, result: LocateResult) -> Place:
    """Compare the true ``T_map_base`` of a scan with the answer to it."""
    others = [
        hypothesis
        for hypothesis in result.hypotheses
        if hypothesis.probability >= PLAUSIBLE and not _is_at(pose, hypothesis)
    ]
    look = _look(pose, result)
    single = look in (Look.FOUND, Look.MISTAKEN)
    needs_second_view = single and result.verdict is Verdict.AMBIGUOUS
    return Place(pose, look, others[0] if others else None, needs_second_view)


def share(places: Sequence[Place], look: Look) -> float:
    """Return the share of places that look so, 0 to 1."""
    return sum(place.look is look for place in places) / max(1, len(places))


def doubles(places: Sequence[Place]) -> list[tuple[SE2, Hypothesis]]:
    """List ambiguous or mistaken places with what they were taken for, most likely first."""
    pairs = [
        (place.pose, place.double)
        for place in places
        if place.double is not None and place.look in (Look.AMBIGUOUS, Look.MISTAKEN)
    ]
    return sorted(pairs, key=lambda pair: -pair[1].probability)


def _look(pose: SE2, result: LocateResult) -> Look:
    best = result.best
    if best is None or result.verdict is Verdict.NO_MATCH:
        return Look.LOST
    if best.probability < LocateConfig().unique_probability:
        return Look.AMBIGUOUS
    return Look.FOUND if _is_at(pose, best) else Look.MISTAKEN


def _is_at(pose: SE2, hypothesis: Hypothesis) -> bool:
    return PoseError.between(hypothesis.pose, pose).is_within(FOUND)
