"""The scenarios of ``firstfix bench --kidnap``."""

from __future__ import annotations

from collections.abc import Callable

from firstfix.lab.scenarios.phases import (
    CarryTo,
    Crowd,
    Grip,
    Manner,
    Phase,
    Slip,
    SlipKind,
    Stand,
    Teleport,
    Wander,
)

# Time after a disturbance, s: enough for a search and 10 s of right poses.
AFTER_S = 25.0
_STARTING_S = 2.0
_BEFORE_S = 12.0
_NOTHING_S = 60.0

# So many people around a robot mostly take 20 to 45 % of its beams (medians of 24 scenarios: 13 to
# 53 %); those who walk about, 1 to 41 %.
_AROUND = (4, 5, 6)
_ABOUT = 12


def scripted(seed: int, after_s: float = AFTER_S) -> tuple[str, list[Phase]]:
    """Return the kind of a scenario and its phases.

    The kinds alternate from seed to seed; ``after_s`` is the time after each disturbance.
    """
    kind = list(_SCRIPTS)[seed % len(_SCRIPTS)]
    return kind, [Stand(_STARTING_S), *_SCRIPTS[kind](seed // len(_SCRIPTS), after_s)]


def _teleport(_: int, after_s: float) -> list[Phase]:
    one: list[Phase] = [Stand(1.0), Teleport(), Stand(2.0), Wander(after_s)]
    return [Wander(_BEFORE_S), *(3 * one)]


def _carry(_: int, after_s: float) -> list[Phase]:
    carried = [
        phase
        for grip in (Grip.HANDS, Grip.COVERED, Grip.OPEN)
        for phase in (CarryTo(seconds=4.0, grip=grip), Stand(2.0), Wander(after_s))
    ]
    return [Wander(_BEFORE_S), *carried]


def _teleport_driving(_: int, after_s: float) -> list[Phase]:
    one: list[Phase] = [Teleport(), Wander(after_s)]
    return [Wander(_BEFORE_S), *(3 * one)]


def _crowd_teleport(turn: int, after_s: float) -> list[Phase]:
    count = _AROUND[turn % len(_AROUND)]
    # Others come to where the robot is now, before it sees anything there.
    one: list[Phase] = [Teleport(), Crowd(count), Wander(after_s)]
    return [Wander(_BEFORE_S), Crowd(count), Wander(_BEFORE_S), *(2 * one)]


def _slip(turn: int, after_s: float) -> list[Phase]:
    degrees = 20.0 if turn % 2 == 0 else -20.0
    slips = [
        phase
        for kind in (SlipKind.PUSHED, SlipKind.SPINNING, SlipKind.PUSHED)
        for phase in (Slip(0.5, degrees, kind), Wander(after_s))
    ]
    return [Wander(_BEFORE_S), *slips]


def _crowd(turn: int, _: float) -> list[Phase]:
    around = Crowd(_AROUND[turn % len(_AROUND)])
    about = Crowd(_ABOUT, manner=Manner.WALK)
    return [around, Wander(_NOTHING_S / 2), about, Wander(_NOTHING_S / 2)]


def _nothing(_: int, __: float) -> list[Phase]:
    return [Wander(_NOTHING_S)]


# In this order, so that a few scenarios already show the most different ones.
_SCRIPTS: dict[str, Callable[[int, float], list[Phase]]] = {
    "teleport": _teleport,
    "carry": _carry,
    "teleport_driving": _teleport_driving,
    "crowd_teleport": _crowd_teleport,
    "slip": _slip,
    "crowd": _crowd,
    "nothing": _nothing,
}
