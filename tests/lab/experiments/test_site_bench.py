"""A small site, from drawn floors to figures."""

from __future__ import annotations

import json

import pytest

from firstfix.lab.benchmarks import site_benchmark
from firstfix.lab.experiments.site_bench import SiteTask, site_document, site_table
from firstfix.lab.worlds.floors import AREA_M2, RandomFloor


@pytest.mark.slow
def test_scans_are_located_in_a_site_of_drawn_floors() -> None:
    by_area = sorted(range(40), key=lambda seed: RandomFloor(seed).plan().outline.area_m2)
    figures = SiteTask(tuple(by_area[:3]), 6)()
    assert figures.floors == 3
    assert figures.queries == 6
    assert 3 * 0.9 * AREA_M2[0] < figures.area_m2 < 15_000.0
    assert figures.right_map >= 5 / 6
    assert figures.wrong_unique == 0
    assert figures.first_look_best_20 == 1.0
    document = site_document(figures)
    assert json.loads(json.dumps(document, allow_nan=False)) == document
    assert document["extrapolated"]["wall_s_16_cores"] > 0.0
    assert "right map" in site_table(document)


def test_a_site_is_one_task() -> None:
    benchmark = site_benchmark(range(5, 8), 10)
    assert list(benchmark.tasks) == [SiteTask((5, 6, 7), 10)]
