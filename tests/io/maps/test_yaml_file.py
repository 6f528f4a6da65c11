"""The keys of a map: what is accepted, what is refused, and what the refusal says."""

import math

import pytest
import yaml

from firstfix.core.errors import MapError
from firstfix.core.se2 import SE2
from firstfix.io.maps.yaml_file import EXAMPLES, MapMode, read_yaml

GOOD = "\n".join(EXAMPLES.values())


@pytest.fixture
def read(tmp_path):
    (tmp_path / "map.pgm").write_bytes(b"P5 1 1 255\n\0")

    def read(text: str):
        (tmp_path / "map.yaml").write_text(text)
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
        ("resolution: 5e-2", 0.05),  # a word to PyYAML, a number to the servers
        ("resolution: '0.05'", 0.05),
        ("resolution: !!float 0.05", 0.05),
        ("resolution: .5", 0.5),
        ("resolution: 1", 1.0),
    ],
)
def test_numbers_are_read_as_the_servers_read_them(read, line, resolution):
    assert read(replaced("resolution", line)).resolution == resolution


@pytest.mark.parametrize("key", [key for key in EXAMPLES if key != "mode"])
def test_a_missing_key_is_named_with_a_line_to_add(read, key):
    with pytest.raises(MapError, match=f"the key {key} in") as caught:
        read(replaced(key, ""))
    assert EXAMPLES[key] in caught.value.remedy


def test_a_misspelt_key_is_found(read):
    with pytest.raises(MapError, match="rename 'resolutoin'"):
        read(replaced("resolution", "resolutoin: 0.05"))


@pytest.mark.parametrize("key", ["resolution", "occupied_thresh", "free_thresh"])
@pytest.mark.parametrize(
    "value",
    ["x", ".nan", ".inf", "-.inf", "1e999", "", "[1]", "{a: 1}", "1_0", "-0.1", "true", "٣"],
)
def test_what_is_no_number(read, key, value):
    with pytest.raises(MapError, match=key) as caught:
        read(replaced(key, f"{key}: {value}"))
    assert caught.value.remedy


@pytest.mark.parametrize("value", ["0.00001", "0", "1001"])
def test_what_is_no_side_of_a_cell(read, value):
    with pytest.raises(MapError, match=r"resolution of 0\.0001 to 1000 m"):
        read(replaced("resolution", f"resolution: {value}"))


@pytest.mark.parametrize(
    "value",
    ["[1, 2]", "[1, 2, 3, 4]", "[]", "1", "", "[1, 2, x]", "[1, 2, .nan]", "[1, 2, [3]]", "{x: 1}"],
)
def test_what_is_no_origin(read, value):
    with pytest.raises(MapError, match="origin"):
        read(replaced("origin", f"origin: {value}"))


@pytest.mark.parametrize("yaw", [math.pi, 0.1, 3.14, 4.0])
def test_yaw_is_the_same_direction(read, yaw):
    got = read(replaced("origin", f"origin: [0, 0, {yaw}]")).T_map_grid.yaw
    assert math.cos(got - yaw) == pytest.approx(1.0)


@pytest.mark.parametrize(("free", "occupied"), [(0.65, 0.65), (0.7, 0.65), (0.2, 1.01), (-0.1, 1)])
def test_thresholds_that_exclude_each_other(read, free, occupied):
    text = replaced("free_thresh", f"free_thresh: {free}")
    with pytest.raises(MapError, match="thresh"):
        read(text.replace(EXAMPLES["occupied_thresh"], f"occupied_thresh: {occupied}"))


def test_the_extreme_thresholds_are_allowed(read):
    text = replaced("free_thresh", "free_thresh: 0")
    header = read(text.replace(EXAMPLES["occupied_thresh"], "occupied_thresh: 1"))
    assert (header.free_thresh, header.occupied_thresh) == (0.0, 1.0)


@pytest.mark.parametrize("value", ["2.5", "maybe", "", "[0]", "0.0"])
def test_what_is_no_flag(read, value):
    with pytest.raises(MapError, match="negate"):
        read(replaced("negate", f"negate: {value}"))


@pytest.mark.parametrize("value", ["ternary", "", "[raw]", "1"])
def test_what_is_no_mode(read, value):
    with pytest.raises(MapError, match="mode"):
        read(replaced("mode", f"mode: {value}"))


def test_the_examples_are_the_format_itself():
    assert list(yaml.safe_load(GOOD)) == list(EXAMPLES)
