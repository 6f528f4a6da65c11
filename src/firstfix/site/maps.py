"""Prepared maps, loaded on demand within a limit of memory."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Mapping
from pathlib import Path
from threading import Lock

from firstfix.core.errors import InputError
from firstfix.fields.map_fields import MapFields
from firstfix.global_localization.searchable import check_positions, check_searchable
from firstfix.io.maps.map_server import load_map
from firstfix.io.maps.site_yaml import SiteMap


class PreparedMaps:
    """The fields of maps by their ids; the least recently used are dropped.

    Parameters
    ----------
    maps : mapping of str to SiteMap
        The maps of the site.
    cache_dir : Path or None
        Folder of prepared maps; None prepares in memory.
    memory_limit : int
        Size of the fields that are held, bytes; at least one map is.
    """

    def __init__(
        self, maps: Mapping[str, SiteMap], cache_dir: Path | None, memory_limit: int
    ) -> None:
        self._maps = maps
        self._cache_dir = cache_dir
        self._limit = memory_limit
        self._held: OrderedDict[str, MapFields] = OrderedDict()
        self._lock = Lock()

    def get(self, map_id: str) -> MapFields:
        """Return the fields of a map; they are loaded, or prepared, if they are not held.

        Raises
        ------
        InputError
            If there is no such map, or it cannot be used.
        """
        with self._lock:
            held = self._held.get(map_id)
            if held is not None:
                self._held.move_to_end(map_id)
                return held
        if map_id not in self._maps:
            raise InputError(f"There is no map {map_id!r:.60} in this site. Check map_ids.")
        fields = self._prepared(self._maps[map_id])
        with self._lock:
            self._held[map_id] = fields
            self._held.move_to_end(map_id)
            while len(self._held) > 1 and self.held_bytes > self._limit:
                self._held.popitem(last=False)
        return fields

    @property
    def held_bytes(self) -> int:
        """Size of the maps that are held, bytes."""
        return sum(_size(fields) for fields in self._held.values())

    def _prepared(self, entry: SiteMap) -> MapFields:
        grid = load_map(entry.path)
        check_searchable(grid)
        fields = MapFields(grid, self._cache_dir)
        check_positions(fields)
        fields.compute("squares", "clearance", "endpoints", "ranges")
        return fields


def _size(fields: MapFields) -> int:
    arrays = (fields.squares, fields.clearance, fields.endpoints.values, fields.ranges)
    # cells, and the masks of occupied, free and unknown cells
    return sum(array.nbytes for array in arrays) + 4 * fields.grid.cells.size
