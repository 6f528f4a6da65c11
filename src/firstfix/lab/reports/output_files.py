"""Files and folders for results: checked before the work, written whole after it."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from firstfix.core.errors import InputError
from firstfix.io.atomic_files import write_whole
from firstfix.plots.figure import check_path, new_figure


def check_file(path: Path) -> None:
    """Refuse a file that cannot be written; create its folder if it is missing.

    An existing file keeps its content.

    Raises
    ------
    InputError
        If it cannot be written.
    """
    with _writing(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        is_new = not path.exists()
        path.open("a").close()
        if is_new:
            path.unlink()


def check_picture(path: Path) -> None:
    """Refuse a picture whose format is unknown, or any picture where matplotlib is missing."""
    check_path(path)
    new_figure(1.0, 1.0)


def check_targets(json_file: Path | None, report: Path | None) -> None:
    """Refuse before hours of work what cannot be written after them; create the report's folder."""
    if json_file is not None:
        check_file(json_file)
    if report is not None:
        new_figure(1.0, 1.0)
        make_folder(report)


def make_folder(folder: Path) -> None:
    """Create the folder of a report if it is missing; raises InputError if that is impossible."""
    with _writing(folder):
        folder.mkdir(parents=True, exist_ok=True)


def write_json(document: dict[str, Any], path: Path) -> None:
    """Write a document, all or nothing."""
    text = json.dumps(document, indent=2, allow_nan=False)
    with _writing(path):
        write_whole(path, [text.encode(), b"\n"])


def write_page(parts: Sequence[str], folder: Path) -> Path:
    """Write ``report.md`` from parts in Markdown into an existing folder; return its absolute path.

    Raises
    ------
    InputError
        If it cannot be written.
    """
    page = folder / "report.md"
    with _writing(folder):
        page.write_text("\n\n".join(part.strip() for part in parts) + "\n", encoding="utf-8")
    return page.resolve()


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
