import os
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays, scalar_dtypes

from firstfix.fields import cache
from firstfix.fields.cache import cache_folder, content_key, load_or_build

plain = scalar_dtypes().filter(lambda dtype: dtype.kind in "biufc")
any_array = plain.flatmap(lambda dtype: arrays(dtype, array_shapes(min_dims=0, min_side=0)))
into_one_folder = settings(
    deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)


class Builder:
    """Counts how often it was needed."""

    def __init__(self, arrays=None):
        self.calls = 0
        self.arrays = arrays or {
            "squares": np.arange(300, dtype=np.uint16).reshape(20, 15),
            "scale": np.array(0.05),
        }

    def __call__(self):
        self.calls += 1
        return dict(self.arrays)


def assert_equal_arrays(actual, expected):
    assert list(actual) == list(expected)
    for name, array in expected.items():
        assert actual[name].dtype == array.dtype
        assert actual[name].shape == array.shape
        assert actual[name].tobytes() == array.tobytes()
        assert not actual[name].flags.writeable


def only_file(folder: Path) -> Path:
    (path,) = folder.iterdir()
    return path


@into_one_folder
@given(st.dictionaries(st.text(), any_array, max_size=4))
def test_what_comes_back_is_what_was_built(tmp_path_factory, contents):
    folder = tmp_path_factory.mktemp("cache")
    builder = Builder()
    builder.arrays = contents
    assert_equal_arrays(load_or_build("key", builder, folder), contents)
    assert_equal_arrays(load_or_build("key", builder, folder), contents)
    assert builder.calls == 1


def test_slices_and_fortran_order_come_back_in_shape(tmp_path):
    grid = np.arange(60).reshape(6, 10)
    builder = Builder(
        {"columns": grid[:, ::3], "turned": grid.T, "fortran": np.asfortranarray(grid)}
    )
    for _ in range(2):
        assert_equal_arrays(load_or_build("key", builder, tmp_path), builder.arrays)
    assert builder.calls == 1


def test_arrays_lie_aligned_in_the_file(tmp_path):
    load_or_build("key", Builder({"a": np.ones(3, np.uint8), "b": np.full(2, 7.0)}), tmp_path)
    content = only_file(tmp_path).read_bytes()
    assert content.index(np.full(2, 7.0).tobytes()) % 64 == 0


def test_keys_are_kept_apart(tmp_path):
    one, two = Builder({"a": np.ones(3)}), Builder({"a": np.zeros(3)})
    load_or_build("one", one, tmp_path)
    load_or_build("two", two, tmp_path)
    (tmp_path / "one.fields").replace(tmp_path / "two.fields")  # a file under a wrong name
    assert_equal_arrays(load_or_build("two", two, tmp_path), two.arrays)
    assert_equal_arrays(load_or_build("two", two, tmp_path), two.arrays)
    assert two.calls == 2


@into_one_folder
@given(st.data())
def test_a_file_with_flipped_bits_is_built_again(tmp_path, data):
    builder = Builder()
    load_or_build("key", builder, tmp_path)
    path = tmp_path / "key.fields"
    content = bytearray(path.read_bytes())
    for _ in range(data.draw(st.integers(1, 3))):
        content[data.draw(st.integers(0, len(content) - 1))] ^= data.draw(st.integers(1, 255))
    path.write_bytes(content)
    assert_equal_arrays(load_or_build("key", builder, tmp_path), builder.arrays)
    calls = builder.calls
    assert_equal_arrays(load_or_build("key", builder, tmp_path), builder.arrays)
    assert builder.calls == calls  # it was replaced by a sound one


@into_one_folder
@given(st.floats(0, 1, exclude_max=True))
def test_a_cut_file_is_built_again(tmp_path, share):
    builder = Builder()
    load_or_build("key", builder, tmp_path)
    path = tmp_path / "key.fields"
    size = path.stat().st_size
    os.truncate(path, int(share * size))
    calls = builder.calls
    assert_equal_arrays(load_or_build("key", builder, tmp_path), builder.arrays)
    assert builder.calls == calls + 1
    assert path.stat().st_size == size


def test_a_file_cut_at_any_byte_is_built_again(tmp_path):
    builder = Builder({"a": np.arange(5, dtype=np.uint8), "b": np.array(0.5)})
    load_or_build("key", builder, tmp_path)
    content = only_file(tmp_path).read_bytes()
    for size in range(len(content)):
        (tmp_path / "key.fields").write_bytes(content[:size])
        assert_equal_arrays(load_or_build("key", builder, tmp_path), builder.arrays)
        assert builder.calls == 2 + size
        assert only_file(tmp_path).read_bytes() == content


