"""What is seen, as the JSON messages of docs/live.md."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import Any

from firstfix import __version__
from firstfix.core.se2 import SE2
from firstfix.io.answers import finite
from firstfix.web.map_picture import image_of
from firstfix.web.timeline import Event
from firstfix.web.view import ShownMap, View


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
        "evidence": None if evidence is None else asdict(evidence),
        "particles": 0 if view.belief is None else len(view.belief.particles),
        "cpu_ms": view.cpu_ms,
        "time_to_fix_s": view.time_to_fix_s,
        "motion": None if motion is None else {"turn": motion.turn, "ahead": motion.ahead},
        "truth": pose_list(view.truth),
        "paused": view.paused,
        "viewers": viewers,
    }


def as_text(message: dict[str, Any]) -> str:
    """Write a message; what JSON cannot say becomes null."""
    try:
        return json.dumps(message, allow_nan=False, separators=(",", ":"))
    except ValueError:
        return json.dumps(finite(message), separators=(",", ":"))
