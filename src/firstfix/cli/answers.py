"""Answers for people."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from firstfix.core.estimate import Hypothesis, LocateResult
from firstfix.core.pose_error import PoseError
from firstfix.core.se2 import SE2
from firstfix.lab.reports.tables import markdown_table

# What is listed for a person: places that are likely at all, and some to compare them with.
LEAST_PROBABILITY = 0.001
FEWEST_ROWS, MOST_ROWS = 3, 10


def as_text(result: LocateResult, truth: SE2 | None) -> str:
    """Put an answer into lines for a person; ``truth`` is ``T_map_base`` where it is known."""
    lines = [f"{result.verdict.value}: {result.reason}"]
    best, search = result.best, result.search
    if best is not None:
        sigma = np.sqrt(np.clip(np.diagonal(best.covariance), 0.0, None))
        lines += [
            f"pose         {pose_text(best.pose)}",
            f"σ            {pose_text(SE2.from_array(sigma))}",
            f"probability  {best.probability:.1%}",
            f"evidence     {_evidence_text(best)}",
        ]
        if truth is not None:
            lines.append(f"truth        {error_text(best.pose, truth)} away")
    proof = "optimum proven" if search.proven else "optimum not proven"
    lines += [
        f"search       {search.poses:,} poses, {search.searched:.0%} decided, {proof}",
        f"time         {result.elapsed_s:.3f} s",
    ]
    rows = _rows(result)
    if len(result.hypotheses) > 1:
        lines += ["", _hypothesis_table(result.hypotheses[:rows]).rstrip()]
    if len(result.hypotheses) > rows:
        lines.append(f"and {len(result.hypotheses) - rows} less likely ones (--json lists all)")
    return "\n".join(lines)


def pose_text(pose: SE2) -> str:
    """Write a pose for a person."""
    return f"x {pose.x:.3f} m, y {pose.y:.3f} m, yaw {math.degrees(pose.yaw):.2f}°"


def error_text(pose: SE2, truth: SE2) -> str:
    """Write for a person how far a pose is from the truth."""
    error = PoseError.between(pose, truth)
    return f"{error.metres:.3f} m, {math.degrees(error.radians):.2f}°"


def _evidence_text(hypothesis: Hypothesis) -> str:
    e = hypothesis.evidence
    return (
        f"{e.explained:.0%} of {e.beams} beams explained, {e.short:.0%} short, "
        f"{e.through_wall:.0%} through a wall, {e.unknown:.0%} in unknown space"
    )


def _rows(result: LocateResult) -> int:
    likely = sum(h.probability >= LEAST_PROBABILITY for h in result.hypotheses)
    return min(MOST_ROWS, max(FEWEST_ROWS, likely))


def _hypothesis_table(hypotheses: Sequence[Hypothesis]) -> str:
    head = ["rank", "x m", "y m", "yaw °", "probability", "score", "explained", "through wall"]
    return markdown_table(
        head,
        [
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
        ],
    )
