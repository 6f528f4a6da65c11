"""The image half of a map_server map: pixels of any supported kind, without their meaning.

Every kind of pixel becomes a small integer code, and one table says how bright each code is, so
that a map costs one table look-up a cell, in strips, and never a floating-point copy of itself.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from firstfix.core.errors import MapError
from firstfix.core.grid import MAX_CELLS

# Admits the largest map seen in use (45 million cells) twice; more must be asked for.
DEFAULT_MAX_CELLS = 100_000_000
MAX_SIDE = 1 << 20

_STRIP_PIXELS = 1 << 20


class Strip(NamedTuple):
    """Some whole rows of an image.

    Parameters
    ----------
    top, bottom : int
        Rows from `top` up to but without `bottom`; row 0 is the top row of the image.
    codes : ndarray of unsigned int, shape (bottom - top, width)
        Index into the levels of the image.
    transparent : ndarray of bool of the same shape, or None
        Pixels with alpha below 255; None where all are opaque.
    """

    top: int
    bottom: int
    codes: NDArray[Any]
    transparent: NDArray[np.bool_] | None


@dataclass(frozen=True, eq=False)
class MapImage:
    """An opened image, read strip by strip.

    Parameters
    ----------
    width, height : int
        Pixels.
    kind : str
        File format and layout of a pixel, for a person.
    levels : ndarray of int64, shape (n_codes,)
        Brightness of each pixel code, 0 to `white`; colours are the sum of their channels.
    white : int
        Brightness of white.
    has_alpha : bool
        Pixels can be transparent.
    read : callable
        Takes (top, bottom), gives the codes and the transparency of these rows.
    """

    width: int
    height: int
    kind: str
    levels: NDArray[np.int64]
    white: int
    has_alpha: bool
    read: Callable[[int, int], tuple[NDArray[Any], NDArray[np.bool_] | None]]

    def strips(self) -> Iterator[Strip]:
        """Yield the image from top to bottom, about a million pixels at a time."""
        rows = max(1, _STRIP_PIXELS // self.width)
        for top in range(0, self.height, rows):
            bottom = min(top + rows, self.height)
            yield Strip(top, bottom, *self.read(top, bottom))


def check_size(path: Path, width: int, height: int, max_cells: int) -> None:
    """Refuse an image by the size in its header, before memory is spent on it.

    Raises
    ------
    MapError
        If it has no pixel, more than `max_cells` or more than `MAX_SIDE` in a row or column.
    """
    received = f"{width} x {height} pixels in {path}"
    if width < 1 or height < 1:
        raise MapError(
            expected="an image of at least one pixel",
            received=received,
            remedy="save the map again",
        )
    limit = min(max_cells, MAX_CELLS)
    if width * height > limit or max(width, height) > MAX_SIDE:
        raise MapError(
            expected=f"an image of at most {limit} pixels and {MAX_SIDE} a side",
            received=received,
            remedy=f"crop the map, or pass max_cells of up to {MAX_CELLS} if you trust the file",
        )
