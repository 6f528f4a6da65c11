"""Maps from files: their names, URLs, and why they are refused."""

from pathlib import Path

import numpy as np
import pytest

from firstfix.core.errors import MapError
from firstfix.core.grid import OccupancyGrid
from firstfix.io.maps.map_server import save_map
from firstfix.ros.map_files import map_from, path_of, result_of
from firstfix.ros.services import LoadResult


@pytest.mark.parametrize(
    ("file", "given", "name"),
    [
        ("floor1.yaml", "floor1.yaml", "floor1"),
        ("lab/map.yaml", "lab/map.yaml", "lab"),
        ("lab/map.yaml", "lab", "lab"),
        ("lab/map.yaml", "lab/../lab/map.yaml", "lab"),
    ],
)
def test_a_map_is_named_like_its_file_or_its_folder(
    hall_plan: OccupancyGrid, tmp_path: Path, file: str, given: str, name: str
) -> None:
    (tmp_path / "lab").mkdir()
    save_map(hall_plan, tmp_path / file)
    loaded = map_from(tmp_path / given)
    assert loaded.map_id == name
    assert np.array_equal(loaded.grid.cells, hall_plan.cells)


@pytest.mark.parametrize(
    ("url", "path"),
    [
        ("/maps/floor1.yaml", "/maps/floor1.yaml"),
        ("floor1.yaml", "floor1.yaml"),
        ("file:///maps/floor%201.yaml", "/maps/floor 1.yaml"),
        ("file://localhost/maps/a.yaml", "/maps/a.yaml"),
    ],
)
def test_a_url_names_a_file(url: str, path: str) -> None:
    assert path_of(url) == Path(path)


@pytest.mark.parametrize("url", ["package://maps/a.yaml", "http://x/a.yaml", "file://host/a.yaml"])
def test_other_urls_are_refused(url: str) -> None:
    with pytest.raises(MapError, match="file:///"):
        path_of(url)


def test_the_result_tells_what_is_wrong(hall_plan: OccupancyGrid, tmp_path: Path) -> None:
    assert result_of(tmp_path / "no.yaml") is LoadResult.MAP_DOES_NOT_EXIST
    assert result_of(Path("n" * 5000)) is LoadResult.MAP_DOES_NOT_EXIST
    assert result_of(Path("\0")) is LoadResult.MAP_DOES_NOT_EXIST
    (tmp_path / "empty.yaml").write_text("")
    assert result_of(tmp_path / "empty.yaml") is LoadResult.INVALID_MAP_METADATA
    save_map(hall_plan, tmp_path / "cut.yaml")
    (tmp_path / "cut.pgm").write_bytes(b"P5\n")
    assert result_of(tmp_path / "cut.yaml") is LoadResult.INVALID_MAP_DATA
