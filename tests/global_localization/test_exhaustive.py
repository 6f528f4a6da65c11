"""The paper's method: its kernel is three nested loops, made fast."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from firstfix.core.angles import FULL_TURN, angle_error
from firstfix.core.estimate import Verdict
from firstfix.core.grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.fields.map_fields import MapFields
from firstfix.fields.raycast import cast_rays, expected_ranges
from firstfix.global_localization.beams import Beams
from firstfix.global_localization.exhaustive import BASIC, FAST, ExhaustiveSearch, PoseGrid

# As coarse as this, every free cell is a place to be, so that maps can be tiny.
CELL_M = 0.25


def random_fields(seed: int, height: int, width: int) -> MapFields:
    rng = np.random.default_rng(seed)
    cells = rng.choice(
        np.array([FREE, UNKNOWN, OCCUPIED], np.int8), (height, width), p=[0.7, 0.15, 0.15]
    )
    wall, floor = rng.choice(cells.size, 2, replace=False)
    cells.flat[wall], cells.flat[floor] = OCCUPIED, FREE
    return MapFields(OccupancyGrid(cells, CELL_M))


def random_hits(seed: int, n: int, longest: float) -> Beams:
    rng = np.random.default_rng(seed)
    return Beams(
        rng.uniform(-9.0, 9.0, n), rng.uniform(0.1, longest, n) * CELL_M, np.ones(n, np.bool_)
    )


def triple_loop(hits: Beams, fields: MapFields, poses: PoseGrid):
    """Eq. 3 and Fig. 10 of the paper: every block, every heading, every beam."""
    grid = fields.grid
    walls = np.argwhere(grid.occupied)
    tried, scores = [], []
    stride = poses.stride
    for row in range(0, grid.height, stride):
        for column in range(0, grid.width, stride):
            if not grid.free[row : row + stride, column : column + stride].any():
                continue
            best = None
            for h in range(poses.headings):
                heading = h * (FULL_TURN / poses.headings)
                score = 0
                for bearing, range_m in zip(hits.bearings, hits.ranges, strict=True):
                    angle, cells = bearing + heading, range_m / grid.resolution
                    y = row + math.floor(stride / 2 + cells * math.sin(angle))
                    x = column + math.floor(stride / 2 + cells * math.cos(angle))
                    score += nearest_wall(walls, y, x)
                if best is None or score < best[0]:
                    best = (score, heading)
            assert best is not None
            tried.append((column + stride / 2, row + stride / 2, best[1]))
            scores.append(best[0])
    return np.array(tried).reshape(-1, 3), np.array(scores, np.int64)


def nearest_wall(walls: NDArray[np.int64], y: int, x: int) -> int:
    """Manhattan distance, also from outside the map."""
    return int(np.abs(walls - (y, x)).sum(axis=1).min())


def assert_same(hits: Beams, fields: MapFields, poses: PoseGrid) -> None:
    tried, scores = ExhaustiveSearch(fields, poses).pose_scores(hits)
    slow_tried, slow_scores = triple_loop(hits, fields, poses)
    np.testing.assert_array_equal(scores, slow_scores)
    np.testing.assert_array_equal(tried, slow_tried)


@settings(deadline=None, max_examples=25)
@given(
    st.integers(0, 2**32 - 1),
    st.tuples(st.integers(1, 8), st.integers(2, 9)),
    st.integers(1, 4),
    st.sampled_from([3.0, 10.0, 50.0]),
    st.sampled_from([PoseGrid(1, 5), PoseGrid(2, 7), PoseGrid(3, 8), FAST]),
)
def test_the_kernel_is_the_triple_loop(seed, shape, n, longest, poses):
    """End points within, near and far outside the map."""
    assert_same(random_hits(seed, n, longest), random_fields(seed, *shape), poses)


@pytest.mark.parametrize("n", [1, 7, 8, 9, 17])
def test_any_number_of_beams(n):
    """The kernel takes them by eights."""
    assert_same(random_hits(n, n, 10.0), random_fields(n, 7, 9), FAST)


def test_every_degree_of_every_cell():
    assert_same(random_hits(1, 4, 5.0), random_fields(1, 4, 5), BASIC)


@pytest.mark.parametrize("width", [31, 32, 33, 70])
def test_rows_of_any_length(width):
    """Rows are summed in whole vectors."""
    assert_same(random_hits(width, 2, 10.0), random_fields(width, 2, width), PoseGrid(1, 3))


def test_only_blocks_with_a_free_cell_are_tried():
    cells = np.full((9, 10), OCCUPIED, np.int8)
    cells[0, 0] = cells[5, 9] = FREE
    cells[8] = UNKNOWN
    fields = MapFields(OccupancyGrid(cells, CELL_M))
    tried, scores = ExhaustiveSearch(fields, FAST).pose_scores(random_hits(0, 3, 5.0))
    assert tried[:, :2].tolist() == [[2.0, 2.0], [10.0, 6.0]]
    assert len(scores) == 2


def test_unseen_blocks_are_not_tried():
    cells = np.zeros((4, 8), np.int8)
    cells[0, 0] = OCCUPIED
    unseen = np.zeros(cells.shape, np.bool_)
    unseen[:, 4:] = True
    fields = MapFields(OccupancyGrid(cells, CELL_M, unseen=unseen))
    tried, _ = ExhaustiveSearch(fields, FAST).pose_scores(random_hits(0, 3, 5.0))
    assert tried[:, :2].tolist() == [[2.0, 2.0]]


def test_of_equal_headings_the_first_wins():
    cells = np.zeros((9, 9), np.int8)
    cells[4, 4] = OCCUPIED
    fields = MapFields(OccupancyGrid(cells, 1.0))
    # A beam of no length has the same score in every heading.
    hits = Beams(np.zeros(1), np.array([1e-6]), np.ones(1, np.bool_))
    tried, scores = ExhaustiveSearch(fields, PoseGrid(1, 24)).pose_scores(hits)
    assert (tried[:, 2] == 0.0).all()
    assert scores.reshape(-1)[0] == 8


@pytest.mark.parametrize("poses", [FAST, BASIC])
@pytest.mark.parametrize("place", [(96, 100, 3), (64, 52, 17), (144, 72, 10)])
def test_a_scan_from_a_pose_of_the_grid_scores_zero_there_and_is_found(room, poses, place):
    x, y = (n + poses.stride / 2 for n in place[:2])
    heading = place[2] * (FULL_TURN / 24)  # a heading of both grids
    bearings = np.arange(180) * (FULL_TURN / 180)
    cells = cast_rays(room.grid.occupied, x, y, heading + bearings, 1e3)
    # A little beyond the face of the wall, or rounding decides for the free side of it.
    hits = Beams(bearings, (cells + 0.01) * 0.05, np.ones(180, np.bool_))
    tried, scores = ExhaustiveSearch(room, poses).pose_scores(hits)
    best = int(np.argmin(scores))
    # A beam through the last corner of a cell may end one further.
    assert scores[best] <= 2
    assert np.hypot(tried[best, 0] - x, tried[best, 1] - y) * 0.05 <= 0.1
    assert angle_error(float(tried[best, 2]), heading) <= np.radians(1.01)
    exact = (tried[:, 0] == x) & (tried[:, 1] == y)
    assert scores[exact] <= 2


def scan_at(fields: MapFields, T_map_base: SE2, range_max: float = 30.0) -> LaserScan:
    bearings = np.arange(180) * (FULL_TURN / 180)
    ranges = expected_ranges(fields.grid, T_map_base, bearings, range_max)
    return LaserScan(ranges.astype(np.float32), 0.0, FULL_TURN / 180, 0.05, range_max)


@pytest.mark.parametrize("poses", [FAST, BASIC])
def test_the_answer_of_the_paper(room, poses):
    truth = SE2(4.9, 5.1, math.radians(45.0))
    result = ExhaustiveSearch(room, poses).locate(scan_at(room, truth))
    assert result.verdict is Verdict.UNIQUE
    assert result.search.proven
    assert result.search.searched == 1.0
    assert result.search.poses % poses.headings == 0
    best = result.best
    assert best is not None
    assert best.pose.distance_to(truth) < 0.2
    assert angle_error(best.pose.yaw, truth.yaw) <= np.radians(15.0)
    assert best.probability == 1.0
    assert [h.probability for h in result.hypotheses[1:]] == [0.0] * (len(result.hypotheses) - 1)
    scores = [h.score for h in result.hypotheses]
    assert scores == sorted(scores)
    assert best.evidence.explained > 0.9
    for hypothesis in result.hypotheses:
        assert (np.linalg.eigvalsh(hypothesis.covariance) > 0.0).all()


def test_the_score_is_the_mean_over_the_beams(room):
    scan = scan_at(room, SE2(4.9, 5.1, 0.0))
    best = ExhaustiveSearch(room, FAST).locate(scan).best
    assert best is not None
    assert best.score * len(scan) == pytest.approx(round(best.score * len(scan)))


def test_beams_without_a_return_take_no_part(room):
    """The paper's score has end points only: it is the same with and without them."""
    truth = SE2(4.9, 5.1, 1.0)
    scan = scan_at(room, truth, range_max=4.0)
    assert scan.no_return.any()
    invalid = np.where(scan.no_return, np.nan, scan.ranges).astype(np.float32)
    blind = LaserScan(invalid, scan.angle_min, scan.angle_increment, 0.05, 4.0)
    there, here = (ExhaustiveSearch(room, FAST).locate(s) for s in (scan, blind))
    assert [h.score for h in there.hypotheses] == [h.score for h in here.hypotheses]
    assert [h.pose for h in there.hypotheses] == [h.pose for h in here.hypotheses]


def test_a_scan_without_hits_matches_nothing(room):
    scan = LaserScan(np.full(20, np.inf, np.float32), 0.0, 0.1, 0.1, 5.0)
    assert ExhaustiveSearch(room, FAST).locate(scan).verdict is Verdict.NO_MATCH


def test_twice_is_the_same(room):
    scan = scan_at(room, SE2(3.3, 3.0, 2.0))
    first, second = (ExhaustiveSearch(room, FAST).locate(scan) for _ in range(2))
    assert [(h.pose, h.score) for h in first.hypotheses] == [
        (h.pose, h.score) for h in second.hypotheses
    ]
