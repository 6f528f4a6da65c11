"""The YAML of a map: how it is found, which values are accepted, and the message of each error."""

import math
import os
import time

import pytest
import yaml

from firstfix.core.errors import MapError
from firstfix.core.se2 import SE2
from firstfix.io.maps.map_yaml import EXAMPLES, MapMode, find_image, find_yaml, read_yaml

GOOD = "\n".join(EXAMPLES.values())


@pytest.fixture
def read(tmp_path):
    (tmp_path / "map.pgm").write_bytes(b"P5 1 1 255\n\0")

    def read(text: str | bytes):
        (tmp_path / "map.yaml").write_bytes(text if isinstance(text, bytes) else text.encode())
        return read_yaml(tmp_path / "map.yaml")

    return read


def replaced(key: str, line: str) -> str:
    return GOOD.replace(EXAMPLES[key], line)


def test_every_key_is_read(read, tmp_path):
    header = read(
        "image: map.pgm\nresolution: 0.1\norigin: [1, -2.5, 1.0e+0]\nnegate: 1\n"
        "occupied_thresh: 0.7\nfree_thresh: 0.2\nmode: Scale\nauthor: me\n"
    )
    assert header.image == tmp_path / "map.pgm"
    assert (header.resolution, header.T_map_grid) == (0.1, SE2(1.0, -2.5, 1.0))
    assert header.negate
    assert (header.occupied_thresh, header.free_thresh) == (0.7, 0.2)
    assert header.mode is MapMode.SCALE
    assert header.keys[-1] == "author"


@pytest.mark.parametrize(
    ("line", "resolution"),
    [
        ("resolution: 5e-2", 0.05),  # text in YAML 1.1
        ("resolution: '0.05'", 0.05),
        ("resolution: !!float 0.05", 0.05),
        ("resolution: .5", 0.5),
        ("resolution: 1", 1.0),
    ],
)
def test_numbers_are_read_as_in_map_server(read, line, resolution):
    assert read(replaced("resolution", line)).resolution == resolution


@pytest.mark.parametrize("key", [key for key in EXAMPLES if key != "mode"])
def test_a_missing_key_is_named_with_a_line_to_add(read, key):
    with pytest.raises(MapError, match=f"the key {key} in") as caught:
        read(replaced(key, ""))
    assert EXAMPLES[key] in caught.value.remedy


def test_a_misspelled_key_is_named(read):
    with pytest.raises(MapError, match="rename 'resolutoin'"):
        read(replaced("resolution", "resolutoin: 0.05"))


@pytest.mark.parametrize("key", ["resolution", "occupied_thresh", "free_thresh"])
@pytest.mark.parametrize(
    "value",
    ["x", ".nan", ".inf", "-.inf", "1e999", "", "[1]", "{a: 1}", "-0.1", "true", "'x'", "9" * 400],
)
def test_values_that_are_not_numbers_are_rejected(read, key, value):
    with pytest.raises(MapError, match=key) as caught:
        read(replaced(key, f"{key}: {value}"))
    assert caught.value.remedy


@pytest.mark.parametrize("value", ["0.00001", "0", "1001"])
def test_implausible_resolutions_are_rejected(read, value):
    with pytest.raises(MapError, match=r"resolution of 0\.0001 to 1000 m"):
        read(replaced("resolution", f"resolution: {value}"))


@pytest.mark.parametrize(
    "value",
    ["[1, 2]", "[1, 2, 3, 4]", "[]", "1", "", "[1, 2, x]", "[1, 2, .nan]", "[1, 2, [3]]", "{x: 1}"],
)
def test_invalid_origins_are_rejected(read, value):
    with pytest.raises(MapError, match="origin"):
        read(replaced("origin", f"origin: {value}"))


@pytest.mark.parametrize("yaw", [math.pi, 0.1, 3.14, 4.0])
def test_yaw_is_the_same_direction(read, yaw):
    got = read(replaced("origin", f"origin: [0, 0, {yaw}]")).T_map_grid.yaw
    assert math.cos(got - yaw) == pytest.approx(1.0)


@pytest.mark.parametrize(("free", "occupied"), [(0.65, 0.65), (0.7, 0.65), (0.2, 1.01), (-0.1, 1)])
def test_contradicting_thresholds_are_rejected(read, free, occupied):
    text = replaced("free_thresh", f"free_thresh: {free}")
    with pytest.raises(MapError, match="thresh"):
        read(text.replace(EXAMPLES["occupied_thresh"], f"occupied_thresh: {occupied}"))


def test_the_extreme_thresholds_are_allowed(read):
    text = replaced("free_thresh", "free_thresh: 0")
    header = read(text.replace(EXAMPLES["occupied_thresh"], "occupied_thresh: 1"))
    assert (header.free_thresh, header.occupied_thresh) == (0.0, 1.0)


@pytest.mark.parametrize("value", ["2.5", "maybe", "", "[0]", "0.0"])
def test_invalid_flags_are_rejected(read, value):
    with pytest.raises(MapError, match="negate"):
        read(replaced("negate", f"negate: {value}"))


@pytest.mark.parametrize("value", ["ternary", "", "[raw]", "1"])
def test_invalid_modes_are_rejected(read, value):
    with pytest.raises(MapError, match="mode"):
        read(replaced("mode", f"mode: {value}"))


