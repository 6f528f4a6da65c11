"""Figures into files, without a window; the only place that names matplotlib at run time."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from firstfix.core.errors import InputError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SUFFIXES = (".png", ".svg", ".pdf")

# Okabe & Ito (2008): told apart by people who are colour-blind, and in grey.
BLUE, ORANGE, GREEN = "#0072B2", "#E69F00", "#009E73"
RED, PURPLE, SKY = "#D55E00", "#CC79A7", "#56B4E9"
PALETTE = (BLUE, ORANGE, GREEN, RED, PURPLE, SKY)


def check_path(path: Path) -> None:
    """Refuse a name that no figure can be saved under, before any work is done for it.

    Raises
    ------
    InputError
        If its suffix names no known format.
    """
    if path.suffix.lower() not in SUFFIXES:
        raise InputError(
            expected=f"a picture that ends in {', '.join(SUFFIXES)}",
            received=f"{path}",
            remedy="name the file by its format, such as place.png",
        )


def can_draw() -> bool:
    """Tell whether matplotlib is installed."""
    try:
        import matplotlib.figure  # noqa: F401 - only whether it is there
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
    """Write a figure in the format its name ends in; missing folders are made.

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
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path, dpi=120)
    except OSError as error:
        raise InputError(
            expected="a place where a picture can be written",
            received=f"{path} ({error.strerror or error})",
            remedy="choose another file",
        ) from None
    return path.resolve()
