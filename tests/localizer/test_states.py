"""The table: complete, connected, and drawn as it is."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from firstfix.localizer.states import TABLE, Event, State, after, diagram

ANYWHERE = {Event.MAP_CAME, Event.PERSON_SAID, Event.KIDNAPPED, Event.RESET}
# What a localizer may fire in which state: `Localizer` does nothing before there is a map.
FIRED = {
    State.NO_MAP: {Event.MAP_CAME},
    State.SEARCHING: ANYWHERE | {Event.ONE_PLACE, Event.SEVERAL_PLACES},
    State.TRACKING: ANYWHERE | {Event.PLACE_WON, Event.LOST},
    State.LOCALIZED: ANYWHERE | {Event.FOUND_ELSEWHERE, Event.LOST},
}


def reachable(start: State) -> set[State]:
    known, new = {start}, {start}
    while new:
        new = {target for (state, _), target in TABLE.items() if state in new} - known
        known |= new
    return known


def test_there_is_a_row_for_what_may_happen_and_for_nothing_else() -> None:
    assert set(TABLE) == {(state, event) for state, events in FIRED.items() for event in events}


def test_every_event_can_happen() -> None:
    assert {event for _, event in TABLE} == set(Event)


def test_every_state_is_reached_from_the_start() -> None:
    assert reachable(State.NO_MAP) == set(State)


@pytest.mark.parametrize("state", [State.SEARCHING, State.TRACKING, State.LOCALIZED])
def test_no_state_is_a_trap_and_a_map_stays(state: State) -> None:
    assert reachable(state) == set(State) - {State.NO_MAP}


def test_whatever_makes_the_past_worthless_leads_to_a_search() -> None:
    for (_, event), target in TABLE.items():
        if event in (Event.MAP_CAME, Event.KIDNAPPED, Event.RESET, Event.LOST):
            assert target is State.SEARCHING


def test_only_a_place_makes_a_robot_localized() -> None:
    found = {Event.ONE_PLACE, Event.PLACE_WON, Event.FOUND_ELSEWHERE}
    for (_, event), target in TABLE.items():
        assert (target is State.LOCALIZED) == (event in found)


def test_after_is_the_table_and_refuses_what_is_not_in_it() -> None:
    for (state, event), target in TABLE.items():
        assert after(state, event) is target
    with pytest.raises(KeyError):
        after(State.NO_MAP, Event.ONE_PLACE)


def test_the_diagram_has_every_row_once() -> None:
    lines = diagram().splitlines()
    assert lines[:2] == ["stateDiagram-v2", "    [*] --> NO_MAP"]
    rows = [re.fullmatch(r" {4}(\w+) --> (\w+): (.+)", line) for line in lines[2:]]
    assert all(rows)
    drawn = [(State(row[1]), Event(row[3]), State(row[2])) for row in rows if row]
    assert len(drawn) == len(TABLE)
    assert {(state, event): target for state, event, target in drawn} == TABLE


def test_the_diagram_does_not_depend_on_the_order_of_the_table(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    before = diagram()
    reverse = dict(reversed(TABLE.items()))
    monkeypatch.setattr("firstfix.localizer.states.TABLE", reverse)
    assert diagram() == before


def test_the_picture_in_the_docs_is_drawn_from_the_table() -> None:
    page = Path(__file__).parents[2] / "docs" / "states.md"
    assert f"```mermaid\n{diagram()}```" in page.read_text(encoding="utf-8")
