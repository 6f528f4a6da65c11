"""The maps that the fleet control can name."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from firstfix.core.errors import InputError
from firstfix.core.grid import OccupancyGrid
from firstfix.global_localization.searchable import check_searchable
from firstfix.io.maps.map_server import load_map
from firstfix.io.saved_pose import map_key
from firstfix.vda5050.messages import LONGEST
from firstfix.vda5050.report import MapEntry

# Characters of the hash that is the version of a map without one.
_SHORT = 12


@dataclass(frozen=True, slots=True)
class MapName:
    """How the fleet control names a map; an empty version is the hash of its content."""

    id: str
    version: str = ""

    def __str__(self) -> str:
        return f"{self.id} version {self.version}" if self.version else self.id


@dataclass(frozen=True, eq=False, slots=True)
class KnownMap:
    """A map, and how the fleet control names it."""

    name: MapName
    key: str
    grid: OccupancyGrid | None = field(repr=False)  # None: the localizer has the maps of a site


def read_map_name(text: str) -> MapName:
    """Return the name in ``ID`` or ``ID@VERSION``.

    Raises
    ------
    InputError
        If a part is missing or too long.
    """
    id_, at, version = text.rpartition("@") if "@" in text else (text, "", "")
    if not id_ or (at and not version) or len(text) > LONGEST or not text.isprintable():
        raise InputError(
            expected=f"a map id, ID or ID@VERSION, of 1 to {LONGEST} characters",
            received=f"{text!r:.60}",
            remedy="write it as the fleet control does",
        )
    return MapName(id_, version)


def read_map(text: str) -> KnownMap:
    """Return the map of ``ID=MAP.yaml`` or ``ID@VERSION=MAP.yaml``.

    Raises
    ------
    InputError
        If the text or the map cannot be used.
    """
    name, equals, path = text.partition("=")
    if not equals or not path:
        raise InputError(
            expected="--vda5050-map as ID=MAP.yaml or ID@VERSION=MAP.yaml",
            received=f"{text!r:.60}",
            remedy="write the id of the fleet control before the file",
        )
    grid = load_map(Path(path))
    check_searchable(grid)
    return _known(read_map_name(name), grid)


class MapRegister:
    """The map in use, the others that are known, and which of them are enabled.

    Parameters
    ----------
    first : MapName
        Name of the first map that the localizer receives.
    others : sequence of KnownMap
        Maps that the fleet control can enable.

    Raises
    ------
    InputError
        If two maps have one name.
    """

    def __init__(self, first: MapName, others: Sequence[KnownMap] = ()) -> None:
        self._first = first
        self._known = list(others)
        self._enabled: set[MapName] = set()
        self.in_use: KnownMap | None = None
        self.has_site = False
        names = [first, *(known.name for known in others)]
        for name in names:
            if names.count(name) > 1:
                raise InputError(
                    expected="a different id or version for each map",
                    received=f"{name} twice",
                    remedy="add a version: ID@VERSION",
                )

    @property
    def id_in_use(self) -> str:
        """The id of the map in use; before the first map, the one that is expected."""
        return self._first.id if self.in_use is None else self.in_use.name.id

    @property
    def entries(self) -> tuple[MapEntry, ...]:
        """All known maps."""
        return tuple(
            MapEntry(known.name.id, known.name.version, known.name in self._enabled)
            for known in self._known
        )

    def receive(self, grid: OccupancyGrid) -> None:
        """Note the map that the localizer uses from now on.

        A map of unknown content, after the first, gets a name of its own: its poses must not
        appear on another map.
        """
        key = map_key(grid)
        known = next((known for known in self._known if known.key == key), None)
        if known is None:
            is_first = self.in_use is None
            name = self._first if is_first else MapName(f"unknown-{key[:_SHORT]}")
            known = _known(name, grid, key)
            if is_first:
                self._known.insert(0, known)
        self.in_use = known
        self.enable(known)

    def receive_site(self, contents: Mapping[str, str], map_id: str | None) -> None:
        """Note the maps of a site, all enabled, and the one in use.

        Parameters
        ----------
        contents : mapping of str to str
            Hash of each map, by id.
        map_id : str or None
            The map in use; None before the first.
        """
        if not self.has_site:
            self.has_site = True
            self._known = [
                KnownMap(MapName(name, key[:_SHORT]), key, None) for name, key in contents.items()
            ]
            self._enabled = {known.name for known in self._known}
        self.in_use = next((known for known in self._known if known.name.id == map_id), None)

    def find(self, name: MapName) -> KnownMap | None:
        """Return a map by id and version; None if it is not known."""
        return next((known for known in self._known if known.name == name), None)

    def enabled(self, id_: str) -> KnownMap | None:
        """Return the enabled map of an id; None if there is none."""
        return next((k for k in self._known if k.name.id == id_ and k.name in self._enabled), None)

    def enable(self, known: KnownMap) -> None:
        """Enable a known map, and disable the other versions of its id."""
        self._enabled = {name for name in self._enabled if name.id != known.name.id}
        self._enabled.add(known.name)


def _known(name: MapName, grid: OccupancyGrid, key: str | None = None) -> KnownMap:
    key = map_key(grid) if key is None else key
    return KnownMap(MapName(name.id, name.version or key[:_SHORT]), key, grid)
