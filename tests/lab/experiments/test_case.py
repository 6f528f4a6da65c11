"""Cases: which truth counts, which scans, which building next."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from firstfix.core.errors import InputError
from firstfix.core.recording import Recording
from firstfix.core.scan import LaserScan
from firstfix.lab.experiments.case import Case, evenly_spaced, known_truth, next_elsewhere


@given(st.integers(1, 200), st.integers(1, 50))
def test_evenly_spaced_keeps_both_ends_and_repeats_nothing(n: int, limit: int) -> None:
    kept = evenly_spaced(np.arange(n), limit)
    assert len(kept) == min(n, limit)
    assert kept[0] == 0
    assert (np.diff(kept) > 0).all()
    if limit > 1:
        assert kept[-1] == n - 1


def test_no_limit_keeps_all() -> None:
    assert evenly_spaced(np.arange(7), 0).tolist() == list(range(7))


def test_the_next_case_elsewhere_goes_round_the_list(case: Case) -> None:
    a, b, c = (replace(case, name=n, site=s) for n, s in (("a", "x"), ("b", "x"), ("c", "y")))
    assert next_elsewhere([a, b, c], 0) is c
    assert next_elsewhere([a, b, c], 2) is a
    assert next_elsewhere([a, b], 0) is None


def test_a_case_needs_truth_somewhere(case: Case, cross: LaserScan) -> None:
    assert known_truth(case, case.recording()).shape == (5, 3)
    for truth in (None, np.full((1, 3), np.nan)):
        with pytest.raises(InputError, match="case hall with true poses"):
            known_truth(case, Recording((cross,), truth=truth))
