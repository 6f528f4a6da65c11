from xml.etree import ElementTree

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firstfix.core.errors import InputError
from firstfix.ros.dds.domain import domain_settings


def configuration(**environment):
    text = domain_settings(environment).configuration
    return ElementTree.fromstring(text)  # noqa: S314 - our own text


def peers(**environment):
    return [peer.get("address") for peer in configuration(**environment).iter("Peer")]


def test_without_variables_the_robots_of_the_local_network_are_found():
    assert domain_settings({}).number == 0
    assert configuration().find("*/Discovery") is None
    assert configuration().find("*/General") is None


def test_the_domain_is_that_of_ros():
    assert domain_settings({"ROS_DOMAIN_ID": "42"}).number == 42
    assert domain_settings({"ROS_DOMAIN_ID": ""}).number == 0


@pytest.mark.parametrize("text", ["-1", "233", "x", "1.5", "²", "9" * 5000])
def test_an_invalid_domain_is_refused(text):
    with pytest.raises(InputError, match="ROS_DOMAIN_ID from 0 to 232"):
        domain_settings({"ROS_DOMAIN_ID": text})


def test_endpoints_match_by_the_name_of_their_type_alone():
    ignored = configuration().findtext("*/Compatibility/IgnoreTypeInformation")
    assert ignored is not None
    assert "1.15" in ignored.split(",")


@pytest.mark.parametrize(
    "environment", [{"ROS_LOCALHOST_ONLY": "1"}, {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}]
)
def test_localhost_means_no_multicast_and_one_peer(environment):
    root = configuration(**environment)
    assert root.findtext("*/General/AllowMulticast") == "false"
    assert root.findtext("*/Discovery/ParticipantIndex") == "auto"
    assert peers(**environment) == ["localhost"]


@pytest.mark.parametrize("distribution", ["foxy", "galactic", "humble"])
def test_before_iron_localhost_keeps_multicast_on_the_loopback_interface(distribution):
    environment = {"ROS_LOCALHOST_ONLY": "1", "ROS_DISTRO": distribution}
    root = configuration(**environment)
    assert root.find("*/General/AllowMulticast") is None
    (interface,) = root.iter("NetworkInterface")
    assert interface.get("address") == "127.0.0.1"
    assert peers(**environment) == ["127.0.0.1"]


@pytest.mark.parametrize("distribution", ["humble", "jazzy", "kilted", "lyrical"])
def test_the_variables_of_ros_count_in_every_distribution(distribution):
    environment = {"ROS_DISTRO": distribution, "ROS_DOMAIN_ID": "7"}
    assert domain_settings(environment).number == 7
    assert peers(**environment, ROS_STATIC_PEERS="10.0.0.1;robot.local") == [
        "10.0.0.1",
        "robot.local",
    ]
    reach = "ROS_AUTOMATIC_DISCOVERY_RANGE"
    assert configuration(**environment, **{reach: "SUBNET"}).find("*/General") is None
    near = configuration(**environment, **{reach: "LOCALHOST"})
    has_multicast = near.findtext("*/General/AllowMulticast") != "false"
    assert has_multicast == (distribution == "humble")
    off = configuration(**environment, **{reach: "OFF"})
    assert off.findtext("*/Discovery/ParticipantIndex") == "none"
    assert off.findtext("*/General/AllowMulticast") == "false"


def test_the_older_variable_counts_where_both_are_set():
    both = {"ROS_LOCALHOST_ONLY": "1", "ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET"}
    assert peers(**both, ROS_STATIC_PEERS="10.0.0.1") == ["localhost"]
    assert peers(ROS_LOCALHOST_ONLY="0") == []


def test_static_peers_are_looked_for_besides():
    assert peers(ROS_STATIC_PEERS="10.0.0.1; robot.local ;") == ["10.0.0.1", "robot.local"]
    reach = "ROS_AUTOMATIC_DISCOVERY_RANGE"
    assert peers(ROS_STATIC_PEERS="a", **{reach: "LOCALHOST"}) == ["localhost", "a"]
    assert peers(ROS_STATIC_PEERS="a", **{reach: "SYSTEM_DEFAULT"}) == []
    assert configuration(ROS_STATIC_PEERS="a").find("*/General") is None


def test_discovery_range_off_finds_no_one():
    root = configuration(ROS_AUTOMATIC_DISCOVERY_RANGE="OFF", ROS_STATIC_PEERS="a")
    assert root.findtext("*/General/AllowMulticast") == "false"
    assert root.find("*/Discovery/Tag") is not None
    assert not list(root.iter("Peer"))


def test_a_range_that_does_not_exist_is_refused():
    with pytest.raises(InputError, match="SUBNET, LOCALHOST, OFF, SYSTEM_DEFAULT"):
        domain_settings({"ROS_AUTOMATIC_DISCOVERY_RANGE": "MOON"})


def test_the_users_own_configuration_takes_precedence():
    text = domain_settings({"CYCLONEDDS_URI": "file:///etc/mine.xml"}).configuration
    assert text.endswith("</CycloneDDS>,file:///etc/mine.xml")


def test_settings_that_cyclone_dds_lacks_are_rejected():
    with pytest.raises(InputError, match="ASCII"):
        domain_settings({"CYCLONEDDS_URI": "file:///home/zoë/mine.xml"})


@given(st.text(st.characters(min_codepoint=32, max_codepoint=126)))
def test_peers_cannot_break_the_configuration(text):
    assert len(peers(ROS_STATIC_PEERS=text)) == sum(bool(p.strip()) for p in text.split(";"))


def test_dds_is_here_where_it_must_be(dds):
    assert dds.domain > 0  # other modules of tests are passed over where it is missing
