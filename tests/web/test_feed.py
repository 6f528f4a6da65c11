"""What viewers may see follows what the localizer says."""

from __future__ import annotations

import threading

import numpy as np
import pytest
from live_lab import drive

from firstfix.core.se2 import SE2
from firstfix.lab.worlds.catalog import random_free_poses
from firstfix.localizer.inputs import PoseHint, Reset
from firstfix.localizer.states import State
from firstfix.web.timeline import MOST_EVENTS

ASLEEP = 20  # silent scans at the start of a simulated robot


def kinds(feed) -> list[str]:
    return [event.kind for event in feed.events()]


@pytest.fixture(scope="module")
def found():
    """A robot that was found by its first scan."""
    found = drive()
    found.step(ASLEEP + 1)
    return found


def test_there_is_nothing_before_the_first_map_and_no_pose_before_the_first_scan():
    begun = drive()
    view = begun.feed.view
    assert (view.state, view.pose, view.placed, view.belief) == (State.SEARCHING, None, None, None)
    assert view.map.name == "house"
    assert view.map.matcher is begun.localizer.matcher
    assert kinds(begun.feed) == ["map"]


def test_a_robot_is_found_and_everything_fits_together(found):
    view = found.feed.view
    assert view.state is State.LOCALIZED
    assert view.pose.distance_to(view.truth) < 0.05
    assert view.placed.T_map_base == view.pose
    assert view.placed.scan.stamp == view.stamp
    assert view.belief.particles is found.localizer.particles
    assert view.evidence.explained > 0.9
    assert view.hypotheses == ()
    assert 0.0 < view.time_to_fix_s < 30.0
    assert kinds(found.feed) == ["map", "found"]
    assert "found at (" in found.feed.events()[-1].text


def test_numbers_of_events_go_up_and_only_the_last_are_kept(found):
    feed = found.feed
    for i in range(MOST_EVENTS + 10):
        feed.tell("person", f"{i}")
    events = feed.events()
    assert len(events) == MOST_EVENTS
    assert [e.number for e in events] == list(range(events[0].number, events[-1].number + 1))
    assert feed.events(events[-1].number) == [events[-1]]
    assert feed.events(events[-1].number + 1) == []


def test_a_lifted_robot_is_nowhere_and_its_time_counts_from_when_it_stands():
    begun = drive()
    begun.step(ASLEEP + 5)
    (pose,) = random_free_poses(begun.feed.view.map.grid, np.random.default_rng(5), 1, 0.5)
    begun.robot.carry_to(pose)
    begun.step(10)
    view = begun.feed.view
    assert (view.pose, view.placed, view.belief, view.hypotheses) == (None, None, None, ())
    assert view.state is State.SEARCHING
    begun.step(32)
    assert begun.feed.view.pose.distance_to(pose) < 0.1
    assert begun.feed.view.time_to_fix_s < 2.0
    assert kinds(begun.feed) == ["map", "found", "lifted", "lifted", "found"]


def test_several_places_are_shown_with_the_scan_at_the_first():
    begun = drive("rooms")
    begun.step(ASLEEP + 1)
    view = begun.feed.view
    assert view.state is State.TRACKING
    assert view.pose is None
    assert len(view.hypotheses) >= 4
    assert view.placed.T_map_base == view.hypotheses[0].pose
    assert kinds(begun.feed) == ["map", "state"]
    begun.give(PoseHint(view.stamp, view.hypotheses[2].pose))
    begun.step(1)
    view = begun.feed.view
    assert view.state is State.LOCALIZED
    assert view.hypotheses == ()
    assert kinds(begun.feed) == ["map", "state", "hint", "found"]


def test_a_reset_forgets_all_and_nothing_was_lost():
    begun = drive()
    begun.step(ASLEEP + 1)
    begun.give(Reset(begun.feed.view.stamp))
    view = begun.feed.view
    assert (view.state, view.pose, view.placed) == (State.SEARCHING, None, None)
    assert kinds(begun.feed)[-1] == "state"


def test_particles_remember_the_pose_that_was_taken_from_them():
    begun = drive()
    begun.step(ASLEEP + 1)
    beliefs = set()
    for _ in range(60):
        begun.step()
        view = begun.feed.view
        beliefs.add(view.belief)
        assert view.belief.T_map_base.distance_to(view.pose) < 0.6
    assert len(beliefs) > 1  # it drove, and they were used again


def test_a_view_is_not_changed_by_what_comes_later(found):
    view = found.feed.view
    pose, stamp = view.pose, view.stamp
    found.feed.know(SE2(1.0, 2.0, 3.0))
    found.step(3)
    assert (view.pose, view.stamp) == (pose, stamp)
    assert found.feed.view.stamp > stamp


def test_whoever_listens_is_called_until_they_hang_up(found):
    calls = []

    def changed() -> None:
        calls.append(threading.get_ident())

    found.feed.listen(changed)
    found.step()
    assert calls
    found.feed.hang_up(changed)
    calls.clear()
    found.step()
    found.feed.stand_still(paused=True)
    assert calls == []
    assert found.feed.view.paused


def test_the_processor_time_is_that_of_the_localizer_alone(found):
    found.step(60)
    assert 0.0 < found.feed.view.cpu_ms < 1000.0
