"""Actions of a fleet control on a real localizer, without a broker."""

from __future__ import annotations

import json
from typing import Any

from firstfix.vda5050.actions import Actions
from firstfix.vda5050.localization import Localization
from firstfix.vda5050.maps import KnownMap, MapName, MapRegister
from firstfix.vda5050.report import ActionReport, Problem


class Desk:
    """Actions of a fleet control, and the robot that they are for."""

    def __init__(self, robot: Any, *others: KnownMap) -> None:
        self.robot = robot
        self.maps = MapRegister(MapName("hall", "1"), others)
        self.localization = Localization()
        self.actions = Actions(self.maps, self.localization)
        robot.watchers.append(self._watch)

    def act(self, kind: str, action_id: str, **parameters: Any) -> ActionReport:
        """Send an action to the robot, and return its report."""
        values = [{"key": key, "value": value} for key, value in parameters.items()]
        action = {"actionType": kind, "actionId": action_id, "blockingType": "NONE"}
        return self.send({"actions": [action | {"actionParameters": values}]}, action_id)

    def send(self, message: dict[str, Any], action_id: str) -> ActionReport:
        for each in self.actions.receive(json.dumps(message).encode()):
            self.robot.give(each)
        return self.report(action_id)

    def pose(self, action_id: str, px: float, py: float, yaw: float, **other: Any) -> ActionReport:
        where = {"x": px, "y": py, "theta": yaw, "mapId": "hall", "lastNodeId": f"of {action_id}"}
        return self.act("initPosition", action_id, **(where | other))

    def report(self, action_id: str) -> ActionReport:
        (found,) = [each for each in self.actions.reports if each.id == action_id]
        return found

    @property
    def problems(self) -> list[Problem]:
        return [error.problem for error in self.actions.errors]

    def _watch(self, given: Any, outputs: Any, localizer: Any) -> None:
        in_use = self.maps.in_use
        if in_use is None or in_use.grid is not localizer.matcher.fields.grid:
            self.maps.receive(localizer.matcher.fields.grid)
        self.actions.observe(given, outputs)
        self.localization.observe(given, outputs, 0.0)
