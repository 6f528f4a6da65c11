"""A file is complete, old or new, whatever happens during writing."""

import os
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from firstfix.core.errors import InputError
from firstfix.io.atomic_files import read_bytes, replace_file


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def failing() -> Iterator[bytes]:
    yield b"half of it"
    raise OSError(28, "No space left on device")


def test_written_bytes_are_read(tmp_path):
    replace_file(tmp_path / "a", [b"one ", b"two"])
    assert read_bytes(tmp_path / "a", what="a text", limit=7) == b"one two"
    assert names(tmp_path) == ["a"]


def test_an_error_during_writing_leaves_only_the_old_file(tmp_path):
    (tmp_path / "a").write_bytes(b"old")
    with pytest.raises(InputError, match="No space left"):
        replace_file(tmp_path / "a", failing())
    assert (tmp_path / "a").read_bytes() == b"old"
    assert names(tmp_path) == ["a"]


def test_an_error_during_renaming_leaves_only_the_old_file(tmp_path, monkeypatch):
    (tmp_path / "a").write_bytes(b"old")

    def refuse(*_args):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(type(tmp_path), "replace", refuse)
    with pytest.raises(InputError, match="Permission denied"):
        replace_file(tmp_path / "a", [b"new"])
    assert (tmp_path / "a").read_bytes() == b"old"
    assert names(tmp_path) == ["a"]


def test_readers_never_see_a_mixture_of_two_writers(tmp_path):
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


def test_a_full_disk_leaves_only_the_old_file(tmp_path, full_after):
    (tmp_path / "a").write_bytes(b"old")
    for size in range(40):
        with full_after(size), pytest.raises(InputError, match="File too large"):
            replace_file(tmp_path / "a", [b"1" * 15, b"2" * 25])
        assert (tmp_path / "a").read_bytes() == b"old"
        assert names(tmp_path) == ["a"]
    with full_after(40):
        replace_file(tmp_path / "a", [b"1" * 15, b"2" * 25])
    assert (tmp_path / "a").read_bytes() == b"1" * 15 + b"2" * 25


FULL_THEN_READ_ONLY = """
import subprocess, sys
from pathlib import Path
from firstfix.core.errors import InputError
from firstfix.io.atomic_files import read_bytes, remove_file, replace_file

disk = Path(sys.argv[1])
file = disk / "a"

def refused(step, why):
    try:
        step()
    except InputError as error:
        assert why in str(error), error
    else:
        raise AssertionError("it was not refused")
    assert read_bytes(file, what="a text", limit=10) == b"old"
    assert {path.name for path in disk.iterdir()} <= {"a", "ballast"}

replace_file(file, [b"old"])
refused(lambda: replace_file(file, [bytes(100_000)]), "No space left on device")
try:
    (disk / "ballast").write_bytes(bytes(100_000))
except OSError:
    pass  # there is not a byte left
refused(lambda: replace_file(file, [b"new"]), "No space left on device")
(disk / "ballast").unlink()
subprocess.run(["mount", "-o", "remount,ro", disk], check=True)
refused(lambda: replace_file(file, [b"new"]), "Read-only file system")
refused(lambda: remove_file(file), "Read-only file system")
subprocess.run(["mount", "-o", "remount,rw", disk], check=True)
replace_file(file, [b"new"])
assert read_bytes(file, what="a text", limit=10) == b"new"
"""


def test_full_and_read_only_disks_keep_the_old_file(on_small_disk):
    on_small_disk(FULL_THEN_READ_ONLY)


