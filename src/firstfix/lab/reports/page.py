"""The page of a report: Markdown beside the pictures that it shows."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from firstfix.core.errors import InputError


def write_page(parts: Sequence[str], folder: Path) -> Path:
    """Write ``report.md`` into a folder.

    Parameters
    ----------
    parts : sequence of str
        Headings, paragraphs, tables and pictures, in Markdown, one after the other.
    folder : Path
        An existing one; an earlier page is replaced.

    Returns
    -------
    Path
        ``report.md``, absolute.

    Raises
    ------
    InputError
        If it cannot be written.
    """
    page = folder / "report.md"
    try:
        page.write_text("\n\n".join(part.strip() for part in parts) + "\n", encoding="utf-8")
    except OSError as error:
        raise InputError(
            expected="a folder where a report can be written",
            received=f"{folder} ({error.strerror})",
            remedy="choose another folder",
        ) from None
    return page.resolve()
