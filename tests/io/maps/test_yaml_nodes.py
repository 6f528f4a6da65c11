"""YAML from strangers is refused cheaply and never acted on."""

import time

import pytest

from firstfix.core.errors import MapError
from firstfix.io.maps.yaml_nodes import read_nodes


@pytest.fixture
def read(tmp_path):
    def read(data: bytes):
        (tmp_path / "map.yaml").write_bytes(data)
        return read_nodes(tmp_path / "map.yaml")

    return read


def test_entries_keep_their_order_and_text(read):
    nodes = read(b"---\nb: 1e-3  # a comment\na: [x, 2]\n? [odd]\n: 1\n")
    assert list(nodes) == ["b", "a", "a list"]
    assert nodes["b"].value == "1e-3"


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16"])
def test_a_byte_order_mark_is_no_part_of_the_first_key(read, encoding):
    assert list(read("image: ä.pgm".encode(encoding))) == ["image"]


BILLION_LAUGHS = "a: &a [x, x]\n" + "".join(
    f"{b}: &{b} [*{a}, *{a}, *{a}]\n" for a, b in zip("abcdefgh", "bcdefghi", strict=True)
)


@pytest.mark.parametrize(
    ("data", "says"),
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
        (b"just words", "just words"),
        (b"- a\n- b", "a list"),
        (b"a: 1\n" * 20_000, "a larger file"),
    ],
)
def test_what_is_refused_and_why(read, data, says):
    with pytest.raises(MapError, match=says):
        read(data)


def test_tags_construct_nothing(read, tmp_path):
    read(b"image: !!python/object/apply:os.mkdir [made]\n")
    assert [p.name for p in tmp_path.iterdir()] == ["map.yaml"]


@pytest.mark.slow
def test_the_longest_admitted_file_takes_little_time(read):
    started = time.process_time()
    read(b"a: {" + b"a," * 16_000 + b"}")
    assert time.process_time() - started < 10.0  # 0.8 s on a quiet machine
