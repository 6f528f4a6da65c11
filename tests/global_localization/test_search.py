"""The fast search equals the slow obvious one over the same score."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from firstfix.core.angles import FULL_TURN, angle_error
from firstfix.core.grid import OCCUPIED, UNKNOWN, OccupancyGrid
from firstfix.core.se2 import SE2
from firstfix.fields import endpoint_field, range_table
from firstfix.fields.map_fields import MapFields
from firstfix.fields.range_table import DIRECTIONS
from firstfix.global_localization.beams import Beams, by_direction, usable_beams
from firstfix.global_localization.config import LocateConfig
from firstfix.global_localization.search import (
    ENDPOINT_BEAMS,
    NO_RETURN_LIMIT,
    RANGE_BEAMS,
    SECTORS,
    SHORT_LIMIT,
    THROUGH_LIMIT,
    Candidates,
    search,
)
from firstfix.lab.simulation.lidar import Lidar

UNIT = 2.0**-23  # metres that the integer scores count
PLACE = 2  # positions to the side of a place of the shortlist
ALL = 10**6
ALL_POSES = LocateConfig().max_poses


def random_map(seed: int, height: int, width: int, resolution: float) -> OccupancyGrid:
    """Boxes of wall and of unknown space in a hall, and dust."""
    rng = np.random.default_rng(seed)
    cells = np.zeros((height, width), np.int8)
    for value in (OCCUPIED, UNKNOWN, OCCUPIED):
        y, x = rng.integers(0, height), rng.integers(0, width)
        cells[y : y + rng.integers(1, 9), x : x + rng.integers(1, 9)] = value
    cells[rng.random(cells.shape) < 0.01] = OCCUPIED
    cells[0, 0] = OCCUPIED
    return OccupancyGrid(cells, resolution)


def random_beams(seed: int, n: int, hit_share: float, longest_m: float) -> Beams:
    """Beams of any bearing, as scans with a negative step or from another turn have them."""
    rng = np.random.default_rng(seed)
    start, step = rng.uniform(-4.0, 4.0), rng.choice([-1.0, 1.0]) * rng.uniform(0.5, 1.0)
    bearings = start + step * FULL_TURN / n * np.arange(n)
    return Beams(bearings, rng.uniform(0.05, longest_m, n), rng.random(n) < hit_share)


def slow_search(beams: Beams, fields: MapFields, shortlist: int) -> Candidates:
    """Score every position and heading, one sum at a time; keep the best of every place."""
    words = slow_scores(beams, fields)
    positions = fields.positions
    of_sector = words.reshape(len(positions), SECTORS, DIRECTIONS // SECTORS).min(axis=2)
    position, sector = np.divmod(np.arange(of_sector.size), SECTORS)
    order = np.lexsort((position * SECTORS + sector, of_sector.ravel()))
    taken = set[tuple[int, int, int]]()
    poses, scores = [], []
    x, y = positions.centres(np.arange(len(positions)))
    for i in order:
        p = position[i]
        place = (
            int(positions.rows[p]) // PLACE,
            int(positions.columns[p]) // PLACE,
            int(sector[i]),
        )
        if place in taken:
            continue
        taken.add(place)
        score, heading = divmod(int(of_sector.ravel()[i]), DIRECTIONS)
        poses.append((x[p], y[p], heading * (FULL_TURN / DIRECTIONS)))
        scores.append(score * UNIT)
        if len(poses) == shortlist:
            break
    return Candidates(np.array(poses), np.array(scores))


def slow_scores(beams: Beams, fields: MapFields) -> NDArray[np.int64]:
    """Score and, below it, heading of every pose, shape (n_positions, DIRECTIONS)."""
    headings = np.arange(DIRECTIONS)
    scores = np.zeros((len(fields.positions), DIRECTIONS), np.int64)
    # End points: hits within reach, evenly thinned, on the pooled truncated distance.
    hits = beams.hits()
    reached = hits.ranges < range_table.REACH_M
    ends = Beams(hits.bearings[reached], hits.ranges[reached], hits.hit[reached])
    ends = ends.thinned(ENDPOINT_BEAMS)
    end_weight = round(endpoint_field.UNIT_M * len(hits) / len(beams) / max(1, len(ends)) / UNIT)
    field, side = pooled_field(fields)
    per_block = fields.positions.stride // side
    centre = fields.positions.offset
    for bearing, range_m in zip(ends.bearings, ends.ranges, strict=True):
        cells = range_m / fields.grid.resolution
        angles = bearing + headings * (FULL_TURN / DIRECTIONS)
        # Relative to the block, so that rounding falls as it does in the kernel.
        down = np.floor((centre + cells * np.sin(angles)) / side).astype(np.int64)
        across = np.floor((centre + cells * np.cos(angles)) / side).astype(np.int64)
        row = fields.positions.rows[:, None].astype(np.int64) * per_block + down
        column = fields.positions.columns[:, None].astype(np.int64) * per_block + across
        inside = (row >= 0) & (row < field.shape[0]) & (column >= 0) & (column < field.shape[1])
        values = np.full(row.shape, endpoint_field.LIMIT)
        values[inside] = field[row[inside], column[inside]]
        scores += end_weight * values
    # Ranges: one beam for each direction of the table, evenly thinned.
    directions, seen = by_direction(beams)
    keep = np.linspace(0, len(seen) - 1, min(RANGE_BEAMS, len(seen))).round().astype(int)
    range_weight = round(range_table.UNIT_M / len(keep) / UNIT)
    for i in keep:
        measured = min(round(seen.ranges[i] / range_table.UNIT_M), range_table.FARTHEST)
        expected = fields.ranges[:, (directions[i] + headings) % DIRECTIONS].astype(np.int64)
        through, short = (
            (int(THROUGH_LIMIT), int(SHORT_LIMIT)) if seen.hit[i] else (int(NO_RETURN_LIMIT), 0)
        )
        gap = measured - expected
        scores += range_weight * (np.clip(gap, 0, through) + np.clip(-gap, 0, short))
    return scores * DIRECTIONS + headings


def pooled_field(fields: MapFields) -> tuple[NDArray[np.int64], int]:
    """Mean truncated distance, in counts, of squares of half a block."""
    side = max(1, fields.positions.stride // 2)
    metres = np.sqrt(fields.squares.astype(np.float64)) * fields.grid.resolution
    counts = np.minimum(metres / endpoint_field.UNIT_M, endpoint_field.LIMIT).astype(np.float32)
    height, width = counts.shape
    pooled = np.empty((-(-height // side), -(-width // side)), np.int64)
    for row, column in np.ndindex(pooled.shape):
        part = counts[row * side : (row + 1) * side, column * side : (column + 1) * side]
        pooled[row, column] = math.floor(part.astype(np.float64).mean() + 0.5)
    return pooled, side


def assert_same(fast: Candidates, slow: Candidates) -> None:
    np.testing.assert_array_equal(fast.scores, slow.scores)
    np.testing.assert_array_equal(fast.poses, slow.poses)


seeds = st.integers(0, 2**32 - 1)


@settings(deadline=None, max_examples=40)
@given(
    seeds,
    st.tuples(st.integers(4, 48), st.integers(4, 48)),
    st.sampled_from([0.02, 0.05, 0.1, 0.25]),
    st.integers(1, 30) | st.integers(31, 200),
    st.sampled_from([0.0, 0.5, 0.9, 1.0]),
    st.sampled_from([1.0, 4.0, 40.0]),
    st.sampled_from([1, 7, ALL]),
)
def test_fast_equals_slow(seed, shape, resolution, n, hit_share, longest_m, shortlist):
    fields = MapFields(random_map(seed, *shape, resolution))
    beams = random_beams(seed, n, hit_share, longest_m)
    candidates, report = search(beams, fields, shortlist, ALL_POSES)
    assert report.proven
    assert report.searched == pytest.approx(1.0) or len(fields.positions) == 0
    assert report.poses == len(fields.positions) * DIRECTIONS
    if len(fields.positions):
        assert_same(candidates, slow_search(beams, fields, shortlist))
    else:
        assert candidates.poses.shape == (0, 3)


@pytest.mark.parametrize("n", range(1, 14))
def test_any_few_beams(n, room):
    """Kernels take beams by fours and twelves; what is left over counts as well."""
    beams = random_beams(n, n, 0.8, 6.0)
    assert_same(search(beams, room, 50, ALL_POSES)[0], slow_search(beams, room, 50))


@pytest.mark.parametrize("hit", [True, False])
def test_beams_longer_than_the_reach(hit, room):
    n = 40
    bearings = np.linspace(-3.0, 3.0, n)
    beams = Beams(bearings, np.full(n, range_table.REACH_M + 1.0), np.full(n, hit))
    candidates, report = search(beams, room, 20, ALL_POSES)
    assert report.proven
    assert_same(candidates, slow_search(beams, room, 20))


@pytest.fixture(scope="module")
def tiles() -> MapFields:
    """Rows of several tiles."""
    fields = MapFields(random_map(5, 90, 200, 0.25))
    assert len(fields.positions.tile_rows) > 16
    return fields


@pytest.mark.slow
def test_many_tiles(tiles):
    beams = random_beams(5, 9, 0.7, 10.0)
    candidates, report = search(beams, tiles, 300, ALL_POSES)
    assert report.proven
    assert_same(candidates, slow_search(beams, tiles, 300))


@pytest.mark.parametrize("turns", [-1, 1])
def test_a_turn_of_all_bearings_changes_nothing(turns, room):
    step = FULL_TURN / DIRECTIONS
    bearings = (np.arange(-50, 50) + 0.3) * step  # away from where directions meet
    ranges = np.random.default_rng(1).uniform(0.3, 7.0, len(bearings))
    hit = np.ones(len(bearings), np.bool_)
    there, _ = search(Beams(bearings, ranges, hit), room, 20, ALL_POSES)
    back, _ = search(Beams(bearings + turns * FULL_TURN, ranges, hit), room, 20, ALL_POSES)
    assert_same(back, there)


def test_candidates_come_best_first_and_separate(room):
    candidates, _ = search(random_beams(3, 90, 0.9, 6.0), room, 200, ALL_POSES)
    assert len(candidates.poses) == 200
    assert (np.diff(candidates.scores) >= 0.0).all()
    blocks = (candidates.poses[:, :2] // (PLACE * room.positions.stride)).astype(int)
    sectors = np.round(candidates.poses[:, 2] / FULL_TURN * DIRECTIONS) // (DIRECTIONS // SECTORS)
    places = {(*block, sector) for block, sector in zip(blocks.tolist(), sectors, strict=True)}
    assert len(places) == 200


@pytest.mark.parametrize("seed", range(10))
def test_the_true_place_is_among_the_first(seed, room):
    rng = np.random.default_rng(seed)
    free = np.flatnonzero(room.clearance.ravel() * room.grid.free.ravel() > 6)
    row, column = np.divmod(rng.choice(free), room.grid.width)
    heading = rng.uniform(-np.pi, np.pi)
    truth = SE2(column * 0.05, row * 0.05, heading)
    scan = Lidar(beams=180, sigma_m=0.02).scan(room.grid, truth, rng)
    candidates, _ = search(usable_beams(scan), room, 5, ALL_POSES)
    distance = np.hypot(candidates.poses[:, 0] - column, candidates.poses[:, 1] - row) * 0.05
    turn = angle_error(candidates.poses[:, 2], heading)
    assert ((distance < 0.3) & (turn < np.radians(5.0))).any()


def test_a_search_cut_short_reports_its_share_and_keeps_the_best_it_scored(tiles):
    beams = random_beams(5, 30, 0.7, 10.0)
    every, _ = search(beams, tiles, ALL, ALL_POSES)
    some, report = search(beams, tiles, ALL, 1)
    assert not report.proven
    assert 0.0 < report.searched < 1.0
    assert report.poses == len(tiles.positions) * DIRECTIONS
    best_of = dict(zip(map(tuple, every.poses.tolist()), every.scores.tolist(), strict=True))
    assert 0 < len(some.poses) < len(every.poses)
    # A place on the edge of what was seen may be kept by its second position.
    inside = [
        best_of[tuple(pose)] == score
        for pose, score in zip(some.poses.tolist(), some.scores.tolist(), strict=True)
        if tuple(pose) in best_of
    ]
    assert all(inside)
    assert len(inside) >= 0.9 * len(some.poses)


@pytest.mark.parametrize("share", [0.1, 0.5, 0.99])
def test_max_poses_limits_the_poses_scored(tiles, share):
    beams, every = random_beams(5, 30, 0.7, 10.0), len(tiles.positions) * DIRECTIONS
    _, report = search(beams, tiles, ALL, round(share * every))
    assert 0.0 < report.searched <= share
    assert not report.proven
    assert search(beams, tiles, ALL, every)[1].proven


def test_the_scan_is_not_changed(room):
    beams = random_beams(2, 50, 0.8, 6.0)
    before = [array.copy() for array in (beams.bearings, beams.ranges, beams.hit)]
    search(beams, room, 10, ALL_POSES)
    for array, copy in zip((beams.bearings, beams.ranges, beams.hit), before, strict=True):
        np.testing.assert_array_equal(array, copy)
