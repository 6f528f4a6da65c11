"""The table of states: complete, connected, and drawn in the docs as it is."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from firstfix.localizer.states import TABLE, Event, State, TransitionError, diagram, next_state

ON_THE_FLOOR = set(State) - {State.NO_MAP, State.LIFTED}
FROM_OUTSIDE = {Event.MAP_RECEIVED, Event.HINT_RECEIVED, Event.RESET, Event.PICKED_UP}
# The events that `Localizer` fires in each state.
FIRED = {
    State.NO_MAP: {Event.MAP_RECEIVED},
    State.SEARCHING: FROM_OUTSIDE | {Event.ONE_PLACE_FITS, Event.SEVERAL_PLACES_FIT},
    State.DISAMBIGUATING: FROM_OUTSIDE | {Event.DECIDED, Event.CONTRADICTED, Event.ODOMETRY_JUMPED},
    State.VERIFYING_HINT: FROM_OUTSIDE
    | {Event.HINT_CONFIRMED, Event.HINT_REJECTED, Event.SEVERAL_PLACES_FIT},
    State.LIFTED: FROM_OUTSIDE | {Event.SET_DOWN},
    State.LOCALIZED: FROM_OUTSIDE | {Event.RELOCALIZED, Event.CONTRADICTED, Event.REVOKED},
}
DOCS = Path(__file__).parents[2] / "docs"


def reachable(start: State) -> set[State]:
    known, new = {start}, {start}
    while new:
        new = {target for (state, _), target in TABLE.items() if state in new} - known
        known |= new
    return known


def test_the_table_has_a_row_for_each_event_that_is_fired_and_no_other() -> None:
    assert set(TABLE) == {(state, event) for state, events in FIRED.items() for event in events}


def test_every_event_is_used() -> None:
    assert {event for _, event in TABLE} == set(Event)


def test_every_state_is_reachable_from_the_start() -> None:
    assert reachable(State.NO_MAP) == set(State)


@pytest.mark.parametrize("state", sorted(set(State) - {State.NO_MAP}, key=lambda s: s.value))
def test_every_state_can_be_left_and_a_map_is_never_lost(state: State) -> None:
    assert reachable(state) == set(State) - {State.NO_MAP}


def test_a_lifted_robot_is_localized_only_after_it_was_set_down() -> None:
    after_lift = {target for (state, _), target in TABLE.items() if state is State.LIFTED}
    assert after_lift == {State.LIFTED, State.SEARCHING}


def test_picking_up_leads_to_lifted_from_every_state_with_a_map() -> None:
    for state in set(State) - {State.NO_MAP}:
        assert next_state(state, Event.PICKED_UP) is State.LIFTED


def test_a_hint_is_verified_before_it_is_published() -> None:
    for state in ON_THE_FLOOR:
        assert next_state(state, Event.HINT_RECEIVED) is State.VERIFYING_HINT


def test_only_a_place_that_was_found_makes_a_robot_localized() -> None:
    found = {Event.ONE_PLACE_FITS, Event.DECIDED, Event.HINT_CONFIRMED, Event.RELOCALIZED}
    for (_, event), target in TABLE.items():
        assert (target is State.LOCALIZED) == (event in found)


def test_next_state_is_the_table() -> None:
    for (state, event), target in TABLE.items():
        assert next_state(state, event) is target


def test_an_illegal_transition_names_state_and_event() -> None:
    for state in State:
        for event in set(Event) - FIRED[state]:
            with pytest.raises(TransitionError, match=f"'{event.value}'.* {state.value}$"):
                next_state(state, event)


def test_the_diagram_has_every_row_once() -> None:
    lines = diagram().splitlines()
    assert lines[:2] == ["stateDiagram-v2", "    [*] --> NO_MAP"]
    arrows = [re.fullmatch(r" {4}(\w+) --> (\w+): (.+)", line) for line in lines[2:]]
    assert all(arrows)
    drawn = [
        (State(arrow[1]), Event(event), State(arrow[2]))
        for arrow in arrows
        if arrow
        for event in arrow[3].split(", ")
    ]
    assert len(drawn) == len(TABLE)
    assert {(state, event): target for state, event, target in drawn} == TABLE


def test_the_diagram_does_not_depend_on_the_order_of_the_table(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    before = diagram()
    reverse = dict(reversed(TABLE.items()))
    monkeypatch.setattr("firstfix.localizer.states.TABLE", reverse)
    assert diagram() == before


def test_the_diagram_in_the_docs_is_drawn_from_the_table() -> None:
    page = (DOCS / "states.md").read_text(encoding="utf-8")
    assert f"```mermaid\n{diagram()}```" in page


@pytest.mark.parametrize("page", ["states.md", "ros.md"])
def test_the_docs_name_every_state(page: str) -> None:
    text = (DOCS / page).read_text(encoding="utf-8")
    assert all(state.value in text for state in State)


def test_the_page_has_words_for_every_state() -> None:
    script = Path("src/firstfix/web/static/format.js")
    text = (DOCS.parent / script).read_text(encoding="utf-8")
    assert all(f"  {state.value}: {{" in text for state in State)
