"""A saved pose is loaded unchanged, and a damaged one is rejected."""

import json
import math
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from firstfix.core.angles import angle_error
from firstfix.core.errors import InputError
from firstfix.core.grid import OccupancyGrid
from firstfix.core.se2 import SE2
from firstfix.io.saved_pose import MAX_POSITION_M, SavedPose, load_pose, map_key, save_pose

COVARIANCE = np.array([[0.04, 0.01, 0.0], [0.01, 0.09, 0.002], [0.0, 0.002, 0.01]])


def pose(**changes) -> SavedPose:
    good = {
        "T_map_base": SE2(1.25, -3.5, 0.5),
        "covariance": COVARIANCE,
        "stamp": 1700000000.123,
        "T_odom_base": SE2(10.0, 5.0, -1.0),
        "map_key": "0123abcd",
    }
    return SavedPose(**(good | changes))


def assert_same(a: SavedPose, b: SavedPose) -> None:
    assert (a.stamp, a.map_key) == (b.stamp, b.map_key)
    assert_array_equal(a.covariance, b.covariance)
    assert (a.T_odom_base is None) == (b.T_odom_base is None)
    for p, q in ((a.T_map_base, b.T_map_base), (a.T_odom_base, b.T_odom_base)):
        if p is not None and q is not None:
            assert (p.x, p.y) == (q.x, q.y)
            assert angle_error(p.yaw, q.yaw) < 1e-15


LENGTHS = st.floats(-MAX_POSITION_M, MAX_POSITION_M)
POSES = st.builds(SE2, LENGTHS, LENGTHS, st.floats(-4.0, 4.0))


@settings(max_examples=50, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    T_map_base=POSES,
    T_odom_base=st.none() | POSES,
    stamp=st.floats(allow_nan=False, allow_infinity=False),
    map_key=st.text(min_size=1, max_size=200),
    root=st.lists(st.floats(-1e5, 1e5), min_size=9, max_size=9),
)
def test_a_saved_pose_is_loaded_unchanged(tmp_path, T_map_base, T_odom_base, stamp, map_key, root):
    matrix = np.array(root).reshape(3, 3)
    saved = SavedPose(T_map_base, matrix @ matrix.T, stamp, T_odom_base, map_key)
    save_pose(tmp_path / "pose.json", saved)
    assert_same(load_pose(tmp_path / "pose.json"), saved)


def test_the_covariance_is_a_read_only_copy():
    matrix = COVARIANCE.copy()
    saved = pose(covariance=matrix)
    matrix[0, 0] = 1.0
    assert_array_equal(saved.covariance, COVARIANCE)
    with pytest.raises(ValueError, match="read-only"):
        saved.covariance[0, 0] = 1.0


def test_a_covariance_of_zeros_is_valid():
    assert_array_equal(pose(covariance=np.zeros((3, 3))).covariance, np.zeros((3, 3)))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"covariance": np.full((3, 3), np.nan)}, "finite"),
        ({"covariance": np.diag([1.0, 1.0, np.inf])}, "finite"),
        ({"covariance": np.diag([1.0, 1.0, 1e13])}, "finite numbers up to"),
        ({"covariance": np.eye(2)}, r"shape \(3, 3\)"),
        ({"covariance": np.triu(np.ones((3, 3)))}, "symmetric"),
        ({"covariance": np.diag([1.0, 1.0, -0.1])}, "negative eigenvalues"),
        ({"covariance": np.array([[1.0, 2.0, 0], [2.0, 1.0, 0], [0, 0, 1]])}, "negative"),
        ({"stamp": math.nan}, "finite stamp"),
        ({"map_key": ""}, "key"),
        ({"map_key": "k" * 201}, "key"),
        ({"T_map_base": SE2(1e10, 0.0, 0.0)}, "position"),
        ({"T_odom_base": SE2(0.0, -1e10, 0.0)}, "position"),
    ],
)
def test_invalid_poses_are_rejected(changes, message):
    with pytest.raises(InputError, match=message):
        pose(**changes)


