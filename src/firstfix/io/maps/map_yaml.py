"""The YAML file of a map: name of the image, resolution, origin, thresholds."""

from __future__ import annotations

import difflib
import os
import sys
from contextlib import suppress
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Any

from firstfix.core.errors import InputError, MapError
from firstfix.core.se2 import SE2
from firstfix.io.atomic_files import is_file, read_bytes, show
from firstfix.io.maps.image import MAGICS
from firstfix.io.safe_yaml import entries, kind, load_mapping, load_yaml

# Every key of the format with a valid line.
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

# A real one is a few hundred bytes; PyYAML needs up to a second for this many.
MAX_YAML_BYTES = 32_768

_SUFFIXES = (".yaml", ".yml")
_IMAGE_SUFFIXES = (".pgm", ".png", ".bmp", ".jpg", ".jpeg", ".tif", ".tiff", ".gif", ".ppm")


class MapMode(Enum):
    """How map_server turns the brightness of a pixel into a cell."""

    TRINARY = "trinary"
    SCALE = "scale"
    RAW = "raw"


@dataclass(frozen=True, slots=True)
class MapYaml:
    """Content of the YAML of a map.

    Parameters
    ----------
    path, image : Path
        The YAML and the image that it names.
    resolution : float
        Side of a cell, m.
    T_map_grid : SE2
        Pose of the lower-left corner of the image in the map frame.
    negate : bool
        Bright pixels are the occupied ones.
    occupied_thresh, free_thresh : float
        Occupancy, 0 to 1: from `occupied_thresh` up a cell is a wall, up to `free_thresh` free.
    mode : MapMode
        Trinary if the file has no mode.
    keys : tuple of str
        All keys of the file in their order, known or unknown.
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
    """Read and check the YAML of a map.

    Parameters
    ----------
    path : path-like
        The YAML, or a folder with ``map.yaml`` or a single other YAML in it.

    Returns
    -------
    MapYaml
        Checked values. The image exists, but is not read yet.

    Raises
    ------
    MapError
        If there is no such file, it is not YAML, or a key is missing or wrong.
    """
    found = find_yaml(Path(path))
    keys = _Keys(found, _read_entries(found))
    for key in EXAMPLES:
        if key != "mode":  # the only key that map_server does not require
            keys.value(key)
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
        keys=tuple(keys.values),
    )


def find_yaml(path: Path) -> Path:
    """Find the YAML of a map: the path itself, or ``map.yaml`` or the only YAML of a folder.

    Raises
    ------
    MapError
        If there is none, or more than one to choose from.
    """
    if is_file(path):
        return path
    try:
        inside = sorted(p for p in path.iterdir() if p.suffix in _SUFFIXES and is_file(p))
    except (OSError, ValueError):  # not a folder
        raise MapError(
            expected="the YAML of a map",
            received=f"no file {show(str(path))}",
            remedy=_yaml_remedy(Path(f"{path}.yaml"), "check the path"),
        ) from None
    found = [p for p in inside if p.name == "map.yaml"] or inside
    if len(found) != 1:
        names = " and ".join(p.name for p in found[:3]) or "no YAML"
        raise MapError(
            expected="a folder with one map.yaml",
            received=f"{path} with {names}",
            remedy="pass the path of the .yaml itself",
        )
    return found[0]


def _yaml_remedy(path: Path, otherwise: str) -> str:
    """Return which file to pass, if there is a YAML of this name."""
    found = [p for p in (path.with_suffix(suffix) for suffix in _SUFFIXES) if is_file(p)]
    return f"pass {found[0]}" if found else otherwise


def _read_entries(path: Path) -> dict[str, Any]:
    try:
        data = read_bytes(path, what="the YAML of a map", limit=MAX_YAML_BYTES)
        if not (path.suffix.lower() in _IMAGE_SUFFIXES or data.startswith(MAGICS)):
            return entries(load_mapping(data, path, example=EXAMPLES["image"]), path)
    except InputError as error:
        raise MapError(
            expected=error.expected, received=error.received, remedy=error.remedy
        ) from error
    raise MapError(
        expected="the YAML of a map",
        received=f"an image, {path}",
        remedy=_yaml_remedy(path, "write a .yaml beside it that names it"),
    )


def find_image(yaml: Path, name: str) -> Path:
    """Find the image that a YAML names, relative to the YAML.

    Raises
    ------
    MapError
        If there is no such file.
    """
    image = yaml.parent / name
    if is_file(image):
        return image
    near = Path(name).name
    raise MapError(
        expected=f"an image at the path of 'image:' in {yaml}",
        received=f"no file {show(str(image))}" if name else "an empty name",
        remedy=f"write 'image: {near}'"
        if near and is_file(yaml.parent / near)
        else "give the path of the image relative to the YAML",
    )


def check_resolution(resolution: float, path: Path) -> float:
    """Return the side of a cell, m, if it is plausible.

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
    """The entries of one file."""

    path: Path
    values: dict[str, Any]

    def wrong(self, key: str, expected: str, received: str) -> MapError:
        return MapError(
            expected=f"{expected} in {self.path}",
            received=received,
            remedy=f"write it like '{EXAMPLES[key]}'",
        )

    def value(self, key: str) -> Any:
        """Return a value; text in quotes is read again, because map_server ignores quotes."""
        if key in self.values:
            return _unquoted(self.values[key])
        near = difflib.get_close_matches(key, [k for k in self.values if k not in EXAMPLES], 1)
        raise MapError(
            expected=f"the key {key} in {self.path}",
            received=f"only {show(', '.join(self.values))}",
            remedy=f"rename {show(near[0])}" if near else f"add a line like '{EXAMPLES[key]}'",
        )

    def text(self, key: str) -> str:
        if isinstance(self.values[key], (list, dict)):
            raise self.wrong(key, f"one value for {key}", kind(self.values[key]))
        return "" if self.values[key] is None else str(self.values[key]).strip()

    def number(self, key: str) -> float:
        return self._to_number(key, self.value(key))

    def _to_number(self, key: str, value: Any) -> float:
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise self.wrong(key, f"a finite number for {key}", kind(value))
        if not abs(value) <= sys.float_info.max:
            raise self.wrong(key, f"a finite number for {key}", show(value))
        return float(value)

    def threshold(self, key: str) -> float:
        value = self.number(key)
        if not 0.0 <= value <= 1.0:
            raise self.wrong(key, f"a {key} from 0 to 1", f"{value}")
        return value

    def pose(self, key: str) -> SE2:
        items = self.value(key)
        if not isinstance(items, list) or len(items) != 3:
            raise self.wrong(key, f"a list of three numbers x, y, yaw for {key}", show(items))
        return SE2(*(self._to_number(key, _unquoted(item)) for item in items))

    def flag(self, key: str) -> bool:
        value = self.value(key)
        if not isinstance(value, int):  # bool is one
            raise self.wrong(key, f"0, 1, true or false for {key}", kind(value))
        return value != 0

    def mode(self) -> MapMode:
        if "mode" not in self.values:
            return MapMode.TRINARY
        text = self.text("mode").lower()
        if text not in {mode.value for mode in MapMode}:
            raise self.wrong("mode", "mode trinary, scale or raw", show(text))
        return MapMode(text)


def _unquoted(value: Any) -> Any:
    if not isinstance(value, str):
        return value
    with suppress(InputError):
        return load_yaml(value, Path(), example="")
    return value
