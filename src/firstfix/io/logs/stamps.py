"""Scans in the order of their stamps."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

# Who asks for the first scans of a log gets the first by stamp, as if all had been read and sorted,
# unless one was recorded more than so many scans too late.
SORTED_AHEAD = 100


def ascending(stamps: NDArray[np.float64]) -> NDArray[np.intp]:
    """Return the order that sorts stamps, shape (n,); equal stamps keep theirs."""
    return np.argsort(stamps, kind="stable")


def sorting_notes(order: NDArray[np.intp]) -> tuple[str, ...]:
    """Say whether an order, shape (n,), changed anything: scan numbers differ from the file's."""
    steps_back = int(np.count_nonzero(np.diff(order) < 0))
    if not steps_back:
        return ()
    return (f"stamps step back {steps_back} time(s) in the file: scans were sorted by stamp",)
