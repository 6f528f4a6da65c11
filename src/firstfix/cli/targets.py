"""Where results go: refused before the work, not after it, where they could not be written."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from firstfix.core.errors import InputError
from firstfix.io.atomic_files import write_whole


def check_file(path: Path) -> None:
    """Refuse a file that could not be written; make its folder where it is missing.

    What an existing file holds stays until there is something new.

    Raises
    ------
    InputError
        If it could not be written.
    """
    with _writing(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        is_new = not path.exists()
        path.open("a").close()
        if is_new:
            path.unlink()


def check_folder(path: Path) -> None:
    """Make a folder for results, or refuse it as `check_file` does."""
    with _writing(path):
        path.mkdir(parents=True, exist_ok=True)


def check_picture(path: Path) -> None:
    """Refuse a picture that could not be drawn, or not be written under this name."""
    from firstfix.plots.figure import check_path

    check_path(path)
    check_plots()


def check_plots() -> None:
    """Say now, not after the work, that matplotlib is missing."""
    from firstfix.plots.figure import new_figure

    new_figure(1.0, 1.0)


def check_targets(json_file: Path | None, report: Path | None) -> None:
    """Refuse before hours of work what could not be written after them."""
    if json_file is not None:
        check_file(json_file)
    if report is not None:
        check_plots()
        check_folder(report)


def write_json(document: dict[str, Any], path: Path) -> None:
    """Write a document, all or nothing."""
    text = json.dumps(document, indent=2, allow_nan=False)
    with _writing(path):
        write_whole(path, [text.encode(), b"\n"])


@contextmanager
def _writing(path: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise InputError(
            expected="a place where results can be written",
            received=f"{path} ({error.strerror})",
            remedy="choose another one",
        ) from None
