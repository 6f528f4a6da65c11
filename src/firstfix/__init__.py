"""Find a robot anywhere in its map from one 2D LIDAR scan, without motion."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from firstfix.amcl.config import AmclConfig, MotionModel, SensorModel
    from firstfix.belief.prior import All, AnyOf, Gaussian, Near, Region
    from firstfix.changes.counts import ChangeCounter
    from firstfix.changes.survey import Change, MapChanges, find_changes
    from firstfix.core.deskew import deskew
    from firstfix.core.errors import FirstfixError, InputError, MapError, ScanError
    from firstfix.core.estimate import Evidence, Hypothesis, LocateResult, SearchReport, Verdict
    from firstfix.core.grid import OccupancyGrid
    from firstfix.core.odometry import Odometry, Signal, SignalKind
    from firstfix.core.points import points_from_depth, scan_from_points
    from firstfix.core.recording import Recording
    from firstfix.core.scan import LaserScan, Mounting
    from firstfix.core.se2 import SE2
    from firstfix.core.trajectory import Trajectory
    from firstfix.global_localization.config import LocateConfig, Method
    from firstfix.global_localization.scan_matcher import ScanMatcher
    from firstfix.io.logs.load import load_recording
    from firstfix.io.logs.npz import save_recording
    from firstfix.io.logs.tum import load_trajectory, save_trajectory
    from firstfix.io.maps.map_server import load_map, save_map
    from firstfix.lab.scenarios.example_drive import simulate_drive
    from firstfix.lab.simulation.lidar import Lidar
    from firstfix.localizer.config import ChangesConfig, LocalizerConfig, MonitorConfig, ScansConfig
    from firstfix.localizer.inputs import (
        MapHint,
        NewMap,
        NoMotionUpdate,
        PoseHint,
        PositionFix,
        Reset,
    )
    from firstfix.localizer.localizer import Localizer
    from firstfix.localizer.outputs import (
        Hypotheses,
        InitialPose,
        MapSwitched,
        MotionRequest,
        Status,
        TrackedPose,
    )
    from firstfix.localizer.precompile import precompile
    from firstfix.localizer.states import Event, State
    from firstfix.site.floors import SiteLocalizer
    from firstfix.site.result import SiteResult
    from firstfix.site.site import Site

__version__ = "0.1.0"

__all__ = [  # noqa: RUF022 - in plain alphabetical order
    "All",
    "AmclConfig",
    "AnyOf",
    "Change",
    "ChangeCounter",
    "ChangesConfig",
    "Event",
    "Evidence",
    "FirstfixError",
    "Gaussian",
    "Hypotheses",
    "Hypothesis",
    "InitialPose",
    "InputError",
    "LaserScan",
    "Lidar",
    "Localizer",
    "LocalizerConfig",
    "LocateConfig",
    "LocateResult",
    "MapChanges",
    "MapError",
    "MapHint",
    "MapSwitched",
    "Method",
    "MonitorConfig",
    "MotionModel",
    "MotionRequest",
    "Mounting",
    "Near",
    "NewMap",
    "NoMotionUpdate",
    "OccupancyGrid",
    "Odometry",
    "PoseHint",
    "PositionFix",
    "Recording",
    "Region",
    "Reset",
    "SE2",
    "ScanError",
    "ScanMatcher",
    "ScansConfig",
    "SearchReport",
    "SensorModel",
    "Signal",
    "SignalKind",
    "Site",
    "SiteLocalizer",
    "SiteResult",
    "State",
    "Status",
    "TrackedPose",
    "Trajectory",
    "Verdict",
    "deskew",
    "find_changes",
    "load_map",
    "load_recording",
    "load_trajectory",
    "points_from_depth",
    "precompile",
    "save_map",
    "save_recording",
    "save_trajectory",
    "scan_from_points",
    "simulate_drive",
]

# A name is imported at its first use: numba alone takes longer than 0.3 s to import.
_MODULES = {
    "amcl.config": ("AmclConfig", "MotionModel", "SensorModel"),
    "belief.prior": ("All", "AnyOf", "Gaussian", "Near", "Region"),
    "changes.counts": ("ChangeCounter",),
    "changes.survey": ("Change", "MapChanges", "find_changes"),
    "core.deskew": ("deskew",),
    "core.errors": ("FirstfixError", "InputError", "MapError", "ScanError"),
    "core.estimate": ("Evidence", "Hypothesis", "LocateResult", "SearchReport", "Verdict"),
    "core.grid": ("OccupancyGrid",),
    "core.odometry": ("Odometry", "Signal", "SignalKind"),
    "core.points": ("points_from_depth", "scan_from_points"),
    "core.recording": ("Recording",),
    "core.scan": ("LaserScan", "Mounting"),
    "core.se2": ("SE2",),
    "core.trajectory": ("Trajectory",),
    "global_localization.config": ("LocateConfig", "Method"),
    "global_localization.scan_matcher": ("ScanMatcher",),
    "io.logs.load": ("load_recording",),
    "io.logs.npz": ("save_recording",),
    "io.logs.tum": ("load_trajectory", "save_trajectory"),
    "io.maps.map_server": ("load_map", "save_map"),
    "lab.scenarios.example_drive": ("simulate_drive",),
    "lab.simulation.lidar": ("Lidar",),
    "localizer.config": ("ChangesConfig", "LocalizerConfig", "MonitorConfig", "ScansConfig"),
    "localizer.inputs": ("MapHint", "NewMap", "NoMotionUpdate", "PoseHint", "PositionFix", "Reset"),
    "localizer.localizer": ("Localizer",),
    "localizer.outputs": (
        "Hypotheses",
        "InitialPose",
        "MapSwitched",
        "MotionRequest",
        "Status",
        "TrackedPose",
    ),
    "localizer.precompile": ("precompile",),
    "localizer.states": ("Event", "State"),
    "site.result": ("SiteResult",),
    "site.floors": ("SiteLocalizer",),
    "site.site": ("Site",),
}
_HOMES = {name: module for module, names in _MODULES.items() for name in names}


def __getattr__(name: str) -> Any:
    """Import a public name from its module."""
    if name == "Locator":
        return _renamed("Locator", "ScanMatcher")
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(importlib.import_module(f"{__name__}.{_HOMES[name]}"), name)
    globals()[name] = value
    return value


def _renamed(old: str, new: str) -> Any:
    """Return a public name under its former one, with a warning."""
    import warnings

    message = f"firstfix.{old} was renamed: use firstfix.{new}"
    warnings.warn(message, DeprecationWarning, stacklevel=3)
    return __getattr__(new)


def __dir__() -> list[str]:
    """List the public names, imported or not."""
    return sorted({*globals(), *__all__})
