"""Many maps as one: load, look, search, judge."""

from __future__ import annotations

import logging
import math
import os
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from firstfix.core.errors import FirstfixError, InputError
from firstfix.core.grid import OccupancyGrid
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.fields.cache import remove_unused
from firstfix.fields.map_fields import MapFields
from firstfix.io.maps.site_yaml import SiteDescription, SiteMap, Transition, read_site
from firstfix.site.follow import follow
from firstfix.site.judge import judge_site
from firstfix.site.look import PROMISING, Looked, look_at_all, look_at_maps
from firstfix.site.maps import PreparedMaps
from firstfix.site.places import SiteCandidates, SitePlace
from firstfix.site.query import SitePrior, SiteQuery
from firstfix.site.result import SiteResult
from firstfix.site.search import search_one_look
from firstfix.site.site_belief import Followed, SiteBelief
from firstfix.site.surroundings import surroundings
from firstfix.site.views import are_seen_together, search_views
from firstfix.site.zones import zone_prior

_log = logging.getLogger(__name__)

MEMORY_LIMIT = 2 << 30
"""Default size of the prepared maps that are held at once, bytes."""

FIELDS = ("squares", "clearance", "unknown", "endpoints", "look")
"""What the search reads of a prepared map."""

# Places that may turn out to be one: only of these the surroundings are compared.
LIKELY_PLACES = 6
LIKELY_SHARE = 1e-3

UNUSED_DAYS = 90.0
"""Files of prepared maps that no site has read for so long are removed."""


