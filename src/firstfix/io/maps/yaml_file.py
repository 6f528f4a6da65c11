"""The YAML half of a map_server map: which image, how wide a cell, where the map lies."""

from __future__ import annotations

import difflib
import math
import os
import re
from dataclasses import dataclass
from enum import Enum
from pathlib import Path

import yaml

from firstfix.core.errors import MapError
from firstfix.core.se2 import SE2
from firstfix.io.maps.files import find_image, find_yaml, show
from firstfix.io.maps.yaml_nodes import read_nodes
from firstfix.io.safe_yaml import kind, to_flag, to_number

# Every key of the format with a line that would be right.
EXAMPLES = {
    "image": "image: map.pgm",
    "resolution": "resolution: 0.05",
    "origin": "origin: [0.0, 0.0, 0.0]",
    "negate": "negate: 0",
    "occupied_thresh": "occupied_thresh: 0.65",
    "free_thresh": "free_thresh: 0.196",
    "mode": "mode: trinary",
}

# Beyond these a length is in the wrong unit, and its square may leave the floats.
MIN_RESOLUTION, MAX_RESOLUTION = 1e-4, 1e3

_INTEGER = re.compile(r"[-+]?[0-9]+")


class MapMode(Enum):
    """How map_server turns the brightness of a pixel into a cell."""

    TRINARY = "trinary"
    SCALE = "scale"
    RAW = "raw"


@dataclass(frozen=True, slots=True)
class MapYaml:
    """What the YAML of a map says.

    Parameters
    ----------
    path, image : Path
        The YAML itself and the image it names.
    resolution : float
        Side of a cell, m.
    T_map_grid : SE2
        Pose of the lower-left corner of the image in the map frame.
    negate : bool
        Bright pixels are the occupied ones.
    occupied_thresh, free_thresh : float
        Occupancy, 0 to 1, from which a cell is wall and up to which it is free.
    mode : MapMode
        Trinary where the file does not say.
    keys : tuple of str
        All keys of the file, in its order, known or not.
    """

    path: Path
    image: Path
    resolution: float
    T_map_grid: SE2
    negate: bool
    occupied_thresh: float
    free_thresh: float
    mode: MapMode
    keys: tuple[str, ...]


def read_yaml(path: str | os.PathLike[str]) -> MapYaml:
    """Read the YAML of a map, and refuse what no server could use.

    Parameters
    ----------
    path : path-like
        The YAML, or a folder with ``map.yaml`` or a single other YAML in it.

    Returns
    -------
    MapYaml
        Checked values; the image exists, but nobody has looked into it yet.

    Raises
    ------
    MapError
        If there is no such file, it is not YAML, or a key is missing or wrong.
    """
    found = find_yaml(Path(path))
    keys = _Keys(found, read_nodes(found))
    for key in EXAMPLES:
        if key != "mode":  # trinary where missing; the servers, too, insist on all others
            keys.node(key)
    free, occupied = keys.threshold("free_thresh"), keys.threshold("occupied_thresh")
    if free >= occupied:
        received = f"free_thresh {free} and occupied_thresh {occupied}"
        raise keys.wrong("free_thresh", "a free_thresh below occupied_thresh", received)
    return MapYaml(
        path=found,
        image=find_image(found, keys.text("image")),
        resolution=check_resolution(keys.number("resolution"), found),
        T_map_grid=keys.pose("origin"),
        negate=keys.flag("negate"),
        occupied_thresh=occupied,
        free_thresh=free,
        mode=keys.mode(),
        keys=tuple(keys.nodes),
    )


def check_resolution(resolution: float, path: Path) -> float:
    """Return the side of a cell, m, unless no map can have it.

    Raises
    ------
    MapError
        If it is outside `MIN_RESOLUTION` to `MAX_RESOLUTION`.
    """
    if not MIN_RESOLUTION <= resolution <= MAX_RESOLUTION:
        raise MapError(
            expected=f"a resolution of {MIN_RESOLUTION:g} to {MAX_RESOLUTION:g} m in {path}",
            received=f"{resolution}",
            remedy=f"give the side of a cell in metres, like '{EXAMPLES['resolution']}'",
        )
    return resolution


@dataclass(frozen=True, slots=True)
class _Keys:
    """The entries of one file, read as the servers do: from their text, quoted or not."""

    path: Path
    nodes: dict[str, yaml.Node]

    def wrong(self, key: str, expected: str, received: str) -> MapError:
        return MapError(
            expected=f"{expected} in {self.path}",
            received=received,
            remedy=f"write it like '{EXAMPLES[key]}'",
        )

    def node(self, key: str) -> yaml.Node:
        if key in self.nodes:
            return self.nodes[key]
        near = difflib.get_close_matches(key, [k for k in self.nodes if k not in EXAMPLES], 1)
        raise MapError(
            expected=f"the key {key} in {self.path}",
            received=f"only {show(', '.join(self.nodes))}",
            remedy=f"rename {show(near[0])}" if near else f"add a line like '{EXAMPLES[key]}'",
        )

    def text(self, key: str) -> str:
        node = self.node(key)
        if not isinstance(node, yaml.ScalarNode):
            raise self.wrong(key, f"one value for {key}", kind(node))
        return str(node.value).strip()

    def number(self, key: str) -> float:
        return self._to_number(key, self.text(key))

    def _to_number(self, key: str, text: str) -> float:
        number = to_number(text)
        if not math.isfinite(number):
            raise self.wrong(key, f"a finite number for {key}", show(text))
        return number

    def threshold(self, key: str) -> float:
        value = self.number(key)
        if not 0.0 <= value <= 1.0:
            raise self.wrong(key, f"a {key} from 0 to 1", f"{value}")
        return value

    def pose(self, key: str) -> SE2:
        node = self.node(key)
        items = node.value if isinstance(node, yaml.SequenceNode) else [node]
        texts = [item.value for item in items if isinstance(item, yaml.ScalarNode)]
        if len(items) != 3 or len(texts) != 3:
            expected = f"a list of three numbers x, y, yaw for {key}"
            raise self.wrong(key, expected, show(texts))
        return SE2(*(self._to_number(key, text.strip()) for text in texts))

    def flag(self, key: str) -> bool:
        text = self.text(key)
        if _INTEGER.fullmatch(text):
            return text.strip("+-0") != ""
        flag = to_flag(text)
        if flag is None:
            raise self.wrong(key, f"0, 1, true or false for {key}", show(text))
        return flag

    def mode(self) -> MapMode:
        if "mode" not in self.nodes:
            return MapMode.TRINARY
        text = self.text("mode").lower()
        if text not in {mode.value for mode in MapMode}:
            raise self.wrong("mode", "mode trinary, scale or raw", show(text))
        return MapMode(text)
