"""Line styles, the curve of a share, and the palette of a PNG."""

import math
from pathlib import Path

import numpy as np
from numpy.testing import assert_array_equal
from PIL import Image

from firstfix.plots.figure import PALETTE, line_style, new_figure, save_figure, share_curve


def test_lines_of_a_plot_have_different_styles() -> None:
    looks = {tuple(line_style(number).values()) for number in range(4 * len(PALETTE))}
    assert len(looks) == 4 * len(PALETTE)
    assert line_style(0) == line_style(4 * len(PALETTE))


def test_a_share_counts_unknown_values_and_values_off_the_axis() -> None:
    x, y = share_curve([2.0, math.inf, 0.001, 50.0], 0.1, 10.0)
    assert_array_equal(x, [0.1, 0.1, 2.0, 10.0, 10.0])
    assert_array_equal(y, [0.0, 0.25, 0.5, 0.75, 0.75])
    assert_array_equal(share_curve([math.inf], 0.1, 10.0), [[0.1, 10.0], [0.0, 0.0]])


def test_a_png_has_a_palette_and_keeps_its_colours(tmp_path: Path) -> None:
    figure = new_figure(6.0, 4.0)
    axes = figure.subplots()
    for i, colour in enumerate(PALETTE):
        axes.scatter([i], [0.5], s=9, color=colour)
    axes.imshow(np.random.default_rng(0).random((40, 60, 3)), extent=(0.0, 5.0, 1.0, 5.0))
    axes.set_ylim(0.0, 5.0)
    with Image.open(save_figure(figure, tmp_path / "points.png")) as image:
        assert image.mode == "P"
        pixels = np.asarray(image.convert("RGB")).reshape(-1, 3).astype(int)
    for colour in (*PALETTE, "#ffffff"):
        wanted = [int(colour[i : i + 2], 16) for i in (1, 3, 5)]
        assert np.abs(pixels - wanted).max(axis=1).min() == 0
