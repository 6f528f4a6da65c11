"""The likelihood field: equal to brute force over beams, particles and walls."""

from __future__ import annotations

import dataclasses
import math
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from numpy.typing import NDArray

from firstfix.amcl import likelihood_field
from firstfix.amcl.beam_selection import SelectedBeams, select_beams
from firstfix.amcl.config import AmclConfig, SensorModel
from firstfix.amcl.likelihood_field import LikelihoodField, likelihoods
from firstfix.amcl.particles import Particles, equal_weights
from firstfix.core.grid import OCCUPIED, UNKNOWN, OccupancyGrid
from firstfix.core.scan import LaserScan, Mounting
from firstfix.core.se2 import SE2
from firstfix.fields.distance import MAX_LIMIT

# Unseen ground left of the wall, and a pillar.
PLAN = """
    ???####################
    ???#..................#
    ???#.........##.......#
    ???#.........##.......#
    ???#..................#
    ???#..................#
    ???###########........#
    ?????????????#........#
    ?????????????##########
"""
CODE = {"#": OCCUPIED, ".": 0, "?": UNKNOWN}
RESOLUTION = 0.2
# Kernels add coordinates in float32: an end point that near a side of a cell (cells) may round to
# the other. Maps of a few hundred cells round below 1e-4.
NEAR_SIDE = 1e-3
UNIT = 2.0**-12  # of the logarithms


def drawn(plan: str = PLAN, place: SE2 = SE2(-1.0, -2.0, 0.7)) -> OccupancyGrid:  # noqa: B008
    rows = [[CODE[c] for c in line] for line in plan.split()]
    return OccupancyGrid(np.array(rows[::-1], np.int8), RESOLUTION, place)


def scan_of(n: int, seed: int = 0, longest: float = 3.0, **rest: object) -> LaserScan:
    rng = np.random.default_rng(seed)
    ranges = rng.uniform(0.1, longest, n).astype(np.float32)
    ranges[::9] = math.inf
    ranges[5::9] = math.nan
    return LaserScan(ranges, -2.0, 4.0 / n, 0.05, 8.0, **rest)


def somewhere(grid: OccupancyGrid, n: int, seed: int = 0, beyond: float = 0.0) -> Particles:
    """Poses over the map and as many cells beyond it."""
    rng = np.random.default_rng(seed)
    size = np.array([grid.width, grid.height])
    cells = rng.uniform(-beyond, size + beyond, (n, 2))
    return equal_weights(np.column_stack([grid.to_map(cells), rng.uniform(-4.0, 4.0, n)]))


def end_cells(
    pose: NDArray[np.float64], beams: SelectedBeams, grid: OccupancyGrid
) -> NDArray[np.float64]:
    return grid.to_cells(SE2.from_array(pose).apply(beams.hits))


def settled(particles: Particles, beams: SelectedBeams, grid: OccupancyGrid) -> Particles:
    """Keep the particles none of whose beams ends near the side of a cell."""
    poses = particles.poses()
    ends = np.array([end_cells(pose, beams, grid) for pose in poses])
    near = np.abs(ends - np.rint(ends)).min(axis=(1, 2), initial=1.0) < NEAR_SIDE
    assert near.mean() < 0.3
    return equal_weights(poses[~near])


def distance_m(end: NDArray[np.float64], grid: OccupancyGrid, config: AmclConfig) -> float:
    """Distance of an end point's cell to the nearest wall, m; NaN in unknown space."""
    column, row = (math.floor(v) for v in end)
    inside = 0 <= column < grid.width and 0 <= row < grid.height
    if config.model_unknown_space and not (inside and not grid.unknown[row, column]):
        return math.nan
    farthest = math.ceil(config.laser_likelihood_max_dist / grid.resolution)
    walls_row, walls_column = np.nonzero(grid.occupied)
    if not inside or len(walls_row) == 0:
        return farthest * grid.resolution
    nearest = np.hypot(walls_row - row, walls_column - column).min()
    return min(nearest, farthest) * grid.resolution


def likelihood(distance: float, range_max: float, config: AmclConfig) -> float:
    """Table 6.3 of the textbook."""
    if math.isnan(distance):
        return 1.0 / range_max
    hit = math.exp(-(distance**2) / (2.0 * config.sigma_hit**2))
    return config.z_hit * hit + config.z_rand / range_max


def kept_beams(distances: NDArray[np.float64], config: AmclConfig) -> NDArray[np.bool_]:
    """Nav2's beam skipping; distances of shape (particles, beams)."""
    everything = np.ones(distances.shape[1], np.bool_)
    if not config.do_beamskip or config.laser_model_type is not SensorModel.LIKELIHOOD_FIELD_PROB:
        return everything
    keep = (distances < config.beam_skip_distance).mean(axis=0) > config.beam_skip_threshold
    return everything if (~keep).mean() >= config.beam_skip_error_threshold else keep


