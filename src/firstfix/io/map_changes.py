"""Counts of hits and passes in files, one for each day and map."""

from __future__ import annotations

import io
import os
import zipfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firstfix.changes.counts import DayCounts
from firstfix.core.errors import InputError
from firstfix.core.grid import OccupancyGrid
from firstfix.io.atomic_files import replace_file, unreachable
from firstfix.io.saved_pose import map_key

_ARRAYS = ("hits", "near", "passes")
_NUMBERS = ("day", "views", "beams", "explained")
_MOST_DAYS = 366
_MOST_NUMBER = 2**40
_PATTERN = "counts-*.npz"


def save_counts(
    days: Sequence[DayCounts], grid: OccupancyGrid, folder: str | os.PathLike[str]
) -> list[Path]:
    """Write the counts of each day to ``counts-DATE.npz``, each file completely or not at all.

    Parameters
    ----------
    days : sequence of DayCounts
        Counted in ``grid``.
    grid : OccupancyGrid
        The map; its hash is saved, too.
    folder : path-like
        An existing folder; files of these days are replaced.

    Raises
    ------
    InputError
        If a file cannot be written.
    """
    paths = []
    for counts in days:
        buffer = io.BytesIO()
        arrays = {name: getattr(counts, name) for name in (*_ARRAYS, *_NUMBERS)}
        np.savez_compressed(buffer, map_key=np.array(map_key(grid)), **arrays)
        paths.append(Path(folder) / f"counts-{counts.date}.npz")
        replace_file(paths[-1], [buffer.getvalue()])
    return paths


def load_counts(folder: str | os.PathLike[str], grid: OccupancyGrid) -> list[DayCounts]:
    """Read the counts of all days in a folder, oldest first.

    Parameters
    ----------
    folder : path-like
        Where `save_counts` wrote.
    grid : OccupancyGrid
        The map in which they were counted.

    Raises
    ------
    InputError
        If there are none, or a file is damaged or belongs to another map.
    """
    try:
        paths = sorted(Path(folder).glob(_PATTERN))
    except (OSError, ValueError):
        paths = []
    if not 0 < len(paths) <= _MOST_DAYS:
        raise InputError(
            f"{folder} has {len(paths)} files {_PATTERN}. Pass the folder that an earlier "
            "'firstfix map changes --out' wrote."
        )
    return sorted((_load(path, grid) for path in paths), key=lambda counts: counts.day)


def _load(path: Path, grid: OccupancyGrid) -> DayCounts:
    arrays = _unpack(path, grid.cells.size)
    if str(arrays["map_key"]) != map_key(grid):
        raise InputError(
            f"{path} was counted in another map, or this map was redrawn since. Leave it out."
        )
    shape = grid.cells.shape
    numbers = {name: arrays[name] for name in _NUMBERS}
    if any(arrays[name].dtype != np.uint16 or arrays[name].shape != shape for name in _ARRAYS):
        raise _damaged(path)
    if any(n.shape != () or n.dtype.kind not in "iu" for n in numbers.values()):
        raise _damaged(path)
    day, views, beams, explained = (int(number) for number in numbers.values())
    if not (abs(day) <= _MOST_DAYS * 1000 and 0 <= explained <= beams <= _MOST_NUMBER):
        raise _damaged(path)
    if not 0 <= views <= _MOST_NUMBER:
        raise _damaged(path)
    hits, near, passes = (arrays[name] for name in _ARRAYS)
    return DayCounts(day, hits, near, passes, views, beams, explained)


def _unpack(path: Path, cells: int) -> dict[str, NDArray[Any]]:
    """Unpack the arrays, after a check of the sizes that the archive states."""
    wanted = (*_ARRAYS, *_NUMBERS, "map_key")
    # Three arrays of two bytes, and headers.
    limit = 6 * cells + 10_000
    try:
        with path.open("rb") as file:
            with zipfile.ZipFile(file) as archive:
                sizes = {info.filename: info.file_size for info in archive.infolist()}
            if sum(sizes[f"{name}.npy"] for name in wanted) > limit:
                raise _damaged(path)
            file.seek(0)
            with np.load(file, allow_pickle=False) as unpacked:
                return {name: unpacked[name] for name in wanted}
    except InputError:
        raise
    except OSError as error:
        raise unreachable(path, error) from error
    except Exception as error:
        raise _damaged(path) from error


def _damaged(path: Path) -> InputError:
    return InputError(
        f"{path} has no counts of this map: it is damaged or another file. Remove it."
    )
