"""Scores of given poses, a search around a pose, and the class of each beam."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from firstfix.core.angles import wrap
from firstfix.core.estimate import Hypothesis
from firstfix.core.grid import OccupancyGrid
from firstfix.core.scan import LaserScan, Scans, as_scans
from firstfix.core.se2 import SE2
from firstfix.fields.map_fields import MapFields
from firstfix.global_localization.beams import Beams
from firstfix.global_localization.frames import to_cells
from firstfix.global_localization.refine import refine_on_field, refine_on_rays
from firstfix.global_localization.sensors import joint_beams
from firstfix.global_localization.verdict import exponent_of, place_probabilities
from firstfix.global_localization.verify import (
    BEAMS,
    BeamClass,
    Verification,
    beam_classes,
    verified_place,
    verify,
)

# Refinement corrects the small error of a tracked pose; it must not find another place.
_REFINED_M = 0.3
_REFINED_RAD = math.radians(10.0)

# The neighbourhood of a slip. Refinement corrects errors of half a step.
_NEAR_M = 0.9
_NEAR_STEP_M = 0.3
_NEAR_RAD = math.radians(40.0)
_NEAR_STEP_RAD = math.radians(10.0)
_FIRST_LOOK_BEAMS = 60
_SECOND_LOOK = 8

# A map may be cropped so tightly that a door's far side lies outside; farther out, beams meet
# nothing that is mapped, and their low cost is no evidence for the pose.
_OUTSIDE_M = 1.0


def score_poses(scans: Scans, poses: Sequence[SE2], fields: MapFields) -> tuple[Hypothesis, ...]:
    """Score poses by how well a scan fits there, allowing for small errors.

    Parameters
    ----------
    scans : LaserScan or sequence of LaserScan
        The scan, with the sensor's pose on the robot; or one of each sensor, at one time.
    poses : sequence of SE2
        ``T_map_base`` proposed; at least one.
    fields : MapFields
        The prepared map.

    Returns
    -------
    tuple of Hypothesis
        For each pose, in their order, the better one of itself and of where refinement takes it,
        up to 0.3 m and 10 degrees away. The probability is that of the place against a wrong map,
        as if there were no other. Covariances are zero.
    """
    scan, beams = joint_beams(as_scans(scans))
    given = np.array([to_cells(fields.grid, scan, pose) for pose in poses])
    refined = _held(refine_on_field(given, beams, fields), given, fields.grid.resolution)
    verification = verify(np.concatenate([refined, given]), beams, fields)
    unknown = np.zeros((3, 3))
    n = len(given)
    better = np.where(
        verification.scores[:n] < verification.scores[n:], np.arange(n), np.arange(n) + n
    )
    return tuple(
        verified_place(
            fields.grid, scan, verification, i, unknown, _alone(verification, i, beams, fields.grid)
        )
        for i in better.tolist()
    )


def search_locally(scans: Scans, T_map_base: SE2, fields: MapFields) -> Hypothesis:
    """Find the best pose within about 0.9 m and 40 degrees of a given one.

    Parameters
    ----------
    scans : LaserScan or sequence of LaserScan
        The scan, with the sensor's pose on the robot; or one of each sensor, at one time.
    T_map_base : SE2
        Where to look.
    fields : MapFields
        The prepared map.

    Returns
    -------
    Hypothesis
        The best, refined and with covariance. Its probability is that of the place against a wrong
        map, as if there were no other.
    """
    scan, beams = joint_beams(as_scans(scans))
    starts = np.array([to_cells(fields.grid, scan, T_map_base @ off) for off in _OFFSETS])
    poses = refine_on_field(starts, beams, fields)
    first = verify(poses, beams.thinned(_FIRST_LOOK_BEAMS), fields).scores
    poses = poses[np.argsort(first, kind="stable")[:_SECOND_LOOK]]
    best = poses[[int(np.argmin(verify(poses, beams, fields).scores))]]
    on_rays, covariances = refine_on_rays(best, beams, fields)
    verification = verify(np.concatenate([on_rays, best]), beams, fields)
    i = int(np.argmin(verification.scores))
    probability = _alone(verification, i, beams, fields.grid)
    return verified_place(fields.grid, scan, verification, i, covariances[0], probability)


@dataclass(frozen=True, eq=False)
class ClassifiedBeams:
    """The beams of a scan that are compared with the map at a pose, and how each agrees.

    The shares of these classes are the `firstfix.core.estimate.Evidence` of a hypothesis there.

    Parameters
    ----------
    ends : ndarray, shape (n, 2)
        Where the beams end in the map frame, m; a beam without a return ends at its range limit.
    hit : ndarray of bool, shape (n,)
        True where a surface returned the beam.
    classes : ndarray of uint8, shape (n,)
        Values of `firstfix.global_localization.verify.BeamClass`.
    """

    ends: NDArray[np.float64]
    hit: NDArray[np.bool_]
    classes: NDArray[np.uint8]

    def share(self, kind: BeamClass) -> float:
        """Share of the beams in a class, 0 to 1."""
        return float(np.count_nonzero(self.classes == kind) / max(1, len(self.classes)))


def classify_beams(
    scans: Sequence[LaserScan], T_map_base: SE2, fields: MapFields
) -> ClassifiedBeams:
    """Classify the beams of one or several sensors at a pose.

    Parameters
    ----------
    scans : sequence of LaserScan
        One of each sensor, with its pose on the robot.
    T_map_base : SE2
        Pose of the robot.
    fields : MapFields
        The prepared map.

    Returns
    -------
    ClassifiedBeams
        At most `firstfix.global_localization.verify.BEAMS` beams.
    """
    scan, beams = joint_beams(scans)
    beams = beams.thinned(BEAMS)
    ends = (T_map_base @ scan.T_base_laser).apply(beams.ends)
    classes = beam_classes(to_cells(fields.grid, scan, T_map_base), beams, fields)
    return ClassifiedBeams(ends, beams.hit, classes)


def _alone(verification: Verification, i: int, beams: Beams, grid: OccupancyGrid) -> float:
    """Return the probability of a place against a wrong map, as if there were no other."""
    beyond = _OUTSIDE_M / grid.resolution
    x, y, _ = verification.poses[i]
    if not (-beyond <= x <= grid.width + beyond and -beyond <= y <= grid.height + beyond):
        return 0.0
    exponent = exponent_of(beams)
    return float(place_probabilities(verification.scores[[i]], exponent)[0])


def _held(
    refined: NDArray[np.float64], given: NDArray[np.float64], resolution: float
) -> NDArray[np.float64]:
    """Undo refinements that moved to another place."""
    far = np.hypot(*(refined - given)[:, :2].T) * resolution > _REFINED_M
    turned = np.abs(wrap(refined[:, 2] - given[:, 2])) > _REFINED_RAD
    return np.where((far | turned)[:, None], given, refined)


def _offsets() -> tuple[SE2, ...]:
    steps = np.arange(-_NEAR_M, _NEAR_M + 1e-9, _NEAR_STEP_M)
    turns = np.arange(-_NEAR_RAD, _NEAR_RAD + 1e-9, _NEAR_STEP_RAD)
    return tuple(
        SE2(float(x), float(y), float(turn))
        for x in steps
        for y in steps
        if math.hypot(x, y) <= _NEAR_M
        for turn in turns
    )


_OFFSETS = _offsets()
