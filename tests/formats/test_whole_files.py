"""A file is there as a whole, old or new, whatever happens while it is written."""

import os
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from firstfix.core.errors import InputError
from firstfix.formats.whole_files import read_bytes, replace_file


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def failing() -> Iterator[bytes]:
    yield b"half of it"
    raise OSError(28, "No space left on device")


def test_what_is_written_is_read(tmp_path):
    replace_file(tmp_path / "a", [b"one ", b"two"])
    assert read_bytes(tmp_path / "a", what="a text", limit=7) == b"one two"
    assert names(tmp_path) == ["a"]


def test_an_error_while_writing_leaves_the_old_file_and_nothing_else(tmp_path):
    (tmp_path / "a").write_bytes(b"old")
    with pytest.raises(InputError, match="No space left"):
        replace_file(tmp_path / "a", failing())
    assert (tmp_path / "a").read_bytes() == b"old"
    assert names(tmp_path) == ["a"]


def test_an_error_while_renaming_leaves_the_old_file_and_nothing_else(tmp_path, monkeypatch):
    (tmp_path / "a").write_bytes(b"old")

    def refuse(*_args):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(type(tmp_path), "replace", refuse)
    with pytest.raises(InputError, match="Permission denied"):
        replace_file(tmp_path / "a", [b"new"])
    assert (tmp_path / "a").read_bytes() == b"old"
    assert names(tmp_path) == ["a"]


def test_two_writers_and_a_reader_who_never_sees_a_mixture(tmp_path):
    path = tmp_path / "a"
    path.write_bytes(b"0" * 10_000)

    def write(letter: bytes) -> None:
        for _ in range(20):
            replace_file(path, [letter * 5_000, letter * 5_000])

    writers = [threading.Thread(target=write, args=(letter,)) for letter in (b"1", b"2")]
    for writer in writers:
        writer.start()
    while any(writer.is_alive() for writer in writers):
        seen = path.read_bytes()
        assert len(seen) == 10_000
        assert len(set(seen)) == 1
    assert set(path.read_bytes()) <= set(b"12")
    assert names(tmp_path) == ["a"]


def test_a_link_stays_one(tmp_path):
    (tmp_path / "folder").mkdir()
    (tmp_path / "folder" / "a").write_bytes(b"old")
    (tmp_path / "link").symlink_to(tmp_path / "folder" / "a")
    replace_file(tmp_path / "link", [b"new"])
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "folder" / "a").read_bytes() == b"new"


@pytest.mark.parametrize(
    "name", ["no folder/a", "folder", "pipe", "ring", "x\0y", "\ud800", "a" * 300]
)
def test_where_no_file_can_be_written(tmp_path, name):
    (tmp_path / "folder").mkdir()
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "ring").symlink_to(tmp_path / "ring")
    before = names(tmp_path)
    with pytest.raises(InputError) as caught:
        replace_file(tmp_path / name, [b"new"])
    str(caught.value).encode()
    assert names(tmp_path) == before


@pytest.mark.parametrize("name", ["missing", "folder", "pipe", "x\0y", "\ud800"])
def test_what_is_no_file_to_read(tmp_path, name):
    (tmp_path / "folder").mkdir()
    os.mkfifo(tmp_path / "pipe")  # reading it would wait for ever
    with pytest.raises(InputError, match="expected a text, received no file"):
        read_bytes(tmp_path / name, what="a text", limit=10)


def test_a_file_larger_than_its_limit(tmp_path):
    (tmp_path / "a").write_bytes(bytes(11))
    with pytest.raises(InputError, match="a text of at most 10 bytes"):
        read_bytes(tmp_path / "a", what="a text", limit=10)


def test_a_file_without_permission(tmp_path, monkeypatch):
    (tmp_path / "a").touch()

    def refuse(*_args, **_kwargs):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(type(tmp_path), "open", refuse)
    with pytest.raises(InputError, match="Permission denied"):
        read_bytes(tmp_path / "a", what="a text", limit=10)
