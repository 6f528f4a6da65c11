"""The kernels of the belief over the whole map."""

from __future__ import annotations

import counts
import limits
import numpy as np
from kernel import Kernel
from numpy.typing import NDArray

from firstfix.belief import adjust, merge, scan_matching
from firstfix.core.scan import LaserScan
from firstfix.fields.map_fields import MapFields
from firstfix.global_localization import places
from firstfix.global_localization.beams import Beams, usable_beams
from firstfix.global_localization.search import search

PLACES = 600


def kernels(fields: MapFields, scan: LaserScan, rng: np.random.Generator) -> list[Kernel]:
    """All of firstfix.belief; places are those of a search, each twice and a little apart."""
    beams = usable_beams(scan)
    found = search(beams, fields, PLACES, 1 << 40)[0].poses
    twice = np.concatenate([found, found + rng.normal(0.0, [2.0, 2.0, 0.02], found.shape)])
    return [
        _merged(twice, fields, rng),
        _adjusted(twice, beams.hits(), fields),
        _directed(scan),
        _compared(scan),
    ]


def _merged(poses: NDArray[np.float64], fields: MapFields, rng: np.random.Generator) -> Kernel:
    n, order = len(poses), rng.permutation(len(poses))
    near = places.SAME_PLACE_M / fields.grid.resolution, places.SAME_PLACE_RAD
    seen, compared = counts.pairs(poses, order, *near, n)
    ids = np.arange(n)
    return Kernel(
        function=merge._merge,
        parts=(),
        unit="pair of poses",
        units=float(compared),
        call=lambda: merge._merge(poses, order, ids, (0, n // 2), *near, n),
        working_set=float(poses.nbytes),
        moved=32 * seen / compared + 32,
        operations=11,
        roofs={
            "arithmetic": ((limits.operations("f64"), 11),),
            "looking up": ((limits.gather(poses.nbytes), 1),),
        },
    )


def _adjusted(poses: NDArray[np.float64], hits: Beams, fields: MapFields) -> Kernel:
    used, resolution = hits.thinned(adjust._BEAMS), fields.grid.resolution
    ends_x, ends_y = np.ascontiguousarray(used.ends.T / resolution)
    sigmas = np.geomspace(adjust._FIRST_SIGMA_M, adjust._LAST_SIGMA_M, adjust._ROUNDS) / resolution
    around = 4.0 * (2.0 * float(used.ranges.max()) / resolution) ** 2
    return Kernel(
        function=adjust._descend,
        parts=(),
        unit="beam of a round",
        units=float(len(poses) * len(sigmas) * len(used)),
        call=lambda: adjust._descend(
            poses.copy(), ends_x, ends_y, fields.squares, fields.distances, sigmas, (4.0, 400.0)
        ),
        working_set=around,
        moved=2 * 8 + 4 * (2 + 4),
        operations=62,
        roofs={
            "looking up": ((limits.gather(around), 4), (limits.gather(2000), 4)),
            "arithmetic": ((limits.operations("f64"), 60), (limits.calls("division"), 2)),
        },
    )


def _directed(scan: LaserScan) -> Kernel:
    walls = scan_matching._walls(scan)
    farthest = np.full(len(walls.ends), scan_matching._ONE_WALL_M)
    gaps = 2 * scan_matching._NEIGHBOURS
    return Kernel(
        function=scan_matching._normals,
        parts=(),
        unit="end point",
        units=float(len(walls.ends)),
        call=lambda: scan_matching._normals(walls.ends, farthest),
        working_set=float(2 * walls.ends.nbytes + farthest.nbytes),
        moved=2 * 16 + 8,
        operations=6 * gaps + 8,
        roofs={
            "arithmetic": (
                (limits.operations("f64"), 5 * gaps + 4),
                (limits.calls("sqrt"), gaps + 1),
                (limits.calls("division"), 2),
            ),
        },
    )


def _compared(scan: LaserScan) -> Kernel:
    points, walls = scan_matching._end_points(scan), scan_matching._walls(scan)
    arrays = (walls.ends, walls.bearings, walls.ranges, walls.normals, walls.origin)
    size = float(sum(array.nbytes for array in arrays))
    step, gate, sigma = np.array([0.05, 0.0, 0.02]), 0.25, 0.05
    gradient, curvature = np.zeros(3), np.zeros((3, 3))
    # The nearest end point, and one on each side to know it; a search of their directions.
    seen, halvings = 3, np.log2(len(walls.bearings))
    return Kernel(
        function=scan_matching._add_points,
        parts=(),
        unit="point",
        units=float(len(points)),
        call=lambda: scan_matching._add_points(
            step, points, arrays, gate, sigma, gradient, curvature
        ),
        working_set=size,
        moved=16 + seen * 24 + 16,
        operations=40 + 12 * seen,
        roofs={
            "looking up": ((limits.gather(size), halvings + 2 * seen),),
            "arithmetic": (
                (limits.operations("f64"), 40 + 10 * seen),
                (limits.calls("sin + cos"), seen),
                (limits.calls("division"), 2),
            ),
        },
    )
