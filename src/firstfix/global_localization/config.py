"""What a user can choose about the static stage."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from firstfix.core.errors import InputError


class Method(Enum):
    """How the map is searched."""

    FAST = "fast"
    PAPER = "paper"
    PAPER_BASIC = "paper-basic"


@dataclass(frozen=True, slots=True)
class LocateConfig:
    """Settings of the default method; every default holds for all maps and sensors.

    Parameters
    ----------
    budget_s : float
        Wall time after which the search stops and says what it has not seen, s, at least 0.
    shortlist : int
        Places of the search that are refined, at least 1.
    hypotheses : int
        Most places in a result, at least 2.
    unique_probability : float
        Least probability of the best place for the verdict UNIQUE, 0 to 1.

    Raises
    ------
    InputError
        If a setting is out of its range.
    """

    budget_s: float = 30.0
    shortlist: int = 150
    hypotheses: int = 24
    unique_probability: float = 0.95

    def __post_init__(self) -> None:
        for name, least, most in (
            ("budget_s", 0.0, float("inf")),
            ("shortlist", 1, 100_000),
            ("hypotheses", 2, 1_000),
            ("unique_probability", 0.0, 1.0),
        ):
            value = getattr(self, name)
            if not least <= value <= most:
                raise InputError(
                    expected=f"{name} from {least} to {most}",
                    received=f"{value}",
                    remedy="leave it at its default if in doubt",
                )
