"""What is known of one robot in a site: its last views, and its places in the maps they fit.

The belief is a value. It holds no map, so that it can be sent to the workers that have the maps,
which carry its places to the next view (`follow.follow`); `believe` puts their results
together.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from firstfix.belief.belief import NEWS_M, NEWS_RAD, rests
from firstfix.belief.config import BeliefConfig
from firstfix.belief.judge import EXPLAINED_COST
from firstfix.belief.misses import MOST_MISSES
from firstfix.belief.several import LONGEST_STEP_M, check_sequence
from firstfix.belief.tracks import Tracks
from firstfix.belief.view import Observation, View
from firstfix.core.se2 import SE2
from firstfix.global_localization.beams import FEWEST_HITS
from firstfix.site.judge import judge_site
from firstfix.site.look import Looked
from firstfix.site.places import SiteCandidates, SitePlace
from firstfix.site.query import SitePrior, SiteQuery
from firstfix.site.result import SiteResult
from firstfix.site.views import has_moved

VIEWS = BeliefConfig().window
"""Views that are judged together."""

ENTERING = 8
"""Maps that may enter with each view, because a look at it alone finds them promising."""

PLACES = 3000
"""Places of all maps that are kept: at most 1 MB for a robot, and some 30 kB once it is found."""

# Less likely places are left out, as in the belief of one map.
_NEGLIGIBLE_LOG = math.log(1e-6)

# Views from one place that are kept.
_MOST_AT_REST = 3


@dataclass(frozen=True, eq=False, slots=True)
class MapTracks:
    """Places of one map, each with its past.

    Parameters
    ----------
    tracks : Tracks
        The places, over all views of the belief.
    past : ndarray, shape (n, v)
        Log-posterior of each place after each view; a wrong map has 0, a place that was not held
        yet minus infinity.
    rivals : tuple of float
        `Observation.rival_cost` of each view.
    next_id : int
        First id that no place of the map has had.
    """

    tracks: Tracks
    past: NDArray[np.float64]
    rivals: tuple[float, ...]
    next_id: int

    def over(self, views: slice) -> MapTracks:
        """Keep some of the views."""
        return replace(
            self,
            tracks=self.tracks.over(views),
            past=self.past[:, views],
            rivals=self.rivals[views],
        )

    def take(self, kept: NDArray[np.bool_]) -> MapTracks:
        """Choose some of the places."""
        return replace(self, tracks=self.tracks.take(kept), past=self.past[kept])

    @property
    def logs(self) -> NDArray[np.float64]:
        """Log-posterior of each place after the newest view, shape (n,)."""
        newest: NDArray[np.float64] = self.past[:, -1]
        return newest


@dataclass(frozen=True, eq=False, slots=True)
class SiteBelief:
    """Where a robot may be, in any map of a site; ``SiteBelief()`` knows nothing. Can be pickled.

    Parameters
    ----------
    views : tuple of tuple of View
        The last ones that brought news, oldest first; those of one place together.
    maps : mapping of str to MapTracks
        Maps that the views fit. Empty after the first view.
    totals : tuple of float
        Logarithm of the likelihood of all places of all maps after each view; empty while there is
        no place.
    prior : mapping of str to Prior or None
        Maps in which the robot may be; None if it may be in any.
    T_odom_prior : SE2 or None
        Odometry where the prior held.
    misses : int
        Views in a row that the best place does not explain though others do.
    """

    views: tuple[tuple[View, ...], ...] = ()
    maps: Mapping[str, MapTracks] = field(default_factory=dict)
    totals: tuple[float, ...] = ()
    prior: SitePrior | None = None
    T_odom_prior: SE2 | None = None
    misses: int = 0

    @property
    def query(self) -> SiteQuery:
        """All views as a question."""
        seen = [Observation(group, 1.0) for group in self.views]
        return SiteQuery(
            tuple(scan for one in seen for scan in one.scans),
            tuple(one.views[-1].T_odom_base for one in seen for _ in one.scans),
            self.prior,
        )

    @property
    def newest(self) -> SiteQuery:
        """The newest view as a question."""
        return replace(self, views=self.views[-1:]).query

    @property
    def has_joined(self) -> bool:
        """True if the newest scan was taken where the one before was."""
        return len(self.views[-1]) > 1

    @property
    def is_followed(self) -> bool:
        """True if there are places to follow; else all views are to be searched."""
        return bool(self.totals)

    def of_maps(self, map_ids: Iterable[str]) -> SiteBelief:
        """Return what a worker needs that has these maps."""
        return replace(self, maps={name: self.maps[name] for name in map_ids if name in self.maps})

    def over(self, views: slice) -> SiteBelief:
        """Keep some of the views."""
        return replace(
            self,
            views=self.views[views],
            maps={name: held.over(views) for name, held in self.maps.items()},
            totals=self.totals[views],
        )


@dataclass(frozen=True, eq=False, slots=True)
class Followed:
    """Places that were carried to a new view. Can be pickled.

    Parameters
    ----------
    found : SiteCandidates
        Those worth listing. `SiteCandidates.totals` has the newest view only where places were
        followed, and all views where these were searched.
    maps : mapping of str to MapTracks
        All of them.
    """

    found: SiteCandidates
    maps: Mapping[str, MapTracks]


def is_blind(view: View) -> bool:
    """Tell whether too few beams measured a surface for a place to be weighed."""
    return Observation((view,), 1.0).hits < FEWEST_HITS


def with_view(belief: SiteBelief, view: View, prior: SitePrior | None = None) -> SiteBelief:
    """Add a view, by which the places are still to be weighed.

    Parameters
    ----------
    belief : SiteBelief
        Before.
    view : View
        The newest; not blind.
    prior : mapping of str to Prior or None, optional
        What is known at this view; it replaces what was known before.

    Returns
    -------
    SiteBelief
        With one view more than its places have, or with a further scan in the newest view. A view
        that is no news is dropped when the next one comes. Where the odometry jumped, it was
        started anew, and nothing before counts.

    Raises
    ------
    InputError
        If the view is older than the one before, or too far from it for the time between.
    """
    if belief.views:
        last = belief.views[-1][-1]
        if last.T_odom_base.distance_to(view.T_odom_base) > LONGEST_STEP_M:
            belief = SiteBelief()
        else:
            check_sequence((last.scans[-1], view.scans[-1]), (last.T_odom_base, view.T_odom_base))
    if prior is not None:
        belief = replace(belief, prior=prior, T_odom_prior=view.T_odom_base)
    if belief.views and rests(Observation(belief.views[-1], 1.0), view):
        group = (*belief.views[-1], view)[-_MOST_AT_REST:]
        return replace(belief, views=(*belief.views[:-1], group), totals=belief.totals[:-1])
    if len(belief.views) > 1 and not _is_news(belief.views[-2][-1], belief.views[-1][-1]):
        belief = belief.over(slice(None, -1))
    return replace(
        belief.over(slice(-VIEWS + 1, None)), views=(*belief.views[-VIEWS + 1 :], (view,))
    )


def maps_to_follow(belief: SiteBelief, looked: Sequence[Looked]) -> tuple[str, ...]:
    """Return the maps that are weighed by the newest view.

    Parameters
    ----------
    belief : SiteBelief
        With the newest view.
    looked : sequence of Looked
        First looks at the parts of the site; at least one.
    """
    promising = Looked.joined(looked).promising
    if not belief.is_followed:
        return promising
    others = [name for name in promising if name not in belief.maps]
    return (*belief.maps, *others[:ENTERING])


def believe(
    belief: SiteBelief, looked: Sequence[Looked], parts: Sequence[Followed]
) -> tuple[SiteResult, SiteBelief]:
    """Decide between all places of all maps.

    Parameters
    ----------
    belief : SiteBelief
        With the newest view.
    looked : sequence of Looked
        First looks at the parts of the site; at least one.
    parts : sequence of Followed
        What the workers returned.

    Returns
    -------
    SiteResult
        Verdict and ranked hypotheses over all maps.
    SiteBelief
        For the next view. If the best place did not explain the last views though others did, the
        robot was carried or its odometry is wrong, and only the newest view counts.
    """
    totals = np.logaddexp.reduce([part.found.totals for part in parts], axis=0)
    if belief.is_followed:
        totals = np.append(belief.totals, totals)
    found = SiteCandidates(
        tuple(place for part in parts for place in part.found.places),
        totals,
        tuple(name for part in parts for name in part.found.searched),
        tuple(fault for part in parts for fault in part.found.faults),
    )
    result = judge_site(belief.query, looked, [found])
    misses = _misses(belief.misses, found.places)
    if misses >= MOST_MISSES:
        return result, SiteBelief(belief.views[-1:])
    maps = {name: held for part in parts for name, held in part.maps.items()}
    kept = _likely(dict(sorted(maps.items())))
    return result, replace(
        belief, maps=kept, totals=tuple(totals.tolist()) if kept else (), misses=misses
    )


def _likely(maps: Mapping[str, MapTracks]) -> dict[str, MapTracks]:
    """Keep the likely places of all maps. One that comes back is weighed by all views again."""
    logs = np.concatenate([np.empty(0), *(held.logs for held in maps.values())])
    least = logs.max(initial=-math.inf) + _NEGLIGIBLE_LOG
    if len(logs) > PLACES:
        least = max(least, np.partition(logs, -PLACES)[-PLACES])
    kept = {name: held.take(held.logs >= least) for name, held in maps.items()}
    return {name: held for name, held in kept.items() if len(held.tracks)}


def _misses(before: int, places: Sequence[SitePlace]) -> int:
    """Count the views in a row that the best place does not explain though others do."""
    if not places:
        return 0
    best = max(places, key=lambda place: place.log_posterior)
    is_miss = best.cost > EXPLAINED_COST and min(p.cost for p in places) < 0.5 * best.cost
    return before + 1 if is_miss else 0


def _is_news(before: View, view: View) -> bool:
    return has_moved(before, view, NEWS_M, NEWS_RAD)
