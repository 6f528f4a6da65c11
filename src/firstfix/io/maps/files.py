"""Finding the two files of a map, with a helpful word where a user named the wrong one."""

from __future__ import annotations

import reprlib
from pathlib import Path

from firstfix.core.errors import MapError

# A real one is a few hundred bytes; the scanner of PyYAML needs up to a second for this many.
MAX_YAML_BYTES = 32_768

_SUFFIXES = (".yaml", ".yml")
_IMAGE_SUFFIXES = (".pgm", ".png", ".bmp", ".jpg", ".jpeg", ".tif", ".tiff", ".gif", ".ppm")
_IMAGE_STARTS = (b"P2\n", b"P5\n", b"\x89PNG", b"BM", b"\xff\xd8\xff", b"GIF8", b"II*\0", b"MM\0*")


def find_yaml(path: Path) -> Path:
    """Find the YAML of a map.

    Parameters
    ----------
    path : Path
        The YAML, or a folder with ``map.yaml`` or a single other YAML in it.

    Returns
    -------
    Path
        A regular file.

    Raises
    ------
    MapError
        If there is none, or more than one to choose from.
    """
    if is_file(path):
        return path
    try:
        inside = sorted(p for p in path.iterdir() if p.suffix in _SUFFIXES and is_file(p))
    except (OSError, ValueError):  # no folder either
        beside = [p for p in (Path(f"{path}{suffix}") for suffix in _SUFFIXES) if is_file(p)]
        raise MapError(
            expected="the YAML of a map",
            received=f"no file {show(str(path))}",
            remedy=f"pass {beside[0]}" if beside else "check the path",
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


def read_yaml_bytes(path: Path) -> bytes:
    """Read a whole YAML, at most `MAX_YAML_BYTES`.

    Raises
    ------
    MapError
        If it cannot be read, is too large, or is the image of a map.
    """
    try:
        with path.open("rb") as file:
            data = file.read(MAX_YAML_BYTES + 1)
    except OSError as error:
        raise unreadable(path, error) from error
    if path.suffix.lower() in _IMAGE_SUFFIXES or data.startswith(_IMAGE_STARTS):
        beside = [p for p in (path.with_suffix(suffix) for suffix in _SUFFIXES) if is_file(p)]
        raise MapError(
            expected="the YAML of a map",
            received=f"an image, {path}",
            remedy=f"pass {beside[0]}" if beside else "write a .yaml beside it that names it",
        )
    if len(data) > MAX_YAML_BYTES:
        raise MapError(
            expected=f"the YAML of a map, at most {MAX_YAML_BYTES} bytes",
            received=f"a larger file, {path}",
            remedy="pass the small .yaml that names the image of the map",
        )
    return data


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
        expected=f"an image at the path that image: gives in {yaml}",
        received=f"no file {show(str(image))}" if name else "an empty name",
        remedy=f"write 'image: {near}'"
        if near and is_file(yaml.parent / near)
        else "give the path of the image relative to the YAML",
    )


def is_file(path: Path) -> bool:
    """Tell whether this is a regular file; a pipe or a device, which may never end, is none."""
    try:
        return path.is_file()
    except (OSError, ValueError):  # names that no file system can hold
        return False


def unreadable(path: Path, error: OSError) -> MapError:
    """Return the error for a file that is there but cannot be opened, read or written."""
    return MapError(
        expected=f"access to {path}",
        received=error.strerror or type(error).__name__,
        remedy="check the folder and its permissions",
    )


def show(value: object) -> str:
    """Return a short printable form of whatever a file held."""
    shortener = reprlib.Repr()
    shortener.maxstring = shortener.maxother = 100
    return shortener.repr(value)
