"""Pictures: they are written, they show the map where it lies, and errors are sentences."""

import math
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from firstfix.core.errors import InputError
from firstfix.core.estimate import Verdict
from firstfix.core.grid import OccupancyGrid
from firstfix.core.pose_error import PoseError
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.lab.experiments.locate_bench import CaseRun
from firstfix.lab.metrics.outcome import NO_POSE, Outcome
from firstfix.lab.reports.locate_document import bench_document
from firstfix.lab.reports.locate_report import write_report
from firstfix.lab.reports.map_picture import draw_grid
from firstfix.plots.figure import new_figure
from firstfix.plots.map_image import GREY_FREE, GREY_UNKNOWN, GREY_WALL, draw_map, greys
from firstfix.plots.result_picture import draw_result


@pytest.mark.parametrize("suffix", ["png", "svg", "pdf", "PNG"])
def test_an_answer_becomes_a_picture(
    tmp_path: Path, hall: OccupancyGrid, cross: LaserScan, middle: SE2, answer: Any, suffix: str
) -> None:
    result = answer(middle, SE2(5.0, 3.0, math.pi), verdict=Verdict.AMBIGUOUS)
    path = draw_result(hall, [cross], result, tmp_path / f"place.{suffix}", middle)
    assert path.is_absolute()
    assert path.stat().st_size > 5000
    if suffix == "png":
        assert np.ptp(np.asarray(Image.open(path).convert("L"))) > 100


def test_no_place_is_a_picture_too(
    tmp_path: Path, hall: OccupancyGrid, cross: LaserScan, answer: Any
) -> None:
    draw_result(hall, [cross], answer(verdict=Verdict.NO_MATCH), tmp_path / "nowhere.png")


def test_a_scan_without_a_hit_is_a_picture_too(
    tmp_path: Path, hall: OccupancyGrid, middle: SE2, answer: Any
) -> None:
    blind = LaserScan(np.full(4, np.inf), 0.0, 0.1, 0.1, 10.0)
    draw_result(hall, [blind], answer(middle), tmp_path / "blind.png")


@pytest.mark.parametrize("name", ["place.jpeg", "place", "place.txt"])
def test_an_unknown_format_is_refused(tmp_path: Path, hall: OccupancyGrid, name: str) -> None:
    with pytest.raises(InputError, match=r"ends in \.png, \.svg, \.pdf"):
        draw_grid(hall, tmp_path / name, "a hall")


def test_a_place_that_cannot_be_written_is_refused(tmp_path: Path, hall: OccupancyGrid) -> None:
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(InputError, match="no such folder"):
        draw_grid(hall, tmp_path / "file" / "place.png", "a hall")


def test_without_matplotlib_the_remedy_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    with pytest.raises(InputError, match=r"firstfix\[plot\]"):
        new_figure(1.0, 1.0)


def test_a_turned_map_is_drawn_where_it_lies(hall: OccupancyGrid) -> None:
    turned = replace(hall, T_map_grid=SE2(2.0, 1.0, math.pi / 2))
    axes = new_figure(4.0, 4.0).subplots()
    draw_map(axes, turned)
    np.testing.assert_allclose(axes.get_xlim(), [2.0 - 6.0, 2.0], atol=1e-9)
    np.testing.assert_allclose(axes.get_ylim(), [1.0, 11.0], atol=1e-9)


def test_a_large_map_is_shown_small_and_keeps_its_walls() -> None:
    cells = np.full((10, 30), -1, np.int8)
    cells[:, 10:20] = 0
    cells[4, 12] = 100
    small = greys(OccupancyGrid(cells, 0.1), 10)
    assert small.shape == (4, 10)
    assert small[1, 4] == GREY_WALL
    assert small[0, 0] == GREY_UNKNOWN
    assert small[2, 5] == GREY_FREE


@pytest.mark.slow
def test_a_report_has_a_table_and_two_plots(tmp_path: Path) -> None:
    hit = Outcome(0, Verdict.UNIQUE, PoseError(0.02, 0.001), 1, 0.03, 0.04, 0.99)
    lost = Outcome(2, Verdict.NO_MATCH, NO_POSE, None, 0.01, 0.02, 0.0)
    runs = [
        CaseRun("a", "a", "sim", "recorded", method, (hit, lost), 100.0, 0.5, 200.0)
        for method in ("fast", "paper")
    ]
    document = bench_document(runs)
    page = write_report(runs, document, tmp_path / "report")
    assert page == (tmp_path / "report" / "report.md").resolve()
    text = page.read_text(encoding="utf-8")
    for name in ("error_curves.png", "time_by_area.png"):
        assert f"({name})" in text
        assert (page.parent / name).stat().st_size > 5000
    assert "| a " in text
