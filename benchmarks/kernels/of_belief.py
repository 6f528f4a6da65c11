"""The kernels of the belief over the whole map."""

from __future__ import annotations

import counts
import limits
import numpy as np
from kernel import Kernel
from numpy.typing import NDArray

from firstfix.belief import adjust, merge
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
    return [_merged(twice, fields, rng), _adjusted(twice, beams.hits(), fields)]


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
