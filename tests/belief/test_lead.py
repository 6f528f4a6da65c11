"""A place must be ahead by more than one thing, however many views have seen it."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest

from firstfix.belief.belief import begin, update
from firstfix.belief.config import BeliefConfig
from firstfix.belief.joint import counted_since
from firstfix.belief.lead import lead
from firstfix.belief.tracks import Tracks, follow
from firstfix.belief.view import Link, Observation, View, costs
from firstfix.core.estimate import Verdict
from firstfix.core.se2 import SE2
from firstfix.fields.map_fields import MapFields
from firstfix.lab.simulation.lidar import Lidar
from firstfix.lab.worlds.drawing import Drawing

CONFIG = BeliefConfig()
SENSOR = Lidar(beams=121, fov=math.radians(120.0), range_max=8.0, sigma_m=0.01)
PITCH = 9.0
START = SE2(1.0, 2.0, 0.3)
STEPS = [SE2(0.3, 0.0, 0.1)] * 6

CUPBOARD = ((5.6, 2.6, 6.4, 3.2),)
CHAIRS = ((5.6, 2.6, 6.4, 3.2), (3.2, 3.8, 3.8, 4.6), (6.8, 0.4, 7.4, 1.2), (1.6, 4.9, 2.4, 5.4))
NEW_BOXES = ((3.0, 1.2, 3.4, 1.5), (4.2, 4.0, 4.6, 4.3), (6.6, 1.4, 7.0, 1.8), (4.8, 1.0, 5.1, 1.3))


def two_halls(left=(), right=()):
    """Draw two halls of 8 x 6 m; the boxes stand in the left one or in the right one."""
    plan = Drawing(18.0, 7.0, 0.05, 0.5)
    for x, boxes in ((0.0, left), (PITCH, right)):
        plan.room(x, 0.0, x + 8.0, 6.0)
        for x0, y0, x1, y1 in boxes:
            plan.solid(x + x0, y0, x + x1, y1)
    return MapFields(plan.grid())


def observed(world, drive, steps=STEPS):
    return tuple(
        Observation((view,), world.grid.resolution)
        for view in drive(world.grid, START, steps, SENSOR)
    )


def tracks_at(fields, window, *starts):
    """Follow places through all views, the first the best."""
    poses = np.array([(fields.grid.T_map_grid.inverse() @ start).as_array() for start in starts])
    poses[:, :2] /= fields.grid.resolution
    tracks = Tracks.at(poses, costs(poses, window[0], 36, fields), np.arange(len(starts)))
    for start, end in pairwise(window):
        tracks = follow(tracks, start, end, fields)
    return tracks


def lead_of(fields, drive, steps=STEPS):
    window = observed(fields, drive, steps)
    there = SE2(START.x + PITCH, START.y, START.yaw)
    return lead(tracks_at(fields, window, START, there), window, fields, CONFIG)


def test_one_thing_is_no_lead_in_however_many_views(drive):
    fields = two_halls(left=CUPBOARD)
    for n in (1, 6, 12):
        assert lead_of(fields, drive, [SE2(0.1, 0.0, 0.05)] * n) == pytest.approx(0.0, abs=1.0)


@pytest.mark.parametrize("hall", ["left", "right"])
def test_several_things_are_a_lead(drive, hall):
    fields = two_halls(**{hall: CHAIRS})
    assert lead_of(fields, drive) > 3.0


def test_a_thing_that_the_map_has_only_elsewhere_is_one_thing(drive):
    """The beams end on different walls behind it, but in the other hall they all meet it."""
    assert lead_of(two_halls(right=CUPBOARD), drive) == pytest.approx(0.0, abs=1.0)


def test_a_place_without_another_leads(drive):
    fields = two_halls()
    window = observed(fields, drive)
    assert lead(tracks_at(fields, window, START), window, fields, CONFIG) == math.inf


def test_the_nearest_of_the_others_counts(drive):
    fields = two_halls(left=CHAIRS)
    window = observed(fields, drive)
    there, nowhere = SE2(START.x + PITCH, START.y, START.yaw), SE2(4.0, 3.0, 2.0)
    several = tracks_at(fields, window, START, nowhere, there)
    alone = tracks_at(fields, window, START, there)
    assert lead(several, window, fields, CONFIG) <= lead(alone, window, fields, CONFIG) + 1e-9


def verdicts(fields, world, start, drive):
    belief, verdicts = begin(fields), []
    for view in drive(world.grid, start, [SE2(0.3, 0.0, 0.1)] * 9, SENSOR):
        belief = update(belief, view)
        verdicts.append((belief.verdict, belief.poses[0] if len(belief.poses) else None))
    return verdicts


def test_one_thing_is_enough_where_nothing_else_has_been_moved(drive):
    fields = two_halls(left=CUPBOARD)
    assert verdicts(fields, fields, START, drive)[-1][0] is Verdict.UNIQUE


def test_one_thing_is_not_enough_where_other_things_have_been_moved(drive):
    """The cupboard of the left hall stands in the right one, among new boxes."""
    fields, world = two_halls(left=CUPBOARD), two_halls(right=(*CUPBOARD, *NEW_BOXES))
    start = SE2(START.x + PITCH, START.y, START.yaw)
    assert all(
        verdict is not Verdict.UNIQUE for verdict, _ in verdicts(fields, world, start, drive)
    )


def test_views_before_a_kidnap_do_not_count(drive):
    fields = two_halls(left=CHAIRS)
    window = list(observed(fields, drive))
    there = SE2(START.x + PITCH, START.y, START.yaw)
    tracks = tracks_at(fields, window, START, there)
    assert counted_since(tracks, window, CONFIG).tolist() == [0, 0]
    broken = window[3]
    window[3] = Observation(broken.views, broken.resolution, link=Link.BROKEN)
    carried = tracks.costs.copy()
    carried[0, :3] = 6.0
    moved = Tracks(tracks.poses, carried, tracks.strains, tracks.careful, tracks.ids)
    assert counted_since(moved, window, CONFIG).tolist() == [3, 0]


def test_sensors_with_other_beams_in_one_window(drive):
    """Views of few beams and of many are compared without each other's empty places."""
    fields = two_halls(left=CHAIRS)
    few = Lidar(beams=31, fov=math.radians(120.0), range_max=8.0, sigma_m=0.01)
    window = [
        Observation(
            (View(tuple(drive(fields.grid, START, [], lidar)[0].scans), SE2(0.0, 0.0, 0.0)),),
            fields.grid.resolution,
        )
        for lidar in (few, SENSOR)
    ]
    there = SE2(START.x + PITCH, START.y, START.yaw)
    assert lead(tracks_at(fields, window, START, there), window, fields, CONFIG) > 0.0
