"""Maps from files, at the start and by a service."""

from __future__ import annotations

from pathlib import Path
from urllib.parse import unquote, urlsplit

from firstfix.core.errors import MapError
from firstfix.global_localization.searchable import check_searchable
from firstfix.io.maps.map_server import load_map
from firstfix.io.maps.map_yaml import read_yaml
from firstfix.localizer.inputs import NewMap
from firstfix.ros.services import LoadResult
from firstfix.site.site import Site

_FOLDER_FILE = "map"


def map_from(path: Path) -> NewMap:
    """Load a map that can be searched.

    Parameters
    ----------
    path : Path
        The YAML, or a folder with it.

    Returns
    -------
    NewMap
        At time 0, named like its file without the suffix, or like its folder if the file is
        ``map.yaml``.

    Raises
    ------
    MapError
        If it cannot be used.
    """
    grid = load_map(path)
    check_searchable(grid)
    return NewMap(0.0, grid, _name(path))


def map_at(path: Path, site: Site) -> str | None:
    """Return the id of the map of a site that a path names; None if it is none of them.

    Parameters
    ----------
    path : Path
        The YAML, or a folder with it.
    site : Site
        The maps.
    """
    asked = _yaml_of(path).resolve()
    found = (name for name, entry in site.maps.items() if entry.path.resolve() == asked)
    return next(found, None)


def path_of(url: str) -> Path:
    """Return the path that the ``map_url`` of a request names.

    Parameters
    ----------
    url : str
        A path, or a URL ``file:///...``.

    Returns
    -------
    Path
        Not checked.

    Raises
    ------
    MapError
        If the URL has another scheme.
    """
    if "://" not in url:
        return Path(url)
    parts = urlsplit(url)
    if parts.scheme != "file" or parts.netloc not in ("", "localhost"):
        raise MapError(
            expected="a path or a URL like file:///home/me/floor1.yaml",
            received=f"{url!r:.80}",
            remedy="write the absolute path of the YAML",
        )
    return Path(unquote(parts.path))


def result_of(path: Path) -> LoadResult:
    """Return why a map cannot be loaded, in the terms of ``LoadMap``.

    Parameters
    ----------
    path : Path
        A map that `map_from` refused.

    Returns
    -------
    LoadResult
        Not SUCCESS.
    """
    try:
        read_yaml(path)
    except MapError:
        is_there = _exists(path)
        return LoadResult.INVALID_MAP_METADATA if is_there else LoadResult.MAP_DOES_NOT_EXIST
    return LoadResult.INVALID_MAP_DATA


def _yaml_of(path: Path) -> Path:
    return path if path.suffix in (".yaml", ".yml") else path / f"{_FOLDER_FILE}.yaml"


def _name(path: Path) -> str:
    named = _yaml_of(path)
    return named.absolute().parent.name if named.stem == _FOLDER_FILE else named.stem


def _exists(path: Path) -> bool:
    try:
        return path.exists()
    except (OSError, ValueError):  # too long, or with NUL
        return False
