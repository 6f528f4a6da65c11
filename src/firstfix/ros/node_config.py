"""The settings of a node on a robot."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum

from firstfix.amcl.config import AmclConfig
from firstfix.core.settings import check_settings, setting


class Mode(Enum):
    """Who follows the robot once it is found."""

    BOOTSTRAP = "bootstrap"
    FULL = "full"


@dataclass(frozen=True, slots=True)
class NodeConfig:
    """All settings of a node; the metadata of each field has its description and range.

    Raises
    ------
    InputError
        If a setting has the wrong type or is out of its range.
    """

    mode: Mode = setting(
        Mode.BOOTSTRAP,
        "bootstrap: publish initialpose for the AMCL that runs beside; full: be the AMCL",
    )
    yaml_filename: str = setting("", "map to load; empty: hear it on map_topic")
    saved_pose_file: str = setting(
        "",
        "where the last pose outlives a restart, written at save_pose_rate and at the end, removed "
        "when the pose is lost; empty: nowhere",
    )
    cloud_rate: float = setting(2.0, "most clouds of particles a second, Hz; 0: none", 0.0, 100.0)
    status_rate: float = setting(
        2.0, "most messages of localization_status a second, Hz, besides those of changes", 0.1, 1e3
    )
    amcl: AmclConfig = field(default_factory=AmclConfig)

    def __post_init__(self) -> None:
        check_settings(self)
