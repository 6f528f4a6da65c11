"""Properties of a map that surprise users, and sizes."""

from __future__ import annotations

import difflib
import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from firstfix.core.grid import FREE, FREE_UP_TO, OCCUPIED_FROM, UNKNOWN
from firstfix.core.se2 import SE2
from firstfix.io.atomic_files import show
from firstfix.io.maps.image import MapImage, read_image
from firstfix.io.maps.map_server import GREY_UNKNOWN, cell_table, occupancy
from firstfix.io.maps.map_yaml import EXAMPLES, MapMode, MapYaml, read_yaml

# Values outside this range are more often a mistake than a choice, m.
USUAL_RESOLUTION = (0.01, 0.5)
SMALLEST_FREE_AREA = 1.0

# Smoothing leaves many greys, each of them rare; a drawn map has few.
_SMOOTHED_GREYS = 8
_SMOOTHED_SHARE = 0.001


@dataclass(frozen=True, slots=True)
class MapCheck:
    """Sizes, shares and warnings.

    Parameters
    ----------
    yaml, image : Path
        The two files.
    pixels : str
        Format of the image and type of its pixels, in words.
    mode : MapMode
        How pixels become cells.
    width, height : int
        Size in cells.
    width_m, height_m : float
        Size, m.
    resolution : float
        Side of a cell, m.
    T_map_grid : SE2
        Pose of the lower-left corner in the map frame (``origin``).
    free, occupied, unknown : float
        Shares of all cells, 0 to 1; the rest is between the thresholds (modes scale and raw).
    free_area : float
        Area of the free cells, m².
    warnings : tuple of str
        One sentence each: what is wrong and what to do.
    """

    yaml: Path
    image: Path
    pixels: str
    mode: MapMode
    width: int
    height: int
    width_m: float
    height_m: float
    resolution: float
    T_map_grid: SE2
    free: float
    occupied: float
    unknown: float
    free_area: float
    warnings: tuple[str, ...]


def check_map(path: str | os.PathLike[str]) -> MapCheck:
    """Check a map for errors that map servers accept silently.

    Parameters
    ----------
    path : path-like
        The YAML, or a folder that contains it.

    Returns
    -------
    MapCheck
        Sizes, shares and warnings.

    Raises
    ------
    MapError
        Wherever `load_map` does.
    """
    header = read_yaml(path)
    image = read_image(header.image)
    facts = _count_pixels(header, image)
    height, width = image.levels.shape
    return MapCheck(
        yaml=header.path,
        image=header.image,
        pixels=image.kind,
        mode=header.mode,
        width=width,
        height=height,
        width_m=width * header.resolution,
        height_m=height * header.resolution,
        resolution=header.resolution,
        T_map_grid=header.T_map_grid,
        free=facts.free,
        occupied=facts.occupied,
        unknown=facts.unknown,
        free_area=facts.free_area,
        warnings=(
            *_about_yaml(facts.header),
            *_about_pixels(facts),
            *_about_cells(facts),
        ),
    )


@dataclass(frozen=True, eq=False, slots=True)
class _Facts:
    """A map as a histogram of brightness, which is sufficient for all warnings.

    Parameters
    ----------
    header : MapYaml
        Content of the YAML.
    white : int
        Brightness of white.
    has_alpha : bool
        Pixels can be transparent.
    cells, p, counts : ndarray, shape (white + 1,)
        For every brightness: the cell, the occupancy before thresholds (0 to 1), and the number of
        opaque pixels.
    total : int
        Number of all pixels.
    """

    header: MapYaml
    white: int
    has_alpha: bool
    cells: NDArray[np.int8]
    p: NDArray[np.float64]
    counts: NDArray[np.int64]
    total: int

    def share(self, levels: NDArray[np.bool_]) -> float:
        """Return the share of opaque pixels of these brightnesses among all pixels."""
        return int(self.counts[levels].sum()) / self.total

    @property
    def transparent(self) -> int:
        return self.total - int(self.counts.sum())

    @property
    def free(self) -> float:
        return self.share((self.cells >= FREE) & (self.cells <= FREE_UP_TO))

    @property
    def occupied(self) -> float:
        return self.share(self.cells >= OCCUPIED_FROM)

    @property
    def unknown(self) -> float:
        opaque = int(self.counts[self.cells == UNKNOWN].sum())
        return (opaque + self.transparent) / self.total

    @property
    def free_area(self) -> float:
        """Area of the free cells, m²."""
        return self.free * self.total * self.header.resolution**2


def _count_pixels(header: MapYaml, image: MapImage) -> _Facts:
    counts = np.zeros(image.white + 1, np.int64)
    opaque = None if image.transparent is None or header.mode is MapMode.RAW else ~image.transparent
    # Row by row: bincount makes 8 bytes of every pixel.
    for row, levels in enumerate(image.levels):
        counted = levels if opaque is None else levels[opaque[row]]
        counts += np.bincount(counted, minlength=len(counts))
    return _Facts(
        header=header,
        white=image.white,
        has_alpha=image.transparent is not None,
        cells=cell_table(header, image.white),
        p=occupancy(header, image.white),
        counts=counts,
        total=image.levels.size,
    )


