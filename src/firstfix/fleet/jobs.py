"""What the workers of a fleet service do: each job and its result can be pickled."""

from __future__ import annotations

import os
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Generic, Protocol, TypeVar

from firstfix.core.errors import FirstfixError
from firstfix.core.se2 import SE2
from firstfix.global_localization.precompile import scan_of, small_room
from firstfix.io.maps.site_yaml import SiteMap, read_site
from firstfix.site.look import Looked
from firstfix.site.places import SiteCandidates
from firstfix.site.query import SiteQuery
from firstfix.site.site import Site
from firstfix.site.site_belief import Followed, SiteBelief

T = TypeVar("T")
T_co = TypeVar("T_co", covariant=True)


LEAST_MAPS = 50
"""Maps of a worker, before a site is spread. A query costs each worker that it goes to 0.25 s and
5 ms a map (floors of 800 m²), so a small site answers more queries if each worker has all of it.
"""


class Job(Protocol[T_co]):
    """Something that a worker does with its maps."""

    def run(self, site: Site) -> T_co:
        """Do it."""
        ...


@dataclass(frozen=True, eq=False, slots=True)
class Prepare:
    """Prepare one map; the result is a sentence if it cannot be used."""

    map_id: str

    def run(self, site: Site) -> str | None:
        """Do it."""
        try:
            site.prepare_map(self.map_id)
        except FirstfixError as error:
            return f"The map {self.map_id} cannot be used: {error}"
        return site.faults.get(self.map_id)


@dataclass(frozen=True, eq=False, slots=True)
class WarmUp:
    """Search one map for scans of a drawn room: no robot waits for the compiler then."""

    def run(self, site: Site) -> None:
        """Do it."""
        map_ids, room = site.map_ids[:1], small_room()
        first, second = (scan_of(room, SE2(x, 2.5, 0.4)) for x in (3.0, 3.5))
        step = [SE2.identity(), SE2(0.5, 0.0, 0.0)]
        for query in (SiteQuery.of(first), SiteQuery.of([first, replace(second, stamp=1.0)], step)):
            site.first_look(query, map_ids)
            site.search(query, map_ids)


@dataclass(frozen=True, eq=False, slots=True)
class Look:
    """Take a first look at maps."""

    query: SiteQuery
    map_ids: tuple[str, ...]

    def run(self, site: Site) -> Looked:
        """Do it."""
        return site.first_look(self.query, self.map_ids)


@dataclass(frozen=True, eq=False, slots=True)
class Search:
    """Search maps."""

    query: SiteQuery
    map_ids: tuple[str, ...]

    def run(self, site: Site) -> SiteCandidates:
        """Do it."""
        return site.search(self.query, self.map_ids)


@dataclass(frozen=True, eq=False, slots=True)
class Follow:
    """Weigh the places of a robot in maps by its newest view."""

    belief: SiteBelief
    map_ids: tuple[str, ...]

    def run(self, site: Site) -> Followed:
        """Do it."""
        return site.follow(self.belief, self.map_ids)


@dataclass(frozen=True, eq=False, slots=True)
class Done(Generic[T]):
    """The result of a job, and what its worker has used.

    Parameters
    ----------
    result : object
        What the job returned.
    memory : int
        Memory that the process of the worker uses, bytes; 0 where the system does not say.
    cpu_s : float
        Processor time since the process started, s.
    """

    result: T
    memory: int
    cpu_s: float


@dataclass(frozen=True, eq=False)
class ShardedSite:
    """A site whose maps are spread over workers.

    Parameters
    ----------
    path : Path
        The site, at the same path for all workers.
    shards : tuple of tuple of str
        Ids of the maps of each worker.
    cache_dir : Path
        Folder of prepared maps.
    memory_limit : int
        Size of the prepared maps that each worker holds, bytes.
    """

    path: Path
    shards: tuple[tuple[str, ...], ...]
    cache_dir: Path
    memory_limit: int

    def open(self, worker: int) -> Site:
        """Open the part of a worker."""
        described = read_site(self.path)
        mine = set(self.shards[worker])
        maps = tuple(entry for entry in described.maps if entry.id in mine)
        return Site(type(described)(maps), self.cache_dir, self.memory_limit)


def open_map(path: Path, map_id: str, cache_dir: Path) -> Site:
    """Open a site of one map, and prepare it.

    Raises
    ------
    InputError
        If the site has no such map.
    """
    described = read_site(path)
    maps = tuple(entry for entry in described.maps if entry.id == map_id)
    site = Site(type(described)(maps), cache_dir)
    site.prepare_map(map_id)
    return site


def spread(maps: Sequence[SiteMap], workers: int) -> tuple[tuple[str, ...], ...]:
    """Spread maps over workers, so that each gets about the same size of images.

    Parameters
    ----------
    maps : sequence of SiteMap
        The maps.
    workers : int
        At least 1; no more are used than there are maps.

    Returns
    -------
    tuple of tuple of str
        Ids of the maps of each worker.
    """
    sizes = {entry.id: _size(entry) for entry in maps}
    shards: list[list[str]] = [[] for _ in range(max(1, min(workers, len(maps))))]
    filled = [0] * len(shards)
    for map_id in sorted(sizes, key=lambda name: (-sizes[name], name)):
        least = filled.index(min(filled))
        shards[least].append(map_id)
        filled[least] += sizes[map_id]
    return tuple(tuple(shard) for shard in shards)


def parts_for(maps: int, workers: int) -> int:
    """Return into how many parts a site is spread over workers; all parts are there equally often.

    Parameters
    ----------
    maps, workers : int
        Their numbers.
    """
    most = max(1, min(workers, maps // LEAST_MAPS))
    return next(parts for parts in range(most, 0, -1) if workers % parts == 0)


def _size(entry: SiteMap) -> int:
    """Return the size of the largest image beside a map, as a measure of the work that it takes."""
    from firstfix.io.maps.map_yaml import read_yaml

    try:
        return read_yaml(entry.path).image.stat().st_size + 1
    except (FirstfixError, OSError):
        return 1  # a broken map is named when it is prepared


def run_job(job: Job[T], site: Site) -> Done[T]:
    """Do a job in this process."""
    return Done(job.run(site), memory_of_this_process(), time.process_time())


def memory_of_this_process() -> int:
    """Return the resident memory, bytes; 0 where the system does not say."""
    try:
        pages = int(Path("/proc/self/statm").read_text().split()[1])
    except (OSError, ValueError, IndexError):
        return 0
    return pages * os.sysconf("SC_PAGE_SIZE")
