"""The names that users know, and what may be wrong with a table."""

import pytest

from firstfix.amcl.config import AmclConfig
from firstfix.ros.channels import (
    AMCL_POSE,
    HYPOTHESES,
    INITIAL_POSE,
    PARTICLE_POSES,
    PARTICLES,
    STATUS,
    TF,
    Delivery,
    Heard,
    heard_topics,
    said_topics,
)
from firstfix.ros.node_config import Mode, NodeConfig

# What no message on a topic tells.
SERVICES = {Heard.RESET, Heard.UPDATE, Heard.INPUT}


def test_everything_is_heard_on_a_topic_or_asked_of_a_service():
    assert set(heard_topics(NodeConfig())) == set(Heard) - SERVICES


def test_names_are_those_of_nav2_and_kobuki():
    names = {heard: topic.name for heard, topic in heard_topics(NodeConfig()).items()}
    assert names == {
        Heard.SCAN: "scan",
        Heard.MAP: "map",
        Heard.TF: "/tf",
        Heard.TF_STATIC: "/tf_static",
        Heard.ODOM: "odom",
        Heard.INITIAL_POSE: "initialpose",
        Heard.CLIFF: "events/cliff",
        Heard.WHEEL_DROP: "events/wheel_drop",
        Heard.BUMPER: "events/bumper",
        Heard.KIDNAPPED: "kidnapped",
    }


def test_topics_can_be_named_by_parameters():
    config = NodeConfig(amcl=AmclConfig(scan_topic="base_scan", map_topic="map_updates"))
    topics = heard_topics(config)
    assert (topics[Heard.SCAN].name, topics[Heard.MAP].name) == ("base_scan", "map_updates")


def test_a_map_of_its_own_needs_none_of_others():
    assert Heard.MAP not in heard_topics(NodeConfig(yaml_filename="map.yaml"))


def test_what_comes_late_still_gets_maps_and_fixed_transforms():
    topics = heard_topics(NodeConfig())
    assert topics[Heard.MAP].delivery is Delivery.LATCHED
    assert topics[Heard.TF_STATIC].delivery is Delivery.LATCHED_MANY
    assert topics[Heard.SCAN].delivery is Delivery.SENSOR
    assert all(topic.delivery is Delivery.LATCHED for topic in (AMCL_POSE, HYPOTHESES, STATUS))


def test_one_name_has_one_type():
    config = NodeConfig(mode=Mode.FULL)
    for particles in (PARTICLES, PARTICLE_POSES):
        topics = {*heard_topics(config).values(), *said_topics(config, particles), INITIAL_POSE}
        types = {(topic.name, topic.type_name) for topic in topics}
        assert len(types) == len({name for name, _ in types})


@pytest.mark.parametrize("particles", [PARTICLES, PARTICLE_POSES])
def test_each_mode_says_its_own(particles):
    bootstrap = said_topics(NodeConfig(mode=Mode.BOOTSTRAP), particles)
    assert set(bootstrap) == {INITIAL_POSE, HYPOTHESES, STATUS}
    full = said_topics(NodeConfig(mode=Mode.FULL), particles)
    assert set(full) == {AMCL_POSE, TF, particles, HYPOTHESES, STATUS}
    silent = NodeConfig(mode=Mode.FULL, amcl=AmclConfig(tf_broadcast=False))
    assert TF not in said_topics(silent, particles)
