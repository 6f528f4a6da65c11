"""The entry of a node in the ROS graph, for `ros2 node list` and `ros2 node info`."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from cyclonedds.core import Entity

from firstfix.ros.channels import Delivery, Topic
from firstfix.ros.dds.domain import is_before_iron
from firstfix.ros.dds.types import make

GRAPH = Topic("ros_discovery_info", "rmw_dds_common/ParticipantEntitiesInfo", Delivery.LATCHED)

# ROS 2 recognizes its participants by this.
USER_DATA = b"enclave=/;"


def entities(
    participant: Entity,
    namespace: str,
    name: str,
    readers: Iterable[Entity],
    writers: Iterable[Entity],
) -> Any:
    """Build the message that lists the endpoints of a node.

    Parameters
    ----------
    participant : Entity
        That of the node.
    namespace, name : str
        Of the node; the namespace with its leading slash.
    readers, writers : iterable of Entity
        Of its topics.

    Returns
    -------
    message
        For `GRAPH`.
    """
    node = make(
        "rmw_dds_common/NodeEntitiesInfo",
        node_namespace=namespace,
        node_name=name,
        reader_gid_seq=[_gid(reader) for reader in readers],
        writer_gid_seq=[_gid(writer) for writer in writers],
    )
    return make(GRAPH.type_name, gid=_gid(participant), node_entities_info_seq=[node])


def _gid(entity: Entity) -> Any:
    size = 24 if is_before_iron() else 16  # Iron shortened the ids of participants
    padded = entity.guid.bytes.ljust(size, b"\0")
    return make("rmw_dds_common/Gid", data=np.frombuffer(padded, np.uint8))
