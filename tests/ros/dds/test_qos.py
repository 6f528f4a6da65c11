import pytest

pytest.importorskip("cyclonedds")

from cyclonedds.qos import Policy

from firstfix.ros.channels import (
    PARTICLES,
    Channel,
    Delivery,
    Topic,
    published_topics,
    subscribed_topics,
)
from firstfix.ros.dds.qos import quality
from firstfix.ros.dds.types import type_hash
from firstfix.ros.node_config import Mode, NodeConfig

HEARD = subscribed_topics(NodeConfig())


@pytest.mark.parametrize(
    ("received", "reliable", "latched", "depth"),
    [
        (Channel.SCAN, False, False, 5),
        (Channel.ODOM, False, False, 5),
        (Channel.MAP, True, True, 1),
        (Channel.TF, True, False, 100),
        (Channel.TF_STATIC, True, True, 100),
        (Channel.INITIAL_POSE, True, False, 10),
        (Channel.WHEEL_DROP, True, False, 10),
    ],
)
def test_topics_are_delivered_as_nav2_delivers_them(received, reliable, latched, depth):
    policies = set(quality(HEARD[received]))
    assert (Policy.Reliability.BestEffort not in policies) is reliable
    assert (Policy.Durability.TransientLocal in policies) is latched
    assert Policy.History.KeepLast(depth) in policies


def test_data_is_plain_cdr_and_own_messages_are_ignored():
    topics = [*HEARD.values(), *published_topics(NodeConfig(mode=Mode.FULL), PARTICLES)]
    for topic in topics:
        policies = set(quality(topic))
        assert Policy.DataRepresentation(use_cdrv0_representation=True) in policies
        assert Policy.IgnoreLocal.Participant in policies


def test_endpoints_announce_the_hash_of_their_type():
    topic = Topic("flag", "std_msgs/Bool", Delivery.RELIABLE)
    reported = next(p.data for p in quality(topic) if isinstance(p, Policy.Userdata))
    assert reported.decode() == f"typehash={type_hash('std_msgs/Bool')};"
