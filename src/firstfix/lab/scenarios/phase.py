"""What every part of a scenario is."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator

from firstfix.core.se2 import SE2
from firstfix.lab.simulation.simulation import PERIOD_S, Moment, Simulation


class Phase(ABC):
    """A part of a scenario."""

    @abstractmethod
    def run(self, simulation: Simulation) -> Iterator[Moment]:
        """Run the phase to its end, scan by scan; a phase may take no time."""

    @property
    def places(self) -> tuple[SE2, ...]:
        """Poses of the robot that the script names; no furniture is placed there."""
        return ()


def periods(seconds: float) -> int:
    """Return how many scans are taken in a time (s)."""
    return round(seconds / PERIOD_S)
