"""Writes the figures of docs/figures.yaml into README, landing page and experiments.

``python docs/make_figures.py``
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import yaml

DOCS = Path(__file__).parent
FIGURES = DOCS / "figures.yaml"
MARK = "<!-- figures, by docs/make_figures.py -->"
SAMPLE = {
    "out": "**out of sample**",
    "in": "in sample",
    "both": "both",
    "simulated": "simulated",
    "none": "-",
}


def figures() -> list[dict[str, Any]]:
    """Return all figures, in the order of the file."""
    loaded: list[dict[str, Any]] = yaml.safe_load(FIGURES.read_text(encoding="utf-8"))
    return loaded


def headlines(rows: list[dict[str, Any]], docs: str) -> str:
    """Return the table of README and landing page; ``docs`` leads to the folder of the pages."""
    lines = ["| what | result | measured on |\n|---|---|---|\n"]
    for row in rows:
        if line := row.get("headline"):
            on = f"{line['where']} ([{row['measured']}]({docs}{row['link']}))"
            lines.append(f"| {line['what']} | {line['value']} | {on} |\n")
    return "".join(lines)


def evidence(rows: list[dict[str, Any]]) -> str:
    """Return the table that sets constants against evidence."""
    lines = [
        "| figure | value | constants chosen with | judged on | sample | measured |\n",
        "|---|---|---|---|---|---|\n",
    ]
    for row in rows:
        link = row["link"].removeprefix("experiments.md")
        cells = (f"[{row['figure']}]({link})", row["value"], row["chosen"], row["judged"])
        lines.append(f"| {' | '.join(cells)} | {SAMPLE[row['sample']]} | {row['measured']} |\n")
    return "".join(lines)


PAGES: dict[Path, Callable[[list[dict[str, Any]]], str]] = {
    DOCS.parent / "README.md": lambda rows: headlines(rows, "docs/"),
    DOCS / "index.md": lambda rows: headlines(rows, ""),
    DOCS / "experiments.md": evidence,
}


def current(page: Path) -> str:
    """Return a page with the table between its marks brought up to date."""
    before, _, after = page.read_text(encoding="utf-8").split(MARK)
    return f"{before}{MARK}\n\n{PAGES[page](figures())}\n{MARK}{after}"


if __name__ == "__main__":
    for page in PAGES:
        page.write_text(current(page), encoding="utf-8")
