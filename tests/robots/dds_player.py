"""Play a bag of ROS 2 into plain DDS, as it is: run as a program with bag, speed and topics."""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path

from cyclonedds.domain import DomainParticipant
from cyclonedds.qos import Policy
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

sys.path.insert(0, str(Path(__file__).parent))

from dds_robot import RELIABLE, writer

from firstfix.ros.dds.types import Cdr


def main() -> None:
    """Play."""
    bag, speed, *topics = sys.argv[1:]
    participant = DomainParticipant(int(os.environ["ROS_DOMAIN_ID"]))
    store = get_typestore(Stores.ROS2_HUMBLE)
    with AnyReader([Path(bag)], default_typestore=store) as reader:
        chosen = [c for c in reader.connections if c.topic.removeprefix("/") in topics]
        writers = {}
        for connection in chosen:
            is_static = connection.topic == "/tf_static"
            kept = Policy.Durability.TransientLocal if is_static else Policy.Durability.Volatile
            kind = connection.msgtype.replace("/msg/", "/")
            writers[connection.topic] = writer(
                participant, f"rt{connection.topic}", kind, RELIABLE, kept
            )
        while not all(w.get_matched_subscriptions() for w in writers.values()):
            time.sleep(0.05)
        began, first = time.monotonic(), reader.start_time
        for connection, stamp, data in reader.messages(chosen):
            due = began + 1e-9 * (stamp - first) / float(speed)
            time.sleep(max(0.0, due - time.monotonic()))
            writers[connection.topic].write(Cdr(bytes(data)))
    time.sleep(1.0)


if __name__ == "__main__":
    main()
