"""What is seen, as the JSON messages of docs/live.md."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import Any

from firstfix import __version__
from firstfix.core.se2 import SE2
from firstfix.io.answers import finite
from firstfix.web.map_png import image_of
from firstfix.web.snapshot import ActiveMap, Snapshot
from firstfix.web.timeline import Event


def pose_list(pose: SE2 | None) -> list[float] | None:
    """Write a pose as x (m), y (m), yaw (rad)."""
    return None if pose is None else [pose.x, pose.y, pose.yaw]


def map_object(active_map: ActiveMap) -> dict[str, Any]:
    """Describe the map in use: name, cells, place, and where its picture is."""
    grid = active_map.grid
    return {
        "name": active_map.name,
        "width": grid.width,
        "height": grid.height,
        "resolution": grid.resolution,
        "origin": pose_list(grid.T_map_grid),
        "image": image_of(active_map),
    }


def event_message(event: Event) -> dict[str, Any]:
    """Describe an event."""
    return {
        "type": "event",
        "number": event.number,
        "stamp": event.stamp,
        "kind": event.kind,
        "text": event.text,
    }


def hello_message(
    robot: str,
    abilities: tuple[str, ...],
    active_map: ActiveMap | None,
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
    active_map : ActiveMap or None
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
        "map": None if active_map is None else map_object(active_map),
        "events": [event_message(event) for event in events],
    }


def state_message(snapshot: Snapshot, viewers: int) -> dict[str, Any]:
    """Describe the state, for ``viewers`` of them."""
    covariance, evidence, motion = snapshot.covariance, snapshot.evidence, snapshot.motion
    return {
        "type": "state",
        "stamp": snapshot.stamp,
        "state": snapshot.state.value,
        "reason": snapshot.reason,
        "pose": pose_list(snapshot.pose),
        "covariance": None
        if covariance is None
        else [float(covariance[i]) for i in ((0, 0), (0, 1), (1, 1), (2, 2))],
        "hypotheses": [
            {
                "pose": pose_list(place.pose),
                "probability": place.probability,
                "explained": place.evidence.explained,
            }
            for place in snapshot.hypotheses
        ],
        "evidence": None if evidence is None else asdict(evidence),
        "particles": 0 if snapshot.particles is None else len(snapshot.particles.particles),
        "cpu_ms": snapshot.cpu_ms,
        "time_to_fix_s": snapshot.time_to_fix_s,
        "motion": None if motion is None else {"turn": motion.turn, "ahead": motion.ahead},
        "truth": pose_list(snapshot.truth),
        "paused": snapshot.paused,
        "viewers": viewers,
    }


def as_text(message: dict[str, Any]) -> str:
    """Write a message; what JSON cannot say becomes null."""
    try:
        return json.dumps(message, allow_nan=False, separators=(",", ":"))
    except ValueError:
        return json.dumps(finite(message), separators=(",", ":"))
