"""A small robot with two wheels, a bumper, and wheel-drop and cliff sensors."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from firstfix.core.odometry import Signal, SignalKind
from firstfix.core.se2 import SE2
from firstfix.lab.simulation.floor import Floor
from firstfix.lab.simulation.wheels import WheelErrors, Wheels, arc

_PUSH_STEP_M = 0.01  # a push ends at the first wall; steps this short cannot jump one


@dataclass(frozen=True, slots=True)
class Kobuki:
    """The parameters of a Kobuki without a gyro: odometry comes from its wheels alone.

    Parameters
    ----------
    radius_m : float
        Of its round body, m.
    base_m : float
        Distance between the wheels, m.
    v_max, w_max : float
        Limits of speed, m/s and rad/s.
    a_max, alpha_max : float
        Limits of acceleration, m/s² and rad/s².
    wheels : WheelErrors
        Errors of the wheels.
    """

    radius_m: float = 0.18
    base_m: float = 0.23
    v_max: float = 0.5
    w_max: float = 1.9
    a_max: float = 0.8
    alpha_max: float = 4.0
    wheels: WheelErrors = field(default_factory=WheelErrors)


class Robot:
    """One robot on a floor: its true pose, and its odometry; walls stop it."""

    def __init__(
        self, kobuki: Kobuki, floor: Floor, T_map_base: SE2, rng: np.random.Generator
    ) -> None:
        self.kobuki = kobuki
        self.T_map_base = T_map_base
        self.T_odom_base = SE2.identity()
        self.v = 0.0
        self.w = 0.0
        self._floor = floor
        self._wheels = Wheels(kobuki.wheels, kobuki.base_m, rng)
        self._sensed = dict.fromkeys(SignalKind, False)
        self._told = dict(self._sensed)

    @property
    def bumped(self) -> bool:
        """True from the contact with a wall until the robot has moved away."""
        return self._sensed[SignalKind.BUMPER]

    @property
    def lifted(self) -> bool:
        """True while the robot is off the floor."""
        return self._sensed[SignalKind.WHEEL_DROP]

    def drive(self, v: float, w: float, seconds: float) -> None:
        """Drive for a short time, at the requested speed (m/s, rad/s) if the motors permit it.

        The time must be short enough that the speed is constant.
        """
        if self.lifted:
            return
        k = self.kobuki
        self.v = _towards(self.v, _limited(v, k.v_max), k.a_max * seconds)
        self.w = _towards(self.w, _limited(w, k.w_max), k.alpha_max * seconds)
        if not self._move(arc(self.v * seconds, self.w * seconds)):
            # A round robot can still turn at a wall.
            self._sensed[SignalKind.BUMPER] = True
            self.v = 0.0
            self._move(SE2(0.0, 0.0, self.w * seconds))
        elif self.v != 0.0:
            self._sensed[SignalKind.BUMPER] = False
        self.T_odom_base = self.T_odom_base @ self._wheels.count(self.v * seconds, self.w * seconds)

    def spin_wheels(self, length: float, turn: float) -> None:
        """Let the wheels count a motion (m, rad) that the robot does not make."""
        self.T_odom_base = self.T_odom_base @ self._wheels.count(length, turn)

    def push(self, T_base_pushed: SE2) -> None:
        """Push the robot, up to the first wall; its wheels count nothing."""
        steps = max(1, round(SE2.identity().distance_to(T_base_pushed) / _PUSH_STEP_M))
        across = SE2(T_base_pushed.x / steps, T_base_pushed.y / steps, 0.0)
        for _ in range(steps):
            if not self._move(across):
                break
        self._move(SE2(0.0, 0.0, T_base_pushed.yaw))

    def place(self, T_map_base: SE2) -> None:
        """Put the robot elsewhere, at rest; its wheels count nothing."""
        self.T_map_base = T_map_base
        self.v = self.w = 0.0

    def lift(self) -> None:
        """Take the robot off the floor: wheel-drop and cliff sensors report it."""
        self._hold(lifted=True)

    def set_down(self) -> None:
        """Put the robot on the floor again."""
        self._hold(lifted=False)

    def signals(self, stamp: float) -> tuple[Signal, ...]:
        """Return the sensors that changed since the last call; stamp in s."""
        changed = tuple(
            Signal(stamp, kind, active)
            for kind, active in self._sensed.items()
            if active is not self._told[kind]
        )
        self._told = dict(self._sensed)
        return changed

    def _hold(self, *, lifted: bool) -> None:
        self.v = self.w = 0.0
        self._sensed[SignalKind.CLIFF] = self._sensed[SignalKind.WHEEL_DROP] = lifted
        self._sensed[SignalKind.BUMPER] = False

    def _move(self, T_before_after: SE2) -> bool:
        """Move the body if there is room for it; return whether there was."""
        here = self.T_map_base
        there = here @ T_before_after
        room = self._floor.room_at(there.x, there.y)
        # A robot that stands too near a wall may leave it.
        if room < self.kobuki.radius_m and room < self._floor.room_at(here.x, here.y):
            return False
        self.T_map_base = there
        return True


def _limited(speed: float, limit: float) -> float:
    return min(limit, max(-limit, speed))


def _towards(speed: float, wanted: float, change: float) -> float:
    return speed + _limited(wanted - speed, change)