@pytest.fixture
def damaged(tmp_path):
    """Return a function that loads a file with one changed entry, given as JSON text."""

    def damaged(key: str, value: str) -> SavedPose:
        save_pose(tmp_path / "pose.json", pose())
        document = json.loads((tmp_path / "pose.json").read_text()) | {key: "HERE"}
        text = json.dumps(document).replace('"HERE"', value)
        (tmp_path / "pose.json").write_text(text)
        return load_pose(tmp_path / "pose.json")

    return damaged


@pytest.mark.parametrize("key", ["T_map_base", "T_odom_base"])
@pytest.mark.parametrize(
    "value",
    ["[1, 2]", "[1, 2, 3, 4]", "[1, 2, NaN]", "[1, 2, Infinity]", "[1, 2, 1e999]", "[1, 2, true]",
     '[1, 2, "3"]', "[1, 2, [3]]", "7", '"x"', "{}", "[1e10, 0, 0]", "[1" + "0" * 400 + ", 0, 0]"],
)  # fmt: skip
def test_invalid_poses_in_a_file_are_rejected(damaged, key, value):
    with pytest.raises(InputError, match=r"pose\.json.*delete the file"):
        damaged(key, value)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("T_map_base", "null"),
        ("covariance", "null"),
        ("covariance", "[[1, 0, 0], [0, 1, 0]]"),
        ("covariance", "[[1, 0, 0], [0, 1, 0], [0, 1]]"),
        ("covariance", "[[1, 0, 0], [0, 1, 0], [0, 0, NaN]]"),
        ("covariance", "[[1, 0, 0], [0, 1, 0], [0, 0, -1]]"),
        ("covariance", "[[1, 0, 0], [5, 1, 0], [0, 0, 1]]"),
        ("covariance", "[[1, 5, 0], [5, 1, 0], [0, 0, 1]]"),
        ("stamp", "null"),
        ("stamp", "true"),
        ("stamp", "[1]"),
        ("stamp", "-Infinity"),
        ("map_key", "5"),
        ("map_key", '""'),
        ("format", '"firstfix saved pose 2"'),
        ("format", "[]"),
    ],
)
def test_invalid_entries_are_rejected(damaged, key, value):
    with pytest.raises(InputError, match=r"pose\.json.*delete the file"):
        damaged(key, value)


def test_integers_are_numbers_and_odometry_may_be_missing(damaged):
    assert damaged("T_map_base", "[1, 2, 3]").T_map_base == SE2(1.0, 2.0, 3.0)
    assert damaged("T_odom_base", "null").T_odom_base is None
    assert damaged("note", '"an entry of a later version"').map_key == pose().map_key


@pytest.mark.parametrize(
    "data",
    [b"", b"{", b"[]", b"null", b"[" * 16_000, b'{"a":' * 3_000, b"\xff\xfe\x00", b"\0" * 100,
     b"1" * 16_000, b'{"format": "firstfix saved pose 1"}', b"{}" + b" " * 20_000],
)  # fmt: skip
def test_other_files_are_rejected(tmp_path, data):
    (tmp_path / "pose.json").write_bytes(data)
    with pytest.raises(InputError, match=r"pose\.json") as caught:
        load_pose(tmp_path / "pose.json")
    assert "\n" not in str(caught.value)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.data())
def test_a_damaged_file_is_read_or_rejected(tmp_path, data):
    save_pose(tmp_path / "pose.json", pose())
    content = bytearray((tmp_path / "pose.json").read_bytes())
    for _ in range(data.draw(st.integers(1, 3))):
        at = data.draw(st.integers(0, len(content) - 1))
        content[at] = data.draw(st.sampled_from(b'0e.-,[]{}":nN \xff'))
    cut = data.draw(st.integers(0, len(content)))
    (tmp_path / "pose.json").write_bytes(content[:cut] if cut % 2 else content)
    message = ""
    try:
        load_pose(tmp_path / "pose.json")
    except InputError as error:
        message = str(error)
    assert "\n" not in message


