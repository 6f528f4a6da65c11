"""Many rides, from tasks to figures."""

from __future__ import annotations

import json
from dataclasses import replace

from firstfix.lab.benchmarks import rides_benchmark
from firstfix.lab.experiments.lift_bench import Ride
from firstfix.lab.experiments.rides_bench import rides_document, rides_table
from firstfix.lab.worlds.towers import Likeness

FOUND = Ride(0, 5, Likeness.DISTINCT, 90, 0, 1, 1.2, 0.0, 1.0)


def test_rides_are_summed_up_by_the_floor_where_they_end():
    lost = replace(
        FOUND, goal=1, likeness=Likeness.TWIN, wrong_map=2, found_s=float("inf"), found_m=9.0
    )
    late = replace(FOUND, found_s=20.0, found_m=3.0)
    document = rides_document(7, [FOUND, late, lost])
    assert json.loads(json.dumps(document, allow_nan=False)) == document
    assert (document["total"]["wrong_map"], document["total"]["wrong_map_rides"]) == (2, 1)
    assert set(document["kinds"]) == {"distinct", "twin"}
    distinct, twin = document["kinds"]["distinct"], document["kinds"]["twin"]
    assert (distinct["rides"], distinct["found"], distinct["found_later"]) == (2, 0.5, 1.0)
    assert (twin["found"], twin["found_s"]) == (0.0, None)
    assert "to twin floors" in rides_table(document)


def test_all_rides_are_shared_out_between_robots(tmp_path):
    benchmark = rides_benchmark(tmp_path, 3, 45)
    robots = benchmark.tasks[benchmark.first :]
    assert sum(task.rides for task in robots) == 45
    assert len({task.robot for task in robots}) == len(robots)
    assert len(benchmark.names) == len(benchmark.tasks)
