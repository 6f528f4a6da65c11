"""Limits of YAML files: anchors, depth, repeated keys, numbers."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firstfix.core.errors import InputError
from firstfix.io.safe_yaml import entries, kind, load_mapping

PATH = Path("params.yaml")


def loaded(text: str):
    return load_mapping(text.encode(), PATH, example="amcl:")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a: &a 1\nb: *a", "anchors or aliases"),
        ("a: " + "[" * 100, "deep nesting"),
        ("a: b: c", "line 1"),
        ("a: 1\n---\nb: 1", "another document"),
        ("a: !!python/object/apply:os.getcwd []", "could not determine a constructor"),
        ("a: 2020-13-01", "month"),
        ("{[1]: 2}", "unhashable key"),
        ("- a", "a list"),
        ("", "an empty file"),
        ("word", "word"),
    ],
)
def test_invalid_files_are_rejected_with_file_and_example(text, message):
    with pytest.raises(InputError, match=message) as caught:
        loaded(text)
    assert "params.yaml" in caught.value.expected
    assert "amcl:" in caught.value.remedy


def test_entries_keep_their_order_and_reject_repeated_keys():
    assert list(entries(loaded("b: 1\na: [2]"), PATH)) == ["b", "a"]
    with pytest.raises(InputError, match=r"every key once in params\.yaml, received 'a' twice"):
        entries(loaded("a: 1\na: 2"), PATH)


def test_repeated_keys_matter_only_in_the_mapping_that_is_read():
    assert entries(loaded("a: {b: 1, b: 2}\nc: 3"), PATH)["c"] == 3


def test_values_in_words():
    values = entries(loaded("a: 1\nb: [1]\nc: {d: 1}\ne:"), PATH).values()
    assert [kind(value) for value in values] == ["1", "a list", "a mapping", "nothing"]


@given(st.floats(allow_nan=False, allow_infinity=False) | st.integers(-(2**60), 2**60))
def test_numbers_are_read_as_python_and_ros_write_them(number):
    assert loaded(f"a: {number!r}")["a"] == number


@pytest.mark.parametrize(
    ("text", "value"),
    [("1e-3", 1e-3), ("-.5E2", -50.0), ("+2.e0", 2.0), ("-.5", -0.5), ("'1e-3'", "1e-3")],
)
def test_exponents_without_a_point_or_sign_are_numbers(text, value):
    assert loaded(f"a: {text}")["a"] == value
