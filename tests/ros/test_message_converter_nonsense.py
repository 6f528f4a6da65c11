"""Invalid messages: errors of ours at most, and afterwards everything works."""

from __future__ import annotations

import contextlib
from types import SimpleNamespace as Message

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from recorder import Speaker

from firstfix.core.errors import InputError
from firstfix.core.se2 import SE2
from firstfix.localizer.localizer import Localizer
from firstfix.localizer.states import State
from firstfix.ros.channels import Channel
from firstfix.ros.exact_stamps import ExactStamps
from firstfix.ros.message_converter import MessageConverter
from firstfix.ros.node_config import NodeConfig

THERE = SE2(4.0, 3.0, 1.0)
NUMBERS = (
    st.floats() | st.sampled_from([0.0, 1e-300, 1e9, -1e9, 1e300, 9e306]) | st.floats(-10.0, 10.0)
)
FRAMES = st.sampled_from(["map", "odom", "base_footprint", "laser", "", "/odom", "elsewhere"])
STAMPS = st.builds(
    lambda sec, nanosec: Message(sec=sec, nanosec=nanosec),
    st.integers(-(2**31), 2**31 - 1) | st.integers(95, 105),
    st.integers(0, 2**32 - 1),
)
HEADERS = st.builds(Message, stamp=STAMPS, frame_id=FRAMES)
POINTS = st.builds(Message, x=NUMBERS, y=NUMBERS, z=NUMBERS)
LEVEL = st.builds(Message, x=st.just(0.0), y=st.just(0.0), z=NUMBERS, w=NUMBERS)
TURNS = LEVEL | st.builds(Message, x=NUMBERS, y=NUMBERS, z=NUMBERS, w=NUMBERS)
TRANSFORMS = st.builds(
    Message,
    header=HEADERS,
    child_frame_id=FRAMES,
    transform=st.builds(Message, translation=POINTS, rotation=TURNS),
)
POSES = st.builds(Message, pose=st.builds(Message, position=POINTS, orientation=TURNS))
MAPS = st.builds(
    Message,
    header=HEADERS,
    data=st.lists(st.integers(-2, 101), max_size=30),
    info=st.builds(
        Message,
        width=st.integers(0, 6),
        height=st.integers(0, 6),
        resolution=NUMBERS,
        origin=st.builds(Message, position=POINTS, orientation=TURNS),
    ),
)
SCANS = st.builds(
    Message,
    header=HEADERS,
    angle_min=NUMBERS,
    angle_increment=NUMBERS | st.just(0.05),
    range_min=NUMBERS | st.just(0.1),
    range_max=NUMBERS | st.just(10.0),
    ranges=st.lists(NUMBERS, max_size=100).map(np.array),
)
TFS = st.builds(Message, transforms=st.lists(TRANSFORMS, max_size=3))
# What changes the robot, its clock or its world in earnest.
CHANGES = st.one_of(
    st.tuples(st.sampled_from([Channel.TF, Channel.TF_STATIC]), TFS),
    st.tuples(
        st.just(Channel.ODOM), st.builds(Message, header=HEADERS, child_frame_id=FRAMES, pose=POSES)
    ),
    st.tuples(st.just(Channel.MAP), MAPS),
)
NUISANCES = st.one_of(
    st.tuples(st.just(Channel.INITIAL_POSE), st.builds(Message, header=HEADERS, pose=POSES)),
    st.tuples(st.just(Channel.SCAN), SCANS),
    st.tuples(
        st.sampled_from([Channel.CLIFF, Channel.WHEEL_DROP, Channel.BUMPER, Channel.KIDNAPPED]),
        st.builds(Message, wheel=st.integers(0, 3), state=st.integers(0, 255))
        | st.builds(Message, data=st.booleans() | NUMBERS),
    ),
    st.tuples(st.sampled_from([Channel.RESET, Channel.UPDATE]), st.none()),
)
HEARD = CHANGES | NUISANCES


class Pair:
    """What a node has, without its thread."""

    def __init__(self, cache):
        self._converter = MessageConverter(NodeConfig(), ExactStamps(), lambda subject, text: None)
        self.localizer = Localizer(cache_dir=cache)

    def take(self, received, message):
        for given_ in self._converter.convert(received, message):
            self.localizer.handle(given_)


@pytest.fixture(scope="module")
def cache(tmp_path_factory):
    return tmp_path_factory.mktemp("maps")


@pytest.mark.slow
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=60)
@given(st.lists(HEARD, max_size=12), st.lists(HEARD, max_size=12))
def test_any_message_is_converted_or_raises_an_error_of_ours(ros2, hall_plan, cache, before, after):
    robot = Speaker(ros2, hall_plan, THERE)
    pair = Pair(cache)
    for messages in (before, after):
        for received, message in messages:
            with contextlib.suppress(InputError):
                pair.take(received, message)
        for received, message in ((Channel.MAP, robot.map()), (Channel.TF_STATIC, robot.fixed())):
            with contextlib.suppress(InputError):
                pair.take(received, message)
        robot.move()
        with contextlib.suppress(InputError):
            robot.report(pair.take)
    assert pair.localizer.state in State


@pytest.mark.slow
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=40)
@given(st.lists(NUISANCES, max_size=12))
def test_after_any_invalid_messages_a_robot_is_found(ros2, hall_plan, cache, messages):
    robot = Speaker(ros2, hall_plan, THERE)
    pair = Pair(cache)
    pair.take(Channel.MAP, robot.map())
    pair.take(Channel.TF_STATIC, robot.fixed())
    robot.report(pair.take)
    assert pair.localizer.state is State.LOCALIZED
    for received, message in messages:
        with contextlib.suppress(InputError):
            pair.take(received, message)
    for received in (Channel.CLIFF, Channel.WHEEL_DROP, Channel.BUMPER, Channel.KIDNAPPED):
        for which in range(4):
            pair.take(received, Message(wheel=which, state=0))
    for _ in range(30):
        robot.move()
        robot.report(pair.take)
    assert pair.localizer.state is State.LOCALIZED
