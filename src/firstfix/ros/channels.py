"""The topics and services of a node, the same for every transport."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from enum import Enum

from firstfix.ros.node_config import Mode, NodeConfig


class Delivery(Enum):
    """Quality of service."""

    SENSOR = "best effort"
    RELIABLE = "reliable"
    LATCHED = "reliable, latched"
    LATCHED_MANY = "reliable, latched per publisher"


@dataclass(frozen=True, slots=True)
class Topic:
    """A topic.

    Parameters
    ----------
    name : str
        Relative, so that it can be remapped.
    type_name : str
        ``package/Type``; the transport knows the package of Kobuki's events.
    delivery : Delivery
        Quality of service.
    meaning : str
        One line for the documents.
    """

    name: str
    type_name: str
    delivery: Delivery
    meaning: str = field(default="", compare=False)


class Channel(Enum):
    """Where a message came from: a topic, a service, or the program itself."""

    SCAN = "scan"
    CLOUD = "points"
    DEPTH = "depth image"
    CAMERA_INFO = "camera_info"
    MAP = "map"
    TF = "tf"
    TF_STATIC = "tf_static"
    ODOM = "odom"
    INITIAL_POSE = "initialpose"
    POSITION_FIX = "position_fix"
    CLIFF = "events/cliff"
    WHEEL_DROP = "events/wheel_drop"
    BUMPER = "events/bumper"
    KIDNAPPED = "kidnapped"
    RESET = "reinitialize_global_localization"
    UPDATE = "request_nomotion_update"
    MAP_HINT = "map_hint"
    INPUT = "input"


SENSORS = frozenset({Channel.SCAN, Channel.CLOUD, Channel.DEPTH})
"""Channels whose messages become scans."""

POSE_TYPE = "geometry_msgs/PoseWithCovarianceStamped"

INITIAL_POSE = Topic(
    "initialpose", POSE_TYPE, Delivery.RELIABLE, "the pose, once it is found (bootstrap)"
)
AMCL_POSE = Topic("amcl_pose", POSE_TYPE, Delivery.LATCHED, "the pose at every scan (full)")
TF = Topic("/tf", "tf2_msgs/TFMessage", Delivery.RELIABLE, "`map -> odom` (full)")
PARTICLES = Topic(
    "particle_cloud",
    "nav2_msgs/ParticleCloud",
    Delivery.SENSOR,
    "the particles, while there is a subscriber (full)",
)
# RViz of ROS 1 can display this type, and it exists where nav2_msgs is not installed.
PARTICLE_POSES = replace(PARTICLES, type_name="geometry_msgs/PoseArray")
HYPOTHESES = Topic(
    "hypotheses",
    "geometry_msgs/PoseArray",
    Delivery.LATCHED,
    "the places that fit, best first; empty once one is decided",
)
MARKERS = Topic(
    "hypothesis_markers",
    "visualization_msgs/MarkerArray",
    Delivery.RELIABLE,
    "these places with their probabilities, while there is a subscriber",
)
LOCALIZED = Topic(
    "localized",
    "std_msgs/Bool",
    Delivery.LATCHED,
    "true while the pose can be used; published when it changes",
)
MAP_ID = Topic(
    "map_id",
    "std_msgs/String",
    Delivery.LATCHED,
    "the name of the map in use, before any pose in it",
)
MAP = Topic(
    "map", "nav_msgs/OccupancyGrid", Delivery.LATCHED, "the map in use, of a `site`; after its name"
)
STATUS = Topic(
    "localization_status",
    "diagnostic_msgs/DiagnosticArray",
    Delivery.LATCHED,
    "state, reason and evidence",
)


def subscribed_topics(config: NodeConfig) -> dict[Channel, Topic]:
    """Return the topics that a node subscribes to.

    Parameters
    ----------
    config : NodeConfig
        Names the topics of scan and map.

    Returns
    -------
    dict of Channel to Topic
        Services are not among them.
    """
    sensor, reliable = Delivery.SENSOR, Delivery.RELIABLE
    scan, grid, press = "sensor_msgs/LaserScan", "nav_msgs/OccupancyGrid", "the robot was lifted"
    topics = {
        Channel.SCAN: Topic(_scan_topics(config)[0], scan, sensor, "the scans"),
        Channel.TF: replace(TF, meaning="odometry, and sensors that move on the robot"),
        Channel.TF_STATIC: Topic(
            "/tf_static", "tf2_msgs/TFMessage", Delivery.LATCHED_MANY, "where the sensor is mounted"
        ),
        Channel.ODOM: Topic(
            "odom", "nav_msgs/Odometry", sensor, "odometry of robots that do not have it on `/tf`"
        ),
        Channel.INITIAL_POSE: replace(INITIAL_POSE, meaning="a hint of a person, such as in RViz"),
        Channel.POSITION_FIX: Topic(
            "position_fix", POSE_TYPE, reliable, "a measured pose, such as of a fiducial: a prior"
        ),
        Channel.CLIFF: Topic("events/cliff", "kobuki/CliffEvent", reliable, press),
        Channel.WHEEL_DROP: Topic("events/wheel_drop", "kobuki/WheelDropEvent", reliable, press),
        Channel.BUMPER: Topic(
            "events/bumper", "kobuki/BumperEvent", reliable, "a collision (has no effect yet)"
        ),
        Channel.KIDNAPPED: Topic(
            "kidnapped", "std_msgs/Bool", reliable, "true: the robot was lifted; false: set down"
        ),
    }
    if config.site:
        topics[Channel.MAP_HINT] = Topic(
            "map_hint", "std_msgs/String", reliable, "the map that a lift names; a prior"
        )
    elif not config.has_own_maps:
        meaning = "the map, unless `yaml_filename` names a file"
        topics[Channel.MAP] = Topic(config.map_topic, grid, Delivery.LATCHED, meaning)
    return topics


def subscriptions(config: NodeConfig) -> list[tuple[Channel, Topic]]:
    """Return all topics that a node subscribes to: `subscribed_topics`, and of further sensors.

    Parameters
    ----------
    config : NodeConfig
        Names the topics.

    Returns
    -------
    list of tuple of Channel and Topic
        A channel may be there several times.
    """
    first = subscribed_topics(config)
    scan = first[Channel.SCAN]
    cloud = Topic("", "sensor_msgs/PointCloud2", Delivery.SENSOR, "3D points, of `cloud_topics`")
    depth = Topic("", "sensor_msgs/Image", Delivery.SENSOR, "depth images, of `depth_topics`")
    info = Topic("", "sensor_msgs/CameraInfo", Delivery.SENSOR, "beside each of `depth_topics`")
    lasers = [(Channel.SCAN, replace(scan, name=name)) for name in _scan_topics(config)]
    clouds = [(Channel.CLOUD, replace(cloud, name=name)) for name in config.cloud_topics.split()]
    cameras = [
        pair
        for name in config.depth_topics.split()
        for pair in (
            (Channel.DEPTH, replace(depth, name=name)),
            (Channel.CAMERA_INFO, replace(info, name=_beside(name))),
        )
    ]
    rest = [(channel, topic) for channel, topic in first.items() if channel is not Channel.SCAN]
    return [*lasers, *clouds, *cameras, *rest]


def _scan_topics(config: NodeConfig) -> list[str]:
    return config.scan_topics.split() or [config.scan_topic]


def _beside(name: str) -> str:
    folder = name.rpartition("/")[0]
    return f"{folder}/camera_info" if folder or name.startswith("/") else "camera_info"


def published_topics(config: NodeConfig, particles: Topic) -> tuple[Topic, ...]:
    """Return the topics that a node advertises in its mode.

    Parameters
    ----------
    config : NodeConfig
        Has the mode.
    particles : Topic
        The topic on which the transport publishes particle clouds.

    Returns
    -------
    tuple of Topic
        All of them.
    """
    has_map = config.site and not config.load_map_service
    named = (MAP_ID, replace(MAP, name=config.map_topic)) if has_map else (MAP_ID,)
    if config.mode is Mode.BOOTSTRAP:
        return (*named, INITIAL_POSE, HYPOTHESES, MARKERS, LOCALIZED, STATUS)
    moved = [TF] if config.tf_broadcast else []
    return (*named, AMCL_POSE, particles, HYPOTHESES, MARKERS, LOCALIZED, STATUS, *moved)
