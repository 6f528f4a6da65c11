"""Which outputs are published on which topics, and how often."""

import math

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from recorder import Recorder

from firstfix.amcl.particles import Particles
from firstfix.core.estimate import Evidence, Hypothesis
from firstfix.core.se2 import SE2
from firstfix.io.ros_messages.incoming import to_planar, to_pose, to_seconds, to_transform
from firstfix.io.ros_messages.outgoing import pose_with_covariance
from firstfix.localizer.outputs import Hypotheses, InitialPose, MotionRequest, Status, TrackedPose
from firstfix.localizer.states import State
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
    published_topics,
)
from firstfix.ros.exact_stamps import ExactStamps
from firstfix.ros.node_config import Mode, NodeConfig
from firstfix.ros.output_publisher import OutputPublisher
from firstfix.ros.transport import Severity

HERE, DRIFT = SE2(1.0, 2.0, 0.5), SE2(0.25, -0.5, 0.125)
COVARIANCE = np.diag([0.01, 0.04, 0.09])
EVIDENCE = Evidence(explained=0.9, short=0.05, through_wall=0.03, unknown=0.02, beams=120)
FULL, BOOTSTRAP = NodeConfig(mode=Mode.FULL), NodeConfig(mode=Mode.BOOTSTRAP)


def found(stamp=10.0):
    return [InitialPose(stamp, HERE, COVARIANCE), *tracked(stamp)]


def tracked(stamp=10.0, reason="90% of the beams fit"):
    pose = TrackedPose(stamp, HERE, COVARIANCE, DRIFT)
    return [pose, Status(stamp, State.LOCALIZED, reason, EVIDENCE)]


def several(stamp, n=2, *, motion=True):
    places = tuple(
        Hypothesis(SE2(8.0 * i, 0.0, 0.0), COVARIANCE, 0.2, 1 / n, EVIDENCE) for i in range(n)
    )
    outputs = [
        Hypotheses(stamp, places),
        Status(stamp, State.DISAMBIGUATING, f"{n} places", EVIDENCE),
    ]
    return [*outputs, MotionRequest(stamp, 0.5, 1.25, 0.3)] if motion else outputs


def cloud(n=3):
    return Particles(np.arange(float(n)), np.zeros(n), np.zeros(n), np.full(n, 1.0 / n))


def searching(stamp, reason="nothing fits", evidence=None):
    return [Status(stamp, State.SEARCHING, reason, evidence)]


def announced(recorder, config, *batches, particles=None):
    publisher = OutputPublisher(config, ExactStamps(), recorder)
    for outputs in batches:
        publisher.publish(outputs, particles)
    return publisher


def status_values(message):
    return {pair.key: pair.value for pair in message.status[0].values}


# ---- poses while tracking


def test_bootstrap_publishes_one_initial_pose_and_no_transform(recorder):
    announced(recorder, BOOTSTRAP, found(10.0), tracked(10.1), tracked(10.2), particles=cloud())
    (message,) = recorder.on(INITIAL_POSE)
    reported = to_pose(message)
    assert (reported.parent, reported.stamp) == ("map", 10.0)
    assert to_planar(reported).distance_to(HERE) < 1e-12
    covariance = np.reshape(message.pose.covariance, (6, 6))
    assert [covariance[i, i] for i in (0, 1, 5)] == [0.01, 0.04, 0.09]
    assert {topic for topic, _ in recorder.published} == {INITIAL_POSE, LOCALIZED, STATUS}


def test_full_tracks_the_robot_itself(recorder):
    announced(recorder, FULL, found(10.0), tracked(10.5))
    assert recorder.on(INITIAL_POSE) == []
    assert [to_pose(message).stamp for message in recorder.on(AMCL_POSE)] == [10.0, 10.5]
    first, _ = (to_transform(message.transforms[0]) for message in recorder.on(TF))
    assert (first.parent, first.child) == ("map", "odom")
    assert to_planar(first).distance_to(DRIFT) < 1e-12


def test_transforms_hold_until_the_next_one(recorder):
    announced(recorder, NodeConfig(mode=Mode.FULL, transform_tolerance=0.25), found())
    (message,) = recorder.on(TF)
    assert to_seconds(message.transforms[0].header.stamp) == 10.25


