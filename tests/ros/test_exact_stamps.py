"""Stamps survive the way through the float seconds of the localizer."""

from types import SimpleNamespace

from hypothesis import given
from hypothesis import strategies as st

from firstfix.io.ros_messages.outgoing import ExactTime, header
from firstfix.ros.exact_stamps import _KEPT, ExactStamps


def make(type_name, **fields):
    return SimpleNamespace(**fields)


@given(st.integers(0, 2**31 - 1), st.integers(0, 999_999_999))
def test_every_stamp_comes_back_to_the_nanosecond(sec, nanosec):
    stamps = ExactStamps()
    for stamp in (make("", sec=sec, nanosec=nanosec), make("", secs=sec, nsecs=nanosec)):
        back = header(make, stamps.exact(stamps.add(stamp)), "map").stamp
        assert (back.sec, back.nanosec) == (sec, nanosec)


def test_other_times_stay_seconds():
    assert ExactStamps().exact(12.5, 0.25) == 12.75


def test_only_recent_stamps_are_kept():
    stamps = ExactStamps()
    seconds = [stamps.add(make("", sec=i, nanosec=1)) for i in range(_KEPT + 1)]
    assert stamps.exact(seconds[0]) == seconds[0]
    assert stamps.exact(seconds[1], 1.0) == ExactTime(2_000_000_001)
    assert len(stamps._exact) == _KEPT
