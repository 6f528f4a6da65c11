"""The cheapest ways are those that Dijkstra finds."""

import heapq
import math

import numpy as np
import pytest

from firstfix.lab.simulation.wavefront import walking_costs, way_back

NEIGHBOURS = [(r, c) for r in (-1, 0, 1) for c in (-1, 0, 1) if (r, c) != (0, 0)]


def drawn(*rows: str) -> np.ndarray:
    """Read a map: # is no way, a digit what a step costs."""
    return np.array([[math.inf if c == "#" else float(c) for c in row] for row in rows], np.float32)


def dijkstra(weights: np.ndarray, row: int, column: int) -> np.ndarray:
    """The slow obvious twin."""
    costs = np.full(weights.shape, np.inf)
    queue = [(0.0, row, column)]
    costs[row, column] = 0.0
    while queue:
        cost, r, c = heapq.heappop(queue)
        for dr, dc in NEIGHBOURS:
            i, j = r + dr, c + dc
            if 0 <= i < weights.shape[0] and 0 <= j < weights.shape[1]:
                through = cost + math.hypot(dr, dc) * float(weights[i, j])
                if through < costs[i, j]:
                    costs[i, j] = through
                    heapq.heappush(queue, (through, i, j))
    return costs


def test_a_wall_is_walked_round() -> None:
    weights = drawn(
        "11111",
        "1###1",
        "11111",
    )
    costs = walking_costs(weights, 2, 2)
    assert costs[2, 2] == 0.0
    assert costs[0, 2] == pytest.approx(2 + 2 * math.sqrt(2) + 0.0, abs=1e-5)
    assert np.isinf(costs[1, 2])


def test_a_detour_is_taken_where_it_costs_less() -> None:
    weights = drawn(
        "11111",
        "1###1",
        "19991",
    )
    way = way_back(walking_costs(weights, 2, 0), weights, 2, 4)
    assert (0, 2) in {tuple(cell) for cell in way.tolist()}
    assert way[0].tolist() == [2, 4]
    assert way[-1].tolist() == [2, 0]


def test_behind_walls_nothing_is_reached() -> None:
    costs = walking_costs(drawn("11#1", "11#1"), 0, 0)
    assert np.isfinite(costs[:, :2]).all()
    assert np.isinf(costs[:, 2:]).all()


@pytest.mark.parametrize("seed", range(8))
def test_it_agrees_with_dijkstra(seed: int) -> None:
    rng = np.random.default_rng(seed)
    weights = rng.uniform(0.5, 9.0, (40, 30)).astype(np.float32)
    weights[rng.random(weights.shape) < 0.35] = np.inf
    free = np.argwhere(np.isfinite(weights))
    row, column = free[rng.integers(len(free))].tolist()
    costs = walking_costs(weights, row, column)
    np.testing.assert_allclose(costs, dijkstra(weights, row, column), rtol=1e-5)
    for end in rng.permutation(np.argwhere(np.isfinite(costs)))[:5].tolist():
        way = way_back(costs, weights, *end)
        steps = np.diff(way, axis=0)
        assert (np.abs(steps).max(axis=1) == 1).all()
        paid = np.hypot(*steps.T) * weights[way[:-1, 0], way[:-1, 1]]
        assert paid.sum() == pytest.approx(float(costs[tuple(end)]), rel=1e-4)
