"""The occupancy grid: occupied, free and unknown cells."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from firstfix.core.angles import angle_error
from firstfix.core.arguments import as_instance, as_pose
from firstfix.core.errors import MapError
from firstfix.core.se2 import SE2

UNKNOWN = -1
FREE = 0
OCCUPIED = 100

# Thresholds of map_server in per cent (occupied_thresh 0.65, free_thresh 0.25), for the
# probabilities that SLAM systems publish.
OCCUPIED_FROM = 65
FREE_UP_TO = 25

# A float32 distance field of this many cells takes 2 GB: larger maps are an error or an attack.
MAX_CELLS = 500_000_000

# Files write the yaw of a map with at least this many digits.
_SAME_YAW_RAD = 1e-4


@dataclass(frozen=True, eq=False)
class OccupancyGrid:
    """A map of square cells, with the values of ``nav_msgs/OccupancyGrid``.

    Parameters
    ----------
    cells : ndarray of int8, shape (height, width)
        -1 unknown, 0 free ... 100 occupied; row 0 is the bottom row. Made read-only.
    resolution : float
        Side of a cell, m.
    T_map_grid : SE2
        Pose of the lower-left *corner* of cell (0, 0) in the map frame. A tuple (x, y, yaw) in
        metres and radians is accepted.
    unseen : ndarray of bool, shape (height, width), or None
        Free cells that were never observed, where the file distinguishes them: map savers write
        grey 205 for unknown, which ``free_thresh: 0.25`` reads as free. Made read-only.
    changed : ndarray of bool, shape (height, width), or None
        Cells that are known to be different in the building (`with_changes`). Made read-only.

    Raises
    ------
    MapError
        If the shape, a value or the resolution is not that of a map.
    InputError
        If ``T_map_grid`` is not a pose.

    Examples
    --------
    >>> cells = np.zeros((80, 120), np.int8)  # free
    >>> cells[[0, -1]] = cells[:, [0, -1]] = 100  # walls around
    >>> room = ff.OccupancyGrid(cells, resolution=0.05, T_map_grid=(-3.0, -2.0, 0.0))
    >>> room.extent
    (-3.0, 3.0, -2.0, 2.0)
    """

    cells: NDArray[np.int8]
    resolution: float
    T_map_grid: SE2 = field(default_factory=SE2.identity)
    unseen: NDArray[np.bool_] | None = None
    changed: NDArray[np.bool_] | None = None

    def __post_init__(self) -> None:
        cells = np.ascontiguousarray(self.cells)
        if cells.ndim != 2 or cells.size == 0:
            raise MapError(
                expected="a map of at least one row and one column",
                received=f"cells of shape {cells.shape}",
                remedy="check the source image or message",
            )
        if cells.size > MAX_CELLS:
            raise MapError(
                expected=f"at most {MAX_CELLS} cells",
                received=f"{cells.shape[1]} x {cells.shape[0]} cells",
                remedy="crop the map or use a coarser resolution",
            )
        if cells.dtype != np.int8 or cells.min() < UNKNOWN or cells.max() > OCCUPIED:
            raise MapError(
                expected="int8 cells from -1 (unknown) over 0 (free) to 100 (occupied)",
                received=f"{cells.dtype} cells from {cells.min()} to {cells.max()}",
                remedy="convert the map to the values of nav_msgs/OccupancyGrid",
            )
        if not (math.isfinite(self.resolution) and self.resolution > 0.0):
            raise MapError(
                expected="a resolution above 0 m per cell",
                received=f"{self.resolution}",
                remedy="set the side of a cell in metres, such as 0.05",
            )
        if cells is self.cells and cells.flags.writeable:
            cells = cells.copy()
        cells.flags.writeable = False
        object.__setattr__(self, "cells", cells)
        object.__setattr__(self, "resolution", float(self.resolution))
        object.__setattr__(self, "T_map_grid", as_pose(self.T_map_grid, "T_map_grid"))
        for name in ("unseen", "changed"):
            mask = getattr(self, name)
            if mask is None:
                continue
            given = np.asarray(mask)
            if given.shape != cells.shape or given.dtype != np.bool_:
                raise MapError(
                    expected=f"{name} as bool of the shape of the cells, {cells.shape}",
                    received=f"{given.dtype} of shape {given.shape}",
                    remedy="leave it out if it is not known",
                )
            object.__setattr__(self, name, _read_only(given.copy()))

    @property
    def height(self) -> int:
        """Number of rows."""
        return int(self.cells.shape[0])

    @property
    def width(self) -> int:
        """Number of columns."""
        return int(self.cells.shape[1])

    @cached_property
    def occupied(self) -> NDArray[np.bool_]:
        """Occupied cells, shape (height, width)."""
        return _read_only(self.cells >= OCCUPIED_FROM)

    @cached_property
    def free(self) -> NDArray[np.bool_]:
        """Free cells by the thresholds, shape (height, width)."""
        return _read_only((self.cells >= FREE) & (self.cells <= FREE_UP_TO))

    @cached_property
    def seen_free(self) -> NDArray[np.bool_]:
        """Free cells without the unseen ones, shape (height, width): where a robot can be."""
        return self.free if self.unseen is None else _read_only(self.free & ~self.unseen)

    @cached_property
    def unknown(self) -> NDArray[np.bool_]:
        """Unknown and unseen cells, shape (height, width)."""
        unknown = self.cells == UNKNOWN
        return _read_only(unknown if self.unseen is None else unknown | self.unseen)

    def with_changes(self, layer: OccupancyGrid) -> OccupancyGrid:
        """Return this map with the cells marked that a layer shows otherwise.

        Beams that end in such a cell, or that this map lets end there, contradict a pose less.

        Parameters
        ----------
        layer : OccupancyGrid
            What ``firstfix map changes`` writes, of the same cells: occupied where something is
            new, free where a wall is gone, unknown elsewhere. A redrawn map does as well.

        Raises
        ------
        MapError
            If it has other cells than this map.

        Examples
        --------
        >>> cells = grid.cells.copy()
        >>> cells[20:24, 30:34] = 100  # a new cabinet
        >>> int(grid.with_changes(ff.OccupancyGrid(cells, grid.resolution)).changed.sum())
        16
        """
        as_instance(OccupancyGrid, layer, "layer")
        near = 0.01 * self.resolution
        is_same_place = self.T_map_grid.distance_to(layer.T_map_grid) <= near
        if not (
            layer.cells.shape == self.cells.shape
            and math.isclose(layer.resolution, self.resolution, rel_tol=1e-6)
            and is_same_place
            and angle_error(layer.T_map_grid.yaw, self.T_map_grid.yaw) <= _SAME_YAW_RAD
        ):
            raise MapError(
                f"The changes are of another map: {layer!r} at {layer.T_map_grid!r} instead of "
                f"{self!r} at {self.T_map_grid!r}. Make them anew with 'firstfix map changes'."
            )
        changed = (layer.occupied & ~self.occupied) | (layer.free & self.occupied)
        return replace(self, changed=changed)

    @property
    def extent(self) -> tuple[float, float, float, float]:
        """Bounding box in the map frame: x_min, x_max, y_min, y_max, m; for ``imshow`` too."""
        corners = [[0, 0], [self.width, 0], [0, self.height], [self.width, self.height]]
        x, y = self.to_map(np.array(corners, np.float64)).T
        return float(x.min()), float(x.max()), float(y.min()), float(y.max())

    def __repr__(self) -> str:
        sides = f"{self.width * self.resolution:.1f} x {self.height * self.resolution:.1f} m"
        cells = f"{self.width} x {self.height} cells of {self.resolution:g} m"
        return f"<OccupancyGrid {sides}, {cells}>"

    @property
    def free_area(self) -> float:
        """Area of the cells in `seen_free`, m²."""
        return float(np.count_nonzero(self.seen_free)) * self.resolution**2

    def to_cells(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Convert points of the map frame to continuous cell coordinates.

        Parameters
        ----------
        points : ndarray, shape (..., 2)
            x, y in the map frame, m.

        Returns
        -------
        ndarray, shape (..., 2)
            (column, row) with fractions; the cell itself is the floor of both.
        """
        return self.T_map_grid.inverse().apply(points) / self.resolution

    def to_map(self, cells: NDArray[np.float64]) -> NDArray[np.float64]:
        """Convert cell coordinates (column, row), shape (..., 2), to points of the map frame, m."""
        return self.T_map_grid.apply(cells * self.resolution)


def _read_only(array: NDArray[np.bool_]) -> NDArray[np.bool_]:
    array.flags.writeable = False
    return array