def brute_force(
    particles: Particles, beams: SelectedBeams, grid: OccupancyGrid, config: AmclConfig
) -> tuple[NDArray[np.float64], int]:
    ends = [end_cells(pose, beams, grid) for pose in particles.poses()]
    distances = np.array([[distance_m(e, grid, config) for e in row] for row in ends])
    keep = kept_beams(distances, config)
    logs = [
        sum(math.log(likelihood(d, beams.range_max, config)) for d in row[keep])
        for row in distances
    ]
    return np.array(logs), int(keep.sum())


def assert_equal_to_brute_force(
    particles: Particles, scan: LaserScan, grid: OccupancyGrid, config: AmclConfig
) -> None:
    beams = select_beams(scan, config)
    particles = settled(particles, beams, grid)
    logs, used = LikelihoodField(grid, config).log_likelihood(particles, beams)
    expected, expected_used = brute_force(particles, beams, grid, config)
    assert used == expected_used
    np.testing.assert_allclose(logs, expected, atol=used * UNIT / 2 + 1e-9)
    assert np.ptp(expected) > 1.0  # these poses differ


@pytest.mark.parametrize("unknown", [False, True])
@pytest.mark.parametrize("farthest", [0.3, 0.5, 2.0, 9.0])
def test_logs_are_those_of_brute_force(unknown, farthest):
    config = AmclConfig(model_unknown_space=unknown, laser_likelihood_max_dist=farthest)
    grid = drawn()
    assert_equal_to_brute_force(somewhere(grid, 120, beyond=6.0), scan_of(40), grid, config)


@pytest.mark.parametrize("mounting", Mounting)
def test_the_sensor_sits_where_it_sits(mounting):
    scan = scan_of(40, T_base_laser=SE2(0.4, -0.3, 2.0), mounting=mounting)
    assert_equal_to_brute_force(somewhere(drawn(), 100, 1), scan, drawn(), AmclConfig())


def test_other_parameters_of_the_mixture():
    config = AmclConfig(z_hit=0.9, z_rand=0.1, sigma_hit=0.5, laser_max_range=2.5)
    assert_equal_to_brute_force(somewhere(drawn(), 100, 2), scan_of(40, 2), drawn(), config)


def big_map() -> OccupancyGrid:
    cells = np.where(np.random.default_rng(3).random((150, 200)) < 0.02, OCCUPIED, 0)
    return OccupancyGrid(cells.astype(np.int8), RESOLUTION, SE2(3.0, 4.0, -2.0))


def test_far_from_the_border_logs_are_those_of_brute_force():
    """No beam can leave the map: the kernel looks up without clamping."""
    grid = big_map()
    rng = np.random.default_rng(4)
    cells = rng.uniform(40.0, 110.0, (150, 2))
    poses = np.column_stack([grid.to_map(cells), rng.uniform(-4.0, 4.0, 150)])
    assert_equal_to_brute_force(equal_weights(poses), scan_of(40, 4), grid, AmclConfig())


def test_what_else_is_in_the_block_changes_nothing():
    grid, config = big_map(), AmclConfig()
    field, beams = LikelihoodField(grid, config), select_beams(scan_of(60, 5), config)
    inside = somewhere(grid, 700, 5, beyond=-45.0)
    everywhere = somewhere(grid, 700, 6, beyond=30.0)
    poses = np.concatenate([inside.poses(), everywhere.poses(), [[1e6, -1e6, 0.0]]])
    alone, _ = field.log_likelihood(inside, beams)
    order = np.random.default_rng(7).permutation(len(poses))
    mixed, _ = field.log_likelihood(equal_weights(poses[order]), beams)
    np.testing.assert_array_equal(mixed[np.argsort(order)][:700], alone)
    one_by_one = [field.log_likelihood(equal_weights(p[None]), beams)[0][0] for p in poses]
    np.testing.assert_array_equal(mixed, np.array(one_by_one)[order])


@pytest.mark.parametrize("reach", [0.99, 1.0, 1.01, 1.3, 1.7])
@pytest.mark.parametrize("x", [5.003, 10.003, 14.997])
@pytest.mark.parametrize("y", [5.003, 10.003, 14.997])
def test_beams_that_just_reach_the_border_are_looked_up_right(reach, x, y):
    """A row of cells begins where the one below ends: what leaves on one side must not come in."""
    cells = np.where(np.random.default_rng(10).random((20, 20)) < 0.1, OCCUPIED, 0)
    grid = OccupancyGrid(cells.astype(np.int8), RESOLUTION)
    ranges = np.full(60, 5.0 * RESOLUTION * reach, np.float32)
    scan = LaserScan(ranges, 0.013, 2 * math.pi / 60, 0.05, 8.0)
    particles = equal_weights(np.array([[x * RESOLUTION, y * RESOLUTION, 0.0]]))
    config = AmclConfig(laser_likelihood_max_dist=0.6)
    beams = select_beams(scan, config)
    logs, _ = LikelihoodField(grid, config).log_likelihood(particles, beams)
    expected, _ = brute_force(particles, beams, grid, config)
    np.testing.assert_allclose(logs, expected, atol=60 * UNIT)


