"""What a search costs: counted, not judged."""

import json
from pathlib import Path

import numpy as np
import pytest

from firstfix.core.grid import OccupancyGrid
from firstfix.core.se2 import SE2
from firstfix.global_localization.config import Method
from firstfix.global_localization.scan_matcher import ScanMatcher
from firstfix.lab.experiments.scaling import (
    CostTask,
    Sighting,
    ThroughputTask,
    cost_table,
    locate_in_threads,
    scaling_document,
    threads_table,
)
from firstfix.lab.reports.suite_reports import write_scaling_report
from firstfix.lab.simulation.lidar import Lidar

POSES = [SE2(3.0, 2.0, 0.5), SE2(7.5, 5.0, -2.0), SE2(4.5, 4.0, 3.0)]


def sightings(grid: OccupancyGrid, beams: int) -> tuple[Sighting, ...]:
    rng = np.random.default_rng(0)
    return tuple(Sighting(Lidar(beams=beams).scan(grid, pose, rng), pose) for pose in POSES)


def test_every_number_of_beams_has_its_cost(hall_plan: OccupancyGrid) -> None:
    groups = (sightings(hall_plan, 90), sightings(hall_plan, 180))
    costs = CostTask(hall_plan, Method.FAST, groups)()
    assert [cost.beams for cost in costs] == [90, 180]
    for cost in costs:
        assert (cost.method, cost.scans, cost.success) == ("fast", 3, 1.0)
        assert cost.cells == hall_plan.cells.size
        assert cost.map_area_m2 == pytest.approx(80.0)
        assert cost.free_area_m2 == pytest.approx(hall_plan.free_area)
        assert cost.rss_mb is None or cost.rss_before_mb is not None


def test_threads_give_the_answers_of_one(hall_plan: OccupancyGrid) -> None:
    matcher = ScanMatcher(hall_plan)
    scans = [sighting.scan for sighting in sightings(hall_plan, 180)] * 2
    alone, together = (locate_in_threads(matcher, scans, n) for n in (1, 2))
    for a, b in zip(alone, together, strict=True):
        assert a.best is not None
        assert b.best is not None
        assert (a.verdict, a.best.pose, a.best.score) == (b.verdict, b.best.pose, b.best.score)


@pytest.mark.slow
def test_the_report_has_all_tables_and_a_plot(hall_plan: OccupancyGrid, tmp_path: Path) -> None:
    seen = sightings(hall_plan, 90)
    costs = CostTask(hall_plan, Method.PAPER, (seen,))()
    throughputs = ThroughputTask(hall_plan, seen, (1, 2))()
    assert [throughput.threads for throughput in throughputs] == [1, 2]
    assert throughputs[0].speedup == 1.0
    document = scaling_document([("area", costs), ("beams", costs), ("threads", throughputs)], 0)
    assert json.loads(json.dumps(document, allow_nan=False)) == document
    page = write_scaling_report(document, tmp_path / "report")
    text = page.read_text(encoding="utf-8")
    assert cost_table(document["area"]).strip() in text
    assert threads_table(document["threads"]).strip() in text
    assert (page.parent / "scaling.png").stat().st_size > 5000
