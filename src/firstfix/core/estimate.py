"""Results of global localization: places, probabilities and evidence."""

from __future__ import annotations

import base64
import math
from dataclasses import asdict, dataclass, field
from enum import Enum
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from firstfix.core.errors import InputError
from firstfix.core.grid import OccupancyGrid
from firstfix.core.json_values import finite
from firstfix.core.pose_error import PoseError
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class Verdict(Enum):
    """How far a result can be trusted.

    UNIQUE: one place fits, and no other nearly as well. AMBIGUOUS: several places fit, or the
    evidence is too weak. NO_MATCH: no place explains the scan.

    Examples
    --------
    >>> ff.ScanMatcher(grid).locate(scan).verdict is ff.Verdict.UNIQUE
    True
    """

    UNIQUE = "UNIQUE"
    AMBIGUOUS = "AMBIGUOUS"
    NO_MATCH = "NO_MATCH"


@dataclass(frozen=True, slots=True)
class Evidence:
    """How the beams of a scan agree with the map at one pose: shares of the used beams, 0 to 1.

    Parameters
    ----------
    explained : float
        Beams that end at a wall of the map, or return nothing where the map has none.
    short : float
        Beams that end before the wall (people, furniture): weak evidence against the pose.
    through_wall : float
        Beams that pass through a wall: strong evidence against the pose.
    unknown : float
        Beams that end in unknown space, outside the map, or at a cell known to have changed.
    beams : int
        Number of beams used.

    Examples
    --------
    >>> evidence = ff.ScanMatcher(grid).locate(scan).best.evidence
    >>> evidence.explained > 0.9
    True
    """

    explained: float
    short: float
    through_wall: float
    unknown: float
    beams: int


@dataclass(frozen=True, eq=False, slots=True)
class Hypothesis:
    """One possible place of the robot.

    Parameters
    ----------
    pose : SE2
        ``T_map_base``.
    covariance : ndarray, shape (3, 3)
        Of x (m), y (m), yaw (rad) in the map frame, if this is the right place.
    score : float
        Mean cost of a beam; lower is better. Comparable within one result only.
    probability : float
        That this is the right place, 0 to 1. The rest to 1 over all hypotheses is the probability
        of the places that are not listed.
    evidence : Evidence
        How the beams agree with the map at this pose.
    id : int or None
        Number that a localizer gives to the place and keeps as long as the place is listed; None
        in the answer to a single scan.
    map_id : str or None
        Which map of a site the pose is in; None where there is one map only.

    Examples
    --------
    >>> best = ff.ScanMatcher(grid).locate(scan).best
    >>> round(best.pose.x, 1), round(best.pose.y, 1), best.probability > 0.95
    (2.0, 1.5, True)
    >>> best.covariance.shape
    (3, 3)
    """

    pose: SE2
    covariance: NDArray[np.float64]
    score: float
    probability: float
    evidence: Evidence
    id: int | None = None
    map_id: str | None = None

    @property
    def sigma_m(self) -> float:
        """Standard deviation of the position in its least certain direction, m."""
        return math.sqrt(max(0.0, float(np.linalg.eigvalsh(self.covariance[:2, :2])[-1])))

    def __str__(self) -> str:
        spread = f" ±{100.0 * self.sigma_m:.1f} cm" if self.covariance.any() else ""
        return f"{self.pose}{spread}, p {self.probability:.2f}"

    def __repr__(self) -> str:
        return f"<Hypothesis {self}>"

    def to_dict(self) -> dict[str, Any]:
        """Return the place as an object of docs/json.md: a member of ``hypotheses``."""
        return {
            "pose": list(self.pose),
            "covariance": finite(self.covariance.tolist()),
            "score": finite(self.score),
            "probability": self.probability,
            "evidence": asdict(self.evidence),
        }


@dataclass(frozen=True, slots=True)
class SearchReport:
    """Extent of a search.

    Parameters
    ----------
    poses : int
        Number of poses of the search grid.
    searched : float
        Share of them that was scored, 0 to 1; less than 1 only with a small ``max_poses``.
    proven : bool
        True if no pose of the search grid has a lower search score than the best one found.

    Examples
    --------
    >>> ff.ScanMatcher(grid).locate(scan).search.proven
    True
    """

    poses: int
    searched: float
    proven: bool


