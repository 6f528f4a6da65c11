"""Parameters of a node: mode, topics, frames and rates. Algorithms have their own configs."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from firstfix.core.errors import InputError
from firstfix.core.se2 import SE2
from firstfix.core.settings import check_settings, setting
from firstfix.io.ros_messages.sensor_place import given_poses
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
    site: str = setting(
        "",
        "site.yaml or folder of maps, in one of which the robot is; the node publishes that map; "
        "empty: one map",
    )
    load_map_service: str = setting(
        "",
        "service of a map server, such as /map_server/load_map or in ROS 1 /change_map, that is "
        "called with the file of each map of a `site`, and publishes the map in place of this "
        "node; empty: none",
    )
    map_id: str = setting(
        "",
        "name of the first map, published on map_id; empty: the name of its file, or a hash of its "
        "cells",
    )
    base_frame_id: str = setting("base_footprint", "frame of the base")
    odom_frame_id: str = setting("odom", "frame of the odometry")
    global_frame_id: str = setting("map", "frame of the map")
    scan_topic: str = setting("scan", "topic of the scans")
    scan_topics: str = setting(
        "",
        "topics of the scans of several lasers, which decide together: a list, or names with "
        "spaces between; empty: scan_topic",
    )
    cloud_topics: str = setting(
        "", "topics of 3D points (sensor_msgs/PointCloud2), likewise; empty: none"
    )
    depth_topics: str = setting(
        "", "topics of depth images, likewise, each with camera_info beside it; empty: none"
    )
    height_band: str = setting(
        "0.1 1.8",
        "lowest and highest height above the base of 3D points that are compared with the map, m; "
        "the ground must be below",
    )
    laser_pose: str = setting(
        "",
        "X,Y,YAW of the sensor on the robot (m, rad) where tf lacks it; X,Y,YAW,3.14 is upside "
        "down; X,Y,Z,ROLL,PITCH,YAW for 3D points; front_laser=X,Y,YAW for one of several; empty: "
        "by tf",
    )
    laser_frame: str = setting(
        "", "frame of the sensor in tf, in place of that in its messages; empty: as they say"
    )
    map_topic: str = setting("map", "topic of the map")
    first_map_only: bool = setting(False, "ignore maps after the first")
    changes_layer: str = setting(
        "",
        "what is known to have changed in the map: changes.yaml, as 'firstfix map changes --out' "
        "writes it; beams at these cells contradict a pose less; empty: nothing",
    )

    zones: str = setting(
        "",
        "zones of the map in which the robot is at the start, from the file MAP.zones.yaml beside "
        "yaml_filename: a list, or names with spaces between; empty: anywhere",
    )
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
        1.0, "maximum rate of localization_status while the state stays the same, Hz", 0.1, 1e3
    )
    scan_timeout: float = setting(
        2.0, "time without a scan after which localization_status is stale, s; 0: never", 0.0
    )
    incident_seconds: float = setting(
        30.0,
        "last seconds of inputs and outputs that are saved when the pose is lost or revoked, or a "
        "hint is refused; 0: none",
        0.0,
        600.0,
    )
    incident_folder: str = setting(
        "", "folder of the saved incidents, at most 20; empty: that of the user"
    )
    localizer: LocalizerConfig = field(default_factory=LocalizerConfig)

    def __post_init__(self) -> None:
        check_settings(self)
        if not self.band[0] < self.band[1]:
            raise InputError(
                f"height_band {self.height_band} is empty. Write the lower height first, such as "
                "0.1 1.8."
            )
        given_poses(self.laser_pose)
        if self.site and self.yaml_filename:
            raise InputError(
                "site and yaml_filename are both set, but a site has maps of its own. Leave one of "
                "them empty."
            )
        if self.load_map_service and not self.site:
            raise InputError(
                "load_map_service is for the maps of a site, but site is empty. Set it, or leave "
                "load_map_service empty."
            )
        if self.site and self.changes_layer:
            raise InputError(
                "changes_layer is of one map, but a site has many. Leave one of them empty."
            )
        if self.zones and not self.yaml_filename:
            raise InputError(
                "zones are in a file beside the map, but yaml_filename is empty. Set it, or leave "
                "zones empty."
            )

    @property
    def has_own_maps(self) -> bool:
        """True if the node loads its maps from files, not from a topic."""
        return bool(self.yaml_filename or self.site)

    @property
    def band(self) -> tuple[float, float]:
        """Lowest and highest height of 3D points, m."""
        try:
            low, high = (float(number) for number in self.height_band.split())
        except ValueError:
            raise InputError(
                f"height_band {self.height_band} is not two heights. Write them in metres, such as "
                "0.1 1.8."
            ) from None
        return low, high

    @property
    def sensor_poses(self) -> dict[str, NDArray[np.float64]]:
        """Poses of sensors, shape (4, 4), by frame; an empty frame stands for all others."""
        return given_poses(self.laser_pose)
