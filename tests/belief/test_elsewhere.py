"""Places that are not held: they have probability where views say little, and it can be missed."""

from __future__ import annotations

import math

import numpy as np
import pytest

from firstfix.belief.belief import begin, update
from firstfix.belief.config import BeliefConfig
from firstfix.belief.elsewhere import missed_log_odds, rival_cost, with_missed
from firstfix.belief.tracks import Tracks
from firstfix.belief.view import Observation, View
from firstfix.core.estimate import Verdict
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.fields.map_fields import MapFields
from firstfix.lab.simulation.lidar import Lidar
from firstfix.lab.worlds.drawing import Drawing

CONFIG = BeliefConfig()
NARROW = Lidar(beams=61, fov=math.radians(60.0), range_max=5.0, sigma_m=0.01)
NEW_BOXES = ((4.9, 0.9), (0.7, 1.2), (1.6, 5.5), (7.3, 3.8))


def window(rivals, step_m=0.3, fov_deg=60.0, range_max=5.0):
    """Take views along a straight line; the third place of each has a cost."""
    fov = math.radians(fov_deg)
    scan = LaserScan(np.full(61, 2.0), -fov / 2, fov / 60, 0.0, range_max)
    return [
        Observation((View.of(scan, SE2(step_m * i, 0.0, 0.0)),), 0.05, rival)
        for i, rival in enumerate(rivals)
    ]


def track(costs):
    tracks = Tracks.at(np.zeros((1, 3)), np.array(costs[:1]), np.array([0]))
    for cost in costs[1:]:
        tracks = tracks.before(Tracks.at(np.zeros((1, 3)), np.array([cost]), np.array([0])))
    return tracks


def odds(costs, rivals, **options):
    return missed_log_odds(track(costs), window(rivals, **options), CONFIG)


def test_the_rival_is_the_third_place_not_the_third_pose():
    poses = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [90.0, 0.0, 0.0], [0.0, 90.0, 0.0]])
    entering = Tracks.at(poses, np.array([0.1, 0.2, 0.3, 0.4]), np.arange(4))
    assert rival_cost(entering, 0.05) == 0.4
    assert rival_cost(entering.take(np.arange(3)), 0.05) == math.inf


def test_a_view_that_fits_everywhere_says_less_than_one_that_fits_here_alone():
    assert odds([0.1], [0.1]) > odds([0.1], [0.5]) > odds([0.1], [2.0])


def test_views_from_one_place_say_hardly_more_than_one():
    still, driven = (odds([0.1] * 4, [0.5] * 4, step_m=step) for step in (0.01, 2.0))
    assert odds([0.1], [0.5]) - still < 0.2
    assert still - driven > 5.0


def test_a_place_that_is_worse_than_those_of_each_view_is_one_of_many():
    """So was a wrong place that drove along with the right one: good enough, but never the best."""
    assert odds([0.6] * 6, [0.1] * 6, step_m=2.0) > 0.0
    assert odds([0.1] * 6, [0.1] * 6, step_m=2.0) < -3.0


def test_one_view_of_something_new_is_forgiven():
    changed = odds([0.1, 3.0, 0.1, 0.1], [0.5] * 4, step_m=2.0)
    assert changed < odds([0.1, 0.1], [0.5] * 2, step_m=2.0)


def test_a_sensor_that_covers_more_starts_with_less_missed():
    wide = odds([0.1], [0.5], fov_deg=360.0, range_max=12.0)
    assert odds([0.1], [0.5]) - wide == pytest.approx(math.log(12**2 * 6 / 5**2), abs=0.1)


def test_older_views_do_not_count_against_a_robot_that_was_carried():
    old = [4.0] * 4
    carried = odds([*old, *[0.1] * 8], [0.5] * 12, step_m=2.0)
    assert carried == pytest.approx(odds([0.1] * 8, [0.5] * 8, step_m=2.0))


def test_probabilities_and_what_was_missed_sum_to_one():
    probabilities, missed = with_missed(np.array([0.7, 0.2]), 1.0)
    assert probabilities.sum() + missed + 0.1 / (1.0 + 0.7 * math.e) == pytest.approx(1.0)
    assert missed / probabilities[0] == pytest.approx(math.e)


@pytest.fixture(scope="module")
def hall():
    return MapFields(drawn_hall(()))


def drawn_hall(boxes):
    plan = Drawing(11.0, 9.0, 0.05, 1.0)
    plan.room(0.0, 0.0, 9.0, 7.0)
    plan.solid(0.1, 5.5, 2.0, 6.9)
    plan.solid(6.0, 0.1, 7.0, 1.0)
    plan.solid(8.2, 4.0, 8.9, 5.0)
    for x, y in boxes:
        plan.solid(x, y, x + 0.6, y + 0.6)
    return plan.grid()


@pytest.mark.parametrize("yaw", [-2.5, -1.5])
def test_new_boxes_in_a_hall_make_a_turning_camera_sure_of_no_wrong_place(hall, yaw):
    """It was sure at the fourth view, of a place whose costs were 0.7, 1.1, 1.1 and 0.5."""
    world, rng = drawn_hall(NEW_BOXES), np.random.default_rng(0)
    pose, odometry, belief = SE2(1.9, 3.5, yaw), SE2.identity(), begin(hall)
    for _ in range(5):
        belief = update(belief, View.of(NARROW.scan(world, pose, rng), odometry))
        assert belief.verdict is not Verdict.UNIQUE
        assert belief.places[0].pose.distance_to(pose) > 1.0
        assert belief.missed > 0.03
        pose, odometry = (at @ SE2(0.0, 0.0, 0.3) for at in (pose, odometry))


def test_what_is_missed_is_named(hall):
    world, rng = drawn_hall(NEW_BOXES), np.random.default_rng(0)
    belief = begin(hall)
    for turn in (0.0, 0.3, 0.6):
        pose = SE2(1.9, 3.5, turn - 2.5)
        belief = update(belief, View.of(NARROW.scan(world, pose, rng), SE2(0.0, 0.0, turn)))
    assert f"{belief.missed:.0%} is left to places that are not listed" in belief.reason
    assert belief.probabilities.sum() + belief.elsewhere == pytest.approx(1.0)
