"""Every beam is explained, short, through a wall or in unknown space."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firstfix.core.grid import OCCUPIED, UNKNOWN, OccupancyGrid
from firstfix.fields.map_fields import MapFields
from firstfix.global_localization.beams import Beams
from firstfix.global_localization.verify import BeamClass, beam_classes, beam_costs, verify

RESOLUTION = 0.05

# The sensor stands at (2, 3) m and looks east, at a wall 4 m away; nothing is known above 5 m.
SENSOR = np.array([[2.0 / RESOLUTION, 3.0 / RESOLUTION, 0.0]])


@pytest.fixture(scope="module")
def yard() -> MapFields:
    """10 x 8 m with one wall at x = 6 m, 20 cm thick and from y = 0 to 5 m."""
    cells = np.zeros((160, 200), np.int8)
    cells[:100, 120:124] = OCCUPIED
    cells[100:] = UNKNOWN
    return MapFields(OccupancyGrid(cells, RESOLUTION))


def beam(bearing: float, range_m: float, *, hit: bool = True) -> Beams:
    return Beams(np.array([bearing]), np.array([range_m]), np.array([hit]))


NORTH, EAST, WEST = np.pi / 2, 0.0, np.pi

ONE_BEAM = [
    (EAST, 4.02, True, BeamClass.EXPLAINED),
    (EAST, 3.9, True, BeamClass.EXPLAINED),
    (EAST, 4.15, True, BeamClass.EXPLAINED),
    (EAST, 2.5, True, BeamClass.SHORT),
    (EAST, 1.0, True, BeamClass.SHORT),
    (EAST, 5.5, True, BeamClass.THROUGH_WALL),
    (EAST, 30.0, True, BeamClass.THROUGH_WALL),  # through it and out of the map
    (NORTH, 4.0, True, BeamClass.UNKNOWN),
    (WEST, 15.0, True, BeamClass.UNKNOWN),  # outside the map
    (NORTH, 1.0, True, BeamClass.SHORT),  # something stands where the map is free
    (WEST, 10.0, False, BeamClass.EXPLAINED),  # nothing there, and nothing returned
    (EAST, 3.0, False, BeamClass.EXPLAINED),  # the reach ends before the wall
    (EAST, 10.0, False, BeamClass.THROUGH_WALL),  # a wall is there, and nothing returned
]


@pytest.mark.parametrize(("bearing", "range_m", "hit", "kind"), ONE_BEAM)
def test_one_beam(yard, bearing, range_m, hit, kind):
    counts = verify(SENSOR, beam(bearing, range_m, hit=hit), yard).counts
    assert counts.tolist() == [[int(k == kind) for k in range(4)]]
    assert beam_classes(SENSOR[0], beam(bearing, range_m, hit=hit), yard).tolist() == [kind]


def test_unseen_space_is_unknown_whatever_the_thresholds(yard):
    unseen = np.zeros(yard.grid.cells.shape, np.bool_)
    unseen[:, :70] = True  # up to x = 3.5 m; the beam ends at 3 m
    grid = OccupancyGrid(yard.grid.cells, RESOLUTION, unseen=unseen)
    counts = verify(SENSOR, beam(EAST, 1.0), MapFields(grid)).counts
    assert counts[0, BeamClass.UNKNOWN] == 1


@pytest.mark.parametrize("quarter", range(4))
def test_the_heading_turns_the_beams(yard, quarter):
    turn = quarter * np.pi / 2
    turned = SENSOR + np.array([0.0, 0.0, turn])
    there = verify(turned, beam(EAST - turn, 2.5), yard)
    here = verify(SENSOR, beam(EAST, 2.5), yard)
    np.testing.assert_allclose(there.scores, here.scores)
    assert there.counts.tolist() == here.counts.tolist()


def cost(fields: MapFields, bearing: float, range_m: float, *, hit: bool = True) -> float:
    return float(verify(SENSOR, beam(bearing, range_m, hit=hit), fields).scores[0])


def test_seeing_through_a_wall_costs_more_than_being_short_and_that_more_than_fitting(yard):
    fits, short, through = (cost(yard, EAST, r) for r in (4.02, 2.5, 5.5))
    assert fits < 0.2
    assert fits + 1.0 < short < through - 1.0


def test_a_missing_return_costs_only_where_a_wall_should_have_answered(yard):
    assert cost(yard, WEST, 10.0, hit=False) == 0.0
    assert 0.0 < cost(yard, EAST, 10.0, hit=False) < cost(yard, EAST, 10.0)


def test_the_farther_off_the_dearer(yard):
    short = [cost(yard, EAST, r) for r in (4.0, 3.9, 3.8, 3.7, 3.5, 3.0)]
    through = [cost(yard, EAST, r) for r in (4.1, 4.25, 4.4, 4.6, 5.0, 7.0)]
    assert short == sorted(short)
    assert through == sorted(through)


def random_case(seed: int, n: int, poses: int) -> tuple[np.ndarray, Beams]:
    rng = np.random.default_rng(seed)
    x, y = rng.uniform(-5, 205, poses), rng.uniform(-5, 165, poses)
    beams = Beams(rng.uniform(-7, 7, n), rng.uniform(0.05, 12, n), rng.random(n) < 0.7)
    return np.column_stack([x, y, rng.uniform(-7, 7, poses)]), beams


@settings(deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 400), st.integers(0, 5))
def test_shares_are_a_partition_of_the_beams(yard, seed, n, poses):
    """Also where the sensor stands in a wall or outside the map."""
    where, beams = random_case(seed, n, poses)
    verification = verify(where, beams, yard)
    assert verification.counts.shape == (poses, 4)
    assert (verification.counts >= 0).all()
    assert np.isfinite(verification.scores).all()
    assert (verification.scores >= 0.0).all()
    for i in range(poses):
        evidence = verification.evidence(i)
        assert evidence.beams == verification.counts[i].sum() <= n
        shares = (evidence.explained, evidence.short, evidence.through_wall, evidence.unknown)
        assert sum(shares) == pytest.approx(1.0)


@settings(deadline=None)
@given(st.integers(0, 2**32 - 1), st.permutations(range(5)))
def test_each_pose_is_judged_alone(yard, seed, order):
    poses, beams = random_case(seed, 60, 5)
    together, shuffled = verify(poses, beams, yard), verify(poses[order], beams, yard)
    assert shuffled.scores.tolist() == together.scores[order].tolist()
    assert shuffled.counts.tolist() == together.counts[order].tolist()


@settings(deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 60))
def test_the_score_is_a_mean_over_the_beams(yard, seed, n):
    """It lies between the best and the worst beam, and the same beams twice have the same cost."""
    poses, beams = random_case(seed, n, 1)
    score = verify(poses, beams, yard).scores[0]
    alone = [
        verify(poses, beam(bearing, range_m, hit=hit), yard).scores[0]
        for bearing, range_m, hit in zip(beams.bearings, beams.ranges, beams.hit, strict=True)
    ]
    assert min(alone) - 1e-9 <= score <= max(alone) + 1e-9
    twice = Beams(*(np.repeat(array, 2) for array in (beams.bearings, beams.ranges, beams.hit)))
    assert verify(poses, twice, yard).scores[0] == pytest.approx(score)


@pytest.mark.parametrize("x_m", [2.0, 6.1])
def test_the_costs_of_beams_sum_to_the_score(yard, x_m):
    """At 6.1 m the sensor stands in the wall."""
    poses = np.array([[x_m / RESOLUTION, 3.0 / RESOLUTION, 0.0], [*SENSOR[0, :2], 0.4]])
    beams = Beams(np.linspace(-1.0, 1.0, 40), np.linspace(1.0, 8.0, 40), np.arange(40) % 5 > 0)
    costs, _ = beam_costs(poses, beams, yard)
    assert costs.sum(axis=1) == pytest.approx(verify(poses, beams, yard).scores)


@pytest.mark.parametrize(("range_m", "cause_m"), [(2.5, 2.5), (4.02, 4.0), (5.5, 4.0)])
def test_the_cause_of_a_cost_is_what_is_nearer_the_thing_or_the_wall(yard, range_m, cause_m):
    _, causes = beam_costs(SENSOR, beam(EAST, range_m), yard)
    assert causes == pytest.approx(np.array([[cause_m]]))


def test_poses_and_beams_are_not_changed(yard):
    poses, beams = random_case(1, 50, 4)
    before = [poses.copy(), beams.bearings.copy(), beams.ranges.copy(), beams.hit.copy()]
    verify(poses, beams, yard)
    for now, then in zip((poses, beams.bearings, beams.ranges, beams.hit), before, strict=True):
        np.testing.assert_array_equal(now, then)


@pytest.fixture(scope="module")
def thick() -> MapFields:
    """10 x 8 m with a wall 1.2 m thick from x = 6 m on, and a thin one at x = 8.5 m."""
    cells = np.zeros((160, 200), np.int8)
    cells[:, 120:144] = OCCUPIED
    cells[:, 170:172] = OCCUPIED
    return MapFields(OccupancyGrid(cells, RESOLUTION))


@pytest.mark.parametrize(
    ("range_m", "kind"),
    [
        (4.2, BeamClass.EXPLAINED),
        (4.4, BeamClass.THROUGH_WALL),
        (5.1, BeamClass.THROUGH_WALL),  # near the far side
        (6.52, BeamClass.THROUGH_WALL),  # on the next wall
    ],
)
def test_a_beam_that_ends_deep_in_a_wall_goes_through_it(thick, range_m, kind):
    assert beam_classes(SENSOR[0], beam(EAST, range_m), thick).tolist() == [kind]


@pytest.mark.parametrize(
    ("deep", "kind"), [(0.25, BeamClass.EXPLAINED), (0.4, BeamClass.THROUGH_WALL)]
)
def test_a_beam_along_a_wall_may_be_long_in_it_but_not_deep(thick, deep, kind):
    grazing = 1.0
    length = (4.0 + deep) / np.cos(grazing)  # 0.46 m of it in the wall, or 0.74 m
    south = np.array([2.0 / RESOLUTION, 0.3 / RESOLUTION, 0.0])
    assert beam_classes(south, beam(grazing, length), thick).tolist() == [kind]


def test_a_beam_along_a_wall_of_usual_thickness_goes_through_it(yard):
    grazing = 0.5
    length = 4.25 / np.cos(grazing)  # just behind the wall, in free space
    south = np.array([2.0 / RESOLUTION, 0.3 / RESOLUTION, 0.0])
    through = [beam_classes(south, beam(grazing, r), yard)[0] for r in (length, length + 0.3)]
    assert BeamClass.THROUGH_WALL in through


# ---- what is known to have changed

# The wall east of the sensor is gone; a cabinet stands north of it.
WHERE = {"gone": (slice(50, 70), slice(120, 124)), "new": (slice(78, 84), slice(36, 46))}


@pytest.fixture(scope="module")
def changed_yard(yard) -> MapFields:
    cells = np.full_like(yard.grid.cells, UNKNOWN)
    cells[WHERE["gone"]], cells[WHERE["new"]] = 0, OCCUPIED
    return MapFields(yard.grid.with_changes(OccupancyGrid(cells, RESOLUTION)))


@pytest.mark.parametrize(
    ("bearing", "range_m", "hit"),
    [
        (EAST, 5.5, True),  # through the wall that is gone
        (EAST, 10.0, False),
        (NORTH, 0.95, True),  # at the cabinet
    ],
)
def test_a_beam_that_meets_a_known_change_contradicts_less(
    yard, changed_yard, bearing, range_m, hit
):
    before = cost(yard, bearing, range_m, hit=hit)
    assert cost(changed_yard, bearing, range_m, hit=hit) < 0.6 * before
    counts = verify(SENSOR, beam(bearing, range_m, hit=hit), changed_yard).counts
    assert counts[0, BeamClass.UNKNOWN] == 1


@pytest.mark.parametrize(
    ("bearing", "range_m", "hit"),
    [
        (EAST, 4.02, True),  # at the wall, should it still be there
        (EAST, 1.0, True),  # a person in front of it
        (0.7, 5.5, True),  # through the wall, where it is not known to be gone
        (WEST, 10.0, False),
    ],
)
def test_other_beams_cost_the_same_to_the_last_bit(yard, changed_yard, bearing, range_m, hit):
    same = cost(yard, bearing, range_m, hit=hit)
    assert cost(changed_yard, bearing, range_m, hit=hit) == same
