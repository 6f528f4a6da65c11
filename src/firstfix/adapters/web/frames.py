"""What is seen, as the messages of docs/live.md; each is made once for all viewers."""

from __future__ import annotations

import json
import math
import struct
from typing import Any

import numpy as np

from firstfix import __version__
from firstfix.adapters.web.feed import Event
from firstfix.adapters.web.map_image import image_of
from firstfix.adapters.web.view import PlacedParticles, PlacedScan, ShownMap, View
from firstfix.core.se2 import SE2
from firstfix.global_localization.beams import usable_beams
from firstfix.global_localization.examine import sort_beams
from firstfix.global_localization.locate import Locator

VERSION = 1
SCAN, PARTICLES = 1, 2
NO_RETURN = 4

_HEADER = struct.Struct("<BBHId")


def pose_list(pose: SE2 | None) -> list[float] | None:
    """Write a pose as x (m), y (m), yaw (rad)."""
    return None if pose is None else [pose.x, pose.y, pose.yaw]


def map_object(shown: ShownMap) -> dict[str, Any]:
    """Describe the map in use: name, cells, place, and where its picture is."""
    grid = shown.grid
    return {
        "name": shown.name,
        "width": grid.width,
        "height": grid.height,
        "resolution": grid.resolution,
        "origin": pose_list(grid.T_map_grid),
        "image": image_of(shown),
    }


def event_object(event: Event) -> dict[str, Any]:
    """Describe an event."""
    return {
        "type": "event",
        "number": event.number,
        "stamp": event.stamp,
        "kind": event.kind,
        "text": event.text,
    }


def hello_object(
    robot: str,
    abilities: tuple[str, ...],
    shown: ShownMap | None,
    events: list[Event],
    *,
    may_steer: bool,
) -> dict[str, Any]:
    """Describe what a viewer needs to know before all else.

    Parameters
    ----------
    robot : str
        sim, ros1, ros2 or dds.
    abilities : tuple of str
        What the robot can be told besides where it is.
    shown : ShownMap or None
        The map.
    events : list of Event
        What has happened so far.
    may_steer : bool
        False for those who may only watch.

    Returns
    -------
    dict
        Ready for JSON.
    """
    return {
        "type": "hello",
        "version": __version__,
        "robot": robot,
        "may_steer": may_steer,
        "abilities": list(abilities),
        "map": None if shown is None else map_object(shown),
        "events": [event_object(event) for event in events],
    }


def state_object(view: View, viewers: int) -> dict[str, Any]:
    """Describe the state, for ``viewers`` of them."""
    covariance, evidence, motion = view.covariance, view.evidence, view.motion
    return {
        "type": "state",
        "stamp": view.stamp,
        "state": view.state.value,
        "reason": view.reason,
        "pose": pose_list(view.pose),
        "covariance": None
        if covariance is None
        else [float(covariance[i]) for i in ((0, 0), (0, 1), (1, 1), (2, 2))],
        "hypotheses": [
            {
                "pose": pose_list(place.pose),
                "probability": place.probability,
                "explained": place.evidence.explained,
            }
            for place in view.hypotheses
        ],
        "evidence": None
        if evidence is None
        else {
            "explained": evidence.explained,
            "short": evidence.short,
            "through_wall": evidence.through_wall,
            "unknown": evidence.unknown,
            "beams": evidence.beams,
        },
        "particles": 0 if view.belief is None else len(view.belief.particles),
        "cpu_ms": view.cpu_ms,
        "time_to_fix_s": view.time_to_fix_s,
        "motion": None if motion is None else {"turn": motion.turn, "ahead": motion.ahead},
        "truth": pose_list(view.truth),
        "paused": view.paused,
        "viewers": viewers,
    }


def scan_frame(placed: PlacedScan | None, locator: Locator) -> bytes:
    """Write a scan where it was taken, each beam with what the map says to it.

    Parameters
    ----------
    placed : PlacedScan or None
        The scan; None for nothing to be seen.
    locator : Locator
        With the map.

    Returns
    -------
    bytes
        Binary message of kind 1. A beam without a return ends where its sight ends.
    """
    if placed is None:
        return _HEADER.pack(SCAN, VERSION, 0, 0, 0.0)
    scan = placed.scan
    beams = usable_beams(scan)
    classes = sort_beams(scan, placed.T_map_base, locator.fields)
    classes[~beams.hit] = NO_RETURN
    T_map_laser = placed.T_map_base @ scan.T_base_laser
    directions = T_map_laser.yaw + beams.bearings
    points = np.empty((len(beams), 2), "<f4")
    points[:, 0] = T_map_laser.x + beams.ranges * np.cos(directions)
    points[:, 1] = T_map_laser.y + beams.ranges * np.sin(directions)
    header = _HEADER.pack(SCAN, VERSION, 0, len(beams), scan.stamp)
    return header + points.tobytes() + classes.tobytes()


def particles_frame(belief: PlacedParticles | None, pose: SE2 | None, stamp: float) -> bytes:
    """Write particles.

    Parameters
    ----------
    belief : PlacedParticles or None
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


def as_text(message: dict[str, Any]) -> str:
    """Write a message; what JSON cannot say becomes null."""
    try:
        return json.dumps(message, allow_nan=False, separators=(",", ":"), ensure_ascii=False)
    except ValueError:
        return json.dumps(_finite(message), separators=(",", ":"), ensure_ascii=False)


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(inner) for key, inner in value.items()}
    if isinstance(value, list):
        return [_finite(inner) for inner in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
