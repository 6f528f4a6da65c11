"""What a viewer asks for is one of few things, or refused in one sentence."""

from __future__ import annotations

import json
import math
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firstfix.core.errors import InputError
from firstfix.web.commands import COMMANDS, FARTHEST_M, Entry, decode_command
from firstfix.web.strict_json import NotJsonError, parsed

GOOD = {
    "pose": {"x": 1, "y": -2.5, "yaw": 7.0},
    "pick": {"index": 2},
    "relocalize": {},
    "pause": {"paused": True},
    "goal": {"x": 0.0, "y": 1e6},
    "carry": {"x": 1.0, "y": 2.0, "yaw": -3.0},
    "people": {"count": 5},
}
json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
    max_leaves=10,
)
names = st.sampled_from(["type", "x", "y", "yaw", "index", "paused", "count", "token"])
kinds = st.sampled_from([*COMMANDS, "hello", "", "POSE"])


@pytest.mark.parametrize("kind", COMMANDS)
def test_each_order_is_understood(kind):
    order = decode_command({"type": kind, **GOOD[kind], "spare": [1]})
    assert (order.kind, order.given) == (kind, GOOD[kind])


@pytest.mark.parametrize("kind", COMMANDS)
def test_each_entry_is_needed(kind):
    for name in GOOD[kind]:
        without = {key: value for key, value in GOOD[kind].items() if key != name}
        with pytest.raises(InputError, match=name):
            decode_command({"type": kind, **without})


@pytest.mark.parametrize(
    ("kind", "wrong"),
    [
        ("pose", {"x": "1"}),
        ("pose", {"x": True}),
        ("pose", {"yaw": math.nan}),
        ("pose", {"y": math.inf}),
        ("pose", {"x": FARTHEST_M * 1.001}),
        ("pose", {"x": 10**400}),
        ("pose", {"x": None}),
        ("pick", {"index": -1}),
        ("pick", {"index": 1.5}),
        ("pick", {"index": True}),
        ("people", {"count": 31}),
        ("pause", {"paused": 1}),
    ],
)
def test_what_cannot_be_meant_is_refused(kind, wrong):
    with pytest.raises(InputError, match=next(iter(wrong))):
        decode_command({"type": kind, **GOOD[kind], **wrong})


def answered(ask, given_):
    """Return the answer, or None for a refusal in a sentence that is not too long."""
    try:
        return ask(given_)
    except InputError as error:
        told = str(error)
    assert len(told) < 400
    return None


@given(st.dictionaries(names | st.text(), json_values) | json_values, kinds)
def test_nonsense_is_refused_or_an_order(message, kind):
    if isinstance(message, dict):
        message.setdefault("type", kind)
    order = answered(decode_command, message)
    if order is None:
        return
    assert set(order.given) == set(COMMANDS[order.kind])
    for name, value in order.given.items():
        entry = COMMANDS[order.kind][name]
        assert type(value) is entry.kind
        assert entry.kind is bool or entry.least <= value <= entry.most


@given(st.text() | st.binary())
def test_text_is_json_or_refused(text):
    answered(parsed, text)


@pytest.mark.parametrize(
    "text", ["NaN", '{"x": Infinity}', "[" * 100_000, "", "{", b"\xff\xfe", "[1,]", '"\\x"']
)
def test_what_json_does_not_have_is_refused(text):
    with pytest.raises(NotJsonError):
        parsed(text)


def test_endless_digits_are_read_in_no_time():
    assert parsed("9" * 4_000_000) == math.inf
    assert parsed("-" + "1" * 400) == -math.inf
    assert parsed("123456789012345") == 123456789012345


@given(json_values)
def test_json_is_read_as_everybody_reads_it(value):
    text = json.dumps(value).replace("NaN", "0").replace("Infinity", "1")
    exact = json.loads(text)
    if "." not in text and re.search(r"\d{16}", text) is None:
        assert parsed(text) == exact


def test_the_table_describes_itself():
    assert Entry(int, "a count", 0, 3).schema() == {
        "type": "integer",
        "description": "a count",
        "minimum": 0,
        "maximum": 3,
    }
    assert Entry(bool, "yes or no").schema()["type"] == "boolean"
