"""Sizes and warnings of a map; each warning appears only where it applies."""

from pathlib import Path

import numpy as np
import pytest
import yaml
from PIL import Image

from firstfix.core.errors import MapError
from firstfix.core.grid import OccupancyGrid
from firstfix.core.se2 import SE2
from firstfix.io.maps.check import check_map
from firstfix.io.maps.map_server import load_map, save_map
from firstfix.io.maps.map_yaml import MapMode


def test_figures_of_a_drawn_map(tmp_path):
    cells = np.array([[100, 100, 100, 100], [0, 0, 0, 0], [0, 0, -1, -1]], np.int8)
    path = save_map(OccupancyGrid(cells, 0.5, SE2(1.0, 2.0, 0.0)), tmp_path / "m.yaml")
    check = check_map(path)
    assert (check.yaml, check.image) == (path, tmp_path / "m.pgm")
    assert (check.pixels, check.mode) == ("PGM grey", MapMode.TRINARY)
    assert (check.width, check.height) == (4, 3)
    assert (check.width_m, check.height_m) == (2.0, 1.5)
    assert (check.resolution, check.T_map_grid) == (0.5, SE2(1.0, 2.0, 0.0))
    assert (check.free, check.occupied, check.unknown) == (6 / 12, 4 / 12, 2 / 12)
    assert check.free_area == 6 * 0.25
    assert check.warnings == ()


def test_figures_agree_with_the_grid_in_every_mode(tmp_path):
    cells = np.random.default_rng(3).integers(-1, 101, (200, 100), np.int8)
    path = save_map(OccupancyGrid(cells, 0.05), tmp_path / "m.yaml")
    for mode in MapMode:
        path.write_text(path.read_text().replace("mode: raw", f"mode: {mode.value}"))
        grid, check = load_map(path), check_map(path)
        assert check.mode is mode
        assert check.free == pytest.approx(grid.free.mean(), abs=1e-12)
        assert check.occupied == pytest.approx(grid.occupied.mean(), abs=1e-12)
        assert check.unknown == pytest.approx((grid.cells == -1).mean(), abs=1e-12)
        assert check.free_area == pytest.approx(grid.free_area)
        path.write_text(path.read_text().replace(f"mode: {mode.value}", "mode: raw"))


def test_a_map_that_cannot_be_loaded_cannot_be_checked(tmp_path):
    with pytest.raises(MapError):
        check_map(tmp_path / "no.yaml")


GOOD = {
    "image": "map.png",
    "resolution": 0.05,
    "origin": [1.0, 2.0, 0.0],
    "negate": 0,
    "occupied_thresh": 0.65,
    "free_thresh": 0.196,
    "mode": "trinary",
}


def drawn(*extra: int) -> np.ndarray:
    """Draw a walled hall of 2.5 m by 2 m next to unknown space, and some extra greys."""
    greys = np.full((50, 60), 254, np.uint8)
    greys[0] = greys[-1] = 0
    greys[:, 50:] = 205
    greys[10, : len(extra)] = extra
    return greys


def traps(folder: Path, picture: np.ndarray | Image.Image, **keys) -> str:
    picture = picture if isinstance(picture, Image.Image) else Image.fromarray(picture)
    picture.save(folder / "map.png")
    entries = {k: v for k, v in {**GOOD, **keys}.items() if v is not None}
    (folder / "map.yaml").write_text(yaml.safe_dump(entries))
    return "\n".join(check_map(folder / "map.yaml").warnings)


def test_a_good_map_has_no_warnings(tmp_path):
    assert traps(tmp_path, drawn()) == ""
    assert traps(tmp_path, drawn(), occupied_thresh=0.5) == ""
    assert traps(tmp_path, Image.fromarray(drawn()).convert("RGB")) == ""


def test_unknown_that_becomes_free(tmp_path):
    warnings = traps(tmp_path, drawn(), free_thresh=0.25)
    assert warnings.startswith("16.67% of the cells have the grey 205")
    assert warnings.endswith("set free_thresh: 0.196")
    without = drawn()
    without[:, 50:] = 128
    assert traps(tmp_path, without, free_thresh=0.25) == ""


