"""Opening the image of a map, whatever its file format."""

from __future__ import annotations

from pathlib import Path

from firstfix.core.errors import MapError
from firstfix.io.maps.files import show, unreadable
from firstfix.io.maps.pgm import PGM_MAGIC, open_pgm
from firstfix.io.maps.pillow_image import BMP_MAGIC, PNG_MAGIC, open_with_pillow
from firstfix.io.maps.pixels import DEFAULT_MAX_CELLS, MapImage

# Four 16-bit channels, or a plain PGM with room to spare.
_MAX_BYTES_PER_PIXEL = 8
_HEADER_BYTES = 1 << 20


def open_image(path: Path, max_cells: int = DEFAULT_MAX_CELLS) -> MapImage:
    """Open a PGM, PNG or BMP image and decode it.

    Parameters
    ----------
    path : Path
        A regular file.
    max_cells : int
        Refuse larger images before decoding them.

    Returns
    -------
    MapImage
        At least one pixel.

    Raises
    ------
    MapError
        If the file is unreadable, of another kind, broken, empty or too large.
    """
    try:
        with path.open("rb") as file:
            magic = file.read(len(PNG_MAGIC))
        _check_file_size(path, max_cells)
        if magic.startswith(PGM_MAGIC):
            return open_pgm(path, max_cells)
        if magic.startswith((PNG_MAGIC, BMP_MAGIC)):
            return open_with_pillow(path, magic, max_cells)
    except OSError as error:
        raise unreadable(path, error) from error
    raise MapError(
        expected=f"a PGM, PNG or BMP image in {path}",
        received=f"a file that begins with {show(magic)}",
        remedy="save the map as PNG or PGM; JPEG would smear its walls",
    )


def _check_file_size(path: Path, max_cells: int) -> None:
    size = path.stat().st_size
    limit = _MAX_BYTES_PER_PIXEL * max(max_cells, 0) + _HEADER_BYTES
    if size > limit:
        raise MapError(
            expected=f"an image of at most {max_cells} pixels in {path}",
            received=f"{size} bytes",
            remedy="crop the map, or pass a larger max_cells if you trust the file",
        )
