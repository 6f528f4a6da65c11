"""Drives on random floors as cases."""

from __future__ import annotations

import numpy as np
import pytest

from firstfix.core.errors import InputError
from firstfix.lab.experiments.floor_cases import floor_case, parse_floors


@pytest.mark.parametrize(
    ("text", "seeds"), [(None, []), ("7", [7]), ("7-7", [7]), ("1000-1002", [1000, 1001, 1002])]
)
def test_floors_are_named_by_their_seeds(text, seeds):
    assert list(parse_floors(text)) == seeds


@pytest.mark.parametrize("text", ["", "-", "3-", "-3", "5-4", "a-b", "1-2-3", "0-10000", "9" * 30])
def test_what_is_no_range_of_seeds_is_refused(text):
    with pytest.raises(InputError, match="--floors FIRST-LAST"):
        parse_floors(text)


def test_floors_are_different_buildings():
    cases = [floor_case(seed) for seed in (3, 4)]
    assert [case.name for case in cases] == [case.site for case in cases]
    assert cases[0].name != cases[1].name
    assert {case.kind for case in cases} == {"drawn"}


@pytest.mark.slow
def test_a_drive_on_a_floor_is_a_recording_with_odometry_and_truth():
    case = floor_case(2)
    drive, again = case.recording(), case.recording()
    assert drive.odometry is not None
    assert drive.truth is not None
    assert len(drive) >= 600
    assert np.isfinite(drive.truth).all()
    np.testing.assert_array_equal(drive.truth, again.truth)
    np.testing.assert_array_equal(drive.scans[-1].ranges, again.scans[-1].ranges)
