"""The maps of a site: a folder of map_server maps, or a ``site.yaml`` that describes them.

::

    maps:
      ground: ground/map.yaml
      first: {map: first.yaml, building: A, floor: 1, pose: [0, 0, 0]}
    transitions:
      lift: {kind: lift, ends: [{map: ground, pose: [1, 2, 0]}, {map: first, pose: [1, 2, 0]}]}

Only ``maps`` is required. ``pose`` is the pose of a map in a frame that all maps of the site share.
"""

from __future__ import annotations

import math
import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from firstfix.core.errors import InputError, MapError
from firstfix.core.se2 import SE2
from firstfix.io.atomic_files import is_file, read_bytes, show
from firstfix.io.maps.map_yaml import MAX_YAML_BYTES
from firstfix.io.maps.zones import Polygon, zones_of
from firstfix.io.safe_yaml import Repeated, entries, kind, load_mapping

SITE_FILE = "site.yaml"

_EXAMPLE = "maps: {ground: ground/map.yaml}"
_MAP_EXAMPLE = "ground: {map: ground/map.yaml, building: A, floor: 0}"
_TRANSITION_EXAMPLE = (
    "lift: {ends: [{map: ground, pose: [1, 2, 0]}, {map: first, pose: [1, 2, 0]}]}"
)
# PyYAML needs a second for 32 kB of the worst text; a thousand maps take about 100 kB.
_MAX_BYTES = 1_000_000
_MAX_FILES = 100_000
_MAP_KEYS = ("map", "building", "floor", "pose", "zones")
_SUFFIXES = (".yaml", ".yml")


@dataclass(frozen=True, eq=False)
class SiteMap:
    """One map of a site, as its files describe it.

    Parameters
    ----------
    id : str
        Name of the map, unique in its site.
    path : Path
        YAML of the map.
    building, floor : str or None
        Where the map is; None if that is not known.
    T_site_map : SE2 or None
        Pose of the map in the frame of the site; None if that is not known.
    zones : dict of str to polygon
        Named regions, corners (x, y) in the map frame, m.
    """

    id: str
    path: Path
    building: str | None = None
    floor: str | None = None
    T_site_map: SE2 | None = None
    zones: dict[str, Polygon] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class TransitionEnd:
    """Where a transition meets a map: ``T_map_base`` of a robot in it."""

    map_id: str
    pose: SE2


@dataclass(frozen=True, slots=True)
class Transition:
    """A lift, door or ramp by which a robot gets from one map to another.

    Parameters
    ----------
    id : str
        Name.
    kind : str
        Such as ``lift`` or ``door``.
    ends : tuple of TransitionEnd
        One for each map, at least two.
    """

    id: str
    kind: str
    ends: tuple[TransitionEnd, ...]


@dataclass(frozen=True, eq=False)
class SiteDescription:
    """The maps of a site and how they are connected; no image is read yet."""

    maps: tuple[SiteMap, ...]
    transitions: tuple[Transition, ...] = ()


def read_site(path: str | os.PathLike[str]) -> SiteDescription:
    """Read what belongs to a site.

    Parameters
    ----------
    path : path-like
        A ``site.yaml``, a folder that contains one, or a folder of map_server maps.

    Returns
    -------
    SiteDescription
        In a folder without ``site.yaml`` a map's id is its path without ``.yaml`` or ``/map.yaml``.

    Raises
    ------
    InputError
        If there is no such file or folder, no map in it, or the file has a fault.
    """
    given = Path(path)
    if is_file(given):
        return _described(given)
    try:
        if not given.is_dir():
            raise InputError(f"There is no folder or file {show(str(path))}. Check the path.")
    except ValueError as error:
        raise InputError(
            f"There is no folder or file {show(str(path))}. Check the path."
        ) from error
    if is_file(given / SITE_FILE):
        return _described(given / SITE_FILE)
    return _found(given)


def _found(folder: Path) -> SiteDescription:
    """Find the maps in a folder."""
    files = sorted(
        file
        for file, _ in zip(folder.rglob("*.y*ml"), range(_MAX_FILES), strict=False)
        if file.suffix in _SUFFIXES and is_file(file) and _is_map(file)
    )
    if not files:
        raise InputError(
            f"There is no map in {show(str(folder))}. Give a folder of map_server maps "
            f"(YAML and image), or write a {SITE_FILE}."
        )
    named: dict[str, Path] = {}
    for file in files:
        inside = file.relative_to(folder)
        own = inside.stem == "map" and len(inside.parts) > 1
        name = (inside.parent if own else inside.with_suffix("")).as_posix()
        if name in named:
            raise InputError(
                f"Two maps have the id {show(name)}: {named[name]} and {file}. Rename one of them."
            )
        named[name] = file
    return SiteDescription(tuple(SiteMap(name, file) for name, file in named.items()))


