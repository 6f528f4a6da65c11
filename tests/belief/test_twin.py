"""The slow twin of the belief judges it: exact Bayes over every pose of a tiny map."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pytest
from numpy.typing import NDArray

from firstfix.belief.belief import begin, update
from firstfix.belief.evidence import FLOOR, exponent, log_likelihoods, novelty, shares
from firstfix.belief.planar import between, compose
from firstfix.belief.tracks import CAREFUL_BEAMS
from firstfix.belief.view import Observation, View, costs
from firstfix.core.angles import angle_error
from firstfix.core.se2 import SE2
from firstfix.fields.map_fields import MapFields
from firstfix.global_localization.places import distinct_places

STARTS = [SE2(5.5, 4.5, 0.4), SE2(3.0, 1.5, 2.0), SE2(2.5, 3.0, -1.0)]
STEPS = [SE2(0.3, 0.0, -0.35)] * 3

_STEP_M = 0.1
_HEADINGS = 120
# The grid leaves 0.07 m and 1.5 degrees: a finer grid follows the best poses of it.
_FINE_M = 0.025
_FINE_RAD = math.radians(0.75)
_PLACES = 24


def exact_posterior(
    views: Sequence[View], fields: MapFields
) -> tuple[NDArray[np.float64], NDArray[np.float64], float]:
    """Return poses of the base at the last view (n, 3), their probabilities and that of elsewhere.

    Every pose of a grid over all free space is carried back along the odometry, compared with every
    view, and weighed. No search, no list, no window, no adjustment.
    """
    window = [Observation((view,), fields.grid.resolution) for view in views]
    poses = _everywhere(fields)
    joint = _joint(poses, window, 20, fields)
    best = poses[distinct_places(poses, joint, fields.grid.resolution, _PLACES)]
    for _ in range(3):
        around = best[:, None] + _fine(fields)[None]
        joint = _joint(around.reshape(-1, 3), window, CAREFUL_BEAMS, fields).reshape(len(best), -1)
        best = around[np.arange(len(best)), joint.argmin(axis=1)]
    joint = joint.min(axis=1)
    kept = distinct_places(best, joint, fields.grid.resolution, _PLACES)
    power = exponent(float(novelty(window).sum()), len(window[-1].beams))
    probabilities, elsewhere = shares(log_likelihoods(joint[kept], power), power)
    return best[kept], probabilities, elsewhere


def _joint(
    poses: NDArray[np.float64], window: Sequence[Observation], beams: int, fields: MapFields
) -> NDArray[np.float64]:
    last = window[-1].odometry
    total = np.zeros(len(poses))
    for seen in window:
        there = compose(poses, between(last, seen.odometry))
        total += np.log(costs(there, seen, beams, fields) + FLOOR)
    return np.exp(total / len(window)) - FLOOR


def _everywhere(fields: MapFields) -> NDArray[np.float64]:
    step = max(1, round(_STEP_M / fields.grid.resolution))
    rows, columns = np.nonzero(fields.grid.seen_free)
    on_grid = (rows % step == 0) & (columns % step == 0)
    headings = np.arange(_HEADINGS) * (2.0 * math.pi / _HEADINGS)
    xy = np.column_stack([columns[on_grid], rows[on_grid]]) + 0.5
    return np.column_stack([np.repeat(xy, _HEADINGS, axis=0), np.tile(headings, len(xy))])


def _fine(fields: MapFields) -> NDArray[np.float64]:
    off = np.arange(-2, 3) * _FINE_M / fields.grid.resolution
    turn = np.arange(-2, 3) * _FINE_RAD
    return np.stack(np.meshgrid(off, off, turn), axis=-1).reshape(-1, 3)


def paired(belief, poses, fields, least):
    """Return probabilities of each place of the belief and of the same one of the twin."""
    xy = fields.grid.to_map(poses[:, :2])
    for place in belief.places:
        if place.probability >= least:
            off = np.hypot(xy[:, 0] - place.pose.x, xy[:, 1] - place.pose.y)
            turned = angle_error(poses[:, 2], place.pose.yaw)
            same = np.flatnonzero((off < 0.3) & (turned < math.radians(10.0)))
            yield place.probability, same


@pytest.mark.parametrize("start", STARTS)
def test_one_view_is_weighed_as_the_twin_does(room, drive, start):
    views = drive(room.grid, start, [])
    belief = update(begin(room), views[0])
    poses, probabilities, elsewhere = exact_posterior(views, room)
    # The twin holds every pose: nothing can be missed.
    probabilities, elsewhere = probabilities * belief.held, elsewhere * belief.held + belief.missed
    total = belief.missed
    for probability, same in paired(belief, poses, room, 0.01):
        assert abs(probabilities[same].max(initial=0.0) - probability) < 0.03
        total += probabilities[same].max(initial=0.0)
    assert total > 0.95
    assert abs(elsewhere - belief.elsewhere) < 0.02


@pytest.mark.slow
@pytest.mark.parametrize("start", STARTS)
def test_some_views_are_weighed_as_the_twin_does(room, drive, start):
    # The twin takes odometry at its word; the belief leaves it some slack and is less sure.
    views = drive(room.grid, start, STEPS)
    belief = begin(room)
    for view in views:
        belief = update(belief, view)
    poses, probabilities, _ = exact_posterior(views, room)
    held = {int(i): p for p, same in paired(belief, poses, room, 0.0) for i in same}
    for i in np.flatnonzero(probabilities >= 0.05):
        assert held[int(i)] >= 0.8 * probabilities[i] * belief.held
