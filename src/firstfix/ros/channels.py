"""What a node hears and says, under which names; the same for every transport."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from firstfix.ros.node_config import Mode, NodeConfig


class Delivery(Enum):
    """Quality of service."""

    SENSOR = "best effort, the newest"
    RELIABLE = "reliable"
    LATCHED = "reliable, the last one also for those who come late"
    LATCHED_MANY = "reliable, the last of each sender also for those who come late"


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
        How.
    """

    name: str
    type_name: str
    delivery: Delivery


class Heard(Enum):
    """What can be heard."""

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
# What rviz of ROS 1 can show, and what can be had where nav2_msgs is not installed.
PARTICLE_POSES = Topic("particle_cloud", "geometry_msgs/PoseArray", Delivery.SENSOR)
HYPOTHESES = Topic("hypotheses", "geometry_msgs/PoseArray", Delivery.LATCHED)
STATUS = Topic("localization_status", "diagnostic_msgs/DiagnosticArray", Delivery.LATCHED)


def heard_topics(config: NodeConfig) -> dict[Heard, Topic]:
    """Return what a node subscribes to.

    Parameters
    ----------
    config : NodeConfig
        With the topics of scan and map.

    Returns
    -------
    dict of Heard to Topic
        Without what comes as a service.
    """
    topics = {
        Heard.SCAN: Topic(config.amcl.scan_topic, "sensor_msgs/LaserScan", Delivery.SENSOR),
        Heard.TF: TF,
        Heard.TF_STATIC: Topic("/tf_static", "tf2_msgs/TFMessage", Delivery.LATCHED_MANY),
        Heard.ODOM: Topic("odom", "nav_msgs/Odometry", Delivery.SENSOR),
        Heard.INITIAL_POSE: INITIAL_POSE,
        Heard.CLIFF: Topic("events/cliff", "kobuki/CliffEvent", Delivery.RELIABLE),
        Heard.WHEEL_DROP: Topic("events/wheel_drop", "kobuki/WheelDropEvent", Delivery.RELIABLE),
        Heard.BUMPER: Topic("events/bumper", "kobuki/BumperEvent", Delivery.RELIABLE),
        Heard.KIDNAPPED: Topic("kidnapped", "std_msgs/Bool", Delivery.RELIABLE),
    }
    if not config.yaml_filename:
        map_topic = Topic(config.amcl.map_topic, "nav_msgs/OccupancyGrid", Delivery.LATCHED)
        topics[Heard.MAP] = map_topic
    return topics


def said_topics(config: NodeConfig, particles: Topic) -> tuple[Topic, ...]:
    """Return what a node publishes in its mode.

    Parameters
    ----------
    config : NodeConfig
        With the mode.
    particles : Topic
        How the transport publishes clouds.

    Returns
    -------
    tuple of Topic
        To be advertised at the start.
    """
    if config.mode is Mode.BOOTSTRAP:
        return INITIAL_POSE, HYPOTHESES, STATUS
    moved = [TF] if config.amcl.tf_broadcast else []
    return (AMCL_POSE, particles, HYPOTHESES, STATUS, *moved)
