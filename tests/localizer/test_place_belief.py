"""When the belief is updated, what is listed of it, and when it turns against a published pose."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from firstfix.belief.config import BeliefConfig
from firstfix.belief.prior import Near
from firstfix.core.errors import InputError
from firstfix.core.estimate import Verdict
from firstfix.core.se2 import SE2
from firstfix.lab.simulation.lidar import Lidar
from firstfix.localizer.place_belief import Pace, PlaceBelief, Support
from firstfix.localizer.pose_monitor import Fit

LIDAR = Lidar(beams=180)
POSE = SE2(10.5, 1.2, 0.3)  # in the second of three equal rooms
NOWHERE = SE2(12.5, 3.5, -2.0)
TURN = SE2(0.0, 0.0, 0.3)


@pytest.fixture
def places(three_rooms_locator):
    return PlaceBelief(three_rooms_locator.fields, BeliefConfig(), 1.0)


@pytest.fixture
def view(three_rooms):
    """Return the scan at a pose, which is that of the odometry, too."""

    def scan(pose, stamp=0.0):
        return LIDAR.scan(three_rooms, pose, np.random.default_rng(0), stamp)

    return scan


@pytest.mark.parametrize(
    ("moved", "later", "used_at"),
    [
        (SE2.identity(), 0.5, set()),
        (SE2.identity(), 1.0, {Pace.AT_REST_TOO}),
        (SE2.identity(), -50.0, {Pace.AT_REST_TOO}),  # the clock was set back
        (SE2(0.1, 0.0, 0.0), 4.9, set()),
        (SE2(0.1, 0.0, 0.0), 5.0, {Pace.AT_REST_TOO}),
        (SE2(0.31, 0.0, 0.0), 0.1, {Pace.AT_REST_TOO, Pace.EVERY_VIEW}),
        (SE2(0.0, 0.0, 0.3), 0.1, {Pace.AT_REST_TOO, Pace.EVERY_VIEW}),
        (SE2(2.1, 0.0, 0.0), 0.1, {Pace.AT_REST_TOO, Pace.EVERY_VIEW, Pace.BACKGROUND}),
        (SE2(0.0, 0.0, 2.2), 0.1, {Pace.AT_REST_TOO, Pace.EVERY_VIEW, Pace.BACKGROUND}),
    ],
)
@pytest.mark.parametrize("pace", list(Pace))
def test_a_scan_is_used_when_it_is_due(places, view, moved, later, used_at, pace):
    assert places.update(view(POSE, 100.0), POSE, pace)
    now = POSE @ moved
    expected = pace is Pace.EVERY_SCAN or pace in used_at
    assert places.update(view(now, 100.0 + later), now, pace) is expected
    assert places.belief.odometry == now


def test_a_covered_sensor_changes_nothing(places, view, with_ranges):
    places.update(view(POSE), POSE, Pace.EVERY_SCAN)
    before = places.places
    covered = with_ranges(lambda _: np.nan)(view(POSE @ TURN))
    assert not places.update(covered, POSE @ TURN, Pace.EVERY_SCAN)
    assert [place.id for place in places.places] == [place.id for place in before]


def test_numbers_are_never_given_twice(places, view):
    places.update(view(POSE), POSE, Pace.EVERY_SCAN)
    before = {place.id for place in places.places}
    places.restart()
    assert places.places == ()
    places.update(view(POSE), POSE, Pace.EVERY_SCAN)
    assert before.isdisjoint(place.id for place in places.places)


def test_a_prior_that_does_not_fit_the_map_leaves_everything_as_it_was(places, view):
    places.update(view(POSE), POSE, Pace.EVERY_SCAN)
    before = places.belief
    with pytest.raises(InputError, match="expected a prior on the map"):
        places.restart(Near(SE2(900.0, 0.0, 0.0), 1.0))
    assert places.belief is before


def test_a_prior_decides_nothing_by_itself(places, view):
    places.restart(Near(POSE, 1.0))
    places.update(view(POSE), POSE, Pace.EVERY_SCAN)
    assert places.belief.probabilities[0] > 0.98
    assert places.places[0].pose.distance_to(POSE) < 0.1
    assert places.rivals == 3
    assert not places.is_decided_by_evidence
    # The prior speaks against places that were missed, too: without it they have more.
    by_views = 1.0 - places.belief.evidence.sum()
    assert places.belief.missed < places.belief.elsewhere < by_views < 0.02


# ---- a published pose


def moved_on(places, view, steps):
    """Yield the pose of a robot that turns, after each update of its belief."""
    pose = POSE
    for _ in range(steps):
        pose = pose @ TURN
        places.update(view(pose), pose, Pace.EVERY_VIEW)
        yield pose


def test_the_place_of_the_pose_confirms_it_and_the_pace_falls(places, view):
    places.restart(Near(POSE, 1.0))
    places.update(view(POSE), POSE, Pace.EVERY_SCAN)
    places.pose_was_published()
    for pose in moved_on(places, view, 4):
        assert places.tracking_pace is Pace.EVERY_VIEW
        assert places.support_for(pose, Fit.CONSISTENT) is Support.SAME_PLACE
    assert places.tracking_pace is Pace.BACKGROUND


def test_a_young_pose_is_withdrawn_after_two_views(places, view):
    places.pose_was_published()
    found = [places.support_for(NOWHERE, Fit.CONSISTENT) for _ in moved_on(places, view, 2)]
    assert found == [Support.OPEN, Support.WITHDRAWN]


def test_a_pose_that_many_views_have_confirmed_is_not_withdrawn(places, view):
    """Where the map is wrong, other places fit better for metres."""
    places.restart(Near(POSE, 1.0))
    for pose in moved_on(places, view, 6):
        places.support_for(pose, Fit.CONSISTENT)
    places.restart()
    for _ in moved_on(places, view, 6):
        assert places.support_for(NOWHERE, Fit.CONSISTENT) is Support.OPEN


def test_any_pose_that_neither_places_nor_scans_support_is_withdrawn(places, view):
    """It was confirmed, and then the robot was carried away."""
    places.restart(Near(POSE, 1.0))
    for pose in moved_on(places, view, 6):
        places.support_for(pose, Fit.CONSISTENT)
    places.restart()
    fits = [Fit.DOUBTFUL, Fit.CONSISTENT, Fit.DOUBTFUL, Fit.DOUBTFUL]
    moved = moved_on(places, view, 4)
    found = [places.support_for(NOWHERE, fit) for fit, _ in zip(fits, moved, strict=True)]
    assert found == [*3 * [Support.OPEN], Support.WITHDRAWN]


def test_a_doubted_pose_is_watched_until_four_views_confirm_it_again(places, view):
    places.restart(Near(POSE, 1.0))
    for pose in moved_on(places, view, 5):
        places.support_for(pose, Fit.CONSISTENT)
    assert places.tracking_pace is Pace.BACKGROUND
    places.doubt_pose()
    assert places.update(view(pose), pose, places.tracking_pace)  # at once
    for _ in range(4):
        assert places.tracking_pace is Pace.EVERY_VIEW
        places.support_for(pose, Fit.CONSISTENT)
    assert places.tracking_pace is Pace.BACKGROUND


@pytest.mark.parametrize(("confirmed", "needed"), [(0, 1), (2, 2), (6, 4)])
def test_another_sure_place_needs_half_as_many_views_as_have_confirmed(
    places, view, confirmed, needed
):
    places.restart(Near(POSE, 1.0))
    poses = list(moved_on(places, view, 1))
    places.pose_was_published()
    for _ in range(confirmed):
        places.support_for(poses[-1], Fit.CONSISTENT)
    places.belief = dataclasses.replace(
        places.belief,
        judgement=dataclasses.replace(places.belief.judgement, verdict=Verdict.UNIQUE),
    )
    found = [places.support_for(NOWHERE, Fit.CONSISTENT) for _ in range(needed)]
    assert found == [Support.OPEN] * (needed - 1) + [Support.OTHER_PLACE]