def _about_yaml(header: MapYaml) -> Iterator[str]:
    low, high = USUAL_RESOLUTION
    if not low <= header.resolution <= high:
        yield (
            f"resolution {header.resolution} m is unusual ({low} to {high}): "
            "check that it is the side of a cell in metres"
        )
    if header.T_map_grid.yaw != 0.0:
        yield (
            f"origin has a yaw of {header.T_map_grid.yaw:.4g} rad: firstfix applies it, but many "
            "tools ignore it; rotate the image instead if maps disagree"
        )
    if header.negate and header.mode is MapMode.RAW:
        yield "negate is ignored in mode raw, here and in Nav2, but not in ROS 1: set 'negate: 0'"
    for key in header.keys:
        if key not in EXAMPLES:
            near = difflib.get_close_matches(key, EXAMPLES, 1)
            yield f"key {show(key)} is ignored" + (f": did you mean {near[0]}?" if near else "")


def _about_pixels(facts: _Facts) -> Iterator[str]:
    if facts.transparent:
        yield (
            f"{facts.transparent / facts.total:.2%} of the pixels are transparent (alpha below "
            "255) and read as unknown; Noetic and Humble average alpha into the brightness: "
            "flatten the image"
        )
    if facts.header.mode is MapMode.RAW:
        return
    yield from _about_unknown_grey(facts)
    if facts.header.mode is MapMode.TRINARY:
        yield from _about_versions(facts)
        yield from _about_smoothing(facts)


def _about_unknown_grey(facts: _Facts) -> Iterator[str]:
    """Warn if the grey that map savers write for unknown is read as something else."""
    header, white = facts.header, facts.white
    saved = (2 * 255 * np.arange(white + 1) + white) // (2 * white) == GREY_UNKNOWN
    # In mode scale only transparent pixels are unknown.
    as_saved = "mode: trinary" if header.mode is MapMode.SCALE else "free_thresh: 0.196"
    for name, read_as, remedy in (
        (f"free (free_thresh {header.free_thresh})", facts.cells == FREE, f"set {as_saved}"),
        ("a wall", facts.cells >= OCCUPIED_FROM, "check negate and occupied_thresh"),
    ):
        share = facts.share(saved & read_as)
        if share > 0.0:
            yield (
                f"{share:.2%} of the cells have the grey {GREY_UNKNOWN}, which map savers write "
                f"for unknown, but are read as {name}: {remedy}"
            )


def _about_versions(facts: _Facts) -> Iterator[str]:
    """Warn if versions of map_server disagree about this map."""
    header, white = facts.header, facts.white
    edge = facts.share((facts.p == header.free_thresh) | (facts.p == header.occupied_thresh))
    if edge > 0.0:
        yield (
            f"{edge:.2%} of the cells lie exactly on a threshold: wall or free here and in Nav2 "
            "since Jazzy, unknown in Noetic and Humble; move the threshold a little"
        )
    if not facts.has_alpha:
        return
    # Opaque alpha has the brightness of white, as a fourth channel.
    paler = (3 * np.arange(white + 1) + white) / (4 * white)
    p = paler if header.negate else 1.0 - paler
    older = np.where(p > header.occupied_thresh, 100, np.where(p < header.free_thresh, 0, -1))
    share = facts.share(older != facts.cells)
    if share > 0.0:
        yield (
            f"{share:.2%} of the opaque cells mean something else to Noetic and Humble, which "
            "average alpha into the brightness: remove the alpha channel"
        )


def _about_smoothing(facts: _Facts) -> Iterator[str]:
    between = facts.cells == UNKNOWN
    if not between.any():
        return
    # The most frequent grey in between is meant to be unknown.
    commonest = np.argmax(np.where(between, facts.counts, -1))
    between[commonest] = False
    share = facts.share(between)
    greys = int(np.count_nonzero(facts.counts[between]))
    if greys >= _SMOOTHED_GREYS and share >= _SMOOTHED_SHARE:
        yield (
            f"{share:.2%} of the cells have one of {greys} odd greys between the thresholds and "
            "are read as unknown: if the image was smoothed or a JPEG, redraw it in three greys"
        )


def _about_cells(facts: _Facts) -> Iterator[str]:
    hint = "check the thresholds and negate"
    if facts.unknown == 1.0:
        yield f"all cells are unknown: {hint}"
        return
    if facts.occupied == 0.0:
        what = "all cells are free" if facts.free == 1.0 else "there is no wall"
        yield f"{what}, so no scan can match: {hint}"
    if facts.free == 0.0:
        yield f"no cell is free, so there is no place for the robot: {hint}"
    elif facts.free_area < SMALLEST_FREE_AREA:
        yield f"only {facts.free_area:.2g} m² are free: check the resolution"
