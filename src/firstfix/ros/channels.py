"""The topics and services of a node, the same for every transport."""

from __future__ import annotations

from dataclasses import dataclass
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
    """

    name: str
    type_name: str
    delivery: Delivery


class Channel(Enum):
    """Where a message came from: a topic, a service, or the program itself."""

    SCAN = "scan"
    MAP = "map"
    TF = "tf"
    TF_STATIC = "tf_static"
    ODOM = "odom"
    INITIAL_POSE = "initialpose"
    CLIFF = "events/cliff"
    WHEEL_DROP = "events/wheel_drop"
    BUMPER = "events/bumper"
    KIDNAPPED = "kidnapped"
    RESET = "reinitialize_global_localization"
    UPDATE = "request_nomotion_update"
    INPUT = "input"


POSE_TYPE = "geometry_msgs/PoseWithCovarianceStamped"

INITIAL_POSE = Topic("initialpose", POSE_TYPE, Delivery.RELIABLE)
AMCL_POSE = Topic("amcl_pose", POSE_TYPE, Delivery.LATCHED)
TF = Topic("/tf", "tf2_msgs/TFMessage", Delivery.RELIABLE)
PARTICLES = Topic("particle_cloud", "nav2_msgs/ParticleCloud", Delivery.SENSOR)
# RViz of ROS 1 can display this type, and it exists where nav2_msgs is not installed.
PARTICLE_POSES = Topic("particle_cloud", "geometry_msgs/PoseArray", Delivery.SENSOR)
HYPOTHESES = Topic("hypotheses", "geometry_msgs/PoseArray", Delivery.LATCHED)
MARKERS = Topic("hypothesis_markers", "visualization_msgs/MarkerArray", Delivery.RELIABLE)
LOCALIZED = Topic("localized", "std_msgs/Bool", Delivery.LATCHED)
STATUS = Topic("localization_status", "diagnostic_msgs/DiagnosticArray", Delivery.LATCHED)


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
    topics = {
        Channel.SCAN: Topic(config.scan_topic, "sensor_msgs/LaserScan", Delivery.SENSOR),
        Channel.TF: TF,
        Channel.TF_STATIC: Topic("/tf_static", "tf2_msgs/TFMessage", Delivery.LATCHED_MANY),
        Channel.ODOM: Topic("odom", "nav_msgs/Odometry", Delivery.SENSOR),
        Channel.INITIAL_POSE: INITIAL_POSE,
        Channel.CLIFF: Topic("events/cliff", "kobuki/CliffEvent", Delivery.RELIABLE),
        Channel.WHEEL_DROP: Topic("events/wheel_drop", "kobuki/WheelDropEvent", Delivery.RELIABLE),
        Channel.BUMPER: Topic("events/bumper", "kobuki/BumperEvent", Delivery.RELIABLE),
        Channel.KIDNAPPED: Topic("kidnapped", "std_msgs/Bool", Delivery.RELIABLE),
    }
    if not config.yaml_filename:
        map_topic = Topic(config.map_topic, "nav_msgs/OccupancyGrid", Delivery.LATCHED)
        topics[Channel.MAP] = map_topic
    return topics


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
    if config.mode is Mode.BOOTSTRAP:
        return INITIAL_POSE, HYPOTHESES, MARKERS, LOCALIZED, STATUS
    moved = [TF] if config.tf_broadcast else []
    return (AMCL_POSE, particles, HYPOTHESES, MARKERS, LOCALIZED, STATUS, *moved)
