"""Find a robot anywhere in its map from one 2D LIDAR scan, without motion."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from firstfix.core.errors import FirstfixError, InputError, MapError, ScanError
    from firstfix.core.estimate import Evidence, Hypothesis, LocateResult, SearchReport, Verdict
    from firstfix.core.grid import OccupancyGrid
    from firstfix.core.odometry import Odometry
    from firstfix.core.recording import Recording
    from firstfix.core.scan import LaserScan, Mounting
    from firstfix.core.se2 import SE2
    from firstfix.core.trajectory import Trajectory
    from firstfix.global_localization.config import LocateConfig, Method
    from firstfix.global_localization.scan_matcher import ScanMatcher
    from firstfix.io.logs.load import load_recording
    from firstfix.io.maps.map_server import load_map, save_map
    from firstfix.localizer.config import LocalizerConfig
    from firstfix.localizer.inputs import NewMap
    from firstfix.localizer.localizer import Localizer

__version__ = "0.1.0"

__all__ = [  # noqa: RUF022 - plainly sorted, as a reader looks for a name
    "Evidence",
    "FirstfixError",
    "Hypothesis",
    "InputError",
    "LaserScan",
    "Localizer",
    "LocalizerConfig",
    "LocateConfig",
    "LocateResult",
    "MapError",
    "Method",
    "Mounting",
    "NewMap",
    "OccupancyGrid",
    "Odometry",
    "Recording",
    "SE2",
    "ScanError",
    "ScanMatcher",
    "SearchReport",
    "Trajectory",
    "Verdict",
    "load_map",
    "load_recording",
    "save_map",
]

# Each name is imported when it is first asked for: numba alone takes longer than 0.3 s.
_ROOMS = {
    "core.errors": ("FirstfixError", "InputError", "MapError", "ScanError"),
    "core.estimate": ("Evidence", "Hypothesis", "LocateResult", "SearchReport", "Verdict"),
    "core.grid": ("OccupancyGrid",),
    "core.odometry": ("Odometry",),
    "core.recording": ("Recording",),
    "core.scan": ("LaserScan", "Mounting"),
    "core.se2": ("SE2",),
    "core.trajectory": ("Trajectory",),
    "io.maps.map_server": ("load_map", "save_map"),
    "io.logs.load": ("load_recording",),
    "global_localization.config": ("LocateConfig", "Method"),
    "global_localization.scan_matcher": ("ScanMatcher",),
    "localizer.config": ("LocalizerConfig",),
    "localizer.inputs": ("NewMap",),
    "localizer.localizer": ("Localizer",),
}
_HOMES = {name: room for room, names in _ROOMS.items() for name in names}


def __getattr__(name: str) -> Any:
    """Import a public name from where it lives."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(importlib.import_module(f"{__name__}.{_HOMES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """List the public names, imported or not."""
    return sorted({*globals(), *__all__})