def test_mode_scale_has_no_unknown_grey(tmp_path):
    assert traps(tmp_path, drawn(), mode="scale").endswith("set mode: trinary")
    without = drawn()
    without[:, 50:] = 128
    assert traps(tmp_path, without, mode="scale") == ""


def test_unknown_that_becomes_wall(tmp_path):
    assert "read as a wall: check negate" in traps(tmp_path, drawn(), negate=1)


def test_cells_exactly_on_a_threshold(tmp_path):
    assert "0.03% of the cells lie exactly on a threshold" in traps(
        tmp_path, drawn(204), free_thresh=0.2
    )
    assert "exactly on a threshold" in traps(tmp_path, drawn(102), occupied_thresh=0.6)
    assert "threshold:" not in traps(tmp_path, drawn(204), free_thresh=0.2, mode="scale")


def test_transparent_pixels(tmp_path):
    alpha = np.full((50, 60), 255, np.uint8)
    alpha[25] = 254
    greys = drawn()
    greys[:, 50:] = 254
    picture = Image.merge("LA", [Image.fromarray(greys), Image.fromarray(alpha)])
    assert "2.00% of the pixels are transparent" in traps(tmp_path, picture)
    assert "transparent" not in traps(tmp_path, picture, mode="raw")


def test_opaque_alpha_matters_only_where_older_servers_would_differ(tmp_path):
    assert "16.67% of the opaque cells mean something else" in traps(
        tmp_path, Image.fromarray(drawn()).convert("RGBA")
    )
    two_greys = drawn()
    two_greys[:, 50:] = 0
    assert traps(tmp_path, Image.fromarray(two_greys).convert("RGBA")) == ""


def test_smoothed_images(tmp_path):
    assert "9 odd greys between the thresholds" not in traps(tmp_path, drawn())
    assert "0.30% of the cells have one of 9 odd greys" in traps(tmp_path, drawn(*range(110, 119)))
    assert "odd greys" not in traps(tmp_path, drawn(*range(110, 113)))
    assert "odd greys" not in traps(tmp_path, drawn(*range(110, 119)), mode="scale")


@pytest.mark.parametrize(
    ("grey", "message"),
    [
        (254, "all cells are free, so no scan can match"),
        (205, "all cells are unknown"),
        (0, "no cell is free, so there is no place for the robot"),
    ],
)
def test_maps_of_one_grey(tmp_path, grey, message):
    assert message in traps(tmp_path, np.full((50, 60), grey, np.uint8))


def test_no_wall(tmp_path):
    greys = drawn()
    greys[greys == 0] = 254
    assert "there is no wall" in traps(tmp_path, greys)


def test_tiny_free_area(tmp_path):
    assert "only 0.96 m² are free" in traps(tmp_path, drawn(), resolution=0.02)
    assert "m² are free" not in traps(tmp_path, drawn(), resolution=0.03)


@pytest.mark.parametrize(
    ("resolution", "unusual"), [(0.0099, True), (0.01, False), (0.5, False), (0.51, True)]
)
def test_odd_resolutions(tmp_path, resolution, unusual):
    warnings = traps(tmp_path, drawn(), resolution=resolution)
    assert ("is unusual" in warnings) == unusual


def test_origin_with_yaw(tmp_path):
    assert "yaw of 1.5 rad" in traps(tmp_path, drawn(), origin=[0, 0, 1.5])


def test_a_missing_mode_is_no_trap(tmp_path):
    assert traps(tmp_path, drawn(), mode=None) == traps(tmp_path, drawn())


def test_negate_in_mode_raw(tmp_path):
    assert "negate is ignored in mode raw" in traps(tmp_path, drawn(), mode="raw", negate=1)


def test_unknown_keys_name_the_nearest_one(tmp_path):
    assert traps(tmp_path, drawn(), negat=1) == "key 'negat' is ignored: did you mean negate?"
    assert traps(tmp_path, drawn(), author="x") == "key 'author' is ignored"
