"""Loading and saving maps: laws, drawn maps, then damaged files."""

import io
import math
import os
import tracemalloc
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from unittest.mock import patch

import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as npst
from PIL import Image

from firstfix.core.errors import MapError
from firstfix.core.grid import OccupancyGrid
from firstfix.core.se2 import SE2
from firstfix.io.maps import image
from firstfix.io.maps.check import check_map
from firstfix.io.maps.map_server import load_map, save_map

GOOD = {
    "image": "map.pgm",
    "resolution": 0.05,
    "origin": [1.0, 2.0, 0.0],
    "negate": 0,
    "occupied_thresh": 0.65,
    "free_thresh": 0.196,
    "mode": "trinary",
}


def write(folder: Path, greys, maxval=255, **keys) -> Path:
    """Write a PGM and its YAML."""
    greys = np.asarray(greys, np.uint8 if maxval < 256 else ">u2")
    head = f"P5 {greys.shape[1]} {greys.shape[0]} {maxval}\n".encode()
    (folder / "map.pgm").write_bytes(head + greys.tobytes())
    path = folder / "map.yaml"
    path.write_text(yaml.safe_dump({**GOOD, **keys}))
    return path


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    return tmp_path_factory.mktemp("maps")


# --- what a pixel means -------------------------------------------------------------------------


def test_the_bottom_row_of_the_image_is_row_0(tmp_path):
    grid = load_map(write(tmp_path, [[0, 254, 205], [254, 254, 254], [205, 0, 0]]))
    assert grid.cells.tolist() == [[-1, 100, 100], [0, 0, 0], [100, 0, -1]]
    assert grid.cells.dtype == np.int8
    assert not grid.cells.flags.writeable


def test_resolution_and_the_yaw_of_the_origin_are_honoured(tmp_path):
    grid = load_map(write(tmp_path, [[0, 255]], resolution=0.02, origin=[-3.5, 7.25, math.pi / 2]))
    assert grid.resolution == 0.02
    assert grid.T_map_grid == SE2(-3.5, 7.25, math.pi / 2)
    centre = grid.to_map(np.array([1.5, 0.5]))  # of the second cell: up the y axis of the map
    np.testing.assert_allclose(centre, [-3.5 - 0.01, 7.25 + 0.03])


def test_a_pixel_on_a_threshold_belongs_to_its_side(tmp_path):
    # p of 102 is exactly 0.6, of 204 exactly 0.2; a grey further is in between.
    path = write(tmp_path, [[101, 102, 103, 203, 204, 205]], occupied_thresh=0.6, free_thresh=0.2)
    assert load_map(path).cells.tolist() == [[100, 100, -1, -1, 0, 0]]


def test_unknown_of_map_savers_is_just_above_0196_and_below_025(tmp_path):
    greys = [[0, 205, 254]]
    assert load_map(write(tmp_path, greys)).cells.tolist() == [[100, -1, 0]]
    assert load_map(write(tmp_path, greys, free_thresh=0.25)).cells.tolist() == [[100, 0, 0]]


@pytest.mark.parametrize("negate", [1, True, "1", "yes", -2])
def test_negate_turns_bright_into_wall(tmp_path, negate):
    assert load_map(write(tmp_path, [[0, 128, 255]], negate=negate)).cells.tolist() == [
        [0, -1, 100]
    ]


@pytest.mark.parametrize("negate", [0, False, "0", "off"])
def test_no_negate(tmp_path, negate):
    assert load_map(write(tmp_path, [[0, 128, 255]], negate=negate)).cells.tolist() == [
        [100, -1, 0]
    ]


def test_in_mode_raw_greys_are_cells(tmp_path):
    greys = [[0, 1, 99, 100, 101, 205, 255]]
    cells = load_map(write(tmp_path, greys, mode="raw", negate=1)).cells
    assert cells.tolist() == [[0, 1, 99, 100, -1, -1, -1]]


def test_mode_scale_is_linear_between_the_thresholds(tmp_path):
    path = write(tmp_path, [[51, 52, 127, 128, 203, 204]], mode="scale")
    path = write(
        tmp_path, [[51, 52, 128, 203, 204]], mode="Scale", occupied_thresh=0.8, free_thresh=0.2
    )
    assert load_map(path).cells.tolist() == [[100, 99, 50, 1, 0]]


