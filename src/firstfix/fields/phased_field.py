"""A field laid out so that a whole row of positions reads it contiguously.

For one heading, the end point of a beam lies at one fixed offset from the robot, wherever the robot
is: the scores of all positions are a sum of shifted copies of a field. Positions are several cells
apart, so the field is split by the remainders of row and column (its phases), in each of which
neighbouring positions read neighbouring values.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

# Rows are read in whole vectors and tiles, also beyond the edge of the map.
_SLACK_ROWS = 17
_SLACK = 64

# Bytes of the numbers before the values in a packed field: values stay aligned.
_HEAD_BYTES = 64


@dataclass(frozen=True, eq=False)
class PhasedField:
    """A two-dimensional field by phases, with a margin.

    Parameters
    ----------
    values : ndarray, one-dimensional
        Phase after phase, each of ``rows`` x ``columns`` values.
    side : int
        Side of a cell of this field, in cells of the map.
    phases : int
        Cells of this field to the side of a block.
    rows, columns : int
        Size of a phase in blocks, margin included.
    margin : int
        Blocks around the map: beams may end that far outside.
    """

    values: NDArray[Any]
    side: int
    phases: int
    rows: int
    columns: int
    margin: int

    def offsets(self, dy: NDArray[np.float64], dx: NDArray[np.float64]) -> NDArray[np.int64]:
        """Index of an end point relative to `base` of the position's block.

        Parameters
        ----------
        dy, dx : ndarray
            The end point, seen from the lower left corner of the block, cells of the map.

        Returns
        -------
        ndarray of int64
            Offsets into ``values``.
        """
        row = np.floor(dy / self.side).astype(np.int64)
        column = np.floor(dx / self.side).astype(np.int64)
        phase = (row % self.phases) * self.phases + column % self.phases
        return (phase * self.rows + row // self.phases) * self.columns + column // self.phases

    def packed(self) -> NDArray[np.uint8]:
        """Return all of it as one array of bytes, for a file; the values are bytes."""
        numbers = [self.side, self.phases, self.rows, self.columns, self.margin]
        head = np.zeros(_HEAD_BYTES, np.uint8)
        head.view(np.int64)[: len(numbers)] = numbers
        return np.concatenate([head, self.values])

    @classmethod
    def unpacked(cls, packed: NDArray[np.uint8]) -> PhasedField:
        """Return the field of an array that `packed` made."""
        return cls(packed[_HEAD_BYTES:], *packed[:_HEAD_BYTES].view(np.int64)[:5].tolist())

    def base(self, row: NDArray[np.int32], column: NDArray[np.int32]) -> NDArray[np.int64]:
        """Index into ``values`` of the first cell of blocks (row, column)."""
        return (row.astype(np.int64) + self.margin) * self.columns + column + self.margin


def lay_out(field: NDArray[Any], side: int, phases: int, margin: int) -> PhasedField:
    """Split a field that carries its margin already.

    Parameters
    ----------
    field : ndarray, shape (height, width)
        Values; the margin of ``margin * phases`` cells on each side included.
    side : int
        Side of a cell of this field, in cells of the map.
    phases : int
        Cells of this field to the side of a block.
    margin : int
        Blocks around the map.

    Returns
    -------
    PhasedField
        The same values by phases.
    """
    rows, columns = (-(-n // phases) for n in field.shape)
    size = phases * phases * rows * columns
    values = np.zeros(size + _SLACK_ROWS * columns + _SLACK, field.dtype)
    split = values[:size].reshape(phases, phases, rows, columns)
    for y in range(phases):
        for x in range(phases):
            part = field[y::phases, x::phases]
            split[y, x, : part.shape[0], : part.shape[1]] = part
    return PhasedField(values, side, phases, rows, columns, margin)
