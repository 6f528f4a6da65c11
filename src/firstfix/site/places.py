"""Places of several maps, refined and verified: what the search of a part of a site returns."""

from __future__ import annotations

from dataclasses import dataclass

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
    costs : tuple of float
        Mean cost of a beam at each view, oldest first.
    T_site_base : SE2 or None
        The pose in the frame of the site, where that of the map is known.
    content : str
        Hash of the map's cells: copies have the same.
    level : tuple of str or None
        Building and floor of the map.
    """

    hypothesis: Hypothesis
    log_likelihood: float
    prior_log: float
    costs: tuple[float, ...]
    T_site_base: SE2 | None
    content: str
    level: tuple[str | None, str | None]

    @property
    def log_posterior(self) -> float:
        """By scans and prior together."""
        return self.log_likelihood + self.prior_log

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
    searched : tuple of str
        The maps that were searched.
    faults : tuple of str
        One sentence for each map that could not be searched.
    """

    places: tuple[SitePlace, ...]
    searched: tuple[str, ...]
    faults: tuple[str, ...] = ()