def test_a_missing_mode_is_trinary(tmp_path):
    path = write(tmp_path, [[0, 128, 255]])
    path.write_text(yaml.safe_dump({k: v for k, v in GOOD.items() if k != "mode"}))
    assert load_map(path).cells.tolist() == [[100, -1, 0]]


def judge(value: int, maxval: int, keys: dict) -> int:
    """Return the cell of one pixel, computed in exact fractions."""
    shade = Fraction(value, maxval)
    if keys["mode"] == "raw":
        raw = math.floor(255 * shade + Fraction(1, 2))
        return raw if raw <= 100 else -1
    p = shade if keys["negate"] else 1 - shade
    occupied, free = Fraction(str(keys["occupied_thresh"])), Fraction(str(keys["free_thresh"]))
    if p >= occupied:
        return 100
    if p <= free:
        return 0
    if keys["mode"] == "trinary":
        return -1
    return math.floor((p - free) / (occupied - free) * 100 + Fraction(1, 2))


@settings(deadline=None)
@given(
    data=st.data(),
    maxval=st.sampled_from([1, 2, 100, 254, 255, 256, 1000, 65535]),
    thresholds=st.lists(st.integers(0, 1000), min_size=2, max_size=2, unique=True),
    negate=st.integers(0, 1),
    mode=st.sampled_from(["trinary", "raw", "scale"]),
)
def test_every_pixel_agrees_with_exact_fractions(data, folder, maxval, thresholds, negate, mode):
    greys = data.draw(npst.arrays(np.uint16, (2, 3), elements=st.integers(0, maxval)))
    free, occupied = sorted(thresholds)
    keys = {
        "negate": negate,
        "mode": mode,
        "free_thresh": free / 1000,
        "occupied_thresh": occupied / 1000,
    }
    cells = load_map(write(folder, greys, maxval, **keys)).cells
    wanted = [[judge(int(v), maxval, keys) for v in row] for row in greys[::-1]]
    # Only a half of a scaled cell may be rounded either way: thresholds are floats.
    assert np.abs(cells - np.array(wanted)).max() <= (1 if mode == "scale" else 0)
    if mode == "scale":
        assert ((cells == 100) >= (np.array(wanted) == 100)).all()


# --- saving -------------------------------------------------------------------------------------

GRIDS = st.builds(
    OccupancyGrid,
    npst.arrays(
        np.int8,
        npst.array_shapes(min_dims=2, max_dims=2, max_side=6),
        elements=st.sampled_from([-1, 0, 100]) | st.integers(-1, 100),
    ),
    st.floats(1e-4, 1e3),
    st.builds(SE2, *[st.floats(-1e9, 1e9)] * 2, st.floats(-math.pi, math.pi)),
)


@settings(max_examples=50, deadline=None)
@given(grid=GRIDS)
def test_a_saved_map_is_loaded_unchanged(folder, grid):
    back = load_map(save_map(grid, folder / "saved.yaml"))
    assert (back.cells == grid.cells).all()
    assert back.resolution == grid.resolution
    assert back.T_map_grid == grid.T_map_grid


def test_trinary_maps_are_saved_as_map_saver_does(tmp_path):
    grid = OccupancyGrid(np.array([[-1, 0, 100]], np.int8), 0.05, SE2(-1.0, 2.0, 0.5))
    path = save_map(grid, tmp_path / "hall 1.yaml")
    assert path == tmp_path / "hall 1.yaml"
    assert (tmp_path / "hall 1.pgm").read_bytes() == b"P5\n3 1\n255\n\xcd\xfe\x00"
    entries = yaml.safe_load(path.read_text())
    assert entries["image"] == "hall 1.pgm"
    assert (entries["mode"], entries["occupied_thresh"], entries["free_thresh"]) == (
        *("trinary", 0.65, 0.196),
    )


def test_what_is_saved_has_no_traps_and_is_plain_yaml(tmp_path):
    cells = np.zeros((40, 50), np.int8)
    cells[0], cells[-1] = 100, -1
    path = save_map(OccupancyGrid(cells, 0.05), tmp_path / "m.yaml")
    assert check_map(path).warnings == ()
    tiny = save_map(OccupancyGrid(cells, 1e-4), tmp_path / "tiny.yaml")
    assert yaml.safe_load(tiny.read_text())["resolution"] == 1e-4  # 1e-04 would be a word