PROB = SensorModel.LIKELIHOOD_FIELD_PROB


@pytest.mark.parametrize("distance", [0.3, 0.5, 1.1])
@pytest.mark.parametrize("threshold", [0.3, 0.5, 0.6, 0.8])
@pytest.mark.parametrize("unknown", [False, True])
def test_skipped_beams_are_those_of_brute_force(distance, threshold, unknown):
    config = AmclConfig(
        laser_model_type=PROB,
        do_beamskip=True,
        beam_skip_distance=distance,
        beam_skip_threshold=threshold,
        model_unknown_space=unknown,
    )
    grid = drawn()
    assert_equal_to_brute_force(somewhere(grid, 100, 8, beyond=2.0), scan_of(60, 8), grid, config)


def skipping(grid: OccupancyGrid, **settings: object) -> tuple[int, int]:
    """Of a scan that fits but for one third of its beams: beams that hit, and those used."""
    pose = np.array([2.1, 2.1, 0.0])
    ranges = np.full(30, 1.6)  # up to the wall ...
    ranges[10:20] = 0.5  # ... except where a person stands in front of it
    scan = LaserScan(ranges, -0.2, 0.4 / 29, 0.05, 8.0)
    config = AmclConfig(
        laser_model_type=PROB, beam_skip_distance=0.4, **({"do_beamskip": True} | settings)
    )
    beams = select_beams(scan, config)
    rng = np.random.default_rng(0)
    cloud = equal_weights(pose + rng.normal(0.0, 0.02, (100, 3)))
    return len(beams.hits), LikelihoodField(grid, config).log_likelihood(cloud, beams)[1]


def test_beams_that_few_explain_are_left_out():
    cells = np.zeros((20, 20), np.int8)
    cells[:, -1] = OCCUPIED
    grid = OccupancyGrid(cells, RESOLUTION)
    assert skipping(grid) == (30, 20)
    assert skipping(grid, do_beamskip=False) == (30, 30)
    # If that many would go, it is the belief that is wrong.
    assert skipping(grid, beam_skip_error_threshold=0.3) == (30, 30)
    assert skipping(grid, beam_skip_error_threshold=0.4) == (30, 20)


def test_the_cells_that_explain_a_beam_are_computed_once(monkeypatch):
    """It is as large as the map."""
    count, seen = likelihood_field._count_values, []

    def spy(*arguments):
        seen.append(arguments[6])
        count(*arguments)

    monkeypatch.setattr(likelihood_field, "_count_values", spy)
    grid, config = drawn(), AmclConfig(laser_model_type=PROB, do_beamskip=True)
    field = LikelihoodField(grid, config)
    for seed in (1, 2):
        field.log_likelihood(somewhere(grid, 50, seed), select_beams(scan_of(30, seed), config))
    assert seen[0] is seen[1]
    assert seen[0].size == field.squares.size
    assert not seen[0].flags.writeable


def test_sensors_of_two_ranges_keep_their_tables(monkeypatch):
    """A table is as large as the map: scans of two sensors alternate and rebuild none."""
    built = []

    def spy(*arguments):
        built.append(arguments[2])
        return likelihoods(*arguments)

    monkeypatch.setattr(likelihood_field, "likelihoods", spy)
    grid, config = drawn(), AmclConfig()
    field = LikelihoodField(grid, config)
    scans = [scan_of(30, 1), dataclasses.replace(scan_of(30, 2), range_max=7.0)]
    for scan in scans * 3:
        field.log_likelihood(somewhere(grid, 50), select_beams(scan, config))
    assert sorted(built) == sorted({scan.range_max for scan in scans})


def test_beams_are_skipped_by_one_model_only():
    beams = select_beams(scan_of(60), AmclConfig())
    config = AmclConfig(do_beamskip=True, beam_skip_threshold=1.0, beam_skip_error_threshold=1.0)
    _, used = LikelihoodField(drawn(), config).log_likelihood(somewhere(drawn(), 50), beams)
    assert used == len(beams.hits)


