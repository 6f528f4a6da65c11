"""Figures in files, without a window, and their common style."""

from __future__ import annotations

from collections.abc import Sequence
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from firstfix.core.errors import InputError

if TYPE_CHECKING:
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure
    from PIL import Image

_DOTS_PER_INCH = 120
_COLOURS = 128  # a dozen, and their blends at smoothed edges
_SAME_COLOUR = 8  # of 255: the eye sees no difference

SUFFIXES = (".png", ".svg", ".pdf")

# Okabe & Ito (2008): distinct for colour-blind readers, and in grey.
BLUE, ORANGE, GREEN = "#0072B2", "#E69F00", "#009E73"
RED, PURPLE, SKY = "#D55E00", "#CC79A7", "#56B4E9"
PALETTE = (BLUE, ORANGE, GREEN, RED, PURPLE, SKY)
# After the last colour, the next dash begins.
_DASHES = ("-", "--", "-.", ":")


def check_path(path: Path) -> None:
    """Check the path of a picture before the work for it begins.

    Raises
    ------
    InputError
        If its suffix names no known format, or its folder does not exist.
    """
    if path.suffix.lower() not in SUFFIXES:
        raise InputError(
            expected=f"a picture that ends in {', '.join(SUFFIXES)}",
            received=f"{path}",
            remedy="name the file by its format, such as place.png",
        )
    if not path.absolute().parent.is_dir():
        raise InputError(
            expected="an existing folder for the picture",
            received=f"no such folder: {path.parent} ({path})",
            remedy="create the folder, or choose another path",
        )


def line_style(number: int) -> dict[str, Any]:
    """Return colour and dash of line ``number``, from 0, as keywords of matplotlib."""
    return {
        "color": PALETTE[number % len(PALETTE)],
        "ls": _DASHES[number // len(PALETTE) % len(_DASHES)],
    }


def share_curve(
    values: Sequence[float], least: float, most: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the cumulative share of values as the corners of a step curve.

    Parameters
    ----------
    values : sequence of float
        At least one. An unknown value is inf, so that the curve stays below 1.
    least, most : float
        Ends of the axis.

    Returns
    -------
    tuple of ndarray, shape (n + 2,)
        Values of the n that are finite, and shares from 0 to 1; a corner at each end of the axis.
    """
    ordered = np.sort(values)
    share = np.arange(1, len(ordered) + 1) / len(ordered)
    known = np.isfinite(ordered)
    x = np.concatenate([[least], np.clip(ordered[known], least, most), [most]])
    return x, np.concatenate([[0.0], share[known], [known.mean()]])


def number_plainly(axis: Axis) -> None:
    """Write plain numbers on a logarithmic axis; with few decades, between them too."""
    from matplotlib.ticker import LogFormatter

    class Plain(LogFormatter):
        """The numbers of matplotlib, written as 0.1 instead of 1e-01."""

        def __call__(self, x: float, pos: int | None = None) -> str:
            return f"{x:g}" if super().__call__(x, pos) else ""

    axis.set_major_formatter(Plain())
    axis.set_minor_formatter(Plain(labelOnlyBase=False, minor_thresholds=(2.0, 0.5)))


def can_draw() -> bool:
    """Return whether matplotlib is installed."""
    try:
        import matplotlib.figure  # noqa: F401 - checks that it is installed
    except ImportError:
        return False
    return True


def new_figure(width: float, height: float) -> Figure:
    """Return an empty figure of a size in inches.

    Raises
    ------
    InputError
        If matplotlib is not installed.
    """
    try:
        # Not pyplot: its figures and backends are global.
        from matplotlib.figure import Figure
    except ImportError:
        raise InputError(
            expected="matplotlib, to draw pictures",
            received="a Python without it",
            remedy="run pip install 'firstfix[plot]'",
        ) from None
    return Figure(figsize=(width, height), layout="constrained")


def save_figure(figure: Figure, path: Path) -> Path:
    """Write a figure in the format of its suffix.

    Returns
    -------
    Path
        The file, absolute.

    Raises
    ------
    InputError
        If it cannot be written there.
    """
    check_path(path)
    _lay_out(figure)
    try:
        if path.suffix.lower() == ".png":
            _with_few_colours(figure).save(path, optimize=True)
        else:
            figure.savefig(path)
    except OSError as error:
        raise InputError(
            expected="a place where a picture can be written",
            received=f"{path} ({error.strerror or error})",
            remedy="choose another file",
        ) from None
    return path.resolve()


def png_bytes(figure: Figure) -> bytes:
    """Return a figure as a PNG file."""
    _lay_out(figure)
    file = BytesIO()
    _with_few_colours(figure).save(file, "png", optimize=True)
    return file.getvalue()


def _lay_out(figure: Figure) -> None:
    """Lay out once more than when it is drawn: axes of fixed aspect find their size only then."""
    engine = figure.get_layout_engine()
    if engine is not None:
        engine.execute(figure)


def _with_few_colours(figure: Figure) -> Image.Image:
    """Draw a figure with a palette: a third of the bytes, as reports are kept in repositories."""
    from PIL import Image, ImageColor

    drawn = BytesIO()
    figure.savefig(drawn, format="png", dpi=_DOTS_PER_INCH)
    with Image.open(drawn) as image:
        full = image.convert("RGB")
    found = full.quantize(_COLOURS, dither=Image.Dither.NONE).getpalette() or []
    # Pillow would drop colours of few points. The palette therefore contains all of ours, and no
    # similar ones, among which Pillow would choose by chance.
    own = np.array([ImageColor.getrgb(colour) for colour in (*PALETTE, "white", "black")])
    others = np.reshape(found, (-1, 3))
    apart = np.abs(others[:, None] - own).max(axis=2).min(axis=1) > _SAME_COLOUR
    palette = Image.new("P", (1, 1))
    palette.putpalette(np.concatenate([own, others[apart]]).flatten().tolist())
    return full.quantize(palette=palette, dither=Image.Dither.NONE)
