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


def scan_frame(registered: RegisteredScan | None, active_map: ActiveMap | None) -> bytes:
    """Encode a scan in the map frame, with the class of each beam.

    Parameters
    ----------
    registered : RegisteredScan or None
        The scan and the pose at which it is drawn; None for no scan.
    active_map : ActiveMap or None
        The map.

    Returns
    -------
    bytes
        Binary message of kind 1. A beam without a return ends at `range_max`.
    """
    if registered is None or active_map is None:
        return _HEADER.pack(SCAN, VERSION, 0, 0, 0.0)
    scan = registered.scan
    beams = classify_beams(scan, registered.T_map_base, active_map.matcher.fields)
    classes = np.where(beams.hit, beams.classes, np.uint8(NO_RETURN))
    header = _HEADER.pack(SCAN, VERSION, 0, len(classes), scan.stamp)
    return header + beams.ends.astype("<f4").tobytes() + classes.tobytes()


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
