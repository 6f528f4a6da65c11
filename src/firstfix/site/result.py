"""The answer of a site: which map, and where in it."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from firstfix.core.errors import InputError
from firstfix.core.estimate import Hypothesis, LocateResult, SearchReport, Verdict
from firstfix.core.grid import OccupancyGrid
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.site.places import SitePlace

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_PRINTED_MAPS = 5


@dataclass(frozen=True, eq=False)
class SiteResult:
    """The result of `Site.locate`. ``print(result)`` shows it in one line.

    Parameters
    ----------
    verdict : Verdict
        Whether the best hypothesis may be published.
    reason : str
        The verdict in words.
    hypotheses : tuple of Hypothesis
        Separate places of all maps, most likely first, each with its ``map_id``.
    same_places : tuple of tuple of SitePlace
        For each hypothesis the same place in other maps, which overlap or are copies.
    map_probabilities : dict of str to float
        Of each map of the site.
    elsewhere : float
        Probability of a place that is not listed: outside, unmapped, or in a map that was left out.
    searched : tuple of str
        Maps that were searched after the first look.
    faults : tuple of str
        One sentence for each map that could not be used.
    elapsed_s : float
        Wall time of the call, s.
    grid : OccupancyGrid or None
        The map of the most likely hypothesis, for pictures.
    scans : tuple of LaserScan
        The scans, for pictures.

    Examples
    --------
    >>> _ = ff.save_map(grid, "ground.yaml")
    >>> result = ff.Site.load(".").locate(scan)
    >>> print(result)
    UNIQUE ground (2.00, 1.50) m 28...° ±... cm, p 1.00
    >>> result.map_probabilities["ground"] > 0.95
    True
    """

    verdict: Verdict
    reason: str
    hypotheses: tuple[Hypothesis, ...]
    same_places: tuple[tuple[SitePlace, ...], ...]
    map_probabilities: dict[str, float]
    elsewhere: float
    searched: tuple[str, ...]
    faults: tuple[str, ...]
    elapsed_s: float
    grid: OccupancyGrid | None = field(default=None, repr=False)
    scans: tuple[LaserScan, ...] = field(default=(), repr=False)

    @property
    def best(self) -> Hypothesis | None:
        """The most likely hypothesis; None if there is none."""
        return self.hypotheses[0] if self.hypotheses else None

    @property
    def map_id(self) -> str | None:
        """The map of the most likely hypothesis; None if there is none."""
        return None if self.best is None else self.best.map_id

    def __str__(self) -> str:
        if self.best is None or self.verdict is Verdict.NO_MATCH:
            return f"{self.verdict.value}: {self.reason}"
        return f"{self.verdict.value} {self.best.map_id} {self.best}"

    def __repr__(self) -> str:
        return f"<SiteResult {self}>"

    def to_dict(self, index: int = 0) -> dict[str, Any]:
        """Return the result as an object for JSON: no NaN, no infinity.

        Parameters
        ----------
        index : int
            Number of the scan in its recording.
        """
        places = []
        for hypothesis, others in zip(self.hypotheses, self.same_places, strict=True):
            same = [
                {"map_id": other.map_id, "pose": list(other.hypothesis.pose)} for other in others
            ]
            places.append({"map_id": hypothesis.map_id, **hypothesis.to_dict(), "also": same})
        return {
            "index": index,
            "verdict": self.verdict.value,
            "reason": self.reason,
            "map_id": self.map_id,
            "pose": places[0]["pose"] if places else None,
            "covariance": places[0]["covariance"] if places else None,
            "hypotheses": places,
            "maps": {name: p for name, p in self.map_probabilities.items() if p > 0.0},
            "elsewhere": self.elsewhere,
            "searched": len(self.searched),
            "faults": list(self.faults),
            "elapsed_s": self.elapsed_s,
        }

    def plot(self, path: str | Path | None = None, *, truth: SE2 | None = None) -> Figure:
        """Draw the map of the best place, the scan there, and the places in this map.

        Parameters
        ----------
        path : str or Path, optional
            File to write: .png, .svg or .pdf, in an existing folder.
        truth : SE2, optional
            ``T_map_base`` where it is known.

        Returns
        -------
        matplotlib.figure.Figure
            The picture.

        Raises
        ------
        InputError
            If there is no place, matplotlib is not installed or the file cannot be written.
        """
        if self.grid is None or self.best is None:
            raise InputError("This result has no map or no place to draw. Plot one of Site.locate.")
        return self._in_best_map().plot(path, truth=truth)

    def _in_best_map(self) -> LocateResult:
        return LocateResult(
            verdict=self.verdict,
            reason=f"map {self.map_id}: {self.reason}",
            hypotheses=tuple(h for h in self.hypotheses if h.map_id == self.map_id),
            search=SearchReport(poses=0, searched=1.0, proven=True),
            elapsed_s=self.elapsed_s,
            grid=self.grid,
            scans=self.scans,
        )
