"""The names that users know, and what may be wrong with a table."""

import pytest

from firstfix.ros.channels import (
    AMCL_POSE,
    HYPOTHESES,
    INITIAL_POSE,
    LOCALIZED,
    MAP_ID,
    MARKERS,
    PARTICLE_POSES,
    PARTICLES,
    STATUS,
    TF,
    Channel,
    Delivery,
    published_topics,
    subscribed_topics,
)
from firstfix.ros.node_config import Mode, NodeConfig

# Inputs without a topic.
SERVICES = {Channel.RESET, Channel.UPDATE, Channel.INPUT}
# Subscribed to where a parameter names them.
FURTHER = {Channel.CLOUD, Channel.DEPTH, Channel.CAMERA_INFO, Channel.MAP_HINT}


def test_every_input_has_a_topic_or_a_service():
    assert set(subscribed_topics(NodeConfig())) == set(Channel) - SERVICES - FURTHER


def test_the_floor_is_told_to_a_node_with_a_site_only():
    assert Channel.MAP_HINT in subscribed_topics(NodeConfig(site="building"))


def test_names_are_those_of_nav2_and_kobuki():
    names = {received: topic.name for received, topic in subscribed_topics(NodeConfig()).items()}
    assert names == {
        Channel.SCAN: "scan",
        Channel.MAP: "map",
        Channel.TF: "/tf",
        Channel.TF_STATIC: "/tf_static",
        Channel.ODOM: "odom",
        Channel.INITIAL_POSE: "initialpose",
        Channel.POSITION_FIX: "position_fix",
        Channel.CLIFF: "events/cliff",
        Channel.WHEEL_DROP: "events/wheel_drop",
        Channel.BUMPER: "events/bumper",
        Channel.KIDNAPPED: "kidnapped",
    }


def test_topics_can_be_named_by_parameters():
    config = NodeConfig(scan_topic="base_scan", map_topic="map_updates")
    topics = subscribed_topics(config)
    assert (topics[Channel.SCAN].name, topics[Channel.MAP].name) == ("base_scan", "map_updates")


def test_a_map_of_its_own_needs_none_of_others():
    assert Channel.MAP not in subscribed_topics(NodeConfig(yaml_filename="map.yaml"))


def test_late_subscribers_get_maps_and_fixed_transforms():
    topics = subscribed_topics(NodeConfig())
    assert topics[Channel.MAP].delivery is Delivery.LATCHED
    assert topics[Channel.TF_STATIC].delivery is Delivery.LATCHED_MANY
    assert topics[Channel.SCAN].delivery is Delivery.SENSOR
    assert all(topic.delivery is Delivery.LATCHED for topic in (AMCL_POSE, HYPOTHESES, STATUS))


def test_one_name_has_one_type():
    config = NodeConfig(mode=Mode.FULL)
    for particles in (PARTICLES, PARTICLE_POSES):
        topics = {
            *subscribed_topics(config).values(),
            *published_topics(config, particles),
            INITIAL_POSE,
            LOCALIZED,
            MARKERS,
        }
        types = {(topic.name, topic.type_name) for topic in topics}
        assert len(types) == len({name for name, _ in types})


@pytest.mark.parametrize("particles", [PARTICLES, PARTICLE_POSES])
def test_each_mode_publishes_its_own_topics(particles):
    bootstrap = published_topics(NodeConfig(mode=Mode.BOOTSTRAP), particles)
    assert set(bootstrap) == {MAP_ID, INITIAL_POSE, HYPOTHESES, LOCALIZED, MARKERS, STATUS}
    full = published_topics(NodeConfig(mode=Mode.FULL), particles)
    assert set(full) == {MAP_ID, AMCL_POSE, TF, particles, HYPOTHESES, LOCALIZED, MARKERS, STATUS}
    silent = NodeConfig(mode=Mode.FULL, tf_broadcast=False)
    assert TF not in published_topics(silent, particles)
