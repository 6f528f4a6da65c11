"""An answer of the static stage for programs: what `firstfix locate --json` and the page say."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import Any

from firstfix.core.estimate import Hypothesis, LocateResult
from firstfix.core.pose_error import PoseError
from firstfix.core.se2 import SE2


def answer_document(index: int, result: LocateResult, truth: SE2 | None) -> dict[str, Any]:
    """Put an answer into the document of docs/json.md.

    Parameters
    ----------
    index : int
        Of the scan.
    result : LocateResult
        The answer.
    truth : SE2 or None
        ``T_map_base`` where the log knows it.

    Returns
    -------
    dict
        ``index``, ``verdict``, ``reason``, ``pose`` [x (m), y (m), yaw (rad)] and ``covariance``
        of the best hypothesis whatever the verdict (null if there is none), ``hypotheses``,
        ``search``, ``elapsed_s``, ``error`` {"m", "deg"} (null without truth). No NaN, no infinity.
    """
    best = result.best
    error = None
    if best is not None and truth is not None:
        off = PoseError.between(best.pose, truth)
        error = {"m": off.metres, "deg": math.degrees(off.radians)}
    document = {
        "index": index,
        "verdict": result.verdict.value,
        "reason": result.reason,
        "pose": None if best is None else best.pose.as_array().tolist(),
        "covariance": None if best is None else best.covariance.tolist(),
        "hypotheses": [_hypothesis(hypothesis) for hypothesis in result.hypotheses],
        "search": asdict(result.search),
        "elapsed_s": result.elapsed_s,
        "error": error,
    }
    return {key: finite(value) for key, value in document.items()}


def finite(value: Any) -> Any:
    """Replace what JSON cannot say, at any depth of dicts and lists, by None."""
    if isinstance(value, dict):
        return {key: finite(inner) for key, inner in value.items()}
    if isinstance(value, list):
        return [finite(inner) for inner in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _hypothesis(hypothesis: Hypothesis) -> dict[str, Any]:
    return {
        "pose": hypothesis.pose.as_array().tolist(),
        "covariance": hypothesis.covariance.tolist(),
        "score": hypothesis.score,
        "probability": hypothesis.probability,
        "evidence": asdict(hypothesis.evidence),
    }