def test_another_node_may_broadcast_the_transform(recorder):
    announced(recorder, NodeConfig(mode=Mode.FULL, tf_broadcast=False), found())
    assert recorder.on(TF) == []
    assert len(recorder.on(AMCL_POSE)) == 1


def test_frames_are_those_of_the_settings(recorder):
    frames = {"global_frame_id": "floor2", "odom_frame_id": "wheels"}
    announced(recorder, NodeConfig(mode=Mode.FULL, **frames), found(), several(11.0))
    (transform,) = recorder.on(TF)[0].transforms
    assert (transform.header.frame_id, transform.child_frame_id) == ("floor2", "wheels")
    assert recorder.on(AMCL_POSE)[0].header.frame_id == "floor2"
    assert recorder.on(HYPOTHESES)[0].header.frame_id == "floor2"


@pytest.mark.parametrize("config", [FULL, BOOTSTRAP])
@pytest.mark.parametrize("particles", [PARTICLES, PARTICLE_POSES])
def test_nothing_is_published_that_was_not_advertised(ros2, config, particles):
    recorder = Recorder(ros2, particles)
    recorder.listening = {topic.name: 1 for topic in (particles, INITIAL_POSE, MARKERS)}
    announced(recorder, config, searching(1.0), several(2.0), found(3.0), particles=cloud())
    reported = set(published_topics(config, particles))
    assert {topic for topic, _ in recorder.published} == reported - {MAP_ID}


# ---- another AMCL


def test_an_amcl_that_comes_late_gets_the_pose_of_now(recorder):
    publisher = announced(recorder, BOOTSTRAP, found(10.0))
    recorder.listening["initialpose"] = 1
    for stamp in (20.0, 20.1):
        publisher.publish(tracked(stamp), None)
    assert [to_pose(message).stamp for message in recorder.on(INITIAL_POSE)] == [10.0, 20.0]


def test_an_amcl_that_is_restarted_gets_the_pose_again(recorder):
    recorder.listening["initialpose"] = 1
    publisher = announced(recorder, BOOTSTRAP, found(10.0))
    for stamp, listening in ((11.0, 1), (12.0, 0), (13.0, 0), (14.0, 1), (15.0, 1)):
        recorder.listening["initialpose"] = listening
        publisher.publish(tracked(stamp), None)
    assert [to_pose(message).stamp for message in recorder.on(INITIAL_POSE)] == [10.0, 14.0]


def test_a_pose_found_elsewhere_is_published_again(recorder):
    announced(recorder, BOOTSTRAP, found(10.0), tracked(11.0), found(12.0))
    assert len(recorder.on(INITIAL_POSE)) == 2


def test_own_poses_are_distinguished_from_those_of_people(recorder, ros2):
    publisher = announced(recorder, BOOTSTRAP, *(found(float(stamp)) for stamp in range(10, 15)))
    assert all(publisher.is_own(message) for message in recorder.on(INITIAL_POSE))
    for stamp, T in ((10.0, SE2(1.0, 2.0, 0.6)), (10.5, HERE)):
        person = pose_with_covariance(ros2.make, stamp, "map", T, COVARIANCE)
        assert not publisher.is_own(ros2.sent(person))


def test_the_memory_of_own_poses_is_bounded(recorder):
    publisher = announced(recorder, BOOTSTRAP, *(found(float(stamp)) for stamp in range(100)))
    assert sum(publisher.is_own(message) for message in recorder.on(INITIAL_POSE)) == 10


# ---- particles


def stamps_of(messages):
    return [to_seconds(message.header.stamp) for message in messages]


def test_a_cloud_is_published_at_its_rate_and_only_to_subscribers(recorder):
    publisher = OutputPublisher(NodeConfig(mode=Mode.FULL, cloud_rate=2.0), ExactStamps(), recorder)
    for i in range(10):
        recorder.listening[PARTICLES.name] = int(i >= 2)
        publisher.publish(tracked(10.0 + 0.2 * i), cloud())
    assert stamps_of(recorder.on(PARTICLES)) == pytest.approx([10.4, 11.0, 11.6])
    publisher.publish(tracked(3.0), cloud())  # the clock was set back
    assert stamps_of(recorder.on(PARTICLES))[-1] == 3.0


