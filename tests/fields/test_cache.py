"""A cached array is the built one, whatever happens to its file."""

import io
import mmap
import os
import subprocess
import sys
import tempfile
import zlib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays, scalar_dtypes

from firstfix.fields import cache
from firstfix.fields.cache import cache_folder, content_key, load_or_build, remove_unused

plain = scalar_dtypes().filter(lambda dtype: dtype.kind in "biufc")
any_array = plain.flatmap(lambda dtype: arrays(dtype, array_shapes(min_dims=0, min_side=0)))
into_one_folder = settings(
    deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
GRID = np.arange(60, dtype=np.uint16).reshape(6, 10)


class Builder:
    """Counts its calls."""

    def __init__(self, array=GRID):
        self.calls = 0
        self.array = array

    def __call__(self):
        self.calls += 1
        return self.array


def assert_loaded(builder: Builder, folder: Path, key: str = "key") -> None:
    actual = load_or_build(key, builder, folder)
    assert (actual.dtype, actual.shape) == (builder.array.dtype, builder.array.shape)
    assert actual.tobytes() == builder.array.tobytes()
    assert not actual.flags.writeable


def only_file(folder: Path) -> Path:
    (path,) = folder.iterdir()
    return path


@into_one_folder
@given(any_array)
def test_the_loaded_array_is_the_built_one(tmp_path_factory, array):
    folder = tmp_path_factory.mktemp("cache")
    builder = Builder(array)
    assert_loaded(builder, folder)
    assert_loaded(builder, folder)
    assert builder.calls == 1


def test_an_array_is_mapped_and_numpy_can_read_its_file(tmp_path):
    for _ in range(2):
        array = load_or_build("key", Builder(), tmp_path)
        assert isinstance(array.base, mmap.mmap)
    assert np.array_equal(np.load(only_file(tmp_path), mmap_mode="r"), GRID)


@pytest.mark.parametrize("array", [GRID[:, ::3], GRID.T, np.asfortranarray(GRID)])
def test_slices_and_fortran_order_keep_their_shape(tmp_path, array):
    builder = Builder(array)
    for _ in range(2):
        assert_loaded(builder, tmp_path)
    assert builder.calls == 1


def test_keys_have_files_of_their_own(tmp_path):
    for _ in range(2):
        assert_loaded(Builder(np.ones(3)), tmp_path, "one")
        assert_loaded(Builder(np.zeros(3)), tmp_path, "two")


@into_one_folder
@given(st.data())
def test_a_file_with_flipped_bits_gives_the_same_array(tmp_path, data):
    builder = Builder()
    load_or_build("key", builder, tmp_path)
    path = only_file(tmp_path)
    content = bytearray(path.read_bytes())
    for _ in range(data.draw(st.integers(1, 3))):
        content[data.draw(st.integers(0, len(content) - 1))] ^= data.draw(st.integers(1, 255))
    path.write_bytes(content)
    assert_loaded(builder, tmp_path)
    calls = builder.calls
    assert_loaded(builder, tmp_path)
    assert builder.calls == calls  # a damaged file was replaced


def test_a_truncated_file_is_built_again(tmp_path):
    builder = Builder()
    load_or_build("key", builder, tmp_path)
    content = only_file(tmp_path).read_bytes()
    for size in range(0, len(content), 7):
        only_file(tmp_path).write_bytes(content[:size])
        assert_loaded(builder, tmp_path)
        assert builder.calls == 2 + size // 7
    assert only_file(tmp_path).stat().st_size == len(content)


def test_pickles_are_never_loaded(tmp_path):
    for strange in (np.array([{}]), np.array(["text"])):
        file = io.BytesIO()
        np.save(file, strange, allow_pickle=True)
        content = file.getvalue()
        crc = zlib.crc32(content).to_bytes(4, "little")
        (tmp_path / "key.fields").write_bytes(content + crc)
        builder = Builder()
        assert_loaded(builder, tmp_path)
        assert builder.calls == 1


def _full(*args, **kwargs):
    raise OSError(28, "No space left on device")


@pytest.mark.parametrize(
    ("owner", "function"),
    [(Path, "mkdir"), (tempfile, "mkstemp"), (Path, "replace"), (cache, "_write")],
)
def test_a_full_disk_costs_only_time(tmp_path, monkeypatch, owner, function):
    monkeypatch.setattr(owner, function, _full)
    builder = Builder()
    for _ in range(2):
        assert_loaded(builder, tmp_path)
    assert builder.calls == 2
    assert not list(tmp_path.iterdir())  # no partial file is left


SMALL_DISK = """
import subprocess, sys
from pathlib import Path
import numpy as np
from firstfix.fields.cache import load_or_build

disk, calls = Path(sys.argv[1]), []
folder = disk / "cache"

def load(key, size):
    load_or_build(key, lambda: calls.append(key) or np.arange(size), folder)[-1]
    return sorted(path.name for path in folder.iterdir())

assert load("large", 20_000) == [] and calls == ["large"]  # more than the disk has
assert load("small", 2_000) == ["small.fields"]
try:
    (disk / "ballast").write_bytes(bytes(100_000))
except OSError:
    pass  # there is not a byte left
assert load("other", 2_000) == ["small.fields"]
subprocess.run(["mount", "-o", "remount,ro", disk], check=True)
assert load("other", 2_000) == ["small.fields"]
assert load("small", 2_000) == ["small.fields"]  # read, although its time cannot be updated
assert calls == ["large", "small", "other", "other"]
subprocess.run(["mount", "-o", "remount,rw", disk], check=True)
(disk / "ballast").unlink()
assert load("other", 2_000) == ["other.fields", "small.fields"]
"""


def test_a_full_or_read_only_disk_is_read(on_small_disk):
    on_small_disk(SMALL_DISK)


def test_an_impossible_folder_is_ignored(tmp_path):
    (tmp_path / "file").write_text("not a folder")
    (tmp_path / "key.fields").mkdir()  # a folder in place of the file
    builder = Builder()
    for folder in (tmp_path / "file", tmp_path / "file" / "below", tmp_path):
        assert_loaded(builder, folder)
    assert builder.calls == 3


def test_errors_of_the_builder_are_not_caught(tmp_path):
    def build():
        raise RuntimeError("no map")

    with pytest.raises(RuntimeError, match="no map"):
        load_or_build("key", build, tmp_path)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("array", [np.array([{}]), np.array(["text"]), np.zeros(2, "f4,f4")])
def test_only_numbers_are_cached(tmp_path, array):
    with pytest.raises(TypeError, match="arrays of numbers"):
        load_or_build("key", lambda: array, tmp_path)
    with pytest.raises(TypeError, match="arrays of numbers"):
        content_key(array)


@pytest.mark.parametrize("key", ["", "../key", "a/b", "a b", "ключ", ".", "nul\0"])
def test_a_key_cannot_leave_the_folder(tmp_path, key):
    with pytest.raises(ValueError, match="letters and digits"):
        load_or_build(key, Builder(), tmp_path)


def test_the_least_recently_used_file_is_removed_first(tmp_path):
    kilobyte = Builder(np.zeros(1000, np.uint8))
    for age, key in enumerate(["c", "b", "a"]):
        load_or_build(key, kilobyte, tmp_path, 4500)
        os.utime(tmp_path / f"{key}.fields", (age + 1, age + 1))
    (tmp_path / "scans.npz").write_bytes(bytes(9999))  # of the user
    load_or_build("c", kilobyte, tmp_path, 4500)  # the oldest, used again
    load_or_build("d", kilobyte, tmp_path, 4500)
    assert {path.stem for path in tmp_path.iterdir()} == {"a", "c", "d", "scans"}
    load_or_build("large", Builder(np.zeros(9999, np.uint8)), tmp_path, 4500)
    assert {path.stem for path in tmp_path.iterdir()} == {"a", "c", "d", "scans"}


def test_a_folder_without_limit_keeps_all_that_is_used(tmp_path):
    for key in "abc":
        load_or_build(key, Builder(), tmp_path, None)
    os.utime(tmp_path / "a.fields", (1, 1))
    os.utime(tmp_path / "b.fields", (1, 1))
    load_or_build("b", Builder(), tmp_path, None)  # used again
    remove_unused(tmp_path, days=30.0)
    remove_unused(tmp_path / "nowhere", days=30.0)
    assert {path.stem for path in tmp_path.iterdir()} == {"b", "c"}


HAMMER = """
import sys
from pathlib import Path
import numpy as np
from firstfix.fields.cache import load_or_build

folder, rng, calls = Path(sys.argv[1]), np.random.default_rng(int(sys.argv[2])), []
build = lambda: calls.append(1) or np.arange(50_000)
for _ in range(60):
    assert (load_or_build("key", build, folder) == np.arange(50_000)).all()
    if rng.random() < 0.3:
        (folder / "key.fields").unlink(missing_ok=True)
assert 1 <= len(calls) < 60
"""


@pytest.mark.slow
def test_processes_share_a_folder(tmp_path):
    processes = [
        subprocess.Popen([sys.executable, "-c", HAMMER, str(tmp_path), str(seed)])
        for seed in range(3)
    ]
    assert [process.wait(240.0) for process in processes] == [0, 0, 0]
    assert not list(tmp_path.glob("*.partial"))


KILLED = """
import os, random, signal, sys, time
from pathlib import Path
import numpy as np
from firstfix.fields.cache import load_or_build

folder, rng, calls = Path(sys.argv[1]), random.Random(1), []
build = lambda: calls.append(1) or np.arange(50_000)
for _ in range(60):
    writer = os.fork()
    while writer == 0:
        (folder / "key.fields").unlink(missing_ok=True)
        load_or_build("key", build, folder)
    time.sleep(rng.uniform(0.0, 0.01))
    os.kill(writer, signal.SIGKILL)
    os.waitpid(writer, 0)
    if (folder / "key.fields").exists():
        known = len(calls)
        assert (load_or_build("key", build, folder) == np.arange(50_000)).all()
        assert len(calls) == known, "half a file"
assert (load_or_build("key", build, folder) == np.arange(50_000)).all()
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork")
def test_a_killed_writer_leaves_a_complete_file_or_none(tmp_path):
    command = [sys.executable, "-c", KILLED, str(tmp_path)]
    done = subprocess.run(command, capture_output=True, check=False)
    assert done.returncode == 0, done.stderr.decode()


def test_a_key_depends_on_everything():
    a = np.arange(6, dtype=np.int32)
    changed = a.copy()
    changed[3] += 1
    keys = [
        content_key(a),
        content_key(changed),
        content_key(a.reshape(2, 3)),
        content_key(a.reshape(3, 2)),
        content_key(a.view(np.uint32)),
        content_key(a.astype(np.int64)),
        content_key(a.tobytes()),
        content_key(a, ""),
        content_key(a, b""),
        content_key("", a),
        content_key("ab", "c"),
        content_key("a", "bc"),
        content_key("abc"),
        content_key(b"abc"),
        content_key(),
    ]
    assert len(set(keys)) == len(keys)
    assert content_key(np.asfortranarray(a.reshape(2, 3))) == content_key(a.reshape(2, 3))
    assert content_key(a, "v1") == content_key(a.copy(), "v1")


def test_an_environment_variable_sets_the_folder(monkeypatch, tmp_path):
    monkeypatch.setenv("FIRSTFIX_CACHE_DIR", str(tmp_path))
    assert cache_folder() == tmp_path
    monkeypatch.setenv("FIRSTFIX_CACHE_DIR", "")
    assert cache_folder().name == "firstfix"
