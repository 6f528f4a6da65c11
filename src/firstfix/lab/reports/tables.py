"""A benchmark as a Markdown table, for a terminal and for a report alike."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

Row = Mapping[str, Any]

# Title, key in the document, format.
COLUMNS = (
    ("n", "n", ".0f"),
    ("success", "success", ".1%"),
    ("0.2 m 3°", "success_02", ".1%"),
    ("recall@10", "recall_10", ".1%"),
    ("unique", "unique", ".1%"),
    ("right", "unique_right", ".1%"),
    ("wrong", "wrong_unique", ".0f"),
    ("median m", "median_m", ".3f"),
    ("median °", "median_deg", ".2f"),
    ("p95 m", "p95_m", ".3f"),
    ("CPU s", "cpu_s", ".3f"),
    ("p95 CPU s", "cpu_s_p95", ".3f"),
    ("wall s", "wall_s", ".3f"),
    ("prepare s", "prepare_s", ".2f"),
    ("RSS MB", "rss_mb", ".0f"),
)


def bench_table(document: Row) -> str:
    """Lay out cases and totals of a benchmark.

    Parameters
    ----------
    document : mapping
        From `bench_document`.

    Returns
    -------
    str
        Markdown; the numbers are aligned in plain text too.
    """
    rows = [*document["cases"], *document["totals"]]
    return columns_table(rows, {"case": "name", "method": "method"}, COLUMNS)


def wrong_map_table(document: Row) -> str:
    """Lay out the scans that were tried on maps of other buildings."""
    cells = [
        [f["name"], f["on"], f["method"], str(f["n"]), str(f["unique"])]
        for f in document["wrong_map_cases"]
    ]
    return markdown_table(["scans of", "on the map of", "method", "n", "unique (all wrong)"], cells)


def columns_table(
    rows: Sequence[Row], words: Mapping[str, str], columns: Sequence[tuple[str, str, str]]
) -> str:
    """Lay out rows of figures.

    Parameters
    ----------
    rows : sequence of mapping
        Figures by key; None is shown as a dash.
    words : mapping
        Title to key of the columns of words, which come first.
    columns : sequence of tuple
        Title, key and format of each column of figures.

    Returns
    -------
    str
        Markdown.
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
    numeric = [
        all(not row[i] or row[i].lstrip("-")[:1].isdigit() or row[i] == "–" for row in rows)
        for i in range(len(head))
    ]
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
