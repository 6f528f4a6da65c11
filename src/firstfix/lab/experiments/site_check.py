"""How a site will do: which maps are copies or look alike, what it takes in memory and time."""

from __future__ import annotations

import time
from collections import Counter, defaultdict
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from firstfix.core.estimate import Verdict
from firstfix.lab.experiments.perceptual_aliasing import PLAUSIBLE, sensor
from firstfix.lab.worlds.catalog import random_free_poses
from firstfix.site.result import SiteResult
from firstfix.site.site import FIELDS, Site

# Beams, field of view (degrees) and range (m): a common LIDAR, with which one scan can decide.
_SENSOR = (360, 360.0, 12.0)


@dataclass(frozen=True, slots=True)
class CheckedMap:
    """One map of a site.

    Parameters
    ----------
    id : str
        Name.
    area_m2 : float
        Free space.
    nbytes : int
        Size of the map with all its fields.
    scans, right : int
        Simulated scans in it, and those whose most likely map is this one, or a copy of it.
    """

    id: str
    area_m2: float
    nbytes: int
    scans: int
    right: int


@dataclass(frozen=True, slots=True)
class AlikeMaps:
    """Scans of one map that fit in another, too.

    Parameters
    ----------
    map_id, other : str
        The map of the scans, and the one in which they fit.
    scans : int
        How many.
    """

    map_id: str
    other: str
    scans: int


@dataclass(frozen=True, slots=True)
class SiteCheck:
    """What a check of a site found.

    Parameters
    ----------
    maps : tuple of CheckedMap
        Those that can be used.
    faults : tuple of str
        One sentence for each of the others.
    copies : tuple of tuple of str
        Groups of maps that are equal.
    alike : tuple of AlikeMaps
        Most scans first.
    unique, wrong : int
        Scans that were UNIQUE, and those of them in a wrong map.
    prepare_s : float
        Time that it took to load and prepare all maps, s.
    query_s : float
        Mean processor time of one scan, s; 0 without scans.
    """

    maps: tuple[CheckedMap, ...]
    faults: tuple[str, ...]
    copies: tuple[tuple[str, ...], ...]
    alike: tuple[AlikeMaps, ...]
    unique: int
    wrong: int
    prepare_s: float
    query_s: float

    @property
    def nbytes(self) -> int:
        """Size of all maps with their fields, bytes."""
        return sum(one.nbytes for one in self.maps)

    def to_dict(self) -> dict[str, Any]:
        """Return all of it as an object for JSON."""
        return asdict(self)


def check_site(
    site: Site, samples: int, seed: int, done: Callable[[str], None] = lambda _: None
) -> SiteCheck:
    """Prepare all maps, and locate simulated scans of each in the whole site.

    Parameters
    ----------
    site : Site
        The site.
    samples : int
        Random places in each map; 0 only prepares.
    seed : int
        Of the places and the noise.
    done : callable
        Called after each map, twice if there are samples.
    """
    started = time.perf_counter()
    site.prepare(done)
    prepare_s = time.perf_counter() - started
    same = _copies(site)
    started = time.process_time()
    answers = {
        name: _answers(site, name, samples, np.random.default_rng([seed, i]), done)
        for i, name in enumerate(site.map_ids if samples else ())
    }
    scans = sum(map(len, answers.values()))
    query_s = (time.process_time() - started) / max(1, scans)
    published = [
        (name, answer)
        for name, of_map in answers.items()
        for answer in of_map
        if answer.verdict is Verdict.UNIQUE
    ]
    return SiteCheck(
        maps=tuple(_checked(site, name, answers.get(name, []), same) for name in site.map_ids),
        faults=tuple(site.faults.values()),
        copies=tuple(sorted({names for names in same.values() if len(names) > 1})),
        alike=_alike(answers, same),
        unique=len(published),
        wrong=sum(answer.map_id not in same[name] for name, answer in published),
        prepare_s=prepare_s,
        query_s=query_s,
    )


def _copies(site: Site) -> dict[str, tuple[str, ...]]:
    """Return for each map the maps that are equal to it, itself included."""
    groups: dict[str, list[str]] = defaultdict(list)
    for name in site.map_ids:
        groups[site.content(name)].append(name)
    return {name: tuple(names) for names in groups.values() for name in names}


def _answers(
    site: Site, name: str, samples: int, rng: np.random.Generator, done: Callable[[str], None]
) -> list[SiteResult]:
    grid, lidar = site.grid(name), sensor(*_SENSOR)
    poses = random_free_poses(grid, rng, samples)
    answers = [site.locate(lidar.scan(grid, pose, rng)) for pose in poses]
    done(name)
    return answers


def _checked(
    site: Site, name: str, answers: Sequence[SiteResult], same: dict[str, tuple[str, ...]]
) -> CheckedMap:
    fields = site.fields(name)
    fields.compute(*FIELDS)
    right = sum(answer.map_id in same[name] for answer in answers)
    return CheckedMap(name, fields.grid.free_area, fields.nbytes, len(answers), right)


def _alike(
    answers: dict[str, list[SiteResult]], same: dict[str, tuple[str, ...]]
) -> tuple[AlikeMaps, ...]:
    """Count the scans of each map that plausibly are in another."""
    counts = Counter(
        (name, other)
        for name, of_map in answers.items()
        for answer in of_map
        for other, probability in answer.map_probabilities.items()
        if probability >= PLAUSIBLE and other not in same[name]
    )
    return tuple(AlikeMaps(*pair, count) for pair, count in counts.most_common())