@pytest.mark.parametrize("move", [SE2(0.0, 0.0, 2.0), SE2(40.0, -7.0, 0.0), SE2(-9.0, 80.0, -1.1)])
@pytest.mark.parametrize("model", [SensorModel.LIKELIHOOD_FIELD, PROB])
def test_moving_map_and_particles_together_changes_nothing(move, model):
    """To the last bit, away from the sides of cells: up to there float32 may round differently."""
    config = AmclConfig(laser_model_type=model, do_beamskip=True, model_unknown_space=True)
    here = drawn()
    there = OccupancyGrid(here.cells, RESOLUTION, move @ here.T_map_grid)
    beams = select_beams(scan_of(40, 9), config)
    particles = settled(somewhere(here, 200, 9, beyond=3.0), beams, here)
    poses = particles.poses()
    moved = np.column_stack([move.apply(poses[:, :2]), poses[:, 2] + move.yaw])
    logs, used = LikelihoodField(here, config).log_likelihood(particles, beams)
    moved_logs, moved_used = LikelihoodField(there, config).log_likelihood(
        equal_weights(moved), beams
    )
    assert used == moved_used
    np.testing.assert_array_equal(moved_logs, logs)


def test_a_table_holds_the_likelihood_of_every_square():
    config = AmclConfig(z_hit=0.7, z_rand=0.2, sigma_hit=0.3)
    table = likelihoods(8, 0.05, 12.0, config)
    assert len(table) == 8**2 + 2
    for square in range(8**2 + 1):
        assert table[square] == pytest.approx(
            likelihood(math.sqrt(square) * 0.05, 12.0, config), rel=1e-12
        )
    assert table[-1] == 1.0 / 12.0
    assert (np.diff(table[:-1]) < 0.0).all()


def test_distances_end_where_they_fit_no_longer():
    cells = np.zeros((3, 400), np.int8)
    cells[:, 0] = OCCUPIED
    field = LikelihoodField(OccupancyGrid(cells, 0.01), AmclConfig(laser_likelihood_max_dist=3.0))
    assert field.limit == MAX_LIMIT
    assert field.squares.max() == MAX_LIMIT**2
    coarse = LikelihoodField(OccupancyGrid(cells, 5.0), AmclConfig(laser_likelihood_max_dist=0.1))
    assert coarse.limit == 1


@pytest.mark.parametrize("wall", [True, False])
def test_a_map_of_a_single_cell_is_a_map(wall):
    grid = OccupancyGrid(np.array([[OCCUPIED if wall else 0]], np.int8), RESOLUTION)
    beams = select_beams(scan_of(30), AmclConfig())
    particles = settled(equal_weights(np.array([[0.1, 0.1, 0.3], [-5.0, 9.0, 1.0]])), beams, grid)
    logs, _ = LikelihoodField(grid, AmclConfig()).log_likelihood(particles, beams)
    expected, used = brute_force(particles, beams, grid, AmclConfig())
    np.testing.assert_allclose(logs, expected, atol=used * UNIT)


def test_a_scan_without_hits_is_uninformative():
    for reading in (math.inf, math.nan):
        scan = LaserScan(np.full(40, reading, np.float32), -1.0, 0.05, 0.1, 8.0)
        for model in (SensorModel.LIKELIHOOD_FIELD, PROB):
            config = AmclConfig(laser_model_type=model, do_beamskip=True)
            field = LikelihoodField(drawn(), config)
            logs, used = field.log_likelihood(somewhere(drawn(), 30), select_beams(scan, config))
            assert used == 0
            assert not logs.any()


def test_as_many_beams_as_a_scan_may_have_are_summed_without_overflow():
    """All as unlikely as can be: the integers of the sums are as large as they get."""
    config = AmclConfig(max_beams=20_000, z_rand=1e-6, laser_max_range=-1.0)
    scan = LaserScan(np.full(20_000, 5.0, np.float32), 0.0, 1e-4, 0.05, 1e6)
    grid = OccupancyGrid(np.zeros((4, 4), np.int8), RESOLUTION)
    logs, used = LikelihoodField(grid, config).log_likelihood(
        equal_weights(np.zeros((3, 3))), select_beams(scan, config)
    )
    assert used == 20_000
    np.testing.assert_allclose(logs, 20_000 * math.log(1e-9), rtol=1e-5)


def test_threads_with_sensors_of_different_range_share_a_field():
    grid, config = drawn(), AmclConfig()
    scans = [dataclasses.replace(scan_of(40), range_max=limit) for limit in (5.0, 6.0, 7.0)]
    beams = [select_beams(scan, config) for scan in scans]
    particles, shared = somewhere(grid, 20), LikelihoodField(grid, config)
    alone = [LikelihoodField(grid, config).log_likelihood(particles, b)[0] for b in beams]
    with ThreadPoolExecutor(3) as pool:
        together = pool.map(lambda b: shared.log_likelihood(particles, b)[0], beams * 20)
        for i, logs in enumerate(together):
            np.testing.assert_array_equal(logs, alone[i % 3])
