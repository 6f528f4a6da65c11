"""A case: a map, scans taken in it, and where they were taken."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from firstfix.core.errors import InputError
from firstfix.core.grid import OccupancyGrid
from firstfix.core.recording import Recording
from firstfix.core.se2 import SE2


@dataclass(frozen=True, slots=True)
class Case:
    """A case that is loaded where it is needed: small enough to send to another process.

    Parameters
    ----------
    name : str
        Its name in tables.
    site : str
        Cases with one site are the same building.
    kind : str
        Where the scans come from, such as ``real`` or ``sim``.
    grid : callable
        Loads the map.
    recording : callable
        Loads the scans with their truth.
    """

    name: str
    site: str
    kind: str
    grid: Callable[[], OccupancyGrid]
    recording: Callable[[], Recording]


def next_elsewhere(cases: list[Case], i: int) -> Case | None:
    """Return the next case after case i, round the list, that is another building; None if none."""
    for other in cases[i + 1 :] + cases[:i]:
        if other.site != cases[i].site:
            return other
    return None


def known_truth(case: Case, recording: Recording) -> NDArray[np.float64]:
    """Return the truth of a case.

    Parameters
    ----------
    case : Case
        The case.
    recording : Recording
        Its scans.

    Returns
    -------
    ndarray, shape (n_scans, 3)
        ``T_map_base``: x (m), y (m), yaw (rad); NaN rows where it is not known.

    Raises
    ------
    InputError
        If it is not known at any scan.
    """
    if recording.truth is None or not np.isfinite(recording.truth).all(axis=1).any():
        raise InputError(
            expected=f"case {case.name} with true poses",
            received="a recording without",
            remedy="add `true_pose` to its scans.npz, or leave the case out",
        )
    return recording.truth


def truth_at(recording: Recording, index: int) -> SE2 | None:
    """Return ``T_map_base`` at a scan; None where the log does not know it."""
    if recording.truth is None or not np.isfinite(recording.truth[index]).all():
        return None
    return SE2.from_array(recording.truth[index])


def evenly_spaced(indices: NDArray[np.intp], limit: int) -> NDArray[np.intp]:
    """Thin out indices evenly, first and last kept, to at most ``limit`` (0: all)."""
    if limit <= 0 or len(indices) <= limit:
        return indices
    return indices[np.linspace(0, len(indices) - 1, limit).round().astype(np.intp)]
