"""Scan, particles and belief as the binary messages of docs/live.md."""

from __future__ import annotations

import math
import struct

import numpy as np
from numpy.typing import NDArray

from firstfix.belief.belief import Belief
from firstfix.core.grid import OccupancyGrid
from firstfix.core.se2 import SE2
from firstfix.global_localization.scoring import classify_beams
from firstfix.web.snapshot import ActiveMap, ParticleCloud, RegisteredScan

VERSION = 1
SCAN, PARTICLES, BELIEF = 1, 2, 3
NO_RETURN = 4

# The number of a sensor has four bits.
_MOST_SENSORS = 16

# The heat map: cells of about this size, m, and so many of them a side at most.
_HEAT_M = 0.5
_MOST_HEAT_CELLS = 256

_HEADER = struct.Struct("<BBHId")
_HEAT_HEADER = struct.Struct("<HHf")


def scan_frame(registered: RegisteredScan | None, active_map: ActiveMap | None) -> bytes:
    """Encode the scans of all sensors in the map frame, with the class of each beam.

    Parameters
    ----------
    registered : RegisteredScan or None
        The scans and the pose at which they are drawn; None for no scan.
    active_map : ActiveMap or None
        The map.

    Returns
    -------
    bytes
        Binary message of kind 1. A beam without a return ends at `range_max`. The upper four bits
        of its class are the number of its sensor.
    """
    if registered is None or active_map is None:
        return _HEADER.pack(SCAN, VERSION, 0, 0, 0.0)
    ends, classes = [], []
    for i, scan in enumerate(registered.scans[:_MOST_SENSORS]):
        beams = classify_beams([scan], registered.T_map_base, active_map.matcher.fields)
        ends.append(beams.ends.astype("<f4").tobytes())
        classes.append(np.where(beams.hit, beams.classes, np.uint8(NO_RETURN)) | np.uint8(i << 4))
    all_classes = np.concatenate(classes)
    stamp = max(scan.stamp for scan in registered.scans)
    header = _HEADER.pack(SCAN, VERSION, 0, len(all_classes), stamp)
    return header + b"".join(ends) + all_classes.tobytes()


def particles_frame(cloud: ParticleCloud | None, pose: SE2 | None, stamp: float) -> bytes:
    """Encode particles.

    Parameters
    ----------
    cloud : ParticleCloud or None
        The particles; None for none.
    pose : SE2 or None
        ``T_map_base`` now. Particles are moved by the odometry since the last update of the
        filter.
    stamp : float
        Time of that pose, s.

    Returns
    -------
    bytes
        Binary message of kind 2.
    """
    if cloud is None:
        return _HEADER.pack(PARTICLES, VERSION, 0, 0, stamp)
    particles = cloud.particles
    moved = SE2.identity() if pose is None else cloud.T_map_base.inverse() @ pose
    cos, sin = np.cos(particles.yaw), np.sin(particles.yaw)
    poses = np.empty((len(particles), 3), "<f4")
    poses[:, 0] = particles.x + moved.x * cos - moved.y * sin
    poses[:, 1] = particles.y + moved.x * sin + moved.y * cos
    poses[:, 2] = particles.yaw + moved.yaw
    return _HEADER.pack(PARTICLES, VERSION, 0, len(particles), stamp) + poses.tobytes()


def belief_frame(belief: Belief | None, active_map: ActiveMap | None) -> bytes:
    """Encode the probability of all places as a heat map over the map.

    Parameters
    ----------
    belief : Belief or None
        The belief; None for none.
    active_map : ActiveMap or None
        The map.

    Returns
    -------
    bytes
        Binary message of kind 3.
    """
    if belief is None or active_map is None or len(belief.poses) == 0:
        return _HEADER.pack(BELIEF, VERSION, 0, 0, 0.0)
    grid = active_map.grid
    mass, cell_m = mass_map(belief.poses, belief.probabilities, grid)
    # The square root keeps small masses visible; no mass at all is 0.
    heat = np.ceil(255.0 * np.sqrt(np.clip(mass, 0.0, 1.0))).astype(np.uint8)
    height, width = heat.shape
    header = _HEADER.pack(BELIEF, VERSION, 0, heat.size, 0.0)
    return header + _HEAT_HEADER.pack(width, height, cell_m) + heat.tobytes()


def mass_map(
    poses: NDArray[np.float64], probabilities: NDArray[np.float64], grid: OccupancyGrid
) -> tuple[NDArray[np.float64], float]:
    """Sum probabilities over large cells of a map.

    Parameters
    ----------
    poses : ndarray, shape (n, 3)
        ``T_map_base``: x (m), y (m), yaw (rad). Places outside of the map are left out.
    probabilities : ndarray, shape (n,)
        Of the poses.
    grid : OccupancyGrid
        The map.

    Returns
    -------
    mass : ndarray, shape (rows, columns)
        Probability in each large cell; [0, 0] is the corner of the map's origin.
    cell_m : float
        Side of a large cell, m: a whole number of cells of the map.
    """
    longer = max(grid.width, grid.height)
    step = max(round(_HEAT_M / grid.resolution), math.ceil(longer / _MOST_HEAT_CELLS), 1)
    shape = math.ceil(grid.height / step), math.ceil(grid.width / step)
    mass = np.zeros(shape)
    columns, rows = np.floor(grid.to_cells(poses[:, :2]) / step).astype(np.int64).T
    inside = (rows >= 0) & (rows < shape[0]) & (columns >= 0) & (columns < shape[1])
    np.add.at(mass, (rows[inside], columns[inside]), probabilities[inside])
    return mass, step * grid.resolution
