"""Scans and particles as the binary messages of docs/live.md."""

from __future__ import annotations

import struct

import numpy as np

from firstfix.core.se2 import SE2
from firstfix.global_localization.scoring import classify_beams
from firstfix.web.snapshot import ActiveMap, ParticleCloud, RegisteredScan

VERSION = 1
SCAN, PARTICLES = 1, 2
NO_RETURN = 4

_HEADER = struct.Struct("<BBHId")


def scan_frame(placed: RegisteredScan | None, on: ActiveMap | None) -> bytes:
    """Write a scan where it was taken, each beam with what the map says to it.

    Parameters
    ----------
    placed : RegisteredScan or None
        The scan; None for nothing to be seen.
    on : ActiveMap or None
        The map.

    Returns
    -------
    bytes
        Binary message of kind 1. A beam without a return ends where its sight ends.
    """
    if placed is None or on is None:
        return _HEADER.pack(SCAN, VERSION, 0, 0, 0.0)
    beams = classify_beams(placed.scan, placed.T_map_base, on.matcher.fields)
    classes = np.where(beams.hit, beams.classes, np.uint8(NO_RETURN))
    header = _HEADER.pack(SCAN, VERSION, 0, len(classes), placed.scan.stamp)
    return header + beams.ends.astype("<f4").tobytes() + classes.tobytes()


def particles_frame(belief: ParticleCloud | None, pose: SE2 | None, stamp: float) -> bytes:
    """Write particles.

    Parameters
    ----------
    belief : ParticleCloud or None
        The particles; None for none.
    pose : SE2 or None
        Where the robot is by now: particles stay behind until they are used again, and are shown
        moved on with it.
    stamp : float
        Time of that pose, s.

    Returns
    -------
    bytes
        Binary message of kind 2.
    """
    if belief is None:
        return _HEADER.pack(PARTICLES, VERSION, 0, 0, stamp)
    particles = belief.particles
    moved = SE2.identity() if pose is None else belief.T_map_base.inverse() @ pose
    cos, sin = np.cos(particles.yaw), np.sin(particles.yaw)
    poses = np.empty((len(particles), 3), "<f4")
    poses[:, 0] = particles.x + moved.x * cos - moved.y * sin
    poses[:, 1] = particles.y + moved.x * sin + moved.y * cos
    poses[:, 2] = particles.yaw + moved.yaw
    return _HEADER.pack(PARTICLES, VERSION, 0, len(particles), stamp) + poses.tobytes()