def test_the_examples_are_valid_yaml():
    assert list(yaml.safe_load(GOOD)) == list(EXAMPLES)


# --- finding the files ---


def test_a_file_is_accepted_with_any_name(tmp_path):
    (tmp_path / "anything").write_text("a: 1")
    assert find_yaml(tmp_path / "anything") == tmp_path / "anything"


def test_in_a_folder_map_yaml_or_the_only_yaml_is_found(tmp_path):
    (tmp_path / "hall.yaml").touch()
    assert find_yaml(tmp_path) == tmp_path / "hall.yaml"
    (tmp_path / "params.yml").touch()
    with pytest.raises(MapError, match=r"hall.yaml and params.yml"):
        find_yaml(tmp_path)
    (tmp_path / "map.yaml").touch()
    assert find_yaml(tmp_path) == tmp_path / "map.yaml"


def test_a_folder_without_yaml_is_rejected(tmp_path):
    with pytest.raises(MapError, match="no YAML"):
        find_yaml(tmp_path)


def test_a_missing_suffix_is_suggested(tmp_path):
    (tmp_path / "hall.yaml").touch()
    with pytest.raises(MapError, match=r"pass .*hall\.yaml"):
        find_yaml(tmp_path / "hall")


@pytest.mark.parametrize("name", ["no.yaml", "x\0y", "a" * 5000, "\ud800", "pipe"])
def test_missing_files_and_pipes_are_rejected(tmp_path, name):
    os.mkfifo(tmp_path / "pipe")  # reading it would block
    with pytest.raises(MapError, match="no file") as caught:
        find_yaml(tmp_path / name)
    str(caught.value).encode()


@pytest.mark.parametrize("name", ["m.png", "m.yaml"])
def test_an_image_in_place_of_its_yaml_is_recognized(tmp_path, name):
    (tmp_path / name).write_bytes(b"\x89PNG\r\n\x1a\n")
    with pytest.raises(MapError, match="an image"):
        read_yaml(tmp_path / name)
    (tmp_path / "m.yml").touch()
    with pytest.raises(MapError, match="an image") as caught:
        read_yaml(tmp_path / name)
    assert "m.y" in caught.value.remedy


def test_a_file_without_permission_is_rejected(tmp_path, monkeypatch):
    path = tmp_path / "m.yaml"
    path.touch()

    def refuse(*_args, **_kwargs):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(type(path), "open", refuse)
    with pytest.raises(MapError, match="Permission denied"):
        read_yaml(path)


def test_images_are_relative_to_the_yaml_or_absolute(tmp_path):
    (tmp_path / "images").mkdir()
    image = tmp_path / "images" / "a b.pgm"
    image.touch()
    assert find_image(tmp_path / "m.yaml", "images/a b.pgm") == image
    assert find_image(tmp_path / "m.yaml", str(image)) == image


def test_an_image_beside_the_yaml_is_suggested_for_a_foreign_path(tmp_path):
    (tmp_path / "hall.pgm").touch()
    with pytest.raises(MapError, match=r"write 'image: hall\.pgm'"):
        find_image(tmp_path / "m.yaml", "/home/maps/hall.pgm")


@pytest.mark.parametrize("name", ["", ".", "..", "no.pgm", "x\0y", "/", "a" * 5000])
def test_missing_images_are_rejected(tmp_path, name):
    with pytest.raises(MapError, match=r"no file|an empty name"):
        find_image(tmp_path / "m.yaml", name)


# --- files that are not YAML, or attacks ---


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16"])
def test_a_byte_order_mark_is_not_part_of_the_first_key(read, encoding):
    assert read(GOOD.encode(encoding)).keys[0] == "image"


BILLION_LAUGHS = "a: &a [x, x]\n" + "".join(
    f"{b}: &{b} [*{a}, *{a}, *{a}]\n" for a, b in zip("abcdefgh", "bcdefghi", strict=True)
)


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (BILLION_LAUGHS.encode(), "anchors or aliases"),
        (b"[" * 30_000, "deep nesting"),
        (b"? " * 15_000, "deep nesting"),
        (b"a: b: c", "line 1"),
        (b"a: 1\n\tb: 2", "line 2"),
        (b"a: 1\na: 2", "'a' twice"),
        (b"a: 1\n---\na: 1", "another document"),
        (b'a: "\\UFFFFFFFF"', "YAML"),
        (b"\x00", "YAML"),
        (b"\xff\xfe\x00", "YAML"),
        (b"", "an empty file"),
        (b"# nothing\n", "an empty file"),
        (b"plain words", "plain words"),
        (b"- a\n- b", "a list"),
        (b"a: 1\n" * 20_000, "at most 32768 bytes"),
    ],
)
def test_invalid_yaml_is_rejected_with_the_reason(read, data, message):
    with pytest.raises(MapError, match=message):
        read(data)


def test_tags_construct_nothing(read, tmp_path):
    with pytest.raises(MapError, match="constructor"):
        read(b"image: !!python/object/apply:os.mkdir [made]\n")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["map.pgm", "map.yaml"]


@pytest.mark.slow
def test_the_longest_accepted_file_takes_little_time(read):
    started = time.process_time()
    with pytest.raises(MapError, match="the key image"):
        read(b"a: {" + b"a," * 16_000 + b"}")
    assert time.process_time() - started < 10.0  # 1 s on an idle machine
