"""Priors: where they are high, how far they can go, and which ones are refused."""

from __future__ import annotations

import math

import numpy as np
import pytest

from firstfix.belief.belief import begin, update, with_prior
from firstfix.belief.prior import FLOOR, All, Near, Region
from firstfix.core.errors import InputError
from firstfix.core.se2 import SE2

SQUARE = Region([(0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0)])


def at(*poses):
    return np.array(poses, np.float64)


def test_near_is_flat_within_its_radius_and_falls_to_the_floor():
    prior = Near(SE2(1.0, 2.0, 0.5), 1.0)
    logs = prior.log_likelihood(at((1.0, 2.0, -2.0), (1.9, 2.0, 0.0), (2.5, 2.0, 0.0), (9.0, 9, 0)))
    assert logs[:2].tolist() == [0.0, 0.0]
    assert FLOOR < logs[2] < 0.0
    assert logs[3] == FLOOR


@pytest.mark.parametrize("yaw", [math.pi - 0.1, -math.pi + 0.1])
def test_near_counts_the_heading_across_the_seam(yaw):
    prior = Near(SE2(0.0, 0.0, math.pi), 1.0, angle=0.3)
    assert prior.log_likelihood(at((0.0, 0.0, yaw))).tolist() == [0.0]
    assert prior.log_likelihood(at((0.0, 0.0, 0.0))).tolist() == [FLOOR]


def test_a_region_is_flat_inside_and_falls_outside():
    logs = SQUARE.log_likelihood(
        at((1.0, 1.0, 0.0), (0.1, 1.9, 3.0), (2.2, 1.0, 0), (1.0, -5.0, 0))
    )
    assert logs[:2].tolist() == [0.0, 0.0]
    assert FLOOR < logs[2] < 0.0
    assert logs[3] == FLOOR


def test_a_region_may_have_a_notch():
    notched = Region([(0, 0), (4, 0), (4, 4), (2, 1), (0, 4)])
    logs = notched.log_likelihood(at((2.0, 0.5, 0.0), (2.0, 3.0, 0.0), (0.5, 2.0, 0.0)))
    assert logs[0] == 0.0
    assert logs[1] < -1.0
    assert logs[2] == 0.0


def test_priors_add_up_in_any_order():
    a, b = Near(SE2(1.0, 1.0, 0.0), 0.5), SQUARE
    poses = np.random.default_rng(0).uniform(-3.0, 5.0, (50, 3))
    one = All((a, b)).log_likelihood(poses)
    np.testing.assert_allclose(one, All((b, a)).log_likelihood(poses))
    np.testing.assert_allclose(one, a.log_likelihood(poses) + b.log_likelihood(poses))
    assert one.min() == 2 * FLOOR


def test_the_order_of_priors_does_not_matter_to_a_belief(halls, drive):
    (view,) = drive(halls.grid, SE2(11.0, 2.0, 2.6), [])
    a, b = Near(SE2(11.0, 2.0, 0.0), 1.0), Region([(7, 0), (13, 0), (13, 4), (7, 4)])
    one = update(with_prior(begin(halls, a), b, None), view)
    other = update(with_prior(begin(halls, b), a, None), view)
    np.testing.assert_allclose(one.probabilities, other.probabilities)
    np.testing.assert_allclose(one.poses, other.poses)


def test_a_prior_holds_for_the_time_it_was_given(halls, drive):
    views = drive(halls.grid, SE2(9.0, 2.0, 0.0), [SE2(1.0, 0.0, 0.0)] * 2)
    prior = Near(SE2(9.0, 2.0, 0.0), 0.3)
    early = begin(halls, prior)
    for view in views:
        early = update(early, view)
    assert early.places[0].pose.distance_to(SE2(11.0, 2.0, 0.0)) < 0.1


@pytest.mark.parametrize(
    ("make", "word"),
    [
        (lambda: Near(SE2(0.0, 0.0, 0.0), 0.0), "radius"),
        (lambda: Near(SE2(0.0, 0.0, 0.0), math.nan), "radius"),
        (lambda: Near(SE2(0.0, 0.0, 0.0), 1.0, angle=0.0), "angle"),
        (lambda: Region([(0.0, 0.0), (1.0, 1.0)]), "three corners"),
        (lambda: Region("hall"), "received 'hall'"),
        (lambda: Region(None), "received None"),
        (lambda: Region([(0.0, 0.0), (1.0, 1.0), (2.0, 2.0)]), "one line"),
        (lambda: Region([(0.0, 0.0), (1.0, 1.0), (math.nan, 2.0)]), "NaN"),
    ],
)
def test_priors_that_mean_nothing_are_refused(make, word):
    with pytest.raises(InputError, match=word):
        make()


@pytest.mark.parametrize(
    ("prior", "word"),
    [
        (Near(SE2(50.0, 2.0, 0.0), 1.0), "outside"),
        (Near(SE2(6.5, -0.4, 0.0), 0.2), "free space"),
        (Region([(6.2, 0.0), (6.8, 0.0), (6.8, 4.0), (6.2, 4.0)]), "free space"),
        (All((SQUARE, Near(SE2(50.0, 2.0, 0.0), 1.0))), "outside"),
    ],
)
def test_priors_that_do_not_fit_the_map_are_refused(halls, prior, word):
    with pytest.raises(InputError, match=word):
        begin(halls, prior)