def _is_map(file: Path) -> bool:
    """Tell maps, also broken ones, from other YAML files."""
    try:
        text = file.read_bytes()[:MAX_YAML_BYTES]
    except OSError:
        return True  # named among the faults when it is loaded
    return b"image:" in text and b"resolution:" in text


def _described(file: Path) -> SiteDescription:
    """Read a ``site.yaml``."""
    data = read_bytes(file, what="a site", limit=_MAX_BYTES)
    top = entries(load_mapping(data, file, example=_EXAMPLE), file)
    maps = top.get("maps")
    if not isinstance(maps, dict) or not maps:
        raise InputError(f"{file} has no maps. Write a line like '{_EXAMPLE}'.")
    for name, value in maps.items():
        if isinstance(value, Repeated):
            raise InputError(
                f"Two maps in {file} have the id {show(str(name))}. Rename one of them."
            )
    unknown = sorted(set(top) - {"site", "maps", "transitions"})
    if unknown:
        raise InputError(
            f"{file} has an unknown key {show(unknown[0])}. "
            "The keys are site, maps and transitions."
        )
    found = tuple(_map_of(str(name), value, file) for name, value in maps.items())
    known = {one.id for one in found}
    if len(known) < len(found):
        raise InputError(f"Two maps in {file} have the same id. Rename one of them.")
    transitions = top.get("transitions") or {}
    if not isinstance(transitions, dict):
        raise InputError(
            f"The transitions in {file} cannot be read. Write a line like '{_TRANSITION_EXAMPLE}'."
        )
    return SiteDescription(
        found,
        tuple(
            _transition_of(name, value, known, file)
            for name, value in entries(transitions, file).items()
        ),
    )


def _map_of(name: str, value: Any, file: Path) -> SiteMap:
    if isinstance(value, str):
        return SiteMap(name, file.parent / value)
    wrong = MapError(
        f"The map {show(name)} in {file} cannot be read: {kind(value)}. "
        f"Write a line like '{_MAP_EXAMPLE}'."
    )
    if not isinstance(value, dict):
        raise wrong
    given = entries(value, file)
    if not isinstance(given.get("map"), str):
        raise MapError(
            f"The map {show(name)} in {file} names no file. Write a line like '{_MAP_EXAMPLE}'."
        )
    unknown = sorted(set(given) - set(_MAP_KEYS))
    if unknown:
        raise MapError(
            f"The map {show(name)} in {file} has an unknown key {show(unknown[0])}. "
            f"The keys are {', '.join(_MAP_KEYS)}."
        )
    pose = given.get("pose")
    return SiteMap(
        id=name,
        path=file.parent / given["map"],
        building=_text(given.get("building")),
        floor=_text(given.get("floor")),
        T_site_map=None if pose is None else _pose_of(pose, f"the map {show(name)}", file),
        zones=zones_of(given["zones"], file) if given.get("zones") is not None else {},
    )


def _transition_of(name: str, value: Any, known: set[str], file: Path) -> Transition:
    ends = entries(value, file).get("ends") if isinstance(value, dict) else None
    if not isinstance(ends, list) or len(ends) < 2:
        raise InputError(
            f"The transition {show(name)} in {file} has not two ends. "
            f"Write a line like '{_TRANSITION_EXAMPLE}'."
        )
    read = []
    for end in ends:
        map_id = str(entries(end, file).get("map")) if isinstance(end, dict) else None
        if map_id not in known:
            raise InputError(
                f"The transition {show(name)} in {file} leads to the map {show(map_id)}, which is "
                f"not among the maps. Choose one of {_listed(known)}."
            )
        read.append(
            TransitionEnd(map_id, _pose_of(end.get("pose"), f"the transition {show(name)}", file))
        )
    return Transition(name, str(value.get("kind", "transition")), tuple(read))


def _listed(known: set[str]) -> str:
    names = sorted(known)
    return ", ".join(names[:5]) + (", ..." if len(names) > 5 else "")


def _pose_of(value: Any, owner: str, file: Path) -> SE2:
    if (
        isinstance(value, list)
        and len(value) == 3
        and all(type(v) in (int, float) and math.isfinite(v) for v in value)
    ):
        return SE2(*map(float, value))
    raise InputError(
        f"The pose of {owner} in {file} is {kind(value)}. "
        "Write [x, y, yaw] in metres and radians, such as [1.0, 2.0, 0.0]."
    )


def _text(value: Any) -> str | None:
    return None if value is None else str(value)
