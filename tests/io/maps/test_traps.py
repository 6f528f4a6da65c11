"""Each trap is told when it is there, and only then."""

from pathlib import Path

import numpy as np
import pytest
import yaml
from PIL import Image

from firstfix.io.maps.check import check_map

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
    """Draw a walled hall of 2.5 m by 2 m with some unknown beside it, and some greys in the way."""
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


def test_a_good_map_has_none(tmp_path):
    assert traps(tmp_path, drawn()) == ""
    assert traps(tmp_path, drawn(), occupied_thresh=0.5) == ""
    assert traps(tmp_path, Image.fromarray(drawn()).convert("RGB")) == ""


def test_unknown_that_becomes_free(tmp_path):
    told = traps(tmp_path, drawn(), free_thresh=0.25)
    assert told.startswith("16.67% of the cells have the grey 205")
    assert told.endswith("set free_thresh: 0.196")
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
    ("grey", "says"),
    [
        (254, "all cells are free, so no scan can match"),
        (205, "all cells are unknown"),
        (0, "no cell is free, so the robot can be nowhere"),
    ],
)
def test_maps_of_one_grey(tmp_path, grey, says):
    assert says in traps(tmp_path, np.full((50, 60), grey, np.uint8))


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
    told = traps(tmp_path, drawn(), resolution=resolution)
    assert ("is unusual" in told) == unusual


def test_origin_with_yaw(tmp_path):
    assert "yaw of 1.5 rad" in traps(tmp_path, drawn(), origin=[0, 0, 1.5])


def test_missing_mode(tmp_path):
    assert "mode is missing and read as trinary" in traps(tmp_path, drawn(), mode=None)


def test_negate_in_mode_raw(tmp_path):
    assert "negate is ignored in mode raw" in traps(tmp_path, drawn(), mode="raw", negate=1)


def test_unknown_keys_name_the_nearest_one(tmp_path):
    assert traps(tmp_path, drawn(), negat=1) == "key 'negat' is ignored: did you mean negate?"
    assert traps(tmp_path, drawn(), author="x") == "key 'author' is ignored"
