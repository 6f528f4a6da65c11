"""The traps of map_server maps, told in sentences."""

from __future__ import annotations

import difflib
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from firstfix.core.grid import FREE, FREE_UP_TO, OCCUPIED_FROM, UNKNOWN
from firstfix.io.maps.files import show
from firstfix.io.maps.map_server import GREY_UNKNOWN, cell_table, occupancy
from firstfix.io.maps.pixels import MapImage
from firstfix.io.maps.yaml_file import EXAMPLES, MapMode, MapYaml

# Outside these a resolution is more often a slip of the pen than a choice.
USUAL_RESOLUTION = (0.01, 0.5)
SMALLEST_FREE_AREA = 1.0

# Smoothing leaves many greys, each rare; a drawn map has few.
_SMOOTHED_GREYS = 8
_SMOOTHED_SHARE = 0.001


@dataclass(frozen=True, eq=False, slots=True)
class MapFacts:
    """A map as a histogram of its pixel codes, which is all that the warnings need.

    Parameters
    ----------
    header : MapYaml
        What the YAML says.
    image : MapImage
        The image.
    cells, p, counts : ndarray, shape (n_codes,)
        The cell that each code becomes, its occupancy before thresholds (0 to 1), and how many
        opaque pixels have it.
    total : int
        Number of all pixels.
    """

    header: MapYaml
    image: MapImage
    cells: NDArray[np.int8]
    p: NDArray[np.float64]
    counts: NDArray[np.int64]
    total: int

    def share(self, codes: NDArray[np.bool_]) -> float:
        """Return the share of all pixels, 0 to 1, that have one of these codes and are opaque."""
        return int(self.counts[codes].sum()) / self.total

    @property
    def transparent(self) -> int:
        """Number of the pixels that count as transparent."""
        return self.total - int(self.counts.sum())

    @property
    def free(self) -> float:
        """Share of the cells where a robot can be, 0 to 1."""
        return self.share((self.cells >= FREE) & (self.cells <= FREE_UP_TO))

    @property
    def occupied(self) -> float:
        """Share of the cells that are wall, 0 to 1."""
        return self.share(self.cells >= OCCUPIED_FROM)

    @property
    def unknown(self) -> float:
        """Share of the cells that nobody has seen, 0 to 1."""
        opaque = int(self.counts[self.cells == UNKNOWN].sum())
        return (opaque + self.transparent) / self.total

    @property
    def free_area(self) -> float:
        """Area of the free cells, m²."""
        return self.free * self.total * self.header.resolution**2


def count_pixels(header: MapYaml, image: MapImage) -> MapFacts:
    """Count how often every pixel code occurs, transparent pixels aside."""
    counts = np.zeros(len(image.levels), np.int64)
    for strip in image.strips():
        codes = strip.codes
        if strip.transparent is not None and header.mode is not MapMode.RAW:
            codes = codes[~strip.transparent]
        counts += np.bincount(codes.ravel(), minlength=len(counts))
    return MapFacts(
        header=header,
        image=image,
        cells=cell_table(header, image),
        p=occupancy(header, image),
        counts=counts,
        total=image.width * image.height,
    )


def find_traps(facts: MapFacts) -> Iterator[str]:
    """Yield one sentence for each trap: what is the matter, and what to do."""
    yield from _about_yaml(facts.header)
    yield from _about_pixels(facts)
    yield from _about_cells(facts)


def _about_yaml(header: MapYaml) -> Iterator[str]:
    low, high = USUAL_RESOLUTION
    if not low <= header.resolution <= high:
        yield (
            f"resolution {header.resolution} m is unusual ({low} to {high}): "
            "check that it is the side of a cell in metres"
        )
    if header.T_map_grid.yaw != 0.0:
        yield (
            f"origin has a yaw of {header.T_map_grid.yaw:.4g} rad: it is honoured here, but many "
            "tools ignore it; rotate the image instead if maps disagree"
        )
    if "mode" not in header.keys:
        yield "mode is missing and read as trinary, as servers do: add 'mode: trinary'"
    if header.negate and header.mode is MapMode.RAW:
        yield "negate is ignored in mode raw, here and in Nav2, but not in ROS 1: set 'negate: 0'"
    for key in header.keys:
        if key not in EXAMPLES:
            near = difflib.get_close_matches(key, EXAMPLES, 1)
            yield f"key {show(key)} is ignored" + (f": did you mean {near[0]}?" if near else "")


def _about_pixels(facts: MapFacts) -> Iterator[str]:
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


def _about_unknown_grey(facts: MapFacts) -> Iterator[str]:
    """Warn of the grey that map savers write for unknown, where it is read as anything else."""
    header, white = facts.header, facts.image.white
    saved = (2 * 255 * facts.image.levels + white) // (2 * white) == GREY_UNKNOWN
    # Mode scale knows no unknown grey at all: there, only transparent pixels are unknown.
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


def _about_versions(facts: MapFacts) -> Iterator[str]:
    """Warn where the servers disagree with each other about this very map."""
    header, image = facts.header, facts.image
    edge = facts.share((facts.p == header.free_thresh) | (facts.p == header.occupied_thresh))
    if edge > 0.0:
        yield (
            f"{edge:.2%} of the cells lie exactly on a threshold: wall or free here and in Nav2 "
            "since Jazzy, unknown in Noetic and Humble; move the threshold a little"
        )
    if not image.has_alpha:
        return
    # Opaque alpha is the brightness of white, as a fourth channel.
    paler = (3 * image.levels + image.white) / (4 * image.white)
    p = paler if header.negate else 1.0 - paler
    older = np.where(p > header.occupied_thresh, 100, np.where(p < header.free_thresh, 0, -1))
    share = facts.share(older != facts.cells)
    if share > 0.0:
        yield (
            f"{share:.2%} of the opaque cells mean something else to Noetic and Humble, which "
            "average alpha into the brightness: remove the alpha channel"
        )


def _about_smoothing(facts: MapFacts) -> Iterator[str]:
    between = facts.cells == UNKNOWN
    if not between.any():
        return
    # The commonest grey in between is the one that someone meant to be unknown.
    commonest = np.argmax(np.where(between, facts.counts, -1))
    between[commonest] = False
    share = facts.share(between)
    greys = int(np.count_nonzero(facts.counts[between]))
    if greys >= _SMOOTHED_GREYS and share >= _SMOOTHED_SHARE:
        yield (
            f"{share:.2%} of the cells have one of {greys} odd greys between the thresholds and "
            "are read as unknown: if the image was smoothed or a JPEG, redraw it in three greys"
        )


def _about_cells(facts: MapFacts) -> Iterator[str]:
    hint = "check the thresholds and negate"
    if facts.unknown == 1.0:
        yield f"all cells are unknown: {hint}"
        return
    if facts.occupied == 0.0:
        what = "all cells are free" if facts.free == 1.0 else "there is no wall"
        yield f"{what}, so no scan can match: {hint}"
    if facts.free == 0.0:
        yield f"no cell is free, so the robot can be nowhere: {hint}"
    elif facts.free_area < SMALLEST_FREE_AREA:
        yield f"only {facts.free_area:.2g} m² are free: check the resolution"