KILLED = """
import os, random, signal, sys, time
from pathlib import Path
from firstfix.io.atomic_files import read_bytes, replace_file

file, rng = Path(sys.argv[1]), random.Random(1)
replace_file(file, [b"0" * 50_000])
for _ in range(60):
    writer = os.fork()
    while writer == 0:
        letter = rng.choice((b"1", b"2"))
        replace_file(file, [letter * 20_000, letter * 30_000])
    time.sleep(rng.uniform(0.0, 0.01))
    os.kill(writer, signal.SIGKILL)
    os.waitpid(writer, 0)
    seen = read_bytes(file, what="a text", limit=50_000)
    assert len(seen) == 50_000 and len(set(seen)) == 1, "half a file"
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork")
def test_a_killed_writer_leaves_the_old_or_the_new_file(tmp_path):
    command = [sys.executable, "-c", KILLED, tmp_path / "a"]
    done = subprocess.run(command, capture_output=True, check=False)
    assert done.returncode == 0, done.stderr.decode()


def test_drafts_of_killed_processes_are_removed_after_an_hour(tmp_path):
    old, new = (tmp_path / f".{letter * 32}.draft" for letter in "ab")
    others = [tmp_path / name for name in (".letter.draft", f"{'a' * 32}.draft", ".a", "b")]
    for path in (old, new, *others):
        path.write_bytes(b"half")
    for path in (old, *others):
        os.utime(path, (time.time() - 1e4,) * 2)
    replace_file(tmp_path / "a", [b"new"])
    assert names(tmp_path) == sorted(["a", new.name, *(path.name for path in others)])


def whole_or_nothing(path: Path) -> bytes:
    try:
        return read_bytes(path, what="a text", limit=5_000)
    except InputError:
        return b""


def test_a_file_that_is_replaced_and_removed_is_read_completely_or_not(tmp_path):
    path, is_over = tmp_path / "a", threading.Event()

    def come_and_go() -> None:
        while not is_over.is_set():
            replace_file(path, [b"1" * 5_000])
            path.unlink()

    coming = threading.Thread(target=come_and_go)
    coming.start()
    outcomes = set()
    deadline = time.monotonic() + 60.0
    while len(outcomes) < 2 and time.monotonic() < deadline:
        outcomes.add(whole_or_nothing(path))
    is_over.set()
    coming.join()
    assert outcomes == {b"", b"1" * 5_000}


def test_a_symbolic_link_is_followed(tmp_path):
    (tmp_path / "folder").mkdir()
    (tmp_path / "folder" / "a").write_bytes(b"old")
    (tmp_path / "link").symlink_to(tmp_path / "folder" / "a")
    replace_file(tmp_path / "link", [b"new"])
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "folder" / "a").read_bytes() == b"new"


@pytest.mark.parametrize(
    "name", ["no folder/a", "folder", "pipe", "ring", "x\0y", "\ud800", "a" * 300]
)
def test_impossible_paths_are_rejected(tmp_path, name):
    (tmp_path / "folder").mkdir()
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "ring").symlink_to(tmp_path / "ring")
    before = names(tmp_path)
    with pytest.raises(InputError) as caught:
        replace_file(tmp_path / name, [b"new"])
    str(caught.value).encode()
    assert names(tmp_path) == before


@pytest.mark.parametrize("name", ["missing", "folder", "pipe", "x\0y", "\ud800"])
def test_missing_files_folders_and_pipes_are_rejected(tmp_path, name):
    (tmp_path / "folder").mkdir()
    os.mkfifo(tmp_path / "pipe")  # reading it would block
    with pytest.raises(InputError, match="expected a text, received no file"):
        read_bytes(tmp_path / name, what="a text", limit=10)


def test_a_file_above_its_limit_is_rejected(tmp_path):
    (tmp_path / "a").write_bytes(bytes(11))
    with pytest.raises(InputError, match="a text of at most 10 bytes"):
        read_bytes(tmp_path / "a", what="a text", limit=10)


def test_a_file_without_permission_is_rejected(tmp_path, monkeypatch):
    (tmp_path / "a").touch()

    def refuse(*_args, **_kwargs):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(type(tmp_path), "open", refuse)
    with pytest.raises(InputError, match="Permission denied"):
        read_bytes(tmp_path / "a", what="a text", limit=10)
