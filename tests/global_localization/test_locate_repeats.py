"""One scan, one answer, to the last bit: again, in threads, in other processes, from a cache."""

from __future__ import annotations

import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from firstfix.core.scan import LaserScan
from firstfix.global_localization.scan_matcher import ScanMatcher
from firstfix.lab.simulation.lidar import Lidar
from firstfix.lab.worlds.catalog import random_free_pose

LIDAR = Lidar(beams=360, sigma_m=0.01)


@pytest.mark.slow
def test_twice_and_from_many_threads_it_is_the_same(office_locator, content_of):
    grid = office_locator.fields.grid
    rng = np.random.default_rng(7)
    scans = [LIDAR.scan(grid, random_free_pose(grid, rng), rng) for _ in range(8)]
    alone = [content_of(office_locator.locate(scan)) for scan in scans]
    assert [content_of(office_locator.locate(scan)) for scan in scans] == alone
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(office_locator.locate, scans * 2))
    assert [content_of(result) for result in together] == alone * 2


def test_threads_may_share_a_locator_from_the_first_scan_on(room, content_of):
    """Nothing is prepared late in a way that two threads could disturb."""
    rng = np.random.default_rng(8)
    scan = LIDAR.scan(room.grid, random_free_pose(room.grid, rng), rng)
    fresh = ScanMatcher(room.grid)
    with ThreadPoolExecutor(4) as pool:
        results = [content_of(result) for result in pool.map(fresh.locate, [scan] * 4)]
    assert results == [content_of(ScanMatcher(room.grid).locate(scan))] * 4


PROGRAM = """
import numpy as np
from firstfix.global_localization.scan_matcher import ScanMatcher
from firstfix.lab.simulation.lidar import Lidar
from firstfix.lab.worlds.catalog import identical_rooms, random_free_pose
grid = identical_rooms(2)
rng = np.random.default_rng(9)
result = ScanMatcher(grid).locate(Lidar().scan(grid, random_free_pose(grid, rng), rng))
for h in result.hypotheses:
    print([float(x).hex() for x in (*h.pose.as_array(), *h.covariance.ravel(), h.score)])
"""


@pytest.mark.slow
def test_the_number_of_threads_does_not_matter():
    def run(threads: int) -> str:
        settings = ("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS")
        environment = {**os.environ, **dict.fromkeys(settings, str(threads))}
        return subprocess.run(
            [sys.executable, "-c", PROGRAM], env=environment, check=True, capture_output=True
        ).stdout.decode()

    assert run(1) == run(2) != ""


def test_the_scan_is_not_changed(office_locator):
    ranges = np.random.default_rng(10).uniform(0.5, 5.0, 90).astype(np.float32)
    scan = LaserScan(ranges.copy(), -2.0, 0.04, 0.1, 12.0)
    office_locator.locate(scan)
    assert scan.ranges.tolist() == ranges.tolist()


def test_a_cache_changes_nothing(room, tmp_path, content_of):
    rng = np.random.default_rng(11)
    scan = LIDAR.scan(room.grid, random_free_pose(room.grid, rng), rng)
    fresh = content_of(ScanMatcher(room.grid).locate(scan))
    for _ in range(2):
        assert content_of(ScanMatcher(room.grid, cache_dir=tmp_path).locate(scan)) == fresh
