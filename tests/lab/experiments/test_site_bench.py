"""A small site, from drawn floors to figures."""

from __future__ import annotations

import json

import pytest

from firstfix.lab.benchmarks import site_benchmark
from firstfix.lab.experiments.site_bench import site_document, site_table, site_tasks
from firstfix.lab.worlds.floors import AREA_M2, RandomFloor


@pytest.mark.slow
def test_scans_are_located_in_a_site_of_drawn_floors(tmp_path):
    by_area = sorted(range(40), key=lambda seed: RandomFloor(seed).plan().outline.area_m2)
    prepare, ask = site_tasks(tmp_path, by_area[:3], 6)
    prepared, asked = [task() for task in prepare], [task() for task in ask]
    document = site_document(prepared, asked)
    assert (document["floors"], document["queries"], document["drawn"]) == (3, 6, 3)
    assert 3 * 0.9 * AREA_M2[0] < document["area_m2"] < 15_000.0
    assert document["right_map"] >= 5 / 6
    assert document["wrong_unique"] == 0
    assert document["first_look_best_20"] == 1.0
    assert json.loads(json.dumps(document, allow_nan=False)) == document
    assert document["extrapolated"]["wall_s_16_cores"] > 0.0
    assert "right map" in site_table(document)
    # Another run takes what is there.
    files = {path: path.stat().st_ino for path in tmp_path.rglob("*") if path.is_file()}
    assert prepare[0]().drawn == 0
    assert {path: path.stat().st_ino for path in tmp_path.rglob("*") if path.is_file()} == files


def test_a_site_is_prepared_before_it_is_asked(tmp_path):
    benchmark = site_benchmark(tmp_path, range(5, 45), 30)
    prepare, ask = benchmark.tasks[: benchmark.first], benchmark.tasks[benchmark.first :]
    assert [seed for task in prepare for seed in task.seeds] == list(range(5, 45))
    assert [i for task in ask for i in task.scans] == list(range(30))
    assert {task.seeds for task in ask} == {tuple(range(5, 45))}
    assert len(benchmark.names) == len(benchmark.tasks)
