"""Messages of instant actions: any bytes, any parameter, too much of both."""

from __future__ import annotations

import json
from typing import Any

import pytest
from action_desk import Desk
from hypothesis import given
from hypothesis import strategies as st

from firstfix.core.errors import InputError
from firstfix.vda5050.actions import Actions
from firstfix.vda5050.localization import Localization
from firstfix.vda5050.maps import MapName, MapRegister

TREES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner),
    max_leaves=8,
)


@given(message=st.binary(max_size=200) | TREES.map(lambda tree: json.dumps(tree).encode()))
def test_any_bytes_are_refused_with_one_sentence(message: bytes):
    actions = Actions(MapRegister(MapName("hall")), Localization())
    with pytest.raises(InputError, match="instant actions"):
        actions.receive(message)
    assert actions.reports == ()


@given(value=TREES, name=st.sampled_from(["x", "mapId", "mapVersion"]))
def test_any_parameter_is_refused_or_used(value: Any, name: str):
    actions = Actions(MapRegister(MapName("hall")), Localization())
    where = {"x": 1.0, "y": 1.0, "theta": 0.0, "mapId": "hall", "mapVersion": "1"} | {name: value}
    values = [{"key": key, "value": each} for key, each in where.items()]
    kinds = ("initPosition", "enableMap", "downloadMap", "deleteMap", "stateRequest")
    message = {
        "actions": [
            {"actionType": kind, "actionId": kind, "actionParameters": values} for kind in kinds
        ]
    }
    try:
        inputs = actions.receive(json.dumps(message).encode())
    except InputError:  # NaN is not JSON
        assert actions.reports == ()
        return
    assert len(actions.reports) == len(kinds)
    assert len(inputs) <= 1


def test_a_message_that_is_too_large(desk: Desk):
    with pytest.raises(InputError, match="at most 65536 bytes"):
        desk.actions.receive(b" " * 70_000)


def test_too_many_actions_in_one_message(desk: Desk):
    action = {"actionType": "stateRequest", "blockingType": "NONE"}
    message = {"actions": [action | {"actionId": f"{number}"} for number in range(65)]}
    with pytest.raises(InputError, match="fit"):
        desk.actions.receive(json.dumps(message).encode())
    assert desk.actions.reports == ()
