"""``python -m firstfix.web.file_worker FOLDER INDEX``: locate a scan of files that a viewer sent.

A process of its own, so that no file can take memory or time from a robot's localizer. It prints
one JSON object, or one sentence on stderr with exit status 2.
"""

from __future__ import annotations

import base64
import io
import sys
from contextlib import suppress
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import yaml

from firstfix.core.errors import FirstfixError, InputError
from firstfix.core.grid import OccupancyGrid
from firstfix.core.recording import Recording
from firstfix.global_localization.scan_matcher import ScanMatcher
from firstfix.global_localization.scoring import classify_beams
from firstfix.io.logs.load import load_recording
from firstfix.io.maps.map_server import load_map
from firstfix.io.safe_yaml import load_mapping
from firstfix.plots.map_image import greys_of_blocks

WRONG_INPUT = 2
NO_RETURN = 4
MAP_SUFFIXES = (".yaml", ".yml")
IMAGE_SUFFIXES = (".pgm", ".png", ".bmp", ".ppm", ".pbm")

# 200 x 200 m at 5 cm: a building. Its search takes some 300 MB.
MOST_CELLS = 16_000_000
_LIMIT = "Here the limit is 16 million. Use firstfix locate for larger maps."
MOST_PIXELS = 2048
# Scans of a log that can be chosen.
_MOST_SCANS = 5000
_MOST_MEMORY_BYTES = 6 * 2**30
_NICENESS = 10


def locate_files(folder: Path, index: int) -> dict[str, Any]:
    """Locate one scan of the log in a folder in the map beside it.

    Parameters
    ----------
    folder : Path
        With the YAML and the image of a map, and a log.
    index : int
        Which scan, from 0.

    Returns
    -------
    dict
        The fields of `firstfix.web.messages.LocatedFiles`.

    Raises
    ------
    InputError
        If a file is missing or cannot be used.
    """
    header, image, log = _sort(folder)
    grid = _load(header, image)
    recording = load_recording(log, max_scans=_MOST_SCANS)
    instants = recording.instants()
    if index >= len(instants):
        raise InputError(f"There is no scan {index}. The log has {len(instants)}, from 0.")
    scans = [recording.scans[i] for i in instants[index]]
    matcher = ScanMatcher(grid)
    result = matcher.locate(scans)
    ends, classes = np.empty((0, 2)), np.empty(0, np.uint8)
    if result.best is not None:
        beams = classify_beams(scans, result.best.pose, matcher.fields)
        ends, classes = beams.ends, np.where(beams.hit, beams.classes, np.uint8(NO_RETURN))
    return {
        "map": _map(grid, header.stem),
        "png": base64.b64encode(_png(grid)).decode(),
        "log": log.name,
        "scans": len(instants),
        "notes": _notes(recording),
        "ends": np.round(ends, 4).tolist(),
        "classes": classes.tolist(),
        "answer": result.to_dict(index),
    }


def _sort(folder: Path) -> tuple[Path, Path, Path]:
    """Tell the YAML, the image and the log apart."""
    files = sorted(folder.iterdir())
    headers = [path for path in files if path.suffix.lower() in MAP_SUFFIXES]
    images = [path for path in files if path.suffix.lower() in IMAGE_SUFFIXES]
    logs = [path for path in files if path not in (*headers, *images)]
    for kind, found in (("YAML of a map", headers), ("image of a map", images), ("log", logs)):
        if len(found) != 1:
            raise InputError(f"There must be one {kind}, not {len(found)}. Drop them together.")
    return headers[0], images[0], logs[0]


def _load(header: Path, image: Path) -> OccupancyGrid:
    """Load a map whose YAML may name a path of another machine: the image beside it is meant."""
    from PIL import Image

    mapping = load_mapping(header.read_bytes(), header, example="image: map.pgm")
    header.write_text(yaml.safe_dump(mapping | {"image": image.name}), encoding="utf-8")
    try:
        with Image.open(image) as opened:
            _check_size(*opened.size)  # before a small file becomes a large array
    except (Image.DecompressionBombError, Image.DecompressionBombWarning) as error:
        raise InputError(f"{image.name} has too many pixels. {_LIMIT}") from error
    except (OSError, ValueError, SyntaxError):
        pass  # the reader states what is wrong
    grid = load_map(header)
    _check_size(grid.width, grid.height)
    return grid


def _check_size(width: int, height: int) -> None:
    if width * height > MOST_CELLS:
        raise InputError(f"The map has {width} x {height} cells. {_LIMIT}")


def _step(grid: OccupancyGrid) -> int:
    return -(-max(grid.width, grid.height) // MOST_PIXELS)


def _png(grid: OccupancyGrid) -> bytes:
    from PIL import Image

    file = io.BytesIO()
    Image.fromarray(np.flipud(greys_of_blocks(grid, _step(grid)))).save(file, "PNG")
    return file.getvalue()


def _map(grid: OccupancyGrid, name: str) -> dict[str, Any]:
    step, origin = _step(grid), grid.T_map_grid
    return {
        "name": name,
        "width": grid.width,
        "height": grid.height,
        "resolution": grid.resolution,
        "origin": [origin.x, origin.y, origin.yaw],
        "image": {
            "width": -(-grid.width // step),
            "height": -(-grid.height // step),
            "resolution": step * grid.resolution,
            "url": "",
        },
        "changes": None,
    }


def _notes(recording: Recording) -> list[str]:
    return list(recording.notes[:10])


def _limit_process() -> None:
    with suppress(ImportError, OSError, ValueError):  # not on every system
        import os
        import resource

        os.nice(_NICENESS)
        resource.setrlimit(resource.RLIMIT_AS, (_MOST_MEMORY_BYTES, _MOST_MEMORY_BYTES))


def main() -> int:
    """Run the process, and return its exit status."""
    folder, index = Path(sys.argv[1]), int(sys.argv[2])
    _limit_process()
    try:
        answer = locate_files(folder, index)
    except FirstfixError as error:
        sentence = " ".join(f"{error}".split()).replace(f"{folder}/", "")
        sys.stderr.write(sentence[:500])
        return WRONG_INPUT
    except MemoryError:
        sys.stderr.write("The files need too much memory.")
        return WRONG_INPUT
    sys.stdout.buffer.write(msgspec.json.encode(answer))
    return 0


if __name__ == "__main__":
    sys.exit(main())
