"""The episodes of a demo as JSON values."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from firstfix.lab.scenarios.demo import DemoStep, Episode


def demo_document(
    world: str, episodes: Sequence[Episode], steps: Sequence[DemoStep], picture: Path | None
) -> dict[str, Any]:
    """Return what happened in each episode, and the processor time of a scan."""
    cpu_ms = sorted(1e3 * step.cpu_s for step in steps)
    return {
        "world": world,
        "succeeded": all(e.is_tracked or e.is_correctly_ambiguous for e in episodes),
        "episodes": [_episode(episode) for episode in episodes],
        "scans": len(steps),
        "cpu_ms": {"median": cpu_ms[len(cpu_ms) // 2], "max": cpu_ms[-1]},
        "picture": None if picture is None else f"{picture}",
    }


def _episode(episode: Episode) -> dict[str, Any]:
    return {
        "began_s": episode.began_s,
        "truth": episode.truth.as_array().tolist(),
        "tracked": episode.is_tracked,
        "correctly_ambiguous": episode.is_correctly_ambiguous,
        "noticed_s": episode.noticed_s,
        "found_s": episode.found_s,
        "found_error": _known({"m": episode.found_error_m, "deg": episode.found_error_deg}),
        "wrong_finds": episode.wrong_finds,
        "kept": None if math.isnan(episode.kept) else episode.kept,
        "rmse": _known({"m": episode.rmse_m, "deg": episode.rmse_deg}),
        "equal_places": [place.pose.as_array().tolist() for place in episode.equal_places],
    }


def _known(errors: dict[str, float]) -> dict[str, float] | None:
    return None if math.isnan(errors["m"]) else errors
