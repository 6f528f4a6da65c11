"""Several views, one belief: laws, a slow reference, and answers that must never occur."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from firstfix.belief.belief import begin, brings_news, predict, update, with_prior
from firstfix.belief.config import BeliefConfig
from firstfix.belief.hints import Source
from firstfix.belief.prior import Near
from firstfix.belief.view import View
from firstfix.core.angles import angle_error
from firstfix.core.estimate import Verdict
from firstfix.core.grid import OCCUPIED, OccupancyGrid
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.fields.map_fields import MapFields
from firstfix.global_localization.search import Candidates
from firstfix.lab.simulation.lidar import Lidar

WIDE = Lidar(beams=180, sigma_m=0.01)
START = SE2(10.5, 2.0, 1.8)
ODOMETRY_START = SE2(-4.0, 2.0, 0.7)
TURN = [SE2(0.3, 0.0, -0.35)] * 10


def beliefs_of(views, fields, **options):
    belief = begin(fields, **options)
    beliefs = []
    for view in views:
        belief = update(belief, view)
        beliefs.append(belief)
    return beliefs


def is_at(pose, truth, most_m=0.1, most_deg=2.0):
    near = pose.distance_to(truth) <= most_m
    return near and angle_error(pose.yaw, truth.yaw) <= math.radians(most_deg)


def end_of(start, steps):
    for step in steps:
        start = start @ step
    return start


# --- the right place, and when it is UNIQUE ---


def test_views_decide_together_what_one_view_leaves_open(halls, drive):
    beliefs = beliefs_of(drive(halls.grid, START, TURN), halls)
    assert beliefs[0].verdict is Verdict.AMBIGUOUS
    assert beliefs[-1].verdict is Verdict.UNIQUE
    assert is_at(beliefs[-1].places[0].pose, end_of(START, TURN))


def test_one_scan_of_a_narrow_sensor_never_decides(halls, drive):
    for yaw in np.linspace(-math.pi, math.pi, 12):
        (view,) = drive(halls.grid, SE2(11.0, 2.0, float(yaw)), [])
        assert update(begin(halls), view).verdict is not Verdict.UNIQUE


def test_one_scan_of_a_sensor_that_sees_much_may_decide(room, drive):
    truth = SE2(5.0, 2.5, 0.4)
    (view,) = drive(room.grid, truth, [], WIDE)
    belief = update(begin(room), view)
    assert belief.verdict is Verdict.UNIQUE
    assert is_at(belief.places[0].pose, truth)


def test_a_view_enters_where_it_was_found_before_and_nowhere_else(four_rooms, drive):
    start = SE2(*four_rooms.grid.to_map(np.array([60.0, 60.0])).tolist(), 0.5)
    (view,) = drive(four_rooms.grid, start, [], WIDE)
    found = Candidates(np.array([[60.0, 60.0, 0.5]]), np.zeros(1))
    belief = update(begin(four_rooms), view, found)
    assert [is_at(place.pose, start) for place in belief.places] == [True]
    assert len(update(begin(four_rooms), view).places) > 1


def test_a_view_that_was_found_nowhere_leaves_all_places_open(room, drive):
    views = drive(room.grid, SE2(5.0, 2.5, 0.4), [SE2(0.5, 0.0, 0.0)] * 2, WIDE)
    nowhere = Candidates(np.empty((0, 3)), np.empty(0))
    belief = update(begin(room), views[0], nowhere)
    assert (belief.places, belief.elsewhere) == ((), 1.0)
    assert update(belief, views[1]).verdict is Verdict.UNIQUE


def test_what_is_identical_stays_open(four_rooms, drive):
    start = SE2(*four_rooms.grid.to_map(np.array([60.0, 60.0])).tolist(), 0.5)
    for belief in beliefs_of(drive(four_rooms.grid, start, [SE2(0.0, 0.0, 0.5)] * 8), four_rooms):
        assert belief.verdict is not Verdict.UNIQUE
        assert belief.probabilities[0] < 0.6


def test_a_published_place_stays_published_at_rest(halls, drive):
    views = drive(halls.grid, START, [*TURN, SE2(0.0, 0.0, 0.0), SE2(0.0, 0.0, 0.0)])
    last = beliefs_of(views, halls)[-3:]
    assert [belief.verdict for belief in last] == [Verdict.UNIQUE] * 3
    assert len({belief.places[0].id for belief in last}) == 1


def test_a_wrong_map_is_never_published(halls, room, drive):
    beliefs = beliefs_of(drive(halls.grid, START, TURN, WIDE), room)
    assert all(belief.verdict is not Verdict.UNIQUE for belief in beliefs)


# --- laws ---


def test_places_that_are_hardly_possible_are_not_counted(room):
    belief = replace(begin(room), probabilities=np.array([0.6, 0.4, 1e-9]))
    assert belief.possible == 2
    assert begin(room).possible == 0


def test_mass_sums_to_one(halls, drive):
    for belief in beliefs_of(drive(halls.grid, START, TURN), halls):
        assert belief.probabilities.sum() + belief.elsewhere == pytest.approx(1.0)
        assert (np.diff(belief.probabilities) <= 0.0).all()


def test_the_same_views_give_the_same_belief(halls, drive):
    one, other = (beliefs_of(drive(halls.grid, START, TURN[:4]), halls)[-1] for _ in range(2))
    np.testing.assert_array_equal(one.poses, other.poses)
    np.testing.assert_array_equal(one.probabilities, other.probabilities)
    assert one.reason == other.reason


def test_nothing_changes_a_belief(halls, drive):
    views = drive(halls.grid, START, TURN[:3])
    belief = update(begin(halls), views[0])
    before = belief.poses.copy(), belief.probabilities.copy()
    update(update(predict(belief, SE2(9.0, 9.0, 1.0)), views[1]), views[2])
    np.testing.assert_array_equal(belief.poses, before[0])
    np.testing.assert_array_equal(belief.probabilities, before[1])


def test_the_frame_of_the_odometry_does_not_matter(halls, drive):
    steps = TURN[:4]
    one = beliefs_of(drive(halls.grid, START, steps), halls)[-1]
    other = beliefs_of(drive(halls.grid, START, steps, odometry=SE2(30.0, -7.0, -2.0)), halls)[-1]
    np.testing.assert_allclose(one.poses, other.poses, atol=1e-6)
    np.testing.assert_allclose(one.probabilities, other.probabilities, atol=1e-6)


def test_map_and_places_move_together(halls, drive):
    move = SE2(-20.0, 5.0, 0.8)
    grid = halls.grid
    moved = OccupancyGrid(grid.cells, grid.resolution, move @ grid.T_map_grid)
    views = drive(grid, START, TURN[:4])
    here, there = beliefs_of(views, halls)[-1], beliefs_of(views, MapFields(moved))[-1]
    np.testing.assert_allclose(here.probabilities, there.probabilities, atol=1e-9)
    for a, b in zip(here.places, there.places, strict=True):
        assert (move @ a.pose).distance_to(b.pose) < 1e-6


def test_two_sensors_in_any_order_are_one_view(halls, drive):
    back = Lidar(
        beams=61,
        fov=math.radians(60.0),
        range_max=5.0,
        sigma_m=0.01,
        T_base_laser=SE2(-0.2, 0.0, math.pi),
    )
    pairs = list(
        zip(drive(halls.grid, START, TURN), drive(halls.grid, START, TURN, back), strict=True)
    )
    one = beliefs_of([View((*a.scans, *b.scans), a.T_odom_base) for a, b in pairs], halls)[-1]
    other = beliefs_of([View((*b.scans, *a.scans), a.T_odom_base) for a, b in pairs], halls)[-1]
    assert one.verdict is Verdict.UNIQUE
    np.testing.assert_allclose(one.probabilities, other.probabilities, atol=1e-9)


# --- motion ---


def test_prediction_moves_every_place(halls, drive):
    (view,) = drive(halls.grid, START, [])
    belief = update(begin(halls), view)
    step = SE2(0.4, 0.1, 0.3)
    moved = predict(belief, view.T_odom_base @ step)
    for before, after in zip(belief.places, moved.places, strict=True):
        assert is_at(after.pose, before.pose @ step, 1e-9, 1e-6)
    for before, after in zip(belief.poses, moved.poses, strict=True):
        assert is_at(SE2.from_array(after), SE2.from_array(before) @ step, 1e-9, 1e-6)


def test_odometry_that_slips_a_tenth_keeps_the_place(halls, drive):
    steps = [SE2(0.3, 0.0, -0.35)] * 10
    belief = beliefs_of(drive(halls.grid, START, steps, slip=0.9), halls)[-1]
    assert belief.verdict is Verdict.UNIQUE
    assert is_at(belief.places[0].pose, end_of(START, steps))


def test_odometry_that_turns_too_far_keeps_the_place(room, drive):
    """Each turn is reported 9 degrees too large: adjustment alone ends at a wrong heading."""
    truth, steps = SE2(5.0, 2.5, 0.4), [SE2(0.3, 0.0, 0.6)] * 8
    views = drive(room.grid, truth, steps, WIDE)
    odometry, wrong = ODOMETRY_START, [views[0]]
    for view in views[1:]:
        odometry = odometry @ SE2(0.3, 0.0, 0.6 + math.radians(9.0))
        wrong.append(View(view.scans, odometry))
    beliefs = beliefs_of(wrong, room)
    assert is_at(beliefs[-1].places[0].pose, end_of(truth, steps))
    assert {belief.tracks.ids[0] for belief in beliefs} == {beliefs[0].tracks.ids[0]}
    assert beliefs[-1].tracks.costs[0].max() < 0.3


def test_ids_last_while_the_robot_moves(halls, drive):
    beliefs = beliefs_of(drive(halls.grid, START, TURN), halls)
    final = beliefs[-1].places[0].id
    assert sum(final in belief.tracks.ids for belief in beliefs) >= len(beliefs) - 2


def test_a_view_of_long_ago_still_counts(four_rooms, drive):
    """Rooms are identical but for a block that the robot saw at first: it is not forgotten."""
    cells = four_rooms.grid.cells.copy()
    cells[40:52, 40:52] = OCCUPIED
    fields = MapFields(OccupancyGrid(cells, four_rooms.grid.resolution, four_rooms.grid.T_map_grid))
    corner = SE2(*fields.grid.to_map(np.array([70.0, 46.0])).tolist(), math.pi)
    look_away = [SE2(0.0, 0.0, 0.35)] * 5
    there = beliefs_of(drive(fields.grid, corner, look_away + [SE2(0.0, 0.0, 0.2)] * 9), fields)
    assert len(there[-1].window) > there[-1].config.window
    assert there[-1].probabilities[0] > 0.9
    short = BeliefConfig(memory=0)
    forgetful = beliefs_of(
        drive(fields.grid, corner, look_away + [SE2(0.0, 0.0, 0.2)] * 9), fields, config=short
    )
    assert forgetful[-1].probabilities[0] < 0.6


def test_a_robot_that_is_carried_away_is_found_again(halls, drive):
    views = drive(halls.grid, START, TURN, WIDE)
    last = views[-1].T_odom_base
    elsewhere = SE2(2.0, 1.5, 1.2)
    views += drive(halls.grid, elsewhere, TURN, WIDE, odometry=last @ SE2(0.3, 0.0, 0.0))
    beliefs = beliefs_of(views, halls)
    assert not any(is_at(b.places[0].pose, START, 1.0) for b in beliefs[-3:])
    assert beliefs[-1].verdict is Verdict.UNIQUE
    assert is_at(beliefs[-1].places[0].pose, end_of(elsewhere, TURN))


@pytest.mark.parametrize(
    ("step", "news"),
    [
        (SE2(0.0, 0.0, 0.0), False),
        (SE2(0.2, 0.1, 0.1), False),
        (SE2(0.31, 0.0, 0.0), True),
        (SE2(0.0, 0.0, -0.3), True),
    ],
)
def test_news_is_motion(halls, drive, step, news):
    (view,) = drive(halls.grid, START, [])
    assert brings_news(begin(halls), view.T_odom_base)
    belief = update(begin(halls), view)
    assert brings_news(belief, view.T_odom_base @ step) is news


# --- views without information ---


def test_a_blind_view_changes_nothing_but_the_prediction(halls, drive):
    (view,) = drive(halls.grid, START, [])
    blind = LaserScan(np.full(61, np.nan), -0.5, 0.0175, 0.1, 5.0)
    first = update(begin(halls), View.of(blind, view.T_odom_base))
    assert first.verdict is Verdict.NO_MATCH
    assert "0 beams measured a surface" in first.reason
    assert first.elsewhere == 1.0
    assert first.places == ()
    belief = update(begin(halls), view)
    step = SE2(0.3, 0.0, 0.0)
    after = update(belief, View.of(blind, view.T_odom_base @ step))
    np.testing.assert_array_equal(after.probabilities, belief.probabilities)
    assert is_at(after.places[0].pose, belief.places[0].pose @ step, 1e-9, 1e-6)


# --- priors ---


def test_a_hint_decides_between_places_that_look_the_same(four_rooms, drive):
    start = SE2(*four_rooms.grid.to_map(np.array([60.0, 60.0])).tolist(), 0.5)
    (view,) = drive(four_rooms.grid, start, [], WIDE)
    near = Near(start @ SE2(0.3, 0.3, 0.2), 1.0)
    belief = update(with_prior(begin(four_rooms), near, None, Source.PERSON), view)
    assert is_at(belief.places[0].pose, start)
    assert belief.verdict is Verdict.UNIQUE


def test_the_prior_of_a_program_decides_nothing_by_itself(four_rooms, drive):
    """It lists the place first; where another looks the same, it may be wrong."""
    start = SE2(*four_rooms.grid.to_map(np.array([60.0, 60.0])).tolist(), 0.5)
    (view,) = drive(four_rooms.grid, start, [], WIDE)
    belief = update(begin(four_rooms, Near(start @ SE2(0.3, 0.3, 0.2), 1.0)), view)
    assert is_at(belief.places[0].pose, start)
    assert belief.places[0].probability > 0.95
    assert belief.verdict is Verdict.AMBIGUOUS
    assert "the prior chooses this place" in belief.reason


def test_the_prior_of_a_program_confirms_what_the_view_finds_likely(room, drive):
    start = SE2(5.0, 2.5, 0.4)
    (view,) = drive(room.grid, start, [], WIDE)
    belief = update(begin(room, Near(start, 1.0)), view)
    assert belief.verdict is Verdict.UNIQUE


def test_evidence_overrules_a_hint(room, drive):
    truth = SE2(5.0, 2.5, 0.4)
    (view,) = drive(room.grid, truth, [], WIDE)
    belief = update(begin(room, Near(SE2(3.0, 4.0, 2.0), 0.5, 0.3)), view)
    assert is_at(belief.places[0].pose, truth)


def test_the_number_of_places_is_limited_by_the_config(halls, drive):
    (view,) = drive(halls.grid, START, [])
    belief = update(begin(halls, config=BeliefConfig(places=5)), view)
    assert len(belief.probabilities) <= 5
    assert belief.probabilities.sum() + belief.elsewhere == pytest.approx(1.0)
