"""Names that can be part of a topic."""

from __future__ import annotations

import pytest

from firstfix.core.errors import InputError
from firstfix.vda5050.identity import Identity, Version


def test_topics():
    assert Identity("ACME", "0001").topic("state") == "uagv/v2/ACME/0001/state"
    assert Identity("A B", "a_.:-Z", Version.V3).topic("state") == "vda5050/v3/A B/a_.:-Z/state"


@pytest.mark.parametrize("name", ["", "a/b", "+", "#", "a$", "a\0", "a\n", "x" * 200, "\ud800"])
def test_manufacturers_that_are_none(name: str):
    with pytest.raises(InputError, match="manufacturer"):
        Identity(name, "0001")


@pytest.mark.parametrize("name", ["", "a b", "a/b", "é", "1\n", "x" * 200, "#"])
def test_serial_numbers_that_are_none(name: str):
    with pytest.raises(InputError, match="serial number"):
        Identity("ACME", name)
