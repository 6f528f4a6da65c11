"""A message of a client is one of few commands, or refused in one sentence."""

from __future__ import annotations

import json
import math

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from firstfix.core.errors import InputError
from firstfix.core.se2 import SE2
from firstfix.web.commands import FARTHEST_M, ClientMessage, SetPose
from firstfix.web.json_decoding import NotJsonError, decode

GOOD = {
    "pose": {"x": 1, "y": -2.5, "yaw": 7.0},
    "pick": {"id": 2},
    "relocalize": {},
    "pause": {"paused": True},
    "goal": {"x": 0.0, "y": 1e6},
    "carry": {"x": 1.0, "y": 2.0, "yaw": -3.0},
    "people": {"count": 5},
    "kidnap": {},
    "cover": {"covered": True},
    "sensor": {"name": "60° x 5 m"},
    "world": {"name": "office"},
    "decide": {},
    "amcl": {"start": "pose"},
    "token": {"token": "secret"},
}
json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
    max_leaves=10,
)
names = st.sampled_from(["type", "x", "y", "yaw", "id", "paused", "count", "token"])
tags = st.sampled_from([*GOOD, "hello", "", "POSE"])


def decoded(**message: object) -> object:
    return decode(json.dumps(message), ClientMessage)


@pytest.mark.parametrize("tag", GOOD)
def test_each_command_is_decoded(tag):
    command = decoded(type=tag, **GOOD[tag], spare=[1])
    assert msgspec.to_builtins(command) == {"type": tag, **GOOD[tag]}


def test_a_pose_is_a_transform():
    assert SetPose(1.0, 2.0, 3.0).T_map_base == SE2(1.0, 2.0, 3.0)


@pytest.mark.parametrize("tag", GOOD)
def test_each_field_is_required(tag):
    for name in GOOD[tag]:
        without = {key: value for key, value in GOOD[tag].items() if key != name}
        with pytest.raises(InputError, match=name):
            decoded(type=tag, **without)


@pytest.mark.parametrize(
    ("tag", "wrong"),
    [
        ("pose", {"x": "1"}),
        ("pose", {"x": True}),
        ("pose", {"x": FARTHEST_M * 1.001}),
        ("pose", {"x": 10**400}),
        ("pose", {"x": None}),
        ("pick", {"id": -1}),
        ("pick", {"id": 1.5}),
        ("pick", {"id": True}),
        ("people", {"count": 31}),
        ("pause", {"paused": 1}),
    ],
)
def test_a_wrong_value_is_refused_by_its_name(tag, wrong):
    with pytest.raises(InputError, match=rf"^{next(iter(wrong))}: "):
        decoded(type=tag, **GOOD[tag] | wrong)


def test_a_refusal_names_types_as_people_do():
    with pytest.raises(InputError, match=r"^x: Expected a number, got text\.$"):
        decoded(type="pose", x="1", y=0, yaw=0)


def command_or_refusal(message: object) -> object:
    try:
        return decode(json.dumps(message), ClientMessage)
    except InputError as error:
        return error


@given(st.dictionaries(names | st.text(), json_values) | json_values, tags)
def test_any_message_is_decoded_or_refused_in_a_short_sentence(message, tag):
    if isinstance(message, dict):
        message.setdefault("type", tag)
    result = command_or_refusal(message)
    if isinstance(result, InputError):
        assert len(str(result)) < 400
    else:
        numbers = [n for n in msgspec.to_builtins(result).values() if isinstance(n, float)]
        assert all(abs(number) <= FARTHEST_M for number in numbers)


@given(st.text() | st.binary())
def test_any_text_is_decoded_or_refused(text):
    with pytest.raises(InputError):
        decode(text, ClientMessage)


@pytest.mark.parametrize(
    "text",
    [
        '{"type": "pose", "x": NaN}',
        '{"type": "pose", "x": Infinity}',
        '{"type": "pose", "spare": ' + "[" * 100_000,
        "",
        "{",
        b"\xff\xfe",
        '{"type": "\ud800"}',
        '"\\x"',
    ],
)
def test_malformed_json_is_refused(text):
    with pytest.raises(NotJsonError):
        decode(text, ClientMessage)


def test_a_number_of_four_million_digits_is_refused():
    with pytest.raises(InputError, match="x"):
        decode('{"type": "goal", "x": ' + "9" * 4_000_000 + ', "y": 0}', ClientMessage)


def test_nan_never_enters():
    with pytest.raises(NotJsonError):
        decoded(type="pose", x=math.nan, y=0, yaw=0)
