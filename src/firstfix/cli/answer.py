"""An answer for a person: coloured with a table on a terminal, plain text in a pipe."""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import typer

if TYPE_CHECKING:
    from firstfix.core.estimate import Hypothesis, LocateResult
    from firstfix.core.se2 import SE2

# What is listed for a person: places that are likely at all, and some to compare them with.
_LEAST_PROBABILITY = 0.001
_FEWEST_ROWS, _MOST_ROWS = 3, 10

VERDICT_STYLES = {"UNIQUE": "bold green", "AMBIGUOUS": "bold yellow", "NO_MATCH": "bold red"}
_HEAD = ["rank", "x m", "y m", "yaw °", "probability", "score", "explained", "through wall"]


@dataclass(frozen=True)
class Waited:
    """How long it took until the search began, s."""

    kernels_s: float
    map_s: float

    def __str__(self) -> str:
        """Return both times, with what they were needed for."""
        return (
            f"{self.kernels_s:.3f} s to load the kernels and {self.map_s:.3f} s to prepare the map"
        )


def print_answer(result: LocateResult, truth: SE2 | None, waited: Waited, title: str = "") -> None:
    """Print the answer for one scan.

    Parameters
    ----------
    result : LocateResult
        The answer.
    truth : SE2 or None
        The true ``T_map_base``, where it is known.
    waited : Waited
        Time before the search.
    title : str
        Before the verdict.
    """
    if sys.stdout.isatty():
        _print_in_colour(result, truth, waited, title)
    else:
        typer.echo(f"{title}{answer_text(result, truth, waited)}")


def answer_text(result: LocateResult, truth: SE2 | None, waited: Waited) -> str:
    """Describe an answer in lines of plain text. Parameters as in `print_answer`."""
    from firstfix.lab.reports.text import markdown_table

    lines = [f"{result.verdict.value}: {result.reason}"]
    lines += [f"{name:<13}{text}" for name, text in _facts(result, truth, waited)]
    listed = _listed(result)
    if len(result.hypotheses) > 1:
        lines += ["", markdown_table(_HEAD, _cells(listed)).rstrip()]
    return "\n".join([*lines, *_rest(result, listed)])


def _print_in_colour(result: LocateResult, truth: SE2 | None, waited: Waited, title: str) -> None:
    from rich import box
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    console = Console(highlight=False)
    verdict = Text(result.verdict.value, VERDICT_STYLES[result.verdict.value])
    console.print(Text.assemble(title, verdict, f"  {result.reason}"))
    facts = Table.grid(padding=(0, 2))
    for name, text in _facts(result, truth, waited):
        facts.add_row(Text(name, "dim"), text)
    console.print(facts)
    listed = _listed(result)
    if len(result.hypotheses) > 1:
        table = Table(box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0))
        for name in _HEAD:
            table.add_column(name, justify="right", no_wrap=True)
        for cells in _cells(listed):
            table.add_row(*cells)
        console.print(table)
    for line in _rest(result, listed):
        console.print(line)


def _facts(result: LocateResult, truth: SE2 | None, waited: Waited) -> list[tuple[str, str]]:
    import numpy as np

    from firstfix.core.pose_error import PoseError
    from firstfix.core.se2 import SE2
    from firstfix.lab.reports.text import pose_text

    facts, best, search = [], result.best, result.search
    if best is not None:
        sigma = np.sqrt(np.clip(np.diagonal(best.covariance), 0.0, None))
        facts += [
            ("pose", pose_text(best.pose)),
            ("σ", pose_text(SE2.from_array(sigma))),
            ("probability", f"{best.probability:.1%}"),
            ("evidence", _evidence_text(best)),
        ]
        if truth is not None:
            error = PoseError.between(best.pose, truth)
            degrees = math.degrees(error.radians)
            facts.append(("truth", f"{error.metres:.3f} m, {degrees:.2f}° away"))
    proof = "optimum proven" if search.proven else "optimum not proven"
    return [
        *facts,
        ("search", f"{search.poses:,} poses, {search.searched:.0%} searched, {proof}"),
        ("time", f"{result.elapsed_s:.3f} s, after {waited}"),
    ]


def _evidence_text(hypothesis: Hypothesis) -> str:
    e = hypothesis.evidence
    return (
        f"{e.explained:.0%} of {e.beams} beams explained, {e.short:.0%} short, "
        f"{e.through_wall:.0%} through a wall, {e.unknown:.0%} in unknown space"
    )


def _listed(result: LocateResult) -> tuple[Hypothesis, ...]:
    likely = sum(h.probability >= _LEAST_PROBABILITY for h in result.hypotheses)
    return result.hypotheses[: min(_MOST_ROWS, max(_FEWEST_ROWS, likely))]


def _rest(result: LocateResult, listed: Sequence[Hypothesis]) -> list[str]:
    more = len(result.hypotheses) - len(listed)
    return [f"and {more} less likely ones (--json lists all)"] if more else []


def _cells(hypotheses: Sequence[Hypothesis]) -> list[list[str]]:
    return [
        [
            str(rank),
            f"{h.pose.x:.3f}",
            f"{h.pose.y:.3f}",
            f"{math.degrees(h.pose.yaw):.2f}",
            f"{h.probability:.1%}",
            f"{h.score:.4f}",
            f"{h.evidence.explained:.0%}",
            f"{h.evidence.through_wall:.0%}",
        ]
        for rank, h in enumerate(hypotheses, 1)
    ]
