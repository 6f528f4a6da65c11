"""Inputs and outputs of a localizer to what a fleet control wants to know."""

from __future__ import annotations

import math
from collections import deque

import numpy as np
from numpy.typing import NDArray

from firstfix.core.estimate import Evidence, Hypothesis
from firstfix.core.odometry import Odometry
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.localizer.inputs import Input, NewMap
from firstfix.localizer.outputs import Hypotheses, InitialPose, Output, Status, TrackedPose
from firstfix.localizer.states import State
from firstfix.vda5050.report import ErrorReport, Position, Problem, Velocity

# A pose without a scan for this time is not tracked any more, s.
_STALE_S = 2.0
# Radius that contains 95 % of a circular normal distribution, in standard deviations.
_RADIUS_95 = 2.448
# Velocity is measured over this time, s; below these values the robot stands.
_SPAN_S = 0.3
_STANDS_M_S = 0.01
_STANDS_RAD_S = 0.02
# Signals without the text that people would need to read the rest of a message.
_LONGEST = 500


class Localization:
    """What is known about the pose; observes a localizer.

    All times called ``now`` are of one monotonic clock, in seconds.
    """

    def __init__(self) -> None:
        self._state = State.NO_MAP
        self._reason = "no map yet"
        self._pose: SE2 | None = None
        self._covariance: NDArray[np.float64] | None = None
        self._evidence: Evidence | None = None
        self._rivals = 0
        self._best: Hypothesis | None = None
        self._tracked_at = -math.inf
        self._odometry: deque[Odometry] = deque()
        self.stamp = 0.0

    @property
    def has_pose(self) -> bool:
        """True while a pose is published."""
        return self._state is State.LOCALIZED

    @property
    def T_map_base(self) -> SE2 | None:
        """The pose, or the last one; None before the first and on a new map."""
        return self._pose

    def observe(self, given: Input, outputs: list[Output], now: float) -> None:
        """Take over what an input led to."""
        if isinstance(given, NewMap):
            self._pose = self._covariance = None  # of another map
        if isinstance(given, Odometry):
            self._add(given)
        if isinstance(given, LaserScan | Odometry):
            self.stamp = given.stamp
        for output in outputs:
            if isinstance(output, InitialPose | TrackedPose):
                self._pose, self._covariance = output.T_map_base, output.covariance
                self._tracked_at = now
            elif isinstance(output, Hypotheses):
                self._best = output.places[0]
                self._pose, self._covariance = self._best.pose, self._best.covariance
            elif isinstance(output, Status):
                self._state, self._reason = output.state, output.reason
                self._evidence, self._rivals = output.evidence, output.rivals

    def is_localized(self, now: float) -> bool:
        """Return whether the pose is published and still tracked."""
        return self._state is State.LOCALIZED and now - self._tracked_at <= _STALE_S

    def position(self, map_id: str, now: float) -> Position:
        """Return where the robot is, or was last."""
        pose = self._pose or SE2.identity()
        is_localized = self.is_localized(now)
        return Position(
            x=pose.x,
            y=pose.y,
            theta=pose.yaw,
            map_id=map_id,
            is_localized=is_localized,
            score=self._score(is_localized=is_localized),
            deviation_m=self._deviation() if is_localized else None,
        )

    def velocity(self) -> Velocity | None:
        """Return the velocity of the last odometry; None without odometry."""
        if len(self._odometry) < 2:
            return None
        first, last = self._odometry[0], self._odometry[-1]
        passed_s = last.stamp - first.stamp
        moved = first.T_odom_base.inverse() @ last.T_odom_base
        # The chord of the way, in the frame of the base in the middle of the turn.
        half = SE2(0.0, 0.0, moved.yaw / 2.0).inverse() @ SE2(moved.x, moved.y, 0.0)
        return Velocity(half.x / passed_s, half.y / passed_s, moved.yaw / passed_s)

    def error(self, now: float) -> ErrorReport | None:
        """Return the error that the robot is not localized, if it is not."""
        if self.is_localized(now):
            return None
        hint = "Move the robot, or send its pose with initPosition (initializePosition)."
        if self._state is State.NO_MAP:
            hint = "Load a map."
        elif self._state is State.LOCALIZED:
            hint = "Check the LIDAR and its connection."
        return ErrorReport(Problem.NOT_LOCALIZED, self.status(now), hint)

    def status(self, now: float) -> str:
        """Return the state and its reason."""
        if self._state is State.LOCALIZED and not self.is_localized(now):
            return f"STALE: no scan for {_STALE_S:g} s or more; the robot was localized"
        return f"{self._state.value}: {self._reason}"[:_LONGEST]

    def _score(self, *, is_localized: bool) -> float:
        if is_localized and self._evidence is not None:
            return _fraction(self._evidence.explained / max(1, self._rivals))
        if self._state is State.DISAMBIGUATING and self._best is not None:
            return _fraction(self._best.evidence.explained * self._best.probability)
        return 0.0

    def _deviation(self) -> float | None:
        if self._covariance is None or not np.isfinite(self._covariance).all():
            return None  # JSON has no other numbers
        variance = float(np.linalg.eigvalsh(self._covariance[:2, :2])[-1])
        return _RADIUS_95 * math.sqrt(max(0.0, variance))

    def _add(self, given: Odometry) -> None:
        if self._odometry and given.stamp <= self._odometry[-1].stamp:
            self._odometry.clear()  # the clock was set back
        self._odometry.append(given)
        while len(self._odometry) > 2 and given.stamp - self._odometry[1].stamp >= _SPAN_S:
            self._odometry.popleft()


def is_driving(velocity: Velocity | None) -> bool:
    """Return whether a robot with this velocity moves."""
    if velocity is None:
        return False
    is_moving = math.hypot(velocity.vx, velocity.vy) > _STANDS_M_S
    return is_moving or abs(velocity.omega) > _STANDS_RAD_S


def _fraction(value: float) -> float:
    return min(1.0, max(0.0, value))
