"""A ``site.yaml`` to begin with: the maps of a folder, and what a person has to fill in."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import yaml

from firstfix.core.errors import InputError
from firstfix.io.atomic_files import is_file, replace_file, show
from firstfix.io.maps.site_yaml import SITE_FILE, SiteMap, read_site
from firstfix.io.maps.zones import load_zones

_HEAD = """\
# The maps of a site. Add to each where it is, so that alike floors are not taken for copies:
#   {map: ground/map.yaml, building: A, floor: 0}
# and, if it is known, the pose of the map in a frame that all maps share: pose: [x, y, yaw].
"""
_TAIL = """\
# Lifts, doors and ramps: the pose [x, y, yaw] of a robot in them, m and rad, in each of the maps.
# transitions:
#   lift: {kind: lift, ends: [{map: %s, pose: [0, 0, 0]}, {map: %s, pose: [0, 0, 0]}]}
"""
_LINE = 1000  # characters: one map, one line


def write_site_skeleton(folder: str | os.PathLike[str]) -> Path:
    """Write the ``site.yaml`` of a folder of maps; transitions are left to be filled in.

    Parameters
    ----------
    folder : path-like
        A folder of map_server maps. The zones of ``hall.zones.yaml`` are those of ``hall.yaml``.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        If the folder has a ``site.yaml``, no maps, or faulty zones, or the file cannot be written.
    """
    path = Path(folder) / SITE_FILE
    if is_file(Path(folder)) or is_file(path):
        raise InputError(f"{show(str(folder))} has a {SITE_FILE} already. Edit that one.")
    maps = read_site(folder).maps
    described = {"maps": {one.id: _described(one, Path(folder)) for one in maps}}
    text = yaml.safe_dump(
        described, sort_keys=False, default_flow_style=None, allow_unicode=True, width=_LINE
    )
    ends = (_word(maps[0].id), _word(maps[-1].id))
    replace_file(path, [f"{_HEAD}{text}{_TAIL % ends}".encode()])
    return path


def _described(one: SiteMap, folder: Path) -> dict[str, Any]:
    entry: dict[str, Any] = {"map": one.path.relative_to(folder).as_posix()}
    if not is_file(one.path.with_suffix(".zones.yaml")):
        return entry
    zones = load_zones(one.path)
    return {**entry, "zones": {name: [list(c) for c in zones[name]] for name in zones}}


def _word(text: str) -> str:
    """Write a name as YAML does."""
    return yaml.safe_dump(text, width=_LINE, allow_unicode=True).partition("\n")[0]
