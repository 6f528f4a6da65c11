"""The paper's own method, exactly: the Manhattan score of every pose on a grid, the lowest wins.

PoseScore (paper, eq. 3) is the sum over the beams of *pointscore*, the Manhattan distance from the
cell a beam ends in to the nearest occupied cell. Beams without a return, or longer than the map,
take no part. Positions are
cell centres and yaw follows REP 103 (docs/decisions/0002 translates the paper's equations).
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from firstfix.core.angles import FULL_TURN
from firstfix.core.estimate import Hypothesis, LocateResult, SearchReport, Verdict
from firstfix.core.scan import LaserScan
from firstfix.fields.kernel_cache import kernel
from firstfix.fields.map_fields import MapFields
from firstfix.fields.phased_field import PhasedField, lay_out
from firstfix.global_localization.beams import Beams, usable_beams
from firstfix.global_localization.frames import to_map
from firstfix.global_localization.places import distinct_places
from firstfix.global_localization.verdict import nothing_to_match
from firstfix.global_localization.verify import verify


@dataclass(frozen=True, slots=True)
class PoseGrid:
    """The poses that the paper tries.

    Parameters
    ----------
    stride : int
        Side of a block of cells; its centre is one position.
    headings : int
        Evenly spaced headings, the first along the grid's x axis.
    """

    stride: int
    headings: int


BASIC = PoseGrid(stride=1, headings=360)
FAST = PoseGrid(stride=4, headings=24)

_HYPOTHESES = 10

# No 2D LIDAR measures farther. Memory grows with the square of the longest beam.
_LONGEST_M = 100.0

# Eight of these fit uint16: twice as many to a vector as uint32.
_SUMMED_NARROW = 65535 // 8

# Rows are summed in whole vectors.
_CHUNK = 32

# Blocks around the map in the smallest layout; doubled until the longest beam ends inside.
_LEAST_MARGIN = 64


class ExhaustiveSearch:
    """Finds the pose of lowest PoseScore in one map.

    Keeps the map's pointscore laid out for the longest beam seen so far: laying it out takes longer
    than a search, and the scans of one sensor share it.

    Parameters
    ----------
    fields : MapFields
        The prepared map.
    poses : PoseGrid
        `BASIC` (every free cell, every degree) or `FAST` (blocks of 4 x 4 cells, 15 degrees).
    """

    def __init__(self, fields: MapFields, poses: PoseGrid) -> None:
        self._fields = fields
        self._poses = poses
        self._layout: PhasedField | None = None

    def locate(self, scan: LaserScan) -> LocateResult:
        """Find the pose of lowest PoseScore.

        Parameters
        ----------
        scan : LaserScan
            The scan, with the sensor's pose on the robot.

        Returns
        -------
        LocateResult
            The paper always publishes the lowest pose: UNIQUE, with probability 1,
            while the next lowest places are listed with probability 0; NO_MATCH if no beam hit.
        """
        started = time.perf_counter()
        fields, poses = self._fields, self._poses
        hits = usable_beams(scan, longest_m=_longest(fields)).hits()
        if len(hits) == 0:
            return nothing_to_match(len(scan), 0, 1, time.perf_counter() - started)
        tried, scores = self.pose_scores(hits)
        ranked = distinct_places(tried, scores, fields.grid.resolution, _HYPOTHESES)
        verification = verify(tried[ranked], usable_beams(scan), fields)
        spread = np.diag([poses.stride, poses.stride, FULL_TURN / poses.headings])
        hypotheses = tuple(
            Hypothesis(
                *to_map(fields.grid, scan, tried[i], spread**2 / 12.0),
                score=float(scores[i]) / len(hits),
                probability=1.0 if k == 0 else 0.0,
                evidence=verification.evidence(k),
            )
            for k, i in enumerate(ranked)
        )
        return LocateResult(
            verdict=Verdict.UNIQUE,
            reason="lowest PoseScore; the paper's method always publishes it",
            hypotheses=hypotheses,
            search=SearchReport(len(tried) * poses.headings, 1.0, proven=True),
            elapsed_s=time.perf_counter() - started,
        )

    def pose_scores(self, hits: Beams) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """Score every pose, and keep the best heading of each position.

        Parameters
        ----------
        hits : Beams
            Beams that met a surface, in the sensor frame.

        Returns
        -------
        tried : ndarray, shape (n, 3)
            x, y (cells), heading (rad) of the sensor in the grid, one row for each block that has a
            free cell, in the order of rows and columns.
        scores : ndarray of int64, shape (n,)
            PoseScore, cells; lower is better.
        """
        grid = self._fields.grid
        stride, headings = self._poses.stride, self._poses.headings
        cells = hits.ranges / grid.resolution
        field = self.layout(float(cells.max()))
        angles = hits.bearings + np.arange(headings)[:, None] * (FULL_TURN / headings)
        # The centre of a block of even side is a corner of cells: the cell above and right of it.
        offsets = field.offsets(
            stride / 2 + cells * np.sin(angles), stride / 2 + cells * np.cos(angles)
        )
        rows, columns = np.nonzero(_has_free_cell(grid.seen_free, stride))
        spans = _spans(rows.astype(np.int32), columns.astype(np.int32))
        best = np.empty((-(-grid.height // stride), field.columns + _CHUNK), np.int64)
        _lowest(field.values, field.base(spans[0], spans[1]), spans, offsets, best)
        word = best[rows, columns]
        tried = np.column_stack(
            [
                columns * stride + stride / 2,
                rows * stride + stride / 2,
                (word % headings) * (FULL_TURN / headings),
            ]
        )
        return tried, word // headings

    def layout(self, longest_cells: float) -> PhasedField:
        """Return pointscore by phases, with a margin for beams of this length, cells."""
        stride, kept = self._poses.stride, self._layout
        if kept is None or kept.margin * stride <= longest_cells + stride:
            margin = _LEAST_MARGIN
            while margin * stride <= longest_cells + stride:
                margin *= 2
            around = _continued(self._fields.pointscore, margin * stride)
            if around.max() > _SUMMED_NARROW:
                around = around.astype(np.uint32)
            kept = self._layout = lay_out(around, 1, stride, margin)
        return kept


def _longest(fields: MapFields) -> float:
    # A beam longer than the map ends outside it from every pose.
    grid = fields.grid
    return min(_LONGEST_M, math.hypot(grid.width, grid.height) * grid.resolution)


def _continued(pointscore: NDArray[np.uint16], margin: int) -> NDArray[np.uint16]:
    """Extend pointscore beyond the map.

    The shortest 4-connected path from outside to a wall leads through the nearest cell of the map.
    """
    height, width = pointscore.shape
    beyond_y, beyond_x = (
        np.maximum(0, np.maximum(-i, i - n + 1))
        for n in (height, width)
        for i in (np.arange(-margin, n + margin),)
    )
    around = np.pad(pointscore, margin, mode="edge")
    around += (beyond_y[:, None] + beyond_x[None, :]).astype(np.uint16)
    return around


def _has_free_cell(free: NDArray[np.bool_], stride: int) -> NDArray[np.bool_]:
    height, width = free.shape
    padded = np.pad(free, ((0, -height % stride), (0, -width % stride)))
    blocks = padded.reshape(-(-height // stride), stride, -(-width // stride), stride)
    return np.asarray(blocks.any(axis=(1, 3)))


def _spans(rows: NDArray[np.int32], columns: NDArray[np.int32]) -> NDArray[np.int32]:
    """First and one past the last free column of every row, shape (3, n): row, first, end."""
    used, first = np.unique(rows, return_index=True)
    last = np.append(first[1:], len(rows)) - 1
    return np.stack([used, columns[first], columns[last] + 1]).astype(np.int32)


@kernel
def _lowest(
    values: NDArray[np.uint16],
    bases: NDArray[np.int64],
    spans: NDArray[np.int32],
    offsets: NDArray[np.int64],
    best: NDArray[np.int64],
) -> None:
    """Lowest ``PoseScore * headings + heading`` of every block in the spans.

    Eight values must fit the type of the values.
    """
    headings, beams = offsets.shape
    narrow = values.dtype.type
    sums = np.empty(best.shape[1], np.uint32)
    for s in range(spans.shape[1]):
        first, base = spans[1, s], bases[s]
        chunks = (spans[2, s] - first + 31) // 32
        lowest = best[spans[0, s], first:]
        lowest[: 32 * chunks] = np.int64(2) ** 62
        for h in range(headings):
            sums[: 32 * chunks] = 0
            i = 0
            while i + 8 <= beams:
                a = values[base + offsets[h, i] :]
                b = values[base + offsets[h, i + 1] :]
                c = values[base + offsets[h, i + 2] :]
                d = values[base + offsets[h, i + 3] :]
                e = values[base + offsets[h, i + 4] :]
                f = values[base + offsets[h, i + 5] :]
                g = values[base + offsets[h, i + 6] :]
                j = values[base + offsets[h, i + 7] :]
                for chunk in range(chunks):
                    for k in range(32):
                        x = chunk * 32 + k
                        p = narrow(narrow(a[x] + b[x]) + narrow(c[x] + d[x]))
                        q = narrow(narrow(e[x] + f[x]) + narrow(g[x] + j[x]))
                        sums[x] += np.uint32(narrow(p + q))
                i += 8
            while i < beams:
                a = values[base + offsets[h, i] :]
                for x in range(32 * chunks):
                    sums[x] += np.uint32(a[x])
                i += 1
            for x in range(32 * chunks):
                word = np.int64(sums[x]) * headings + h
                lowest[x] = min(lowest[x], word)
