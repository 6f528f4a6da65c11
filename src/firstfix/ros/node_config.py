"""Parameters of a node: mode, topics, frames and rates. Algorithms have their own configs."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum

from firstfix.core.se2 import SE2
from firstfix.core.settings import check_settings, setting
from firstfix.localizer.config import LocalizerConfig


class Mode(Enum):
    """Which node tracks the robot once it is found."""

    BOOTSTRAP = "bootstrap"
    FULL = "full"


@dataclass(frozen=True, slots=True)
class NodeConfig:
    """All parameters of a node; the metadata of each field has its description and range.

    Those that Nav2's AMCL has, too, have its names and defaults.

    Raises
    ------
    InputError
        If a parameter has the wrong type or is out of its range.
    """

    mode: Mode = setting(
        Mode.BOOTSTRAP,
        "bootstrap: publish initialpose for a separate AMCL; full: replace AMCL",
    )
    yaml_filename: str = setting("", "map file to load; empty: use map_topic")
    map_id: str = setting(
        "",
        "name of the first map, published on map_id; empty: the name of its file, or a hash of its "
        "cells",
    )
    base_frame_id: str = setting("base_footprint", "frame of the base")
    odom_frame_id: str = setting("odom", "frame of the odometry")
    global_frame_id: str = setting("map", "frame of the map")
    scan_topic: str = setting("scan", "topic of the scans")
    map_topic: str = setting("map", "topic of the map")
    first_map_only: bool = setting(False, "ignore maps after the first")

    set_initial_pose: bool = setting(False, "start at initial_pose")
    initial_pose: SE2 = setting(SE2.identity(), "pose of the base in the map at the start")
    always_reset_initial_pose: bool = setting(
        False, "start at initial_pose on every new map; never use the saved pose"
    )
    saved_pose_file: str = setting(
        "",
        "file that keeps the last pose across restarts, written at save_pose_rate and at the end, "
        "removed when the pose is lost; empty: none",
    )
    save_pose_rate: float = setting(0.5, "rate at which the pose is saved, Hz; -1: never", -1.0)

    transform_tolerance: float = setting(1.0, "validity of map -> odom into the future, s", 0.0)
    tf_broadcast: bool = setting(True, "publish map -> odom")
    cloud_rate: float = setting(2.0, "maximum rate of particle_cloud, Hz; 0: none", 0.0, 100.0)
    status_rate: float = setting(
        2.0, "maximum rate of localization_status while the state stays the same, Hz", 0.1, 1e3
    )
    scan_timeout: float = setting(
        2.0, "time without a scan after which localization_status is stale, s; 0: never", 0.0
    )
    localizer: LocalizerConfig = field(default_factory=LocalizerConfig)

    def __post_init__(self) -> None:
        check_settings(self)
