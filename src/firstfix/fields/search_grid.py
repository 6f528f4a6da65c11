"""The positions of the search: free blocks of cells, sorted into tiles.

A block of ``stride`` x ``stride`` cells is one position. Positions are stored tile by tile
(16 rows x 64 columns of blocks), so that the data of a tile lies together in memory and the
inner loops have a fixed length that compiles to vector instructions without a remainder.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from firstfix.core.grid import OccupancyGrid

TILE_ROWS = 16
TILE_COLUMNS = 64

# Half a robot's width: at the nearest position the map predicts nearly the same scan.
SPACING_M = 0.2

# Above this the table of expected ranges exceeds 200 MB and the search half a second: a first look
# chooses where to search.
MAX_POSITIONS = 800_000


@dataclass(frozen=True, eq=False)
class SearchGrid:
    """Positions of a search, sorted by tile, then row, then column.

    Parameters
    ----------
    stride : int
        Side of a block, cells.
    rows, columns : ndarray of int32, shape (n,)
        Block coordinates.
    tile_rows, tile_columns : ndarray of int32, shape (t,)
        Block coordinates of each tile's first row and column.
    tile_starts : ndarray of int64, shape (t + 1,)
        Positions ``tile_starts[i]`` to ``tile_starts[i + 1]`` belong to tile i.
    """

    stride: int
    rows: NDArray[np.int32]
    columns: NDArray[np.int32]
    tile_rows: NDArray[np.int32]
    tile_columns: NDArray[np.int32]
    tile_starts: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.rows)

    @cached_property
    def in_tile(self) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
        """Row and column of every position in its tile, each of shape (n,)."""
        return self.rows % np.int32(TILE_ROWS), self.columns % np.int32(TILE_COLUMNS)

    def packed(self) -> NDArray[np.int32]:
        """Return all of it as one array, for a file."""
        parts = (self.rows, self.columns, self.tile_rows, self.tile_columns, self.tile_starts)
        head = np.array([self.stride, len(self.rows), len(self.tile_rows)], np.int32)
        return np.concatenate([head, *(part.astype(np.int32) for part in parts)])

    @classmethod
    def unpacked(cls, packed: NDArray[np.int32]) -> SearchGrid:
        """Return the positions of an array that `packed` made."""
        stride, n, tiles = packed[:3].tolist()
        rows, columns, tile_rows, tile_columns, tile_starts = np.split(
            packed[3:], np.cumsum([n, n, tiles, tiles])
        )
        starts = tile_starts.astype(np.int64)
        return cls(stride, rows, columns, tile_rows, tile_columns, starts)

    @property
    def offset(self) -> float:
        """Place of a position in its block, cells: the middle of the block's central cell."""
        return self.stride // 2 + 0.5

    def centres(self, index: NDArray[np.int64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Cell coordinates (x, y), each of shape (n,), of positions given by their index."""
        columns, rows = self.columns[index].astype(np.float64), self.rows[index].astype(np.float64)
        return columns * self.stride + self.offset, rows * self.stride + self.offset


def build_search_grid(grid: OccupancyGrid) -> SearchGrid:
    """Choose the positions to search in a map.

    A block counts where its central cell is free, or no wall and at least half of the block is
    free. The spacing is 0.2 m.

    Parameters
    ----------
    grid : OccupancyGrid
        The map.

    Returns
    -------
    SearchGrid
        The positions; none if nothing is free.
    """
    # Even, so that the end-point field can have two cells to a block; 1 if cells are coarse.
    stride = max(1, 2 * round(SPACING_M / 2 / grid.resolution))
    blocks = _free_blocks(grid.seen_free, grid.occupied, stride)
    rows, columns = (index.astype(np.int32) for index in np.nonzero(blocks))
    tiles_across = -(-blocks.shape[1] // TILE_COLUMNS)
    tile = (rows // TILE_ROWS).astype(np.int64) * tiles_across + columns // TILE_COLUMNS
    order = np.argsort(tile, kind="stable")
    tiles, starts = np.unique(tile[order], return_index=True)
    return SearchGrid(
        stride=stride,
        rows=rows[order],
        columns=columns[order],
        tile_rows=(tiles // tiles_across * TILE_ROWS).astype(np.int32),
        tile_columns=(tiles % tiles_across * TILE_COLUMNS).astype(np.int32),
        tile_starts=np.append(starts, len(rows)).astype(np.int64),
    )


def _free_blocks(
    free: NDArray[np.bool_], occupied: NDArray[np.bool_], stride: int
) -> NDArray[np.bool_]:
    height, width = free.shape
    starts = (np.arange(0, n, stride) for n in (height, width))
    counts = free.view(np.uint8)
    for axis, start in enumerate(starts):
        counts = np.add.reduceat(counts, start, axis=axis, dtype=np.int32)
    # A block on the upper or right edge may have no central cell.
    middle = slice(stride // 2, None, stride)
    centres, walls = free[middle, middle], occupied[middle, middle]
    rows, columns = centres.shape
    blocks = np.zeros(counts.shape, np.bool_)
    half_free = 2 * counts[:rows, :columns] >= stride * stride
    blocks[:rows, :columns] = ~walls & (centres | half_free)
    return blocks
