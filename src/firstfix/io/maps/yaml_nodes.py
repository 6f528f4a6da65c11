"""The entries of a map's YAML, not yet given a meaning."""

from __future__ import annotations

from pathlib import Path

import yaml

from firstfix.core.errors import InputError, MapError
from firstfix.io.maps.files import read_yaml_bytes
from firstfix.io.safe_yaml import entries, parse_yaml


def read_nodes(path: Path) -> dict[str, yaml.Node]:
    """Read the top-level entries of a YAML; nothing is constructed, whatever its tag.

    Parameters
    ----------
    path : Path
        A regular file.

    Returns
    -------
    dict of str to yaml.Node
        In the order of the file; scalars keep their text.

    Raises
    ------
    MapError
        If it cannot be read, is no YAML mapping, uses aliases, or gives a key twice.
    """
    data = read_yaml_bytes(path)
    try:
        return entries(parse_yaml(data, path, example="image: map.pgm"), path)
    except InputError as error:
        raise MapError(
            expected=error.expected, received=error.received, remedy=error.remedy
        ) from error