class Site:
    """Many maps, one of which a robot is in. Made by `Site.load`.

    Parameters
    ----------
    description : SiteDescription
        The maps and how they are connected.
    cache_dir : Path or None
        Folder of prepared maps; None prepares in memory.
    memory_limit : int
        Size of the prepared maps that are held at once, bytes.

    Examples
    --------
    >>> _ = ff.save_map(grid, "ground.yaml")
    >>> _ = ff.save_map(ff.OccupancyGrid(grid.cells[:, ::-1], 0.05), "first.yaml")
    >>> site = ff.Site.load(".")
    >>> site.map_ids
    ('first', 'ground')
    >>> site.locate(scan).map_id
    'ground'
    """

    def __init__(
        self,
        description: SiteDescription,
        cache_dir: Path | None = None,
        memory_limit: int = MEMORY_LIMIT,
    ) -> None:
        self._entries = {entry.id: entry for entry in description.maps}
        self._transitions = description.transitions
        self._cache_dir = cache_dir
        self._maps = PreparedMaps(self._entries, cache_dir, memory_limit)
        self._faults: dict[str, str] = {}

    @classmethod
    def load(
        cls,
        path: str | os.PathLike[str],
        cache_dir: Path | None = None,
        memory_limit: int = MEMORY_LIMIT,
    ) -> Site:
        """Read which maps a site has; each is prepared when it is first used.

        Parameters
        ----------
        path : path-like
            A folder of map_server maps, or a ``site.yaml``.
        cache_dir : Path, optional
            Folder of prepared maps; by default they are prepared in memory.
        memory_limit : int
            Size of the prepared maps that are held at once, bytes.

        Raises
        ------
        InputError
            If there is no map, two have one id, or the site.yaml has a fault.
        """
        return cls(read_site(path), cache_dir, memory_limit)

    @property
    def map_ids(self) -> tuple[str, ...]:
        """Ids of the maps that can be used, as far as is known."""
        return tuple(name for name in self._entries if name not in self._faults)

    @property
    def faults(self) -> dict[str, str]:
        """One sentence for each map that was found to be unusable."""
        return dict(self._faults)

    @property
    def maps(self) -> dict[str, SiteMap]:
        """What the files say of each map, usable or not."""
        return dict(self._entries)

    @property
    def transitions(self) -> tuple[Transition, ...]:
        """Lifts, doors and other ways between maps."""
        return self._transitions

    def zone(self, name: str) -> SitePrior:
        """Return a prior for `locate`: the robot is in a zone, in any map that has it.

        Parameters
        ----------
        name : str
            As in the ``zones`` of ``site.yaml``.

        Raises
        ------
        InputError
            If no map has such a zone.
        """
        return zone_prior(self._entries.values(), name)

    def fields(self, map_id: str) -> MapFields:
        """Return a prepared map.

        Raises
        ------
        InputError
            If there is no such map, or it cannot be used.
        """
        return self._maps.get(map_id).fields

    @property
    def contents(self) -> dict[str, str]:
        """Hash of each map that can be used; copies have the same."""
        known = self._maps.contents
        for name in self.map_ids:
            if name not in known:
                self._is_usable(self._entries[name])
        return dict(known)

    def content(self, map_id: str) -> str:
        """Return a hash of a map: copies have the same."""
        return self._maps.get(map_id).content

    def grid(self, map_id: str) -> OccupancyGrid:
        """Return a map."""
        return self.fields(map_id).grid

    def prepare(self, done: Callable[[str], None] = lambda _: None) -> None:
        """Prepare all maps now, so that no scan waits for it.

        Parameters
        ----------
        done : callable
            Called with the id of each map when it is ready, or found to be unusable.
        """
        for i, map_id in enumerate(self._entries):
            self.prepare_map(map_id)
            _log.info("map %d of %d is prepared: %s", i + 1, len(self._entries), map_id)
            done(map_id)
        if self._cache_dir is not None:
            remove_unused(self._cache_dir, UNUSED_DAYS)

    def prepare_map(self, map_id: str) -> None:
        """Prepare one map now; `faults` says if it is unusable.

        Raises
        ------
        InputError
            If there is no such map.
        """
        if self._is_usable(self._entry(map_id)):
            self.fields(map_id).compute(*FIELDS)

    def locate(
        self,
        scan: LaserScan | Sequence[LaserScan],
        T_odom_base: Sequence[SE2] | None = None,
        prior: SitePrior | None = None,
    ) -> SiteResult:
        """Find the map, and where in it, a scan was taken, or the newest of several.

        Parameters
        ----------
        scan : LaserScan or sequence of LaserScan
            As `ScanMatcher.locate`.
        T_odom_base : sequence of SE2, optional
            Odometry at each of several scans; by default the robot stood still.
        prior : mapping of str to Prior or None, optional
            Maps in which the robot may be, each with what is known of its pose there.

        Returns
        -------
        SiteResult
            One verdict over all maps.

        Raises
        ------
        InputError
            If several scans and their odometry do not belong together, or the prior names a map
            that is not in the site.
        """
        started = time.perf_counter()
        query = self.query(scan, T_odom_base, prior)
        # A look into all maps together is the search itself: to rank maps before is no gain.
        is_joint = query.is_one_look or are_seen_together(query)
        one_stage = is_joint or len(self.map_ids) <= PROMISING
        looked = look_at_all(self.map_ids) if one_stage else self.first_look(query)
        found = self.search(query, looked.promising)
        result = judge_site(query, [looked], [found])
        return replace(
            result,
            grid=None if result.map_id is None else self.grid(result.map_id),
            elapsed_s=time.perf_counter() - started,
        )

    def query(
        self,
        scan: LaserScan | Sequence[LaserScan],
        T_odom_base: Sequence[SE2] | None = None,
        prior: SitePrior | None = None,
    ) -> SiteQuery:
        """Check and put together what `locate` takes; the result can be pickled."""
        query = SiteQuery.of(scan, T_odom_base, prior)
        for map_id in query.prior or {}:
            self._entry(map_id)
        return query

    def first_look(self, query: SiteQuery, map_ids: Sequence[str] | None = None) -> Looked:
        """Tell how promising maps are for a query, at little cost.

        Parameters
        ----------
        query : SiteQuery
            What is asked.
        map_ids : sequence of str, optional
            Some of the maps; by default all.
        """
        chosen = self.map_ids if map_ids is None else tuple(map_ids)
        usable = [name for name in chosen if self._is_usable(self._entry(name))]
        return look_at_maps(query, usable, self._maps.get)

    def search(self, query: SiteQuery, map_ids: Sequence[str]) -> SiteCandidates:
        """Search some of the maps; refine and verify the best places in one pool.

        Parameters
        ----------
        query : SiteQuery
            What is asked.
        map_ids : sequence of str
            Some of the maps; those of `Looked.promising`.

        Raises
        ------
        InputError
            If one of the maps is not in the site.
        """
        usable = [name for name in map_ids if self._is_usable(self._entry(name))]
        search_maps = search_one_look if query.is_one_look else search_views
        if not usable:
            return SiteCandidates((), np.empty(0), (), self._faults_of(self._entries))
        places, totals = search_maps(query, usable, self._maps.get)
        return SiteCandidates(
            self._with_surroundings(places),
            totals,
            searched=tuple(usable),
            faults=self._faults_of(self._entries),
        )

    def follow(self, belief: SiteBelief, map_ids: Sequence[str]) -> Followed:
        """Weigh the places of a robot in some of the maps by its newest view.

        Parameters
        ----------
        belief : SiteBelief
            With the newest view.
        map_ids : sequence of str
            Some of the maps.

        Raises
        ------
        InputError
            If one of the maps is not in the site.
        """
        usable = [name for name in map_ids if self._is_usable(self._entry(name))]
        if not usable:
            nothing = np.full(1 if belief.is_followed else len(belief.views), -np.inf)
            return Followed(SiteCandidates((), nothing, (), self._faults_of(map_ids)), {})
        followed = follow(belief, usable, self._maps.get)
        found = replace(
            followed.found,
            places=self._with_surroundings(followed.found.places),
            faults=self._faults_of(self._entries),
        )
        return replace(followed, found=found)

    def _faults_of(self, map_ids: Iterable[str]) -> tuple[str, ...]:
        return tuple(self._faults[name] for name in map_ids if name in self._faults)

    def _with_surroundings(self, places: Sequence[SitePlace]) -> tuple[SitePlace, ...]:
        """Add to the likely places what their maps show around them."""
        ranked = sorted(places, key=lambda place: -place.log_posterior)
        least = ranked[0].log_posterior + math.log(LIKELY_SHARE) if ranked else 0.0
        likely = [place for place in ranked[:LIKELY_PLACES] if place.log_posterior >= least]
        return (
            *(
                replace(
                    place, around=surroundings(self.fields(place.map_id), place.hypothesis.pose)
                )
                for place in likely
            ),
            *ranked[len(likely) :],
        )

    def _is_usable(self, entry: SiteMap) -> bool:
        """Tell whether a map can be loaded, and note why if it cannot."""
        if entry.id in self._faults:
            return False
        try:
            self._maps.get(entry.id)
        except FirstfixError as error:
            self._faults[entry.id] = f"The map {entry.id} cannot be used: {error}"
            return False
        return True

    def _entry(self, map_id: str) -> SiteMap:
        if map_id not in self._entries:
            names = sorted(self._entries)
            listed = ", ".join(names[:5]) + (", ..." if len(names) > 5 else "")
            raise InputError(
                f"There is no map {map_id!r:.60} in this site. Choose one of {listed}."
            )
        return self._entries[map_id]

    def __repr__(self) -> str:
        faults = f", {len(self._faults)} unusable" if self._faults else ""
        return f"<Site of {len(self._entries)} maps{faults}>"
