"""Quality of service of topics in DDS, and the report of a mismatch."""

from __future__ import annotations

from cyclonedds.core import DDSStatus
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy, Qos
from cyclonedds.sub import DataReader
from cyclonedds.util import duration

from firstfix.ros.channels import Delivery, Topic
from firstfix.ros.dds.types import type_hash

# As in tf2: many nodes publish on this topic.
_TF_DEPTH = 100
_DEPTHS = {
    Delivery.SENSOR: 5,
    Delivery.RELIABLE: 10,
    Delivery.LATCHED: 1,
    Delivery.LATCHED_MANY: _TF_DEPTH,
}
# Cyclone DDS holds Python's lock while a full writer waits for its readers.
_LONGEST_WAIT = duration(milliseconds=100)

# Events besides messages.
STATUS_OF_READERS = DDSStatus.RequestedIncompatibleQos
STATUS_OF_WRITERS = DDSStatus.OfferedIncompatibleQos | DDSStatus.PublicationMatched

# Ids from the DDS specification of the policies that can differ between ROS nodes.
_POLICIES = {
    2: ("durability", "a latched topic needs a publisher that is transient local"),
    11: ("reliability", "a reliable subscriber needs a publisher that is reliable"),
    23: ("data representation", "both must use plain CDR (XCDR1), as ROS 2 does"),
}


def quality(topic: Topic) -> Qos:
    """Return the quality of service of a topic, for its writer and its readers.

    Parameters
    ----------
    topic : Topic
        Its delivery and type are used.

    Returns
    -------
    Qos
        As in ROS 2.
    """
    depth = _TF_DEPTH if topic.type_name == "tf2_msgs/TFMessage" else _DEPTHS[topic.delivery]
    is_latched = topic.delivery in (Delivery.LATCHED, Delivery.LATCHED_MANY)
    is_sensor = topic.delivery is Delivery.SENSOR
    return Qos(
        Policy.Reliability.BestEffort if is_sensor else Policy.Reliability.Reliable(_LONGEST_WAIT),
        Policy.Durability.TransientLocal if is_latched else Policy.Durability.Volatile,
        Policy.History.KeepLast(depth),
        # What a writer keeps for late subscribers.
        Policy.DurabilityService(0, Policy.History.KeepLast(depth), -1, -1, -1),
        Policy.WriterDataLifecycle(autodispose=False),
        Policy.DataRepresentation(use_cdrv0_representation=True),
        # The node must not receive its own messages.
        Policy.IgnoreLocal.Participant,
        # ROS 2 since Iron warns of endpoints without the hash of their type.
        Policy.Userdata(f"typehash={type_hash(topic.type_name)};".encode()),
    )


def mismatch(end: DataReader | DataWriter) -> str | None:
    """Name the policy that has kept another end from matching since the last call.

    Parameters
    ----------
    end : DataReader or DataWriter
        Of a topic.

    Returns
    -------
    str or None
        For people; None if all match.
    """
    if isinstance(end, DataReader):
        status, other = end.get_requested_incompatible_qos_status(), "publisher"
    else:
        status, other = end.get_offered_incompatible_qos_status(), "subscriber"
    if not status.total_count_change:
        return None
    name, advice = _POLICIES.get(status.last_policy_id, (f"policy {status.last_policy_id}", ""))
    advice = advice or "compare both ends with `ros2 topic info --verbose`"
    return f"a {other} does not fit in {name}: {advice}"
