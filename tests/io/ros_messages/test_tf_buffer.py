"""Transforms at a stamp: laws, interpolation compared with scipy, and every lookup failure."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation, Slerp

from firstfix.io.ros_messages.incoming import FARTHEST_M, StampedTransform
from firstfix.io.ros_messages.tf_buffer import KEPT_S, LookupFailure, TransformBuffer
from firstfix.io.ros_messages.transforms import matrix

LENGTHS = st.floats(-10.0, 10.0)
POINTS = st.tuples(LENGTHS, LENGTHS, LENGTHS)
ANGLES = st.floats(-3.1, 3.1)
QUATERNIONS = st.tuples(ANGLES, ANGLES, ANGLES).map(
    lambda a: tuple(Rotation.from_euler("xyz", a).as_quat().tolist())
)
LEVEL = (0.0, 0.0, 0.0, 1.0)


def link(parent, child, stamp=0.0, xyz=(0.0, 0.0, 0.0), q=LEVEL):
    return StampedTransform(parent, child, stamp, xyz, q)


def along(parent, child, *stamps):
    """Drive 1 m a second."""
    return [link(parent, child, stamp, (stamp, 0.0, 0.0)) for stamp in stamps]


def buffer_of(moving=(), fixed=()):
    buffer = TransformBuffer()
    for each in moving:
        buffer.add(each)
    for each in fixed:
        buffer.add_static(each)
    return buffer


def x_at(buffer, stamp, target="odom", source="base"):
    T = buffer.at(target, source, stamp)
    return T if isinstance(T, LookupFailure) else float(T[0, 3])


def why(answer):
    assert isinstance(answer, LookupFailure)
    return answer.why


# ---- laws


@given(POINTS, QUATERNIONS, POINTS, QUATERNIONS, POINTS, QUATERNIONS)
def test_transforms_chain_up_and_down_the_tree(p, q, r, s, t, u):
    """Frames: map - odom - base, and laser at the base: moving, moving, fixed."""
    parts = [link("map", "odom", 1.0, p, q), link("odom", "base", 1.0, r, s)]
    place = link("base", "laser", 0.0, t, u)
    buffer = buffer_of(parts, [place])
    T_map_laser = matrix(parts[0]) @ matrix(parts[1]) @ matrix(place)
    assert_allclose(buffer.at("map", "laser", 1.0), T_map_laser, atol=1e-9)
    there, back = buffer.at("odom", "laser", 1.0), buffer.at("laser", "odom", 1.0)
    assert_allclose(there @ back, np.eye(4), atol=1e-9)
    assert_allclose(buffer.at("map", "odom", 1.0) @ there, T_map_laser, atol=1e-9)


@given(POINTS, QUATERNIONS, POINTS, QUATERNIONS)
def test_siblings_meet_at_their_parent(p, q, r, s):
    left, right = link("base", "left", 0.0, p, q), link("base", "right", 0.0, r, s)
    buffer = buffer_of(fixed=[left, right])
    expected = np.linalg.inv(matrix(left)) @ matrix(right)
    assert_allclose(buffer.at("left", "right", 7.0), expected, atol=1e-9)


def test_a_frame_is_where_it_is():
    assert_allclose(TransformBuffer().at("laser", "laser", 3.0), np.eye(4))


@given(POINTS, QUATERNIONS, POINTS, QUATERNIONS, st.floats(0.0, 1.0))
def test_in_between_is_a_straight_line_and_the_shorter_arc(p, q, r, s, share):
    ends = Rotation.from_quat([q, s])
    angle = (ends[0].inv() * ends[1]).magnitude()
    assume(angle < 3.1)  # half a turn may be made either way
    buffer = buffer_of([link("odom", "base", 10.0, p, q), link("odom", "base", 12.0, r, s)])
    T = buffer.at("odom", "base", 10.0 + 2.0 * share)
    assert_allclose(T[:3, 3], np.array(p) + share * (np.array(r) - p), atol=1e-9)
    assert_allclose(T[:3, :3], Slerp([0.0, 1.0], ends)(share).as_matrix(), atol=1e-6)


@given(QUATERNIONS, QUATERNIONS, st.floats(0.0, 1.0))
def test_a_quaternion_and_its_negative_are_one_rotation(q, s, share):
    minus = tuple(-v for v in s)
    ways = [
        buffer_of([link("odom", "base", 1.0, q=q), link("odom", "base", 2.0, q=end)])
        for end in (s, minus)
    ]
    T, other = (buffer.at("odom", "base", 1.0 + share) for buffer in ways)
    assume(abs(np.dot(q, s)) > 1e-6)  # else there are two shorter arcs
    assert_allclose(T, other, atol=1e-9)


def test_a_tiny_rotation_is_interpolated():
    """Where the sine of the angle is rounding."""
    tiny = (0.0, 0.0, 1e-9, 1.0)
    buffer = buffer_of([link("odom", "base", 1.0), link("odom", "base", 2.0, q=tiny)])
    R = buffer.at("odom", "base", 1.5)[:3, :3]
    assert_allclose(R @ R.T, np.eye(3), atol=1e-12)
    assert R[1, 0] == pytest.approx(1e-9, rel=1e-3)


# ---- time


@given(st.permutations([1.0, 2.0, 3.0, 4.0, 5.0]))
def test_the_order_of_arrival_does_not_matter(stamps):
    buffer = buffer_of(along("odom", "base", *stamps))
    assert buffer.newest("odom", "base") == 5.0
    for stamp in (1.0, 1.5, 2.0, 3.3, 5.0):
        assert x_at(buffer, stamp) == pytest.approx(stamp)


def test_of_two_with_one_stamp_the_last_counts():
    buffer = buffer_of([*along("odom", "base", 1.0, 2.0), link("odom", "base", 1.0, (7.0, 0, 0))])
    assert x_at(buffer, 1.0) == 7.0
    again = buffer_of([*along("odom", "base", 1.0, 2.0), link("odom", "base", 2.0, (7.0, 0, 0))])
    assert x_at(again, 2.0) == 7.0
    assert x_at(again, 1.5) == 4.0


def test_the_newest_of_a_chain_is_that_of_its_slowest_link():
    moving = [*along("odom", "mid", 1.0, 2.0, 3.0), *along("mid", "base", 1.0, 2.5)]
    buffer = buffer_of(moving, [link("base", "laser")])
    assert buffer.newest("odom", "laser") == 2.5
    assert buffer.newest("laser", "odom") == 2.5
    assert buffer.newest("base", "laser") == math.inf
    assert x_at(buffer, 2.5, source="laser") == pytest.approx(5.0)
    assert buffer.links("odom", "laser") == ("laser", "base", "mid")


def test_static_transforms_hold_at_all_times():
    buffer = buffer_of(fixed=[link("base", "laser", 5.0, (1.0, 0.0, 0.0))])
    assert [x_at(buffer, t, "base", "laser") for t in (-1e9, 0.0, 5.0, 1e12)] == [1.0] * 4
    buffer.add_static(link("base", "laser", 1.0, (2.0, 0.0, 0.0)))
    assert x_at(buffer, 5.0, "base", "laser") == 2.0


def test_memory_is_bounded_by_time():
    buffer = buffer_of(along("odom", "base", *np.arange(0.0, 60.0, 0.01).tolist()))
    assert len(buffer._edges["base"].moves) <= KEPT_S / 0.01 + 1
    assert x_at(buffer, 59.0 - KEPT_S + 1.0) == pytest.approx(50.0)
    assert isinstance(buffer.at("odom", "base", 59.9 - KEPT_S - 1.0), LookupFailure)


def test_transforms_older_than_the_buffer_change_nothing():
    buffer = buffer_of(along("odom", "base", 100.0, 101.0, 1.0))
    assert isinstance(buffer.at("odom", "base", 50.0), LookupFailure)
    assert x_at(buffer, 100.5) == pytest.approx(100.5)


def test_a_clock_set_back_discards_moving_frames():
    buffer = buffer_of(along("odom", "base", 100.0), [link("base", "laser")])
    buffer.discard_moving()
    assert buffer.frames == ("base", "laser")
    buffer.add(link("odom", "base", 1.0, (7.0, 0.0, 0.0)))
    assert x_at(buffer, 1.0) == 7.0


# ---- lookup failures


def test_an_empty_buffer_has_no_frame():
    answer = TransformBuffer().at("odom", "base", 1.0)
    assert why(answer) == "no transform has the frame odom and base; known frames: none"
    assert not answer.later
    assert isinstance(TransformBuffer().newest("odom", "base"), LookupFailure)
    assert isinstance(TransformBuffer().links("odom", "base"), LookupFailure)


def test_an_unknown_frame_is_named_with_the_known_ones():
    buffer = buffer_of(along("odom", "base_link", 1.0))
    answer = buffer.at("odom", "base_footprint", 1.0)
    assert why(answer) == "no transform has the frame base_footprint; known frames: base_link, odom"


def test_separate_trees_are_named():
    buffer = buffer_of(along("odom", "base", 1.0), [link("mast", "laser")])
    assert why(buffer.at("base", "laser", 1.0)) == (
        "no transforms join base (below odom) and laser (below mast)"
    )


def test_a_lookup_ahead_may_succeed_later_and_one_too_old_never():
    buffer = buffer_of(along("odom", "base", 1.0, 2.0))
    later, never = buffer.at("odom", "base", 2.5), buffer.at("odom", "base", 0.25)
    assert why(later) == "the transform from odom to base is 0.500 s older than the scan"
    assert later.later
    assert why(never) == "the transform from odom to base is known only from 0.750 s later on"
    assert not never.later


def test_a_loop_ends():
    buffer = buffer_of(along("a", "b", 1.0) + along("b", "c", 1.0) + along("c", "a", 1.0))
    assert not isinstance(buffer.at("a", "b", 1.0), LookupFailure)
    assert isinstance(buffer.at("a", "elsewhere", 1.0), LookupFailure)
    mirror = buffer_of(along("a", "a", 1.0))
    assert_allclose(mirror.at("a", "a", 1.0), np.eye(4))


def test_the_newest_parent_of_a_frame_counts():
    buffer = buffer_of(along("odom", "base", 1.0, 2.0))
    buffer.add(link("dock", "base", 3.0))
    assert isinstance(buffer.at("odom", "base", 2.0), LookupFailure)
    assert x_at(buffer, 3.0, "dock") == 0.0
    buffer.add_static(link("dock", "base", 0.0, (4.0, 0.0, 0.0)))
    assert x_at(buffer, 1e6, "dock") == 4.0


@pytest.mark.parametrize(
    "changes",
    [
        {"stamp": math.nan},
        {"stamp": math.inf},
        {"xyz": (math.nan, 0.0, 0.0)},
        {"xyz": (0.0, 0.0, -math.inf)},
        {"xyz": (0.0, 2 * FARTHEST_M, 0.0)},
        {"q": (math.nan,) * 4},
    ],
)
def test_transforms_that_are_not_finite_are_ignored(changes):
    bad = link("odom", "base", **({"stamp": 1.0} | changes))
    buffer = buffer_of([bad], [bad])
    assert buffer.frames == ()
    buffer = buffer_of([*along("odom", "base", 1.0, 2.0), bad])
    assert x_at(buffer, 1.5) == pytest.approx(1.5)


NAMES = st.sampled_from("abcd")
ANYTHING = st.builds(
    link,
    NAMES,
    NAMES,
    st.floats(0.0, 30.0) | st.floats(),
    st.tuples(st.floats(), LENGTHS, LENGTHS),
    QUATERNIONS | st.just((math.nan,) * 4),
)


@given(st.lists(st.tuples(ANYTHING, st.booleans()), max_size=15), NAMES, NAMES, st.floats())
def test_any_lookup_is_finite_or_has_a_reason(messages, target, source, stamp):
    buffer = TransformBuffer()
    for message, fixed in messages:
        (buffer.add_static if fixed else buffer.add)(message)
    T = buffer.at(target, source, stamp)
    assert isinstance(T, LookupFailure) or np.isfinite(T).all()
    newest = buffer.newest(target, source)
    if not isinstance(newest, LookupFailure) and math.isfinite(newest):
        known = buffer.at(target, source, newest)
        assert isinstance(known, LookupFailure) or np.isfinite(known).all()
