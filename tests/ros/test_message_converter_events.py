"""Events and unusual scans become inputs, or one sentence why not."""

from types import SimpleNamespace as Message

import numpy as np
import pytest
from recorder import Speaker

from firstfix.core.errors import InputError, ScanError
from firstfix.core.odometry import Signal, SignalKind
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.io.ros_messages.outgoing import (
    laser_scan,
)
from firstfix.ros.channels import Channel


@pytest.fixture
def robot(wire, hall_plan):
    return Speaker(wire, hall_plan, SE2(4.0, 3.0, 1.0))


@pytest.fixture
def known(converter, robot):
    """A converter that has the pose of the laser, and odometry up to 100 s."""
    converter.convert(Channel.TF_STATIC, robot.fixed())
    converter.convert(Channel.TF, robot.tf())
    return converter


def kinds(inputs):
    return [type(given) for given in inputs]


@pytest.mark.parametrize(
    ("received", "name", "field", "kind"),
    [
        (Channel.CLIFF, "CliffEvent", "sensor", SignalKind.CLIFF),
        (Channel.WHEEL_DROP, "WheelDropEvent", "wheel", SignalKind.WHEEL_DROP),
        (Channel.BUMPER, "BumperEvent", "bumper", SignalKind.BUMPER),
    ],
)
def test_events_of_a_kobuki_are_signals(known, wire, received, name, field, kind):
    def event(state):
        more = {"bottom": 0} if received is Channel.CLIFF else {}
        return wire.sent(wire.make(f"kobuki/{name}", **{field: 1, "state": state}, **more))

    assert known.convert(received, event(0)) == []
    assert known.convert(received, event(1)) == [Signal(100.0, kind, active=True)]
    assert known.convert(received, event(0)) == [Signal(100.0, kind, active=False)]
    assert known.convert(received, event(0)) == []


def test_a_robot_stands_again_when_both_wheels_do(known):
    def wheel(which, state):
        (signal,) = known.convert(Channel.WHEEL_DROP, Message(wheel=which, state=state))
        return signal.active

    assert [wheel(0, 1), wheel(1, 1), wheel(0, 0), wheel(1, 0)] == [True, True, True, False]


def test_a_requested_search_ends_the_lifted_state(known):
    """A base that was restarted in the air does not report that it was set down."""
    known.convert(Channel.WHEEL_DROP, Message(wheel=0, state=1))
    known.convert(Channel.RESET, None)
    known.convert(Channel.WHEEL_DROP, Message(wheel=1, state=1))
    (signal,) = known.convert(Channel.WHEEL_DROP, Message(wheel=1, state=0))
    assert not signal.active


def test_kinds_of_events_do_not_mix(known):
    known.convert(Channel.WHEEL_DROP, Message(wheel=0, state=1))
    known.convert(Channel.CLIFF, Message(sensor=0, state=1))
    (signal,) = known.convert(Channel.CLIFF, Message(sensor=0, state=0))
    assert (signal.kind, signal.active) == (SignalKind.CLIFF, False)


def test_picked_up_is_a_signal_on_its_topic(known, wire):
    message = wire.sent(wire.make("std_msgs/Bool", data=True))
    assert known.convert(Channel.KIDNAPPED, message) == [
        Signal(100.0, SignalKind.PICKED_UP, active=True)
    ]


def test_another_message_on_the_topic_of_an_event_is_an_error_of_ours(known):
    with pytest.raises(InputError):
        known.convert(Channel.CLIFF, Message(data="false"))
    assert known.convert(Channel.TF, Message(transforms=[])) == []


def test_a_scan_may_have_one_beam_or_thousands(known, robot):
    for ranges in (np.ones(1, np.float32), np.ones(4000, np.float32)):
        scan = LaserScan(ranges, -1.0, 0.001, 0.1, 10.0, stamp=100.0)
        message = robot.wire.sent(laser_scan(robot.wire.make, "laser", scan))
        (given,) = known.convert(Channel.SCAN, message)
        assert len(given) == len(ranges)


def test_an_empty_scan_is_an_error_of_ours(known, robot):
    message = robot.scan()
    message.ranges = np.empty(0, np.float32)
    with pytest.raises(ScanError):
        known.convert(Channel.SCAN, message)
