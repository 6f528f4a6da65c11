"""Prepared maps: files that are mapped into memory on demand, within a limit."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from threading import Lock

import numpy as np
from numpy.typing import NDArray

from firstfix.core.errors import InputError
from firstfix.core.grid import OccupancyGrid
from firstfix.fields import cache
from firstfix.fields.map_fields import MapFields
from firstfix.global_localization.searchable import check_positions, check_searchable
from firstfix.io.atomic_files import unreachable
from firstfix.io.maps.map_server import load_map
from firstfix.io.maps.map_yaml import MapYaml, read_yaml
from firstfix.io.maps.site_yaml import SiteMap


@dataclass(frozen=True, eq=False)
class PreparedMap:
    """A map with its fields, each computed or mapped at its first use.

    Parameters
    ----------
    entry : SiteMap
        What the files of the site say of it.
    fields : MapFields
        The map.
    """

    entry: SiteMap
    fields: MapFields

    @cached_property
    def content(self) -> str:
        """Hash of cells, resolution and origin: maps that are copies have the same."""
        grid = self.fields.grid
        return cache.content_key(grid.cells, repr((grid.resolution, *grid.T_map_grid)))


Maps = Callable[[str], PreparedMap]
"""Loads a map by its id."""


class PreparedMaps:
    """Prepared maps by their ids; the least recently used are dropped.

    Parameters
    ----------
    maps : mapping of str to SiteMap
        The maps of the site.
    cache_dir : Path or None
        Folder of prepared maps; None prepares in memory.
    memory_limit : int
        Size of the maps that are held, bytes. One map is always held.

    Attributes
    ----------
    contents : dict of str to str
        `PreparedMap.content` of each map that has been loaded, held or not.
    """

    def __init__(
        self, maps: Mapping[str, SiteMap], cache_dir: Path | None, memory_limit: int
    ) -> None:
        self._maps = maps
        self._cache_dir = cache_dir
        self._limit = memory_limit
        self._held: OrderedDict[str, PreparedMap] = OrderedDict()
        self._sizes: dict[str, int] = {}
        self._lock = Lock()
        self.contents: dict[str, str] = {}

    def get(self, map_id: str) -> PreparedMap:
        """Return a map; it is mapped from its files, or prepared, if it is not held.

        Raises
        ------
        InputError
            If there is no such map, or it cannot be used.
        """
        with self._lock:
            held = self._held.get(map_id)
        if held is None:
            if map_id not in self._maps:
                raise InputError(f"There is no map {map_id!r:.60} in this site. Check map_ids.")
            held = prepared(self._maps[map_id], self._cache_dir)
            self.contents[map_id] = held.content
        with self._lock:
            held = self._held.setdefault(map_id, held)
            self._held.move_to_end(map_id)
            # Fields are computed when they are used: what a map has grown by counts next time.
            self._sizes[map_id] = held.fields.nbytes
            while len(self._held) > 1 and self.held_bytes > self._limit:
                dropped, _ = self._held.popitem(last=False)
                del self._sizes[dropped]
        return held

    @property
    def held_bytes(self) -> int:
        """Size of the maps that are held, bytes."""
        return sum(self._sizes.values())


def prepared(entry: SiteMap, cache_dir: Path | None) -> PreparedMap:
    """Load a map; what is in the folder already is mapped, not computed.

    Parameters
    ----------
    entry : SiteMap
        The map.
    cache_dir : Path or None
        Folder of prepared maps; None reads the image and computes in memory.

    Raises
    ------
    MapError
        If the map cannot be read, or has nothing to be searched.
    """
    header = read_yaml(entry.path)
    key = cache.content_key("cells 1", _bytes_of(header.path), _bytes_of(header.image))
    if cache_dir is None:
        layers = _layers(entry.path)
    else:
        layers = cache.load_or_build(key, lambda: _layers(entry.path), cache_dir, limit=None)
    grid = _grid_of(layers, header)
    # The tables of the exhaustive search would take most of the memory of a site.
    fields = MapFields(grid, cache_dir, key, cache_limit=None, most_positions=0)
    check_positions(fields)
    return PreparedMap(entry, fields)


def _bytes_of(path: Path) -> NDArray[np.uint8]:
    """Map a file into memory; a damaged image may be of any size."""
    try:
        if path.stat().st_size == 0:
            return np.empty(0, np.uint8)
        return np.memmap(path, np.uint8, "r")
    except OSError as error:
        raise unreachable(path, error) from error


def _layers(path: Path) -> NDArray[np.int8]:
    """Read a map as one array: its cells and, where the file has them, its unseen cells."""
    grid = load_map(path)
    check_searchable(grid)
    layers = [grid.cells] if grid.unseen is None else [grid.cells, grid.unseen.view(np.int8)]
    return np.stack(layers)


def _grid_of(layers: NDArray[np.int8], header: MapYaml) -> OccupancyGrid:
    unseen = layers[1].view(np.bool_) if len(layers) > 1 else None
    return OccupancyGrid(layers[0], header.resolution, header.T_map_grid, unseen)
