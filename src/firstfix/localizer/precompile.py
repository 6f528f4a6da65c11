"""Kernels made ready, so that the first scan of a robot does not wait for the compiler."""

from __future__ import annotations

from dataclasses import replace

from firstfix.amcl.config import AmclConfig
from firstfix.core.odometry import Odometry
from firstfix.core.se2 import SE2
from firstfix.localizer.config import LocalizerConfig
from firstfix.localizer.inputs import NewMap
from firstfix.localizer.localizer import Localizer
from firstfix.localizer.precompile_room import scan_of, small_room

# Seen from two poses: found at one, followed there, lost and found at the other.
_HERE, _THERE = SE2(3.0, 2.5, 0.4), SE2(6.0, 4.5, 2.0)
_STEP_S = 0.1
_SCANS = 30


def warm_up(config: AmclConfig | None = None) -> None:
    """Load or compile all kernels that a localizer may need, by a story in a small room.

    Parameters
    ----------
    config : AmclConfig, optional
        Its sensor and motion model choose among the kernels.
    """
    localizer = Localizer(LocalizerConfig(amcl=config or AmclConfig()))
    grid = small_room()
    localizer.handle(NewMap(0.0, grid))
    for i in range(_SCANS):
        stamp = i * _STEP_S
        # Odometry moves, so that the filter updates; the scans do not follow it.
        localizer.handle(Odometry(stamp, SE2(0.05 * i, 0.0, 0.0)))
        at = _HERE if i < _SCANS // 2 else _THERE
        localizer.handle(replace(scan_of(grid, at), stamp=stamp))
