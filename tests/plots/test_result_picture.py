"""The picture of a result: from Python, in a file and in a notebook."""

import io
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import firstfix as ff
from firstfix.plots import figure


@pytest.fixture(scope="module")
def result(hall_plan: ff.OccupancyGrid) -> ff.LocateResult:
    scan = ff.Lidar(beams=180).scan(hall_plan, ff.SE2(3.0, 2.0, 0.5), np.random.default_rng(0))
    found = ff.ScanMatcher(hall_plan).locate(scan)
    assert (found.grid, found.scans) == (hall_plan, (scan,))
    return found


def test_the_plot_shows_map_scan_and_places(result: ff.LocateResult, tmp_path: Path) -> None:
    drawn = result.plot(tmp_path / "place.png", truth=ff.SE2(3.0, 2.0, 0.5))
    whole, near = drawn.axes
    assert len(whole.images) == len(near.images) == 1
    assert len(near.collections) >= 1
    assert "truth" in near.get_legend_handles_labels()[1]
    with Image.open(tmp_path / "place.png") as image:
        assert image.width > 1000


def test_a_notebook_shows_line_and_picture(result: ff.LocateResult) -> None:
    png = result._repr_png_()
    assert png is not None
    with Image.open(io.BytesIO(png)) as image:
        assert image.format == "PNG"
    html = result._repr_html_()
    assert html is not None
    assert html.startswith(f"<p>{result}</p>")
    assert 'src="data:image/png;base64,' in html


def test_without_matplotlib_a_notebook_shows_text_and_plot_names_the_remedy(
    result: ff.LocateResult, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    assert not figure.can_draw()
    assert result._repr_png_() is None
    assert result._repr_html_() is None
    with pytest.raises(ff.InputError, match=r"pip install 'firstfix\[plot\]'"):
        result.plot()
