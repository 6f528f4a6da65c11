"""Places of several maps, refined and verified: what the search of a part of a site returns."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from firstfix.core.estimate import Hypothesis
from firstfix.core.se2 import SE2


@dataclass(frozen=True, eq=False, slots=True)
class SitePlace:
    """One place of one map.

    Parameters
    ----------
    hypothesis : Hypothesis
        With ``map_id``; its probability is 0 until all maps are judged.
    log_likelihood : float
        By the power law of the verdict, from the scans alone; a wrong map has 0.
    prior_log : float
        What was known before the scans: a log-likelihood up to 0.
    steps : tuple of float
        Log-posterior after each view, oldest first; the last is that after all.
    cost : float
        Mean cost of a beam at the newest view, nats.
    T_site_base : SE2 or None
        The pose in the frame of the site, where that of the map is known.
    content : str
        Hash of the map's cells: copies have the same.
    level : tuple of str or None
        Building and floor of the map.
    part_costs : tuple of float
        What each part of the scan costs (`lead.part_costs`). After several views the parts of all,
        and only for the best place of each map.
    around : ndarray of uint8 or None
        What the map shows around the place (`surroundings`); None for unlikely places.
    """

    hypothesis: Hypothesis
    log_likelihood: float
    prior_log: float
    steps: tuple[float, ...]
    cost: float
    T_site_base: SE2 | None
    content: str
    level: tuple[str | None, str | None]
    part_costs: tuple[float, ...] = ()
    around: NDArray[np.uint8] | None = None

    @property
    def log_posterior(self) -> float:
        """By scans and prior together; a wrong map has 0."""
        return self.steps[-1]

    @property
    def map_id(self) -> str:
        """The map that the place is in."""
        return self.hypothesis.map_id or ""


@dataclass(frozen=True, eq=False, slots=True)
class SiteCandidates:
    """Verified places of the maps that were searched. Can be pickled.

    Parameters
    ----------
    places : tuple of SitePlace
        In no order.
    totals : ndarray, shape (steps,)
        Logarithm of the likelihood of all places of these maps after each view, listed or not.
    searched : tuple of str
        The maps that were searched.
    faults : tuple of str
        One sentence for each map that could not be searched.
    """

    places: tuple[SitePlace, ...]
    totals: NDArray[np.float64]
    searched: tuple[str, ...]
    faults: tuple[str, ...] = ()