def test_saving_replaces_whole_files_and_leaves_nothing_else(tmp_path):
    first, second = (OccupancyGrid(np.full((2, 2), v, np.int8), 0.05) for v in (0, 100))
    path = save_map(first, tmp_path / "m.yaml")
    save_map(second, path)
    assert (load_map(path).cells == 100).all()
    assert sorted(p.name for p in tmp_path.iterdir()) == ["m.pgm", "m.yaml"]


def test_a_failed_save_leaves_the_old_map(tmp_path, monkeypatch):
    path = save_map(OccupancyGrid(np.zeros((2, 2), np.int8), 0.05), tmp_path / "m.yaml")

    def full(descriptor):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(MapError, match="No space left"):
        save_map(OccupancyGrid(np.full((2, 2), 100, np.int8), 0.05), path)
    assert (load_map(path).cells == 0).all()
    assert sorted(p.name for p in tmp_path.iterdir()) == ["m.pgm", "m.yaml"]


@pytest.mark.parametrize("name", ["m", "m.pgm", "missing/m.yaml", "x\0y.yaml", "\ud800.yaml"])
def test_impossible_paths_are_rejected(tmp_path, name):
    with pytest.raises(MapError):
        save_map(OccupancyGrid(np.zeros((2, 2), np.int8), 0.05), tmp_path / name)
    assert list(tmp_path.iterdir()) == []


def test_an_implausible_resolution_is_not_saved(tmp_path):
    with pytest.raises(MapError, match="resolution"):
        save_map(OccupancyGrid(np.zeros((2, 2), np.int8), 1e200), tmp_path / "m.yaml")


# --- limits -------------------------------------------------------------------------------------


def test_a_large_map_needs_little_more_memory_than_its_cells(tmp_path):
    path = write(tmp_path, np.full((2500, 4000), 205, np.uint8))
    tracemalloc.start()
    load_map(path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 4 * 2500 * 4000


# --- nothing but MapError, whatever the bytes ----------------------------------------------------


def survives(path: Path) -> None:
    """Load and check; any exception but MapError, and any warning, fails the test."""
    for use in (load_map, check_map):
        message = error_of(use, path)
        assert len(message) < 1000
        assert "\n" not in message
        message.encode()  # printable, whatever the file held


def error_of(use: Callable[..., object], path: Path) -> str:
    try:
        with patch.object(image, "MAX_CELLS", 10_000):
            use(path)
    except MapError as error:
        return str(error)
    return ""


@settings(max_examples=60, deadline=None)
@given(st.binary(max_size=200) | st.text(max_size=200).map(lambda s: s.encode("utf-8", "replace")))
def test_any_bytes_as_yaml(folder, data):
    path = write(folder, [[0, 255]])
    path.write_bytes(data)
    survives(path)


SCALARS = st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8) | st.dates()
VALUES = st.recursive(
    SCALARS | st.sampled_from(list(GOOD.values())),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=3), inner),
    max_leaves=6,
)


@pytest.mark.slow
@settings(max_examples=60, deadline=None)
@given(changes=st.dictionaries(st.sampled_from(list(GOOD)) | st.text(max_size=5), VALUES))
def test_any_values_in_the_yaml(folder, changes):
    path = write(folder, [[0, 255]])
    path.write_text(yaml.safe_dump({**GOOD, **changes}))
    survives(path)