def test_a_rate_of_zero_is_none(recorder):
    recorder.listening[PARTICLES.name] = 1
    announced(recorder, NodeConfig(mode=Mode.FULL, cloud_rate=0.0), found(), particles=cloud())
    assert recorder.on(PARTICLES) == []


def test_a_cloud_has_the_type_of_the_transport(wire):
    for topic in (PARTICLES, PARTICLE_POSES):
        recorder = Recorder(wire, topic)
        recorder.listening[topic.name] = 1
        announced(recorder, FULL, found(), particles=cloud(4))
        (message,) = recorder.on(topic)
        poses = message.poses if topic is PARTICLE_POSES else [p.pose for p in message.particles]
        assert_array_equal([pose.position.x for pose in poses], [0.0, 1.0, 2.0, 3.0])


def test_without_a_belief_there_is_no_cloud(recorder):
    recorder.listening[PARTICLES.name] = 1
    announced(recorder, FULL, found(), particles=None)
    assert recorder.on(PARTICLES) == []


# ---- places that are left open


def test_places_are_published_and_cleared_when_the_robot_is_found(recorder):
    announced(recorder, BOOTSTRAP, several(10.0, 3), several(11.0, 2), found(12.0), tracked(13.0))
    assert [len(message.poses) for message in recorder.on(HYPOTHESES)] == [3, 2, 0]
    assert [p.position.x for p in recorder.on(HYPOTHESES)[0].poses] == [0.0, 8.0, 16.0]


def test_places_are_cleared_when_the_search_restarts(recorder):
    announced(recorder, FULL, several(10.0, 3), searching(11.0), searching(11.1))
    assert [len(message.poses) for message in recorder.on(HYPOTHESES)] == [3, 0]
    assert status_values(recorder.on(STATUS)[-1])["hypotheses"] == "0"


def test_the_motion_that_would_decide_is_in_the_status_of_its_places(recorder):
    announced(recorder, FULL, several(10.0), several(11.0, motion=False), found(12.0))
    with_motion, without, after = map(status_values, recorder.on(STATUS))
    assert (with_motion["turn_rad"], with_motion["ahead_m"]) == ("0.50", "1.25")
    assert with_motion["hypotheses"] == "2"
    assert "turn_rad" not in without
    assert "turn_rad" not in after


# ---- status and log


def test_a_status_has_state_reason_and_evidence(recorder):
    announced(recorder, FULL, found())
    (message,) = recorder.on(STATUS)
    (status,) = message.status
    assert status.level == 0
    assert status.name == "firstfix: localization"
    assert status.message == "LOCALIZED: 90% of the beams fit"
    assert status_values(message) == {
        "state": "LOCALIZED",
        "mode": "full",
        "hypotheses": "0",
        "explained": "0.900",
        "short": "0.050",
        "through_wall": "0.030",
        "unknown": "0.020",
        "beams": "120",
    }


def test_a_robot_that_is_not_found_is_a_warning_and_one_without_a_map_an_error(recorder):
    states = [Status(float(i), state, "so it is") for i, state in enumerate(State)]
    announced(recorder, FULL, *([status] for status in states))
    levels = {status_values(m)["state"]: m.status[0].level for m in recorder.on(STATUS)}
    assert levels == dict.fromkeys((state.value for state in State), 1) | {
        "NO_MAP": 2,
        "LOCALIZED": 0,
    }


def test_status_comes_at_its_rate_and_at_every_change(recorder):
    publisher = OutputPublisher(
        NodeConfig(mode=Mode.FULL, status_rate=2.0), ExactStamps(), recorder
    )
    for i in range(11):
        publisher.publish(tracked(10.0 + 0.1 * i), None)
    assert stamps_of(recorder.on(STATUS)) == pytest.approx([10.0, 10.5, 11.0])
    publisher.publish(searching(11.01), None)
    publisher.publish(tracked(11.02), None)
    assert stamps_of(recorder.on(STATUS))[-2:] == pytest.approx([11.01, 11.02])
    publisher.publish(tracked(3.0), None)  # the clock was set back
    assert stamps_of(recorder.on(STATUS))[-1] == 3.0


