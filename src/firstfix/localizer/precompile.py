"""Compile or load every kernel in advance, so that the first scan does not wait for the compiler.

Robots' nodes, the demo and the benchmarks use this one module.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from functools import cache

from firstfix.amcl.config import AmclConfig
from firstfix.core.grid import OccupancyGrid
from firstfix.core.odometry import Odometry
from firstfix.core.se2 import SE2
from firstfix.fields.map_fields import MapFields
from firstfix.global_localization.beams import usable_beams
from firstfix.global_localization.config import MAX_POSES, Method
from firstfix.global_localization.look import find_places
from firstfix.global_localization.precompile import precompile_search, scan_of, small_room
from firstfix.localizer.config import LocalizerConfig
from firstfix.localizer.inputs import NewMap, PoseHint, Reset
from firstfix.localizer.localizer import Localizer

# The robot is found at the first pose, tracked there, lost and found again at the second.
_HERE, _THERE = SE2(3.0, 2.5, 0.4), SE2(6.0, 4.5, 2.0)
# Then it searches again with a sensor that sees too little to tell the places apart, m.
_SHORT_RANGE = 2.0
_STEP_S = 0.1
_SCANS = 30


def precompile(config: AmclConfig | None = None, methods: Iterable[Method] = ()) -> None:
    """Run a localizer, and a search by each of some other methods, in a small room.

    Does nothing where this process has done the same before.

    Parameters
    ----------
    config : AmclConfig, optional
        Its sensor model and motion model choose among the kernels.
    methods : iterable of Method
        Methods of search besides the default one.

    Examples
    --------
    >>> ff.precompile()
    """
    _run(config or AmclConfig(), frozenset(methods))


@cache
def _run(config: AmclConfig, methods: frozenset[Method]) -> None:
    localizer = Localizer(LocalizerConfig(amcl=config))
    grid = small_room()
    localizer.handle(NewMap(0.0, grid))
    for i in range(_SCANS):
        stamp = i * _STEP_S
        moved = SE2(0.05 * i, 0.0, 0.0)  # so that the filter updates
        localizer.handle(Odometry(stamp, moved))
        at = _HERE if i < _SCANS // 2 else _THERE
        # Scans that do not follow the odometry would contradict it.
        at = at @ SE2(0.05 * (i % (_SCANS // 2)), 0.0, 0.0)
        localizer.handle(replace(scan_of(grid, at), stamp=stamp))
    _search_again(localizer, grid)
    for method in methods:
        precompile_search(method)
    _search_as_in_a_large_map(grid)


def _search_again(localizer: Localizer, grid: OccupancyGrid) -> None:
    """Let several places fit, and verify a hint of one."""
    for i in (_SCANS, _SCANS + 1):
        stamp = i * _STEP_S
        localizer.handle(Reset(stamp) if i == _SCANS else PoseHint(stamp, _HERE))
        localizer.handle(Odometry(stamp, SE2(0.05 * i, 0.0, 0.0)))
        localizer.handle(replace(scan_of(grid, _HERE), range_max=_SHORT_RANGE, stamp=stamp))


def _search_as_in_a_large_map(grid: OccupancyGrid) -> None:
    beams = usable_beams(scan_of(grid, _HERE))
    find_places(beams, MapFields(grid, most_positions=0), 1, MAX_POSES)
