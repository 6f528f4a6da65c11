"""Tables and poses as text, for terminals and for reports."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from firstfix.core.se2 import SE2

Row = Mapping[str, Any]

# Cells of nothing but these are numbers, which stand to the right.
_NUMERIC = frozenset("0123456789.,-–%/ ")


def pose_text(pose: SE2) -> str:
    """Write a pose for a person."""
    return f"x {pose.x:.3f} m, y {pose.y:.3f} m, yaw {math.degrees(pose.yaw):.2f}°"


def columns_table(
    rows: Sequence[Row], words: Mapping[str, str], columns: Sequence[tuple[str, str, str]]
) -> str:
    """Lay out rows of figures in Markdown; None becomes a dash.

    Parameters
    ----------
    rows : sequence of mapping
        Figures by key.
    words : mapping
        Title to key of the columns of words, which come first.
    columns : sequence of tuple
        Title, key and format of each column of figures.
    """
    cells = [
        [
            *(row[key] for key in words.values()),
            *(_cell(row[key], form) for _, key, form in columns),
        ]
        for row in rows
    ]
    return markdown_table([*words, *(title for title, _, _ in columns)], cells)


def markdown_table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Lay out a table in Markdown: words to the left, numbers to the right."""
    # A rule of Markdown needs three characters.
    widths = [max(3, *map(len, column)) for column in zip(head, *rows, strict=True)]
    numeric = [all(set(row[i]) <= _NUMERIC for row in rows) for i in range(len(head))]
    rule = [
        "-" * (width - 1) + ":" if right else "-" * width
        for width, right in zip(widths, numeric, strict=True)
    ]
    lines = [
        [
            cell.rjust(width) if right else cell.ljust(width)
            for cell, width, right in zip(line, widths, numeric, strict=True)
        ]
        for line in (head, rule, *rows)
    ]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines) + "\n"


def _cell(value: float | None, form: str) -> str:
    return "–" if value is None else format(value, form)