def test_the_log_has_changes_and_at_a_low_rate_why_nothing_is_found(recorder):
    publisher = OutputPublisher(FULL, ExactStamps(), recorder)
    publisher.publish(searching(0.0, "a map came"), None)
    for i in range(1, 25):
        publisher.publish(searching(1000.0 + i, f"only {i}% fit"), None)
    publisher.publish(found(1030.0), None)
    for i in range(100):
        publisher.publish(tracked(1031.0 + i), None)
    assert recorder.logged(Severity.INFO) == [
        "SEARCHING: a map came",
        "SEARCHING: only 1% fit",
        "SEARCHING: only 11% fit",
        "SEARCHING: only 21% fit",
        "LOCALIZED: 90% of the beams fit",
    ]


def test_nan_and_infinity_do_no_harm(recorder):
    evidence = Evidence(math.nan, math.nan, math.nan, math.nan, 0)
    announced(recorder, FULL, searching(1.0, "", evidence))
    assert status_values(recorder.on(STATUS)[0])["explained"] == "nan"


# ---- exact stamps


def test_outputs_for_a_scan_have_its_stamp_to_the_nanosecond(recorder, ros2):
    """At today's times a float of seconds is off by up to 120 ns."""
    stamps = ExactStamps()
    time = ros2.make("builtin_interfaces/Time", sec=1_764_000_000, nanosec=123_456_789)
    seconds = stamps.add(time)
    config = NodeConfig(mode=Mode.FULL, transform_tolerance=0.25)
    recorder.listening = {PARTICLES.name: 1}
    publisher = OutputPublisher(config, stamps, recorder)
    publisher.publish([*several(seconds), *found(seconds)], cloud())
    for topic in (AMCL_POSE, HYPOTHESES, PARTICLES, STATUS):
        stamp = recorder.on(topic)[0].header.stamp
        assert (stamp.sec, stamp.nanosec) == (1_764_000_000, 123_456_789), topic.name
    ahead = recorder.on(TF)[0].transforms[0].header.stamp
    assert (ahead.sec, ahead.nanosec) == (1_764_000_000, 373_456_789)


# ---- stale


def test_without_scans_the_status_is_stale_with_the_reason_and_the_robot_not_localized(recorder):
    publisher = announced(recorder, FULL, found(10.0))
    publisher.publish_stale(2.5)
    publisher.publish_stale(5.0)  # once is enough
    _, stale = recorder.on(STATUS)
    assert stale.status[0].level == 3
    assert stale.status[0].message == "STALE: no scan for 2.5 s; the state was LOCALIZED"
    assert status_values(stale)["state"] == "STALE"
    assert to_seconds(stale.header.stamp) == 12.5
    assert [message.data for message in recorder.on(LOCALIZED)] == [True, False]
    publisher.publish(tracked(12.6), None)
    assert recorder.on(STATUS)[-1].status[0].level == 0
    assert recorder.on(LOCALIZED)[-1].data is True


def test_localized_is_published_when_it_changes(recorder):
    announced(recorder, FULL, searching(1.0), searching(2.0), found(3.0), tracked(4.0))
    assert [message.data for message in recorder.on(LOCALIZED)] == [False, True]


# ---- markers


def test_markers_show_each_place_with_its_probability(recorder):
    recorder.listening = {MARKERS.name: 1}
    publisher = announced(recorder, FULL, several(1.0, 4))
    (message,) = recorder.on(MARKERS)
    clear, *shown = message.markers
    assert clear.action == 3
    assert [marker.text for marker in shown[1::2]] == ["25%"] * 4
    assert [marker.pose.position.x for marker in shown[::2]] == [0.0, 8.0, 16.0, 24.0]
    assert [marker.color.a for marker in shown] == pytest.approx([0.4] * 8)
    assert len({marker.id for marker in shown}) == 8
    publisher.publish(found(2.0), None)
    assert [marker.action for marker in recorder.on(MARKERS)[-1].markers] == [3]


def test_no_markers_are_made_without_subscribers(recorder):
    announced(recorder, FULL, several(1.0, 4))
    assert recorder.on(MARKERS) == []
