"""The instant actions of a fleet control: what they give to the localizer, and their progress."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import msgspec

from firstfix.core.errors import InputError
from firstfix.core.se2 import SE2
from firstfix.localizer.hint import read_hint
from firstfix.localizer.inputs import Input, MapHint, NewMap, PoseHint, Reset
from firstfix.localizer.outputs import InitialPose, Output, Status
from firstfix.localizer.states import State
from firstfix.vda5050.localization import Localization
from firstfix.vda5050.maps import KnownMap, MapName, MapRegister
from firstfix.vda5050.messages import Action, InstantActions, MapVersion, NewPosition
from firstfix.vda5050.report import ActionReport, ActionStatus, ErrorReport, Problem

# A message of a fleet control is some kilobytes.
_MOST_BYTES = 64 * 1024
# Actions whose end is still reported; the oldest are dropped.
_MOST_REPORTS = 50
_LONGEST_REASON = 300
_SOURCE = "the fleet control"

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class _Check:
    """A pose that the localizer verifies."""

    action_id: str
    given: PoseHint | MapHint
    T_map_base: SE2
    map_id: str
    last_node_id: str
    has_begun: bool = False


class _RefusedError(Exception):
    """An action that cannot be executed: kind of error, reason, and what it is about."""

    def __init__(self, problem: Problem, reason: str, *references: tuple[str, str]) -> None:
        self.problem = problem
        self.references = references
        super().__init__(reason)


class Actions:
    """Executes instant actions on a localizer.

    Parameters
    ----------
    maps : MapRegister
        The maps that actions can name.
    localization : Localization
        Has the time of the robot and its pose.
    """

    def __init__(self, maps: MapRegister, localization: Localization) -> None:
        self._maps = maps
        self._localization = localization
        self._reports: dict[str, ActionReport] = {}
        self._check: _Check | None = None
        self.errors: tuple[ErrorReport, ...] = ()
        self.last_node_id = ""
        self._kinds: dict[str, Callable[[Action], list[Input]]] = {
            "initPosition": self._initialize,  # 2.1
            "initializePosition": self._initialize,  # 3.0
            "enableMap": self._enable_map,
            "downloadMap": self._download_map,
            "deleteMap": self._delete_map,
            "stateRequest": self._send_state,
            "clearInstantActions": self._clear,
        }

    @property
    def reports(self) -> tuple[ActionReport, ...]:
        """The actions that run, and the last ones that have ended."""
        return tuple(self._reports.values())

    def receive(self, message: bytes) -> list[Input]:
        """Begin the actions of a message.

        Parameters
        ----------
        message : bytes
            As it came from the broker.

        Returns
        -------
        list of Input
            For the localizer.

        Raises
        ------
        InputError
            If the message is not one of instant actions; then nothing has changed.
        """
        if len(message) > _MOST_BYTES:
            raise InputError(
                expected=f"instant actions of at most {_MOST_BYTES} bytes",
                received=f"{len(message)} bytes",
                remedy="the message is ignored",
            )
        try:
            given = msgspec.json.decode(message, type=InstantActions)
        except (msgspec.MsgspecError, UnicodeError, RecursionError) as error:
            raise InputError(
                expected="instant actions as in VDA 5050",
                received=f"a message that does not fit ({f'{error}'[:_LONGEST_REASON]})",
                remedy="the message is ignored",
            ) from error
        return [given for action in given.actions for given in self._begin(action)]

    def observe(self, given: Input, outputs: list[Output]) -> None:
        """Follow the check of a pose through what the localizer reports."""
        check = self._check
        if check is None:
            return
        if given is check.given:
            self._check = check = replace(check, has_begun=True)
        elif check.has_begun and self._replaces(given):
            self._end(ActionStatus.FAILED, "another pose, map or reset came before the result")
            return
        if check.has_begun:
            for output in outputs:
                self._judge(check, output)

    def _replaces(self, given: Input) -> bool:
        """Tell whether an input ends a check. In a site a `NewMap` only names the map found."""
        if isinstance(given, NewMap) and self._maps.has_site:
            return False
        return isinstance(given, NewMap | Reset | PoseHint | MapHint)

    def _judge(self, check: _Check, output: Output) -> None:
        if isinstance(output, InitialPose):
            found = output.T_map_base
            hint = read_hint(PoseHint(output.stamp, check.T_map_base, source=_SOURCE), ())
            away = found.distance_to(check.T_map_base)
            where = f"found at ({found.x:.2f}, {found.y:.2f}) m, {math.degrees(found.yaw):.0f}°"
            text = f"{where}, {away:.2f} m from the given pose"
            is_there = not self._maps.has_site or self._maps.id_in_use == check.map_id
            if not is_there:
                self._end(ActionStatus.FAILED, f"{where} of map {self._maps.id_in_use}")
            elif hint is not None and hint.matches(found):
                self.last_node_id = check.last_node_id
                self._end(ActionStatus.FINISHED, text)
            else:
                self._end(ActionStatus.FAILED, text)
        elif isinstance(output, Status) and self._check is not None:
            pending = {State.VERIFYING_HINT, State.LIFTED, State.DISAMBIGUATING}
            if self._maps.has_site:
                pending.add(State.SEARCHING)  # the search of all maps verifies the pose
            if output.state in pending:
                self._report(check.action_id, ActionStatus.RUNNING, output.reason)
            else:
                self._end(ActionStatus.FAILED, output.reason)

    def _begin(self, action: Action) -> list[Input]:
        if action.action_id in self._reports:
            return []  # sent again
        self._drop_old()
        self._reports[action.action_id] = ActionReport(
            action.action_id, action.action_type, ActionStatus.RUNNING
        )
        execute = self._kinds.get(action.action_type)
        try:
            if execute is None:
                known = ", ".join(self._kinds)
                raise _RefusedError(
                    Problem.BAD_ACTION, f"A localizer cannot do this. It can do: {known}."
                )
            inputs = execute(action)
        except _RefusedError as refused:
            self._report(action.action_id, ActionStatus.FAILED, f"{refused}")
            references = (
                ("topic", "instantActions"),
                ("actionId", action.action_id),
                *refused.references,
            )
            error = ErrorReport(refused.problem, f"{refused}", references=references)
            self.errors = (*self.errors, error)[-_MOST_REPORTS:]
            return []
        self.errors = ()
        return inputs

    # ---- one kind of action each

    def _initialize(self, action: Action) -> list[Input]:
        wanted = _parameters(action, NewPosition)
        new_map = self._map_for(wanted.map_id)
        if self._check is not None:
            self._end(ActionStatus.FAILED, "replaced by a newer pose of the fleet control")
        stamp, pose = self._localization.stamp, SE2(wanted.x, wanted.y, wanted.theta)
        hint: PoseHint | MapHint = PoseHint(stamp, pose, source=_SOURCE)
        if new_map is not None and new_map.grid is None:
            hint = MapHint(stamp, wanted.map_id, _SOURCE, pose)
        self._check = _Check(action.action_id, hint, pose, wanted.map_id, wanted.last_node_id)
        if new_map is not None and new_map.grid is not None:
            return [NewMap(stamp, new_map.grid), hint]
        return [hint]

    def _map_for(self, map_id: str) -> KnownMap | None:
        """Return the map to switch to; None if it is in use."""
        if map_id == self._maps.id_in_use:
            return None
        known = self._maps.enabled(map_id)
        if known is None:
            listed = {entry.id for entry in self._maps.entries}
            reason = (
                f"Map {map_id} is disabled. Enable it first with enableMap."
                if map_id in listed
                else f"Map {map_id} is not on this robot."
            )
            raise _RefusedError(Problem.UNKNOWN_MAP, reason, ("mapId", map_id))
        return known

    def _enable_map(self, action: Action) -> list[Input]:
        name = _map_name(action)
        known = self._maps.find(name)
        if known is None:
            reason = f"Map {name} is not on this robot."
            raise _RefusedError(Problem.UNKNOWN_MAP, reason, *_references(name))
        self._maps.enable(known)
        self._report(action.action_id, ActionStatus.FINISHED, f"map {known.name} is enabled")
        in_use = self._maps.in_use
        if known.grid is None:
            # Of a site: probably the robot is there, unless the scans say where it is.
            is_open = not self._localization.has_pose
            return [MapHint(self._localization.stamp, name.id, _SOURCE)] if is_open else []
        if in_use is None or in_use.name.id != name.id or in_use is known:
            return []
        # Another version of the map in use: go on at the same pose, if the new one explains it.
        stamp, pose = self._localization.stamp, self._localization.T_map_base
        switch = NewMap(stamp, known.grid)
        return [switch] if pose is None else [switch, PoseHint(stamp, pose, source=_SOURCE)]

    def _download_map(self, action: Action) -> list[Input]:
        name = _map_name(action)
        if self._maps.find(name) is not None:
            reason = f"Map {name} is already on this robot."
            raise _RefusedError(Problem.DUPLICATE_MAP, reason, *_references(name))
        reason = (
            "This robot downloads no maps. Give the map at its start: --vda5050-map ID=MAP.yaml."
        )
        raise _RefusedError(Problem.BAD_ACTION, reason, *_references(name))

    def _delete_map(self, action: Action) -> list[Input]:
        name = _map_name(action)
        known = self._maps.find(name)
        if known is None:
            reason = f"Map {name} is not on this robot."
            raise _RefusedError(Problem.UNKNOWN_MAP, reason, *_references(name))
        reason = (
            f"Map {name} is in use."
            if known is self._maps.in_use
            else f"Map {name} was given at the start of this robot, and is deleted there."
        )
        raise _RefusedError(Problem.BAD_ACTION, reason, *_references(name))

    def _send_state(self, action: Action) -> list[Input]:
        self._report(action.action_id, ActionStatus.FINISHED, "")
        return []

    def _clear(self, action: Action) -> list[Input]:
        for report in self.reports:
            if report.status is not ActionStatus.RUNNING:
                del self._reports[report.id]
        self._report(action.action_id, ActionStatus.FINISHED, "")
        return []

    # ---- reports

    def _report(self, action_id: str, status: ActionStatus, reason: str) -> None:
        report = replace(self._reports[action_id], status=status, result=reason[:_LONGEST_REASON])
        self._reports[action_id] = report

    def _end(self, status: ActionStatus, reason: str) -> None:
        assert self._check is not None  # noqa: S101 - callers have looked
        self._report(self._check.action_id, status, reason)
        self._check = None

    def _drop_old(self) -> None:
        """Make room for one report."""
        ended = [r.id for r in self.reports if r.status is not ActionStatus.RUNNING]
        for action_id in ended[: max(0, len(self._reports) + 1 - _MOST_REPORTS)]:
            del self._reports[action_id]


def _parameters(action: Action, kind: type[T]) -> T:
    values: dict[str, Any] = {each.key: each.value for each in action.action_parameters}
    try:
        return msgspec.convert(values, kind)
    except msgspec.ValidationError as error:
        reason = f"{error}"[:_LONGEST_REASON]
        raise _RefusedError(Problem.BAD_ACTION, f"A parameter cannot be used: {reason}.") from error


def _map_name(action: Action) -> MapName:
    wanted = _parameters(action, MapVersion)
    return MapName(wanted.map_id, wanted.map_version)


def _references(name: MapName) -> tuple[tuple[str, str], ...]:
    return (("mapId", name.id), ("mapVersion", name.version))
