"""The states of a localizer, the events that change them, and the table of transitions."""

from __future__ import annotations

from enum import Enum


class State(Enum):
    """What a localizer is doing. The ROS status, the HTTP API and the page use these names.

    Examples
    --------
    >>> ff.Localizer().state
    <State.NO_MAP: 'NO_MAP'>
    """

    NO_MAP = "NO_MAP"
    SEARCHING = "SEARCHING"
    DISAMBIGUATING = "DISAMBIGUATING"
    VERIFYING_HINT = "VERIFYING_HINT"
    LIFTED = "LIFTED"
    LOCALIZED = "LOCALIZED"


class Event(Enum):
    """What can change the state.

    Examples
    --------
    >>> ff.Event("picked up")
    <Event.PICKED_UP: 'picked up'>
    """

    MAP_RECEIVED = "map received"
    HINT_RECEIVED = "hint received"
    RESET = "reset"
    PICKED_UP = "picked up"
    SET_DOWN = "set down"
    ODOMETRY_JUMPED = "odometry jumped"
    ONE_PLACE_FITS = "one place fits"
    SEVERAL_PLACES_FIT = "several places fit"
    DECIDED = "decided"
    HINT_CONFIRMED = "hint confirmed"
    HINT_REJECTED = "hint rejected"
    RELOCALIZED = "relocalized"
    REVOKED = "revoked"
    CONTRADICTED = "contradicted"


class TransitionError(RuntimeError):
    """An event that its state does not allow: a defect of the caller, not of its input."""

    def __init__(self, state: State, event: Event) -> None:
        self.state = state
        self.event = event
        super().__init__(f"the event '{event.value}' is not allowed in the state {state.value}")


_ON_THE_FLOOR = (State.SEARCHING, State.DISAMBIGUATING, State.VERIFYING_HINT, State.LOCALIZED)

TABLE: dict[tuple[State, Event], State] = {
    (State.NO_MAP, Event.MAP_RECEIVED): State.SEARCHING,
    (State.SEARCHING, Event.ONE_PLACE_FITS): State.LOCALIZED,
    (State.SEARCHING, Event.SEVERAL_PLACES_FIT): State.DISAMBIGUATING,
    (State.DISAMBIGUATING, Event.DECIDED): State.LOCALIZED,
    (State.DISAMBIGUATING, Event.CONTRADICTED): State.SEARCHING,
    (State.DISAMBIGUATING, Event.ODOMETRY_JUMPED): State.SEARCHING,
    (State.VERIFYING_HINT, Event.HINT_CONFIRMED): State.LOCALIZED,
    (State.VERIFYING_HINT, Event.HINT_REJECTED): State.SEARCHING,
    (State.VERIFYING_HINT, Event.SEVERAL_PLACES_FIT): State.DISAMBIGUATING,
    (State.LOCALIZED, Event.RELOCALIZED): State.LOCALIZED,
    (State.LOCALIZED, Event.CONTRADICTED): State.SEARCHING,
    (State.LOCALIZED, Event.REVOKED): State.DISAMBIGUATING,
    (State.LIFTED, Event.MAP_RECEIVED): State.LIFTED,
    (State.LIFTED, Event.HINT_RECEIVED): State.LIFTED,
    (State.LIFTED, Event.RESET): State.SEARCHING,
    (State.LIFTED, Event.PICKED_UP): State.LIFTED,
    (State.LIFTED, Event.SET_DOWN): State.SEARCHING,
} | {
    (state, event): target
    for state in _ON_THE_FLOOR
    for event, target in (
        (Event.MAP_RECEIVED, State.SEARCHING),
        (Event.HINT_RECEIVED, State.VERIFYING_HINT),
        (Event.RESET, State.SEARCHING),
        (Event.PICKED_UP, State.LIFTED),
    )
}


def next_state(state: State, event: Event) -> State:
    """Return the state after an event.

    Raises
    ------
    TransitionError
        If the table has no row for the event in this state.
    """
    try:
        return TABLE[state, event]
    except KeyError:
        raise TransitionError(state, event) from None


def diagram() -> str:
    """Return the table as a Mermaid state diagram, with one arrow for each pair of states."""
    events: dict[tuple[str, str], list[str]] = {}
    for (state, event), target in TABLE.items():
        events.setdefault((state.value, target.value), []).append(event.value)
    arrows = [
        f"    {state} --> {target}: {', '.join(sorted(names))}"
        for (state, target), names in sorted(events.items())
    ]
    return "\n".join(["stateDiagram-v2", "    [*] --> NO_MAP", *arrows]) + "\n"