@into_one_folder
@given(st.binary(max_size=200))
def test_a_foreign_file_is_built_again(tmp_path, content):
    path = tmp_path / "key.fields"
    path.write_bytes(content)
    builder = Builder()
    for _ in range(2):
        assert_equal_arrays(load_or_build("key", builder, tmp_path), builder.arrays)
    assert builder.calls == 1


@pytest.mark.parametrize("code", ["|O", "<U3", "V8", "<f4,<f4", "nonsense"])
def test_a_sound_file_with_other_than_plain_numbers_is_not_believed(tmp_path, monkeypatch, code):
    strange = np.zeros(8, np.uint8).view([("dtype", "u1")])
    with monkeypatch.context() as patch:
        patch.setattr(cache, "_check_plain", lambda array: None)
        patch.setattr(cache, "_encode", _encode_as(code))
        load_or_build("key", Builder({"a": strange}), tmp_path)
    builder = Builder()
    assert_equal_arrays(load_or_build("key", builder, tmp_path), builder.arrays)
    assert builder.calls == 1


def _encode_as(code):
    encode = cache._encode

    class Pretender:
        shape, nbytes, dtype = (1,), 8, type("Code", (), {"str": code})

        def __array__(self, dtype=None, copy=None):
            return np.zeros(8, np.uint8)

    return lambda key, arrays: encode(key, dict.fromkeys(arrays, Pretender()))


def test_another_version_is_built_again(tmp_path, monkeypatch):
    builder = Builder()
    load_or_build("key", builder, tmp_path)
    monkeypatch.setattr(cache, "_MAGIC", b"firstfix cache 2")
    for _ in range(2):
        assert_equal_arrays(load_or_build("key", builder, tmp_path), builder.arrays)
    assert builder.calls == 2


def _full(*args, **kwargs):
    raise OSError(28, "No space left on device")


@pytest.mark.parametrize("where", ["mkdir", "mkstemp", "replace", "write"])
def test_a_disk_that_takes_nothing_costs_only_time(tmp_path, monkeypatch, where):
    if where == "mkdir":
        monkeypatch.setattr(Path, "mkdir", _full)
    elif where == "mkstemp":
        monkeypatch.setattr(tempfile, "mkstemp", _full)
    elif where == "replace":
        monkeypatch.setattr(Path, "replace", _full)
    else:
        monkeypatch.setattr(os, "fdopen", _open_full)
    builder = Builder()
    for _ in range(2):
        assert_equal_arrays(load_or_build("key", builder, tmp_path), builder.arrays)
    assert builder.calls == 2
    assert not list(tmp_path.iterdir())  # no rest of a file is left


def _open_full(descriptor, mode):
    os.close(descriptor)
    raise OSError(28, "No space left on device")


def test_a_disk_that_is_full_after_any_byte_costs_only_time(tmp_path, full_after):
    builder = Builder({"a": np.arange(100, dtype=np.uint8)})
    load_or_build("whole", builder, tmp_path)
    size = only_file(tmp_path).stat().st_size - len("whole") + len("key")
    for most in range(0, size, 7):
        with full_after(most):
            assert_equal_arrays(load_or_build("key", builder, tmp_path), builder.arrays)
        assert only_file(tmp_path).name == "whole.fields"  # no rest of a file is left
    load_or_build("key", builder, tmp_path)
    assert (tmp_path / "key.fields").exists()


SMALL_DISK = """
import subprocess, sys
from pathlib import Path
import numpy as np
from firstfix.fields.cache import load_or_build

disk, calls = Path(sys.argv[1]), []
folder = disk / "cache"

def load(key, size):
    load_or_build(key, lambda: calls.append(key) or {"a": np.arange(size)}, folder)["a"][-1]
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
assert load("small", 2_000) == ["small.fields"]  # read, though nobody can note that it was used
assert calls == ["large", "small", "other", "other"]
subprocess.run(["mount", "-o", "remount,rw", disk], check=True)
(disk / "ballast").unlink()
assert load("other", 2_000) == ["other.fields", "small.fields"]
"""


def test_a_disk_that_is_full_or_read_only_is_read_and_not_missed(on_small_disk):
    on_small_disk(SMALL_DISK)


def test_a_folder_that_cannot_be_is_done_without(tmp_path):
    (tmp_path / "file").write_text("not a folder")
    (tmp_path / "key.fields").mkdir()  # a folder where the file should be
    builder = Builder()
    for folder in (tmp_path / "file", tmp_path / "file" / "below", tmp_path):
        assert_equal_arrays(load_or_build("key", builder, folder), builder.arrays)
    assert builder.calls == 3


@pytest.mark.skipif(os.name != "posix" or os.geteuid() == 0, reason="root may write everywhere")
def test_a_read_only_folder_is_read_and_not_missed(tmp_path):
    builder = Builder()
    load_or_build("key", builder, tmp_path)
    tmp_path.chmod(0o500)
    try:
        for key in ("key", "other"):
            assert_equal_arrays(load_or_build(key, builder, tmp_path), builder.arrays)
    finally:
        tmp_path.chmod(0o700)
    assert builder.calls == 2


