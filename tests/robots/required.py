"""What FIRSTFIX_REQUIRE turns from a skip into a failure."""

import os

import pytest

REQUIRED = set(filter(None, os.environ.get("FIRSTFIX_REQUIRE", "").split(",")))


def missing(part: str, why: str) -> None:
    """Skip because of a missing dependency; fail if FIRSTFIX_REQUIRE names it."""
    if part in REQUIRED:
        pytest.fail(f"FIRSTFIX_REQUIRE asks for {part}: {why}")
    pytest.skip(why)
