"""One joint verdict over maps that are spread over workers."""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections import Counter
from collections.abc import Awaitable, Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, TypeVar

from firstfix.belief.view import View
from firstfix.core.errors import InputError
from firstfix.fleet.engine import Engine, WorkerLostError
from firstfix.fleet.jobs import Done, Follow, Job, Look, Prepare, Search, WarmUp
from firstfix.io.maps.site_yaml import SiteMap
from firstfix.site.judge import judge_site
from firstfix.site.look import Looked, look_at_all
from firstfix.site.query import SitePrior, SiteQuery
from firstfix.site.result import SiteResult
from firstfix.site.site_belief import SiteBelief, believe, is_blind, maps_to_follow, with_view
from firstfix.site.zones import zone_prior

T = TypeVar("T")

OnMap = Callable[[str, Job[Any]], Awaitable[Done[Any]]]

PAUSES_S = (0.0, 0.2, 1.0, 3.0, 8.0)
"""Before each trial of a job whose worker was lost. A process is back within seconds; a Ray cluster
needs about ten to notice that a node is lost. A job that ends each worker ends no more than these.
"""


class UnknownMapError(InputError):
    """A map that is not in the site."""


class NotReadyError(Exception):
    """The query cannot be answered now; its text is a sentence."""


@dataclass(eq=False)
class Fleet:
    """Locates robots in a site.

    Parameters
    ----------
    engine : Engine
        Runs the workers.
    shards : tuple of tuple of str
        Ids of the maps of each part of the site.
    copies : int
        Workers that have the same part: worker ``n`` has part ``n % len(shards)``. A query goes to
        one set of workers that have all parts.
    prepared : set of str
        Maps that can be searched.
    faults : dict of str to str
        A sentence for each map that cannot.
    memory : dict of int to int
        What each worker used when it last answered, bytes.
    cpu_s : dict of int to float
        Processor time of each worker when it last answered, s; from 0 after a loss.
    lost_jobs : int
        Jobs that were lost with their worker.
    warm : set of int
        Workers that have compiled or loaded their kernels.
    maps : sequence of SiteMap
        What the files of the site say of its maps: their zones.
    on_map : callable, optional
        Does a job with one map, by its id; by default the worker that has the map does.
    """

    engine: Engine
    shards: tuple[tuple[str, ...], ...]
    copies: int = 1
    prepared: set[str] = field(default_factory=set)
    faults: dict[str, str] = field(default_factory=dict)
    memory: dict[int, int] = field(default_factory=dict)
    cpu_s: dict[int, float] = field(default_factory=dict)
    lost_jobs: int = 0
    warm: set[int] = field(default_factory=set)
    maps: Sequence[SiteMap] = ()
    on_map: OnMap | None = None
    _running: Counter[int] = field(default_factory=Counter)

    @property
    def map_ids(self) -> tuple[str, ...]:
        """All maps of the site, usable or not."""
        return tuple(sorted(name for shard in self.shards for name in shard))

    @property
    def is_ready(self) -> bool:
        """True when every map is prepared or known to be unusable, and no worker has to compile."""
        maps, workers = sum(map(len, self.shards)), self.copies * len(self.shards)
        return len(self.prepared) + len(self.faults) == maps and len(self.warm) == workers

    async def prepare(self, done: Callable[[str], None] = lambda _: None) -> None:
        """Prepare all maps, each worker one after the other; then let all workers warm up.

        Parameters
        ----------
        done : callable
            Called with the id of each map when it is ready, or found to be unusable.
        """
        await asyncio.gather(*(self._prepare(i, done) for i in range(len(self.shards))))
        await asyncio.gather(*(self._warm_up(i) for i in range(self.copies * len(self.shards))))

    async def locate(self, query: SiteQuery, only: str | None = None) -> SiteResult:
        """Find the map and the place of a robot.

        Parameters
        ----------
        query : SiteQuery
            What is asked.
        only : str, optional
            The map of the robot, where it is known; no other one is looked at.

        Returns
        -------
        SiteResult
            One verdict over all maps.

        Raises
        ------
        UnknownMapError
            If the query names a map that is not in the site.
        InputError
            If the query cannot be answered.
        NotReadyError
            If maps are not prepared yet, or a worker was lost again and again.
        """
        started = time.perf_counter()
        parts = self._usable(query, only)
        with self._copy() as copy:
            if only is None:
                looked = await self._all(copy, [(i, Look(query, names)) for i, names in parts])
            else:
                looked = [look_at_all((only,))]
            promising = set(Looked.joined(looked).promising)
            chosen = [(i, tuple(n for n in names if n in promising)) for i, names in parts]
            searches = [(i, Search(query, names)) for i, names in chosen if names]
            if only is not None and self.on_map is not None:
                done = await self._again(partial(self.on_map, only, Search(query, (only,))))
                found = [done.result]
            else:
                found = await self._all(copy, searches)
        return self._timed(await asyncio.to_thread(judge_site, query, looked, found), started)

    async def follow(
        self, belief: SiteBelief, view: View, prior: SitePrior | None = None
    ) -> tuple[SiteResult, SiteBelief]:
        """Find the map and the place of a robot by all that is known of it.

        Parameters
        ----------
        belief : SiteBelief
            From the view before; ``SiteBelief()`` for a robot that is new.
        view : View
            The newest.
        prior : mapping of str to Prior or None, optional
            What is known at this view.

        Returns
        -------
        SiteResult
            One verdict over all maps.
        SiteBelief
            For the next view.

        Raises
        ------
        UnknownMapError, InputError, NotReadyError
            As `locate`.
        """
        if is_blind(view):
            return await self.locate(SiteBelief(((view,),)).newest), belief
        belief = with_view(belief, view, prior)
        if len(belief.views) == 1:
            return await self.locate(belief.newest), belief
        started = time.perf_counter()
        query = belief.newest if belief.is_followed else belief.query
        parts = self._usable(query, None)
        with self._copy() as copy:
            looked = await self._all(copy, [(i, Look(query, names)) for i, names in parts])
            followed = set(maps_to_follow(belief, looked))
            chosen = [(i, tuple(n for n in names if n in followed)) for i, names in parts]
            jobs = [(i, Follow(belief.of_maps(names), names)) for i, names in chosen if names]
            found = await self._all(copy, jobs)
        result, belief = await asyncio.to_thread(believe, belief, looked, found)
        return self._timed(result, started), belief

    @contextlib.contextmanager
    def _copy(self) -> Iterator[int]:
        """Give the number of the copy of the site that has least to do."""
        copy = min(range(self.copies), key=lambda i: self._running[i])
        self._running[copy] += 1
        try:
            yield copy
        finally:
            self._running[copy] -= 1

    def _timed(self, result: SiteResult, started: float) -> SiteResult:
        return replace(
            result,
            faults=tuple(self.faults.values()),
            elapsed_s=time.perf_counter() - started,
        )

    def zone(self, name: str) -> SitePrior:
        """Return the prior of a robot in a zone; InputError if no map has it."""
        return zone_prior(self.maps, name)

    def check_maps(self, map_ids: Sequence[str]) -> None:
        """Raise UnknownMapError if one of the maps is not in the site."""
        known = set(self.map_ids)
        for name in map_ids:
            if name not in known:
                listed = ", ".join(self.map_ids[:5]) + (", ..." if len(known) > 5 else "")
                raise UnknownMapError(
                    f"There is no map {name!r:.60} in this site. Choose one of {listed}."
                )

    def _usable(self, query: SiteQuery, only: str | None) -> list[tuple[int, tuple[str, ...]]]:
        """Return the maps to look at, by worker."""
        self.check_maps([*(query.prior or {}), *([] if only is None else [only])])
        if only in self.faults:
            raise NotReadyError(self.faults[only])
        asked = self.map_ids if only is None else (only,)
        if missing := [n for n in asked if n not in self.prepared and n not in self.faults]:
            raise NotReadyError(
                f"{len(missing)} of {len(asked)} maps are not prepared yet. Try again later."
            )
        parts = [
            (i, tuple(n for n in shard if n in self.prepared and only in {None, n}))
            for i, shard in enumerate(self.shards)
        ]
        usable = [(i, names) for i, names in parts if names]
        if not usable:
            raise NotReadyError("No map of the site can be used. GET /v1/maps says why.")
        return usable

    async def _prepare(self, worker: int, done: Callable[[str], None]) -> None:
        for map_id in self.shards[worker]:
            try:
                fault = await self._ask(worker, Prepare(map_id))
            except NotReadyError:
                fault = f"The map {map_id} cannot be used: each worker that prepares it is lost."
            if fault is None:
                self.prepared.add(map_id)
            else:
                self.faults[map_id] = fault
            done(map_id)

    async def _warm_up(self, worker: int) -> None:
        with contextlib.suppress(NotReadyError):  # queries will say so
            await self._ask(worker, WarmUp())
        self.warm.add(worker)

    async def _all(self, copy: int, asked: Sequence[tuple[int, Job[T]]]) -> list[T]:
        """Let several workers work at once; if one fails, wait for no other."""
        first = copy * len(self.shards)
        return list(await asyncio.gather(*(self._ask(first + part, job) for part, job in asked)))

    async def _ask(self, worker: int, job: Job[T]) -> T:
        done = await self._again(partial(self.engine.ask, worker, job))
        self.memory[worker], self.cpu_s[worker] = done.memory, done.cpu_s
        return done.result

    async def _again(self, ask: Callable[[], Awaitable[Done[T]]]) -> Done[T]:
        """Ask again while the worker is lost."""
        for pause in PAUSES_S:
            await asyncio.sleep(pause)
            try:
                return await ask()
            except WorkerLostError:
                self.lost_jobs += 1
        raise NotReadyError(
            "A part of the maps cannot be reached: its worker was lost and is started again. "
            "Try again later."
        )