def test_a_truncated_file_is_rejected(tmp_path):
    path = tmp_path / "pose.json"
    save_pose(path, pose())
    content = path.read_bytes()
    assert content.endswith(b"}\n")
    for size in range(len(content) - 1):
        path.write_bytes(content[:size])
        with pytest.raises(InputError, match=r"pose\.json"):
            load_pose(path)
    path.write_bytes(content[:-1])  # all but the end of the line
    assert_same(load_pose(path), pose())


def test_a_missing_file_is_rejected(tmp_path: Path):
    with pytest.raises(InputError, match="expected a saved pose, received no file"):
        load_pose(tmp_path / "pose.json")


def test_a_full_disk_leaves_the_old_pose(tmp_path, full_after):
    save_pose(tmp_path / "pose.json", pose())
    whole = (tmp_path / "pose.json").stat().st_size
    for size in range(whole):
        with full_after(size), pytest.raises(InputError, match="File too large"):
            save_pose(tmp_path / "pose.json", pose(stamp=1700000001.123))
        assert_same(load_pose(tmp_path / "pose.json"), pose())
        assert [path.name for path in tmp_path.iterdir()] == ["pose.json"]
    with full_after(whole):
        save_pose(tmp_path / "pose.json", pose(stamp=1700000001.123))
    assert load_pose(tmp_path / "pose.json").stamp == 1700000001.123


def test_two_threads_that_share_a_file_leave_a_complete_pose(tmp_path):
    path = tmp_path / "pose.json"
    poses = [pose(map_key=letter * 200) for letter in "ab"]
    save_pose(path, poses[0])

    def write(saved: SavedPose) -> None:
        for _ in range(20):
            save_pose(path, saved)

    writers = [threading.Thread(target=write, args=(saved,)) for saved in poses]
    for writer in writers:
        writer.start()
    while any(writer.is_alive() for writer in writers):
        assert load_pose(path).map_key in {saved.map_key for saved in poses}
    assert [path.name for path in tmp_path.iterdir()] == ["pose.json"]


WRITER = """
import sys
import numpy as np
from firstfix.core.se2 import SE2
from firstfix.io.saved_pose import SavedPose, load_pose, save_pose

path, letter = sys.argv[1:]
for i in range(200):
    here = SE2(float(ord(letter)), 0.0, 0.0)
    save_pose(path, SavedPose(here, np.eye(3), float(i), here, letter * 200))
    seen = load_pose(path)
    assert seen.map_key == chr(int(seen.T_map_base.x)) * 200, "two poses in one"
"""


@pytest.mark.slow
def test_two_processes_that_share_a_file_leave_a_complete_pose(tmp_path):
    path = tmp_path / "pose.json"
    save_pose(path, pose(map_key="a" * 200))
    writers = [
        subprocess.Popen([sys.executable, "-c", WRITER, path, letter], stderr=subprocess.PIPE)
        for letter in "ab"
    ]
    while any(writer.poll() is None for writer in writers):
        assert load_pose(path).map_key in {"a" * 200, "b" * 200}
    assert [writer.communicate()[1] for writer in writers] == [b"", b""]
    assert [found.name for found in tmp_path.iterdir()] == ["pose.json"]


def test_the_key_depends_on_cells_and_place_of_a_map():
    cells = np.zeros((3, 4), np.int8)
    wall = cells.copy()
    wall[1, 2] = 100
    origin = SE2(1.0, 2.0, 0.5)
    grid = OccupancyGrid(cells, 0.05, origin)
    others = [
        OccupancyGrid(wall, 0.05, origin),
        OccupancyGrid(cells.T, 0.05, origin),
        OccupancyGrid(cells, 0.1, origin),
        OccupancyGrid(cells, 0.05, SE2(1.0, 2.0, 0.6)),
    ]
    assert map_key(grid) == map_key(OccupancyGrid(cells.copy(), 0.05, origin))
    assert len({map_key(each) for each in (grid, *others)}) == 5
    assert pose(map_key=map_key(grid)).map_key == map_key(grid)