def images() -> dict[str, bytes]:
    """Return one small valid image of every kind."""
    greys = np.random.default_rng(5).integers(0, 256, (7, 5), np.uint8)
    picture = Image.fromarray(greys)
    kinds = {}
    for mode in ("1", "L", "LA", "P", "RGB", "RGBA"):
        for file_format in ("PNG", "BMP"):
            if (mode, file_format) != ("LA", "BMP"):
                buffer = io.BytesIO()
                picture.convert(mode).save(buffer, file_format)
                kinds[f"{file_format} {mode}"] = buffer.getvalue()
    buffer = io.BytesIO()
    Image.fromarray(greys.astype(np.uint16) * 257).save(buffer, "PNG")
    kinds["PNG I;16"] = buffer.getvalue()
    kinds["P5"] = b"P5\n# made up\n5 7\n255\n" + greys.tobytes()
    kinds["P5 16"] = b"P5 5 7 1000\n" + (greys * np.uint16(3)).astype(">u2").tobytes()
    kinds["P6"] = b"P6 5 7 255\n" + greys.repeat(3).tobytes()
    kinds["P2"] = b"P2 5 7 255\n# row\n" + b"\n".join(b"%d" % v for v in greys.ravel()) + b"\n"
    return kinds


IMAGES = images()


@pytest.mark.parametrize("kind", IMAGES)
def test_the_kinds_of_the_fuzz_tests_load(folder, kind):
    (folder / "map.pgm").write_bytes(IMAGES[kind])
    path = folder / "map.yaml"
    path.write_text(yaml.safe_dump(GOOD))
    assert load_map(path).cells.shape == (7, 5)


@settings(max_examples=2 * settings.default.max_examples, deadline=None)
@given(
    kind=st.sampled_from(sorted(IMAGES)),
    edits=st.lists(st.tuples(st.integers(0, 250), st.integers(0, 255)), max_size=4),
    end=st.integers(0, 400) | st.just(10_000),
    tail=st.binary(max_size=8),
)
def test_a_damaged_image_is_a_map_error(folder, kind, edits, end, tail):
    data = bytearray(IMAGES[kind])
    for at, value in edits:
        data[at % len(data)] = value
    (folder / "map.pgm").write_bytes(data[:end] + tail)
    (folder / "map.yaml").write_text(yaml.safe_dump(GOOD))
    survives(folder / "map.yaml")


@settings(max_examples=80, deadline=None)
@given(
    magic=st.sampled_from(
        [b"", b"P2 ", b"P5 ", b"P5 3 3 255\n", b"P2 3 3 9\n", b"\x89PNG\r\n\x1a\n"]
    )
    | st.sampled_from([data[:40] for data in IMAGES.values()]),
    data=st.binary(max_size=200),
)
def test_any_bytes_as_image(folder, magic, data):
    (folder / "map.pgm").write_bytes(magic + data)
    (folder / "map.yaml").write_text(yaml.safe_dump(GOOD))
    survives(folder / "map.yaml")


# --- real maps -------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.shared
def test_every_real_map_loads_and_checks(shared):
    paths = [p for p in sorted(shared.glob("maps/*.yaml")) if "huge" not in p.name]
    assert len(paths) >= 16
    for path in paths:
        grid = load_map(path)
        check = check_map(path)
        assert (check.height, check.width) == grid.cells.shape
        assert check.free == pytest.approx(grid.free.mean(), abs=1e-12)
        assert check.occupied == pytest.approx(grid.occupied.mean(), abs=1e-12)
        assert check.unknown == pytest.approx((grid.cells == -1).mean(), abs=1e-12)
        assert check.free_area == pytest.approx(grid.free.sum() * grid.resolution**2)


@pytest.mark.shared
def test_the_map_of_every_case_loads(shared):
    paths = sorted(shared.glob("cases/*/map.yaml"))
    assert len(paths) >= 20
    for path in paths:
        assert load_map(path).occupied.any()


@pytest.mark.slow
@pytest.mark.shared
def test_a_map_of_45_million_cells_loads_by_default(shared):
    grid = load_map(shared / "maps" / "range_libc__huge_map.yaml")
    assert grid.cells.shape == (10976, 4128)


@pytest.mark.shared
@pytest.mark.parametrize("name", ["f1tenth_racetracks__Austin_Austin_map", "mir_robot__maps_maze"])
def test_real_maps_are_upright(shared, name):
    # Pillow's own way to grey, whose weights sum to 1 for the greys of these images.
    with Image.open(shared / "maps" / f"{name}.png") as picture:
        greys = np.asarray(picture.convert("L"))
    free = load_map(shared / "maps" / f"{name}.yaml").cells == 0
    assert free.any()
    np.testing.assert_array_equal(free[::-1], (255 - greys.astype(float)) / 255 <= 0.196)