@dataclass(frozen=True, eq=False, slots=True)
class LocateResult:
    """The result of `ScanMatcher.locate`. ``print(result)`` shows it in one line.

    Parameters
    ----------
    verdict : Verdict
        Whether the best hypothesis may be published.
    reason : str
        The verdict in words.
    hypotheses : tuple of Hypothesis
        Separate places, most likely first; empty if the scan has too few hits.
    search : SearchReport
        What was searched, and whether its optimum is proven.
    elapsed_s : float
        Wall time of the call, s.
    grid : OccupancyGrid or None
        The map that was searched, for pictures.
    scans : tuple of LaserScan
        The scans, for pictures.
    probability_without_prior : float or None
        Probability of the best hypothesis by the scan alone; None where there was no prior, or
        several scans of one sensor.

    Examples
    --------
    >>> result = ff.ScanMatcher(grid).locate(scan)
    >>> print(result)
    UNIQUE (2.00, 1.50) m 28...° ±... cm, p 1.00
    >>> result.to_dict()["verdict"]
    'UNIQUE'
    """

    verdict: Verdict
    reason: str
    hypotheses: tuple[Hypothesis, ...]
    search: SearchReport
    elapsed_s: float
    grid: OccupancyGrid | None = field(default=None, repr=False)
    scans: tuple[LaserScan, ...] = field(default=(), repr=False)
    probability_without_prior: float | None = None

    @property
    def best(self) -> Hypothesis | None:
        """The most likely hypothesis; None if there is none."""
        return self.hypotheses[0] if self.hypotheses else None

    def __str__(self) -> str:
        if self.best is None or self.verdict is Verdict.NO_MATCH:
            return f"{self.verdict.value}: {self.reason}"
        return f"{self.verdict.value} {self.best}"

    def __repr__(self) -> str:
        return f"<LocateResult {self}>"

    def to_dict(self, index: int = 0, truth: SE2 | None = None) -> dict[str, Any]:
        """Return the result as the object that docs/json.md describes.

        Parameters
        ----------
        index : int
            Number of the scan in its recording.
        truth : SE2 or None
            ``T_map_base`` where it is known.

        Returns
        -------
        dict
            ``index``, ``verdict``, ``reason``, ``pose`` [x (m), y (m), yaw (rad)] and
            ``covariance`` of the best hypothesis whatever the verdict (None if there is none),
            ``hypotheses``, ``probability_without_prior``, ``search``, ``elapsed_s``,
            ``error`` {"m", "deg"} (None without truth).
            No NaN, no infinity.
        """
        places = [hypothesis.to_dict() for hypothesis in self.hypotheses]
        error = None
        if self.best is not None and truth is not None:
            off = PoseError.between(self.best.pose, truth)
            error = {"m": off.metres, "deg": math.degrees(off.radians)}
        return {
            "index": index,
            "verdict": self.verdict.value,
            "reason": self.reason,
            "pose": places[0]["pose"] if places else None,
            "covariance": places[0]["covariance"] if places else None,
            "hypotheses": places,
            "probability_without_prior": self.probability_without_prior,
            "search": asdict(self.search),
            "elapsed_s": self.elapsed_s,
            "error": error,
        }

    def plot(self, path: str | Path | None = None, *, truth: SE2 | None = None) -> Figure:
        """Draw the map, the scan at the best place, and all places.

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
            If matplotlib is not installed, the file cannot be written, or the result does not come
            from `ScanMatcher.locate`.
        """
        from firstfix.plots import figure, result_picture

        if self.grid is None or not self.scans:
            raise InputError(
                expected="a result with its map and scan",
                received="a result without them",
                remedy="plot a result of ScanMatcher.locate",
            )
        drawn = result_picture.result_figure(self.grid, self.scans, self, truth)
        if path is not None:
            figure.save_figure(drawn, Path(path))
        return drawn

    def _repr_png_(self) -> bytes | None:
        """Return the picture for notebooks; None without matplotlib, map or scan."""
        from firstfix.plots import figure

        if self.grid is None or not self.scans or not figure.can_draw():
            return None
        return figure.png_bytes(self.plot())

    def _repr_html_(self) -> str | None:
        """Return the line and the picture for notebooks; None without the picture."""
        png = self._repr_png_()
        if png is None:
            return None
        source = f"data:image/png;base64,{base64.b64encode(png).decode()}"
        return f'<p>{escape(str(self))}</p><img alt="map, scan and places" src="{source}">'
