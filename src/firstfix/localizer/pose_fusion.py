"""A pose estimate sharpened by one ray refinement of the scan, fused by covariance."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from firstfix.core.angles import angle_error, wrap
from firstfix.core.scan import Scans, as_scans
from firstfix.core.se2 import SE2
from firstfix.fields.map_fields import MapFields
from firstfix.global_localization.beams import FEWEST_HITS
from firstfix.global_localization.frames import to_cells, to_map
from firstfix.global_localization.refine import refine_on_rays
from firstfix.global_localization.sensors import joint_beams
from firstfix.global_localization.verify import verify

# A refinement that moves the pose farther went to another wall, or the estimate is wrong.
_FARTHEST_M = 0.3
_FARTHEST_RAD = math.radians(10.0)


def fuse_with_scan(
    T_map_base: SE2, covariance: NDArray[np.float64], scans: Scans, fields: MapFields
) -> tuple[SE2, NDArray[np.float64]]:
    """Fuse an estimate with the pose to which a ray refinement takes the scan from there.

    A particle filter keeps an error of centimetres: its likelihood is flattened on purpose, and
    its particles are few. The refinement has a tenth of that error where walls fix the pose, and a
    large covariance along a corridor, where the filter knows more.

    Parameters
    ----------
    T_map_base : SE2
        Mean of the estimate.
    covariance : ndarray, shape (3, 3)
        Of x (m), y (m), yaw (rad) in the map frame.
    scans : LaserScan or sequence of LaserScan
        The scan, or one of each sensor.
    fields : MapFields
        The prepared map.

    Returns
    -------
    T_map_base : SE2
        The fused pose; the given one if the refinement is too far off or fits the scan less well.
    covariance : ndarray, shape (3, 3)
        Of it.
    """
    scan, beams = joint_beams(as_scans(scans))
    if np.count_nonzero(beams.hit) < FEWEST_HITS:
        return T_map_base, covariance
    given = to_cells(fields.grid, scan, T_map_base)[None]
    refined, refined_covariance = refine_on_rays(given, beams, fields)
    given_cost, refined_cost = verify(np.concatenate([given, refined]), beams, fields).scores
    T_map_refined, noise = to_map(fields.grid, scan, refined[0], refined_covariance[0])
    far = T_map_base.distance_to(T_map_refined) > _FARTHEST_M
    turned = angle_error(T_map_base.yaw, T_map_refined.yaw) > _FARTHEST_RAD
    if far or turned or refined_cost > given_cost:
        return T_map_base, covariance
    offset = T_map_refined.as_array() - T_map_base.as_array()
    offset[2] = wrap(offset[2])
    gain = np.linalg.solve(covariance + noise, covariance).T
    fused = SE2.from_array(T_map_base.as_array() + gain @ offset)
    return fused, gain @ noise
