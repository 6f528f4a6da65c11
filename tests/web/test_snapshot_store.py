"""The snapshot follows the outputs of the localizer."""

from __future__ import annotations

import threading

import numpy as np
import pytest
from live_lab import drive

from firstfix.core.se2 import SE2
from firstfix.lab.worlds.catalog import ROOM_PITCH, random_free_poses
from firstfix.localizer.inputs import PoseHint, Reset
from firstfix.localizer.states import State
from firstfix.web.snapshot import SimulationStatus
from firstfix.web.timeline import MOST_EVENTS

ASLEEP = 20  # steps without a scan at the start of a simulated robot


def kinds(store) -> list[str]:
    return [event.kind for event in store.events()]


@pytest.fixture(scope="module")
def found():
    """A robot that was localized by its first scan."""
    found = drive()
    found.step(ASLEEP + 1)
    return found


def test_there_is_no_pose_before_the_first_scan():
    begun = drive()
    view = begun.store.snapshot
    assert (view.state, view.pose, view.scan, view.particles) == (State.SEARCHING, None, None, None)
    assert view.map.name == "house"
    assert view.map.matcher is begun.localizer.matcher
    assert kinds(begun.store) == ["map"]


def test_a_snapshot_of_a_localized_robot_is_consistent(found):
    view = found.store.snapshot
    assert view.state is State.LOCALIZED
    assert view.pose.distance_to(view.truth) < 0.05
    assert view.scan.T_map_base == view.pose
    assert view.scan.scan.stamp == view.stamp
    assert view.particles.particles is found.localizer.particles
    assert view.evidence.explained > 0.9
    assert view.hypotheses == ()
    assert 0.0 < view.time_to_fix_s < 30.0
    assert kinds(found.store) == ["map", "found"]
    assert "Localized at (" in found.store.events()[-1].text


def test_numbers_of_events_go_up_and_only_the_last_are_kept(found):
    store = found.store
    for i in range(MOST_EVENTS + 10):
        store.add_event("person", f"{i}")
    events = store.events()
    assert len(events) == MOST_EVENTS
    assert [e.number for e in events] == list(range(events[0].number, events[-1].number + 1))
    assert store.events(events[-1].number) == [events[-1]]
    assert store.events(events[-1].number + 1) == []


def test_a_lifted_robot_has_no_pose_and_its_time_to_fix_begins_when_it_is_set_down():
    begun = drive()
    begun.step(ASLEEP + 5)
    (pose,) = random_free_poses(begun.store.snapshot.map.grid, np.random.default_rng(5), 1, 0.5)
    begun.robot.carry_to(pose)
    begun.step(10)
    view = begun.store.snapshot
    assert (view.pose, view.scan, view.particles, view.hypotheses) == (None, None, None, ())
    assert view.state is State.LIFTED
    begun.step(32)
    assert begun.store.snapshot.pose.distance_to(pose) < 0.1
    assert begun.store.snapshot.time_to_fix_s < 2.0
    assert kinds(begun.store) == ["map", "found", "lifted", "lifted", "found"]


def test_several_places_are_listed_with_the_scan_at_the_first():
    begun = drive("rooms")
    begun.step(ASLEEP + 1)
    view = begun.store.snapshot
    assert view.state is State.DISAMBIGUATING
    assert view.pose is None
    assert len(view.hypotheses) >= 4
    assert view.scan.T_map_base == view.hypotheses[0].pose
    assert kinds(begun.store) == ["map", "state"]
    begun.give(PoseHint(view.stamp, view.hypotheses[2].pose))
    begun.step(1)
    view = begun.store.snapshot
    assert view.state is State.LOCALIZED
    assert view.hypotheses == ()
    assert kinds(begun.store) == ["map", "state", "hint", "found"]


def test_the_belief_of_four_identical_rooms_has_a_quarter_of_the_mass_in_each():
    begun = drive("rooms")
    begun.step(ASLEEP + 1)
    belief = begun.store.snapshot.belief
    assert belief is begun.localizer.belief
    room = np.floor(belief.poses[:, 0] / ROOM_PITCH).astype(int)
    mass = np.bincount(room, belief.probabilities)
    np.testing.assert_allclose(mass, 0.25, atol=0.05)
    assert belief.elsewhere < 0.05


def test_a_reset_discards_the_pose_and_is_no_loss():
    begun = drive()
    begun.step(ASLEEP + 1)
    begun.give(Reset(begun.store.snapshot.stamp))
    view = begun.store.snapshot
    assert (view.state, view.pose, view.scan) == (State.SEARCHING, None, None)
    assert kinds(begun.store)[-1] == "state"


def test_particles_keep_the_pose_of_their_update():
    begun = drive()
    begun.step(ASLEEP + 1)
    beliefs = set()
    for _ in range(60):
        begun.step()
        view = begun.store.snapshot
        beliefs.add(view.particles)
        assert view.particles.T_map_base.distance_to(view.pose) < 0.6
    assert len(beliefs) > 1  # it drove, and they were used again


def test_a_snapshot_never_changes(found):
    view = found.store.snapshot
    pose, stamp = view.pose, view.stamp
    found.store.set_truth(SE2(1.0, 2.0, 3.0))
    found.step(3)
    assert (view.pose, view.stamp) == (pose, stamp)
    assert found.store.snapshot.stamp > stamp


def test_subscribers_are_called_until_they_unsubscribe(found):
    calls = []

    def changed() -> None:
        calls.append(threading.get_ident())

    found.store.subscribe(changed)
    found.step()
    assert calls
    found.store.unsubscribe(changed)
    calls.clear()
    found.step()
    found.store.set_simulation(SimulationStatus("house", "any", is_paused=True))
    assert calls == []
    assert found.store.snapshot.simulation.is_paused


def test_the_processor_time_is_that_of_the_localizer_alone(found):
    found.step(60)
    assert 0.0 < found.store.snapshot.cpu_ms < 1000.0


def test_a_pose_that_is_not_accepted_is_an_event_of_its_own():
    house = drive("house")
    house.step(21)
    outside = PoseHint(house.store.snapshot.stamp, SE2(-500.0, 0.0, 0.0))
    house.give(outside)
    assert house.store.events()[-1].kind == "refused"
