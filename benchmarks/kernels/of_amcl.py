"""The kernels of the particle filter."""

from __future__ import annotations

import counts
import limits
import numpy as np
from kernel import Kernel
from of_fields import LEAP_OPERATIONS, leap_roofs

from firstfix.amcl import bins, clusters, kld, likelihood_field, motion, ray_model, resampling
from firstfix.amcl.beam_selection import SelectedBeams, select_beams
from firstfix.amcl.config import AmclConfig
from firstfix.amcl.initial import around_pose
from firstfix.amcl.particles import Particles
from firstfix.core.grid import OccupancyGrid
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2

PARTICLES = 5000
SPREAD = np.diag([0.1**2, 0.1**2, np.radians(5.0) ** 2])
INCREMENT = SE2(0.25, 0.0, 0.03)

HASHED = (bins.bin_of, bins.new_table, bins.with_room, bins.key_of, bins.slot_of)


def kernels(
    grid: OccupancyGrid, pose: SE2, scan: LaserScan, rng: np.random.Generator
) -> list[Kernel]:
    """All of firstfix.amcl, on a belief around the true pose whose particles weigh differently."""
    config = AmclConfig(min_particles=100, max_particles=PARTICLES)
    belief = around_pose(pose, SPREAD, PARTICLES, rng)
    belief = belief.reweighed(rng.random(PARTICLES))
    beams = select_beams(scan, config)
    return [
        *_looked_up(grid, belief, beams, config),
        _cast(grid, belief, beams, config),
        _drive(belief, config, rng),
        _comb(belief),
        _draws(belief, config, rng),
        *_clusters(belief),
    ]


