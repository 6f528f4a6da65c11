"""Errors state expected, received and remedy, also after pickling."""

import pickle

import pytest

from firstfix.core.errors import FirstfixError, InputError, MapError, ScanError


@pytest.mark.parametrize("kind", [InputError, MapError, ScanError])
def test_an_input_error_is_one_sentence(kind: type[InputError]) -> None:
    error = kind(expected="a map", received="a cat", remedy="draw a map")
    assert str(error) == "expected a map, received a cat; draw a map"
    assert isinstance(error, FirstfixError)
    assert isinstance(error, InputError)


@pytest.mark.parametrize("kind", [InputError, MapError, ScanError])
def test_an_input_error_survives_pickling(kind: type[InputError]) -> None:
    error = kind(expected="a map", received="a cat", remedy="draw a map")
    copy = pickle.loads(pickle.dumps(error))  # noqa: S301 - our own bytes
    assert type(copy) is kind
    assert str(copy) == str(error)
    assert (copy.expected, copy.received, copy.remedy) == ("a map", "a cat", "draw a map")
