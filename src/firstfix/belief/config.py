"""Settings of the belief; every default holds for all maps and sensors."""

from __future__ import annotations

from dataclasses import dataclass

from firstfix.core.settings import check_settings, setting


@dataclass(frozen=True, slots=True)
class BeliefConfig:
    """How many views and places a belief holds, and when it is sure."""

    window: int = setting(8, "latest views that are judged together", 1, 100)
    memory: int = setting(8, "older views, 2 m apart, that are judged with them", 0, 100)
    first_shortlist: int = setting(600, "places of the first search that enter", 1, 100_000)
    shortlist: int = setting(150, "places of each later search that enter", 1, 100_000)
    places: int = setting(600, "places held at most; the rest counts as elsewhere", 2, 100_000)
    sure_probability: float = setting(
        0.98, "least share of a place that is sure, of the places that are held", 0.5, 1.0
    )

    def __post_init__(self) -> None:
        check_settings(self)
