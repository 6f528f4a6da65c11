"""The states of a localizer: one table, and nothing else changes state."""

from __future__ import annotations

from enum import Enum


class State(Enum):
    """What a localizer is doing."""

    NO_MAP = "NO_MAP"
    SEARCHING = "SEARCHING"
    TRACKING = "TRACKING"
    LOCALIZED = "LOCALIZED"


class Event(Enum):
    """What can change that; the values say it in words."""

    MAP_CAME = "a map came"
    ONE_PLACE = "one place fits"
    SEVERAL_PLACES = "several places fit"
    PLACE_WON = "one place has won"
    PERSON_SAID = "a person says where"
    FOUND_ELSEWHERE = "found elsewhere"
    KIDNAPPED = "picked up"
    LOST = "contradicted"
    RESET = "told to forget"


TABLE: dict[tuple[State, Event], State] = {
    (State.SEARCHING, Event.ONE_PLACE): State.LOCALIZED,
    (State.SEARCHING, Event.SEVERAL_PLACES): State.TRACKING,
    (State.TRACKING, Event.PLACE_WON): State.LOCALIZED,
    (State.TRACKING, Event.LOST): State.SEARCHING,
    (State.LOCALIZED, Event.FOUND_ELSEWHERE): State.LOCALIZED,
    (State.LOCALIZED, Event.LOST): State.SEARCHING,
    (State.NO_MAP, Event.MAP_CAME): State.SEARCHING,
} | {
    (state, event): target
    for state in (State.SEARCHING, State.TRACKING, State.LOCALIZED)
    for event, target in (
        (Event.MAP_CAME, State.SEARCHING),
        (Event.PERSON_SAID, State.TRACKING),
        (Event.KIDNAPPED, State.SEARCHING),
        (Event.RESET, State.SEARCHING),
    )
}


def after(state: State, event: Event) -> State:
    """Return the state after an event.

    Parameters
    ----------
    state : State
        The state before.
    event : Event
        What happened; it must be in the table for this state.

    Returns
    -------
    State
        The state after.
    """
    return TABLE[state, event]


def diagram() -> str:
    """Return the table as a Mermaid state diagram."""
    lines = ["stateDiagram-v2", "    [*] --> NO_MAP"]
    lines += [
        f"    {state.value} --> {target.value}: {event.value}"
        for (state, event), target in sorted(
            TABLE.items(), key=lambda item: (item[0][0].value, item[1].value, item[0][1].value)
        )
    ]
    return "\n".join(lines) + "\n"
