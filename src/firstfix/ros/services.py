"""The services of a node in ROS 1 and ROS 2. Plain DDS has none: they do not cross its vendors."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum, IntEnum

from firstfix.ros.node_config import Mode, NodeConfig


class Request(Enum):
    """What a service does."""

    SEARCH = "discard the pose, and search the whole map"
    UPDATE = "use the next scan although the robot has not moved"
    HINT = "propose a pose; the next scan verifies it"
    LOAD_MAP = (
        "load a map from a file, by its path or a `file://` URL; with `site`, a hint that the "
        "robot is in that map"
    )
    SET_MAP = "use a map, and propose a pose in it"
    SAVE_INCIDENT = "save the last seconds in a file; the message is its path"
    WAIT = "answer once the robot is localized, for behaviour trees"


class LoadResult(IntEnum):
    """Results of ``nav2_msgs/LoadMap`` and ``nav_msgs/LoadMap``."""

    SUCCESS = 0
    MAP_DOES_NOT_EXIST = 1
    INVALID_MAP_DATA = 2
    INVALID_MAP_METADATA = 3
    UNDEFINED_FAILURE = 255


@dataclass(frozen=True, slots=True)
class Service:
    """A service.

    Parameters
    ----------
    name : str
        Relative, or private with a leading ``~/``.
    type_name : str
        ``package/Type``.
    request : Request
        What it does.
    condition : str
        Where it is offered, for the documents; empty: always.
    """

    name: str
    type_name: str
    request: Request
    condition: str = field(default="", compare=False)


_OWN_MAP = "with `yaml_filename` or `site`"
_EMPTY = "std_srvs/Empty"
_SEARCH = Service("reinitialize_global_localization", _EMPTY, Request.SEARCH)
_UPDATE = Service("request_nomotion_update", _EMPTY, Request.UPDATE)
_SAVE = Service("~/save_incident", "std_srvs/Trigger", Request.SAVE_INCIDENT)
WAIT = Service("wait_until_localized", _EMPTY, Request.WAIT)


def ros2_services(config: NodeConfig) -> tuple[Service, ...]:
    """Return the services of a node of ROS 2.

    Parameters
    ----------
    config : NodeConfig
        A node that loads its maps itself offers to load another one, as a map server does.

    Returns
    -------
    tuple of Service
        Under the names of Nav2.
    """
    hint = Service("set_initial_pose", "nav2_msgs/SetInitialPose", Request.HINT)
    load = Service("~/load_map", "nav2_msgs/LoadMap", Request.LOAD_MAP, _OWN_MAP)
    return (_SEARCH, _UPDATE, hint, _SAVE, *([load] if config.has_own_maps else []))


def ros1_services(config: NodeConfig) -> tuple[Service, ...]:
    """Return the services of a node of ROS 1.

    Parameters
    ----------
    config : NodeConfig
        A service has one provider: an AMCL that runs beside keeps its own.

    Returns
    -------
    tuple of Service
        Under the names of AMCL.
    """
    own, beside = ("", "full") if config.mode is Mode.FULL else ("~/", "bootstrap")
    load = Service("~/load_map", "nav_msgs/LoadMap", Request.LOAD_MAP, _OWN_MAP)
    return (
        _SEARCH,
        Service("global_localization", _EMPTY, Request.SEARCH),
        Service(own + _UPDATE.name, _EMPTY, Request.UPDATE, beside),
        Service(own + "set_map", "nav_msgs/SetMap", Request.SET_MAP, beside),
        _SAVE,
        *([load] if config.has_own_maps else []),
    )