def test_an_error_while_building_is_the_callers(tmp_path):
    def build():
        raise RuntimeError("no map")

    with pytest.raises(RuntimeError, match="no map"):
        load_or_build("key", build, tmp_path)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("array", [np.array([{}]), np.array(["text"]), np.zeros(2, "f4,f4")])
def test_only_plain_numbers_are_kept(tmp_path, array):
    with pytest.raises(TypeError, match="plain numbers"):
        load_or_build("key", lambda: {"a": array}, tmp_path)
    with pytest.raises(TypeError, match="plain numbers"):
        content_key(array)


@pytest.mark.parametrize("key", ["", "../key", "a/b", "a b", "ключ", ".", "nul\0"])
def test_a_key_cannot_leave_the_folder(tmp_path, key):
    with pytest.raises(ValueError, match="letters and digits"):
        load_or_build(key, Builder(), tmp_path)


def test_the_least_recently_used_file_goes_first(tmp_path, monkeypatch):
    monkeypatch.setattr(cache, "MAX_TOTAL_BYTES", 3500)
    kilobyte = Builder({"a": np.zeros(1000, np.uint8)})
    for age, key in enumerate(["c", "b", "a"]):
        load_or_build(key, kilobyte, tmp_path)
        os.utime(tmp_path / f"{key}.fields", (age + 1, age + 1))
    load_or_build("c", kilobyte, tmp_path)  # the oldest, used again
    load_or_build("d", kilobyte, tmp_path)
    assert {path.stem for path in tmp_path.iterdir()} == {"a", "c", "d"}
    load_or_build("large", Builder({"a": np.zeros(9999, np.uint8)}), tmp_path)
    assert {path.stem for path in tmp_path.iterdir()} == {"a", "c", "d"}


def test_what_a_crash_left_is_cleared_after_a_day(tmp_path):
    old, new = tmp_path / "old.partial", tmp_path / "new.partial"
    for path in (old, new):
        path.write_bytes(b"half")
    os.utime(old, (time.time() - 1e6,) * 2)
    load_or_build("key", Builder(), tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == {"new.partial", "key.fields"}


HAMMER = """
import sys
from pathlib import Path
import numpy as np
from firstfix.fields.cache import load_or_build

folder, rng, calls = Path(sys.argv[1]), np.random.default_rng(int(sys.argv[2])), []
build = lambda: calls.append(1) or {"a": np.arange(50_000)}
for _ in range(60):
    assert (load_or_build("key", build, folder)["a"] == np.arange(50_000)).all()
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
    assert [process.wait(60) for process in processes] == [0, 0, 0]
    assert not list(tmp_path.glob("*.partial"))


KILLED = """
import os, random, signal, sys, time
from pathlib import Path
import numpy as np
from firstfix.fields.cache import load_or_build

folder, rng, calls = Path(sys.argv[1]), random.Random(1), []
build = lambda: calls.append(1) or {"a": np.arange(50_000)}
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
        assert (load_or_build("key", build, folder)["a"] == np.arange(50_000)).all()
        assert len(calls) == known, "half a file"
assert (load_or_build("key", build, folder)["a"] == np.arange(50_000)).all()
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no processes that are copies")
def test_whoever_is_killed_while_writing_leaves_a_whole_file_or_none(tmp_path):
    command = [sys.executable, "-c", KILLED, str(tmp_path)]
    done = subprocess.run(command, capture_output=True, check=False)
    assert done.returncode == 0, done.stderr.decode()


def test_a_file_that_somebody_writes_over_while_it_is_read_is_never_believed(tmp_path):
    builder, is_over = Builder({"a": np.arange(50_000)}), threading.Event()
    load_or_build("key", builder, tmp_path)
    path = tmp_path / "key.fields"
    content = path.read_bytes()

    def scribble():
        rng = np.random.default_rng(0)
        while not is_over.is_set():
            at = int(rng.integers(len(content) - 1000))
            path.write_bytes(content[:at] + rng.bytes(1000) + content[at + 1000 :])
            path.write_bytes(content)

    scribbling = threading.Thread(target=scribble)
    scribbling.start()
    for _ in range(100):
        assert_equal_arrays(load_or_build("key", builder, tmp_path), builder.arrays)
    is_over.set()
    scribbling.join()
    assert builder.calls > 1


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


def test_the_environment_names_the_folder(monkeypatch, tmp_path):
    monkeypatch.setenv("FIRSTFIX_CACHE_DIR", str(tmp_path))
    assert cache_folder() == tmp_path
    monkeypatch.setenv("FIRSTFIX_CACHE_DIR", "")
    assert cache_folder().name == "firstfix"
