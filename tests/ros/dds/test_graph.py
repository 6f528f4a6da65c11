import pytest

pytest.importorskip("cyclonedds")

from cyclonedds.domain import DomainParticipant

from firstfix.ros.channels import PARTICLES, Delivery, Topic
from firstfix.ros.dds import types as dds_types
from firstfix.ros.dds.endpoints import Receiver, Sender
from firstfix.ros.dds.graph import GRAPH, entities
from firstfix.ros.dds.types import decode, encode

FLAG = Topic("flag", "std_msgs/Bool", Delivery.RELIABLE)


@pytest.fixture(params=[("humble", 24), ("jazzy", 16), ("kilted", 16), ("lyrical", 16), (None, 16)])
def id_size(request, monkeypatch):
    """Size of an id in a distribution of ROS 2."""
    distribution, size = request.param
    forget_types()
    monkeypatch.delenv("ROS_DISTRO", raising=False)
    if distribution:
        monkeypatch.setenv("ROS_DISTRO", distribution)
    yield size
    forget_types()


def forget_types():
    for cached in (dds_types._store, dds_types.described, dds_types._struct):
        cached.cache_clear()


def test_a_node_announces_its_endpoints(dds, id_size):
    receiver = Receiver(dds.participant, FLAG, "rt/flag")
    sender = Sender(dds.participant, PARTICLES, "rt/particle_cloud")
    message = entities(dds.participant, "/robot1", "finder", [receiver.entity], [sender.entity])
    reported = decode(GRAPH.type_name, encode(GRAPH.type_name, message))
    assert reported.gid.data.tobytes() == padded(dds.participant, id_size)
    (node,) = reported.node_entities_info_seq
    assert (node.node_namespace, node.node_name) == ("/robot1", "finder")
    assert [gid.data.tobytes() for gid in node.reader_gid_seq] == [padded(receiver.entity, id_size)]
    assert [gid.data.tobytes() for gid in node.writer_gid_seq] == [padded(sender.entity, id_size)]


def padded(entity, size):
    return entity.guid.bytes + bytes(size - 16)


def test_late_participants_discover_an_earlier_node(dds, id_size):
    participant = DomainParticipant(dds.domain)
    graph = Sender(participant, GRAPH, GRAPH.name)
    graph.send(entities(participant, "/", "finder", [], []))
    late = dds.ear_named(GRAPH.name, GRAPH.type_name)
    assert late.latched().node_entities_info_seq[0].node_name == "finder"
