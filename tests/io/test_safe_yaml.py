"""What every YAML of ours goes through: limits, entries, numbers and words."""

import math
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firstfix.core.errors import InputError
from firstfix.io.safe_yaml import entries, kind, parse_yaml, to_flag, to_number

PATH = Path("params.yaml")


def parsed(text: str):
    return parse_yaml(text.encode(), PATH, example="amcl:")


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("a: &a 1\nb: *a", "anchors or aliases"),
        ("a: " + "[" * 100, "deep nesting"),
        ("a: b: c", "line 1"),
        ("a: 1\n---\nb: 1", "another document"),
        ("- a", "a list"),
        ("", "an empty file"),
        ("word", "word"),
    ],
)
def test_what_is_refused_names_the_file_and_the_example(text, says):
    with pytest.raises(InputError, match=says) as caught:
        parsed(text)
    assert "params.yaml" in caught.value.expected
    assert "amcl:" in caught.value.remedy


def test_entries_keep_their_order_and_refuse_doubles():
    assert list(entries(parsed("b: 1\na: [2]"), PATH)) == ["b", "a"]
    with pytest.raises(InputError, match=r"every key once in params\.yaml, received 'a' twice"):
        entries(parsed("a: 1\na: 2"), PATH)


def test_nodes_in_words():
    told = [kind(node) for node in entries(parsed("a: 1\nb: [1]\nc: {d: 1}"), PATH).values()]
    assert told == ["'1'", "a list", "a mapping"]


@given(st.floats(allow_nan=False, allow_infinity=False) | st.integers(-(2**60), 2**60))
def test_numbers_are_read_as_they_are_written(number):
    assert to_number(repr(number)) == float(number)


@pytest.mark.parametrize(
    "text", ["", "x", ".nan", ".inf", "inf", "nan", "1_0", "0x10", "1:30", "٣"]
)
def test_what_is_no_number(text):
    assert math.isnan(to_number(text))


def test_a_number_too_large_for_a_float_is_infinite():
    assert to_number("-1e999") == -math.inf


def test_words_for_yes_and_no():
    assert [to_flag(word) for word in ("true", "Yes", "ON", "y")] == [True] * 4
    assert [to_flag(word) for word in ("False", "no", "off", "N")] == [False] * 4
    assert [to_flag(word) for word in ("", "0", "1", "maybe")] == [None] * 4