def _looked_up(
    grid: OccupancyGrid, belief: Particles, beams: SelectedBeams, config: AmclConfig
) -> list[Kernel]:
    sensor = likelihood_field.LikelihoodField(grid, config)
    poses = likelihood_field._in_cells(belief, grid)
    ends = likelihood_field._columns(beams.hits / grid.resolution)
    table, n, m = sensor._table(beams.range_max), len(belief), len(beams.hits)
    sums, counted = np.zeros(n, np.int32), np.zeros(m, np.int64)
    x, y, c, s = (values[:, None] for values in poses)
    columns = (x + c * ends[0] - s * ends[1]).clip(0, sensor.squares.shape[1] - 1)
    rows = (y + s * ends[0] + c * ends[1]).clip(0, sensor.squares.shape[0] - 1)
    cells = rows.astype(np.int64) * sensor.squares.shape[1] + columns.astype(np.int64)
    touched = 64.0 * np.unique(cells // 16).size
    roofs = {
        "looking up": ((limits.gather(touched), 1),),
        "arithmetic": ((limits.operations("f32"), 8), (limits.operations("i32"), 3)),
    }
    return [
        Kernel(
            function=likelihood_field._sum_values,
            parts=(likelihood_field._find_cells,),
            unit="beam of a particle",
            units=float(n * m),
            call=lambda: likelihood_field._sum_values(*poses, *ends, table, *sensor._shape, sums),
            working_set=touched,
            moved=4 + 16 + 8,
            operations=13,
            roofs=roofs,
        ),
        Kernel(
            function=likelihood_field._count_values,
            parts=(),
            unit="beam of a particle",
            units=float(n * m),
            call=lambda: likelihood_field._count_values(
                *poses, *ends, table, *sensor._shape, counted
            ),
            working_set=touched,
            moved=4 + 16,
            operations=13,
            roofs=roofs,
        ),
    ]


def _cast(
    grid: OccupancyGrid, belief: Particles, beams: SelectedBeams, config: AmclConfig
) -> Kernel:
    some = Particles(*(v[:500].copy() for v in (belief.x, belief.y, belief.yaw, belief.weight)))
    model = ray_model.RayModel(grid, config)
    cells = grid.to_cells(np.column_stack([some.x, some.y]))
    along = some.yaw[:, None] - grid.T_map_grid.yaw + beams.bearings
    n, reach = len(beams), beams.range_max / grid.resolution
    leaps = counts.leaps(
        model.clearance,
        np.repeat(cells[:, 0], n),
        np.repeat(cells[:, 1], n),
        np.cos(along).ravel(),
        np.sin(along).ravel(),
        np.full(along.size, reach),
    )
    each, mean_cells = leaps / along.size, float(beams.ranges.mean() / grid.resolution)
    return Kernel(
        function=ray_model._log_of_mixture,
        parts=(),
        unit="beam of a particle",
        units=float(along.size),
        call=lambda: model.log_likelihood(some, beams),
        working_set=(2.0 * mean_cells) ** 2,
        moved=24 + each,
        operations=LEAP_OPERATIONS * each + 15,
        roofs=leap_roofs(
            mean_cells,
            each,
            *((limits.calls(name), 1) for name in ("sin + cos", "exp", "log")),
        ),
    )


def _drive(belief: Particles, config: AmclConfig, rng: np.random.Generator) -> Kernel:
    moved = tuple(motion._differential(INCREMENT, config))
    noise = rng.standard_normal((3, len(belief)), np.float32)
    return Kernel(
        function=motion._drive,
        parts=(),
        unit="particle",
        units=float(len(belief)),
        call=lambda: motion._drive(belief.x, belief.y, belief.yaw, moved, noise),
        working_set=60.0 * len(belief),
        moved=60,
        operations=25,
        roofs={
            "memory": ((limits.copy(60.0 * len(belief)), 60),),
            "functions": ((limits.calls("sin + cos"), 1), (limits.calls("division"), 1)),
        },
    )


def _comb(belief: Particles) -> Kernel:
    n = len(belief)
    return Kernel(
        function=resampling._comb,
        parts=(),
        unit="particle",
        units=float(n),
        call=lambda: resampling._comb(belief.weight, n, 0.5),
        working_set=16.0 * n,
        moved=24,
        operations=5,
        roofs={
            "memory": ((limits.copy(16.0 * n), 24),),
            "chain of sums": ((limits.sums(), 2),),
        },
    )


def _draws(belief: Particles, config: AmclConfig, rng: np.random.Generator) -> Kernel:
    n = len(belief)
    drawn = rng.permutation(resampling.systematic(belief.weight, n, rng))
    poses = belief.x, belief.y, belief.yaw
    # As it is where the robot may be anywhere: all draws are needed.
    return Kernel(
        function=kld._draws_until_enough,
        parts=(kld._needed, *HASHED),
        unit="draw",
        units=float(n),
        call=lambda: kld._draws_until_enough(*poses, drawn, n, config.pf_err, config.pf_z),
        working_set=32.0 * n,
        moved=32 + 8,
        operations=15,
        roofs={
            "looking up": ((limits.gather(24.0 * n), 3), (limits.gather(4096), 1)),
            "division": ((limits.calls("division"), 1),),
        },
    )


def _clusters(belief: Particles) -> list[Kernel]:
    n, poses = len(belief), (belief.x, belief.y, belief.yaw)
    label, count = clusters._label(*poses)
    return [
        Kernel(
            function=clusters._label,
            parts=(clusters._join, clusters._root),
            unit="particle",
            units=float(n),
            call=lambda: clusters._label(*poses),
            working_set=64.0 * n,
            moved=24 + 8 + 8 + 16 + 8,
            operations=15,
            roofs={
                "memory": ((limits.copy(64.0 * n), 64),),
                "looking up": ((limits.gather(4096), 3),),
                "division": ((limits.calls("division"), 1),),
            },
        ),
        Kernel(
            function=clusters._moments,
            parts=(clusters._means, clusters._put, clusters._wrapped),
            unit="particle",
            units=float(n),
            call=lambda: clusters._moments(*poses, belief.weight, belief.weight, label, count),
            working_set=40.0 * n,
            moved=48 + 40,
            operations=50,
            roofs={
                "memory": ((limits.read(40.0 * n), 88),),
                "chain of sums": ((limits.sums(), 2),),
                "arithmetic": ((limits.operations("f64"), 46), (limits.calls("division"), 2)),
            },
        ),
    ]
