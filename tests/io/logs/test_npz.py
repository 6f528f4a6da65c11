"""Recordings in .npz files."""

import io
import math
import struct
import time
import zipfile
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from firstfix.core.errors import ScanError
from firstfix.core.recording import Recording
from firstfix.core.scan import LaserScan, Mounting
from firstfix.core.se2 import SE2
from firstfix.core.trajectory import Trajectory
from firstfix.io.logs.npz import load_npz, read_scan, save_recording

Write = Callable[..., Path]


@pytest.fixture
def write(tmp_path: Path) -> Write:
    """Return a function that writes a file of three scans, with changes."""

    def write(**changes: Any) -> Path:
        arrays: dict[str, Any] = {
            "ranges": np.arange(12, dtype=np.float32).reshape(3, 4),
            "angle_min": -0.3,
            "angle_increment": 0.2,
            "range_min": 0.1,
            "range_max": 10.0,
        }
        arrays = {k: v for k, v in (arrays | changes).items() if v is not None}
        np.savez(tmp_path / "scans.npz", **arrays)
        return tmp_path / "scans.npz"

    return write


def test_defaults_are_index_stamps_and_the_sensor_as_base(write: Write) -> None:
    recording = load_npz(write())
    assert [scan.stamp for scan in recording.scans] == [0.0, 1.0, 2.0]
    assert_array_equal(recording.scans[1].ranges, [4, 5, 6, 7])
    scan = recording.scans[0]
    assert (scan.angle_min, scan.angle_increment) == (-0.3, 0.2)
    assert (scan.range_min, scan.range_max) == (0.1, 10.0)
    assert scan.T_base_laser == SE2.identity()
    assert recording.odometry is None
    assert recording.truth is None
    assert recording.runs is None
    assert recording.notes == ()


def test_a_single_scan_may_be_a_plain_row(write: Write) -> None:
    assert len(load_npz(write(ranges=np.ones(5)))) == 1


def test_all_optional_arrays_are_read(write: Write) -> None:
    poses = np.array([[0.0, 1.0, 2.0], [3.0, 4.0, 5.0 - 2.0 * np.pi], [np.nan] * 3])
    recording = load_npz(
        write(stamp=[5.0, 6.0, 6.5], true_pose=poses, odom=poses, run_id=[0, 0, 1])
    )
    assert recording.truth is not None
    assert recording.odometry is not None
    assert recording.runs is not None
    assert_allclose(recording.truth, poses)
    # Unknown poses are not part of the trajectory.
    assert_array_equal(recording.odometry.stamps, [5.0, 6.0])
    assert_allclose(recording.odometry.poses, poses[:2])
    assert_array_equal(recording.runs, [0, 0, 1])


def test_odometry_of_nan_is_none(write: Write) -> None:
    assert load_npz(write(odom=np.full((3, 3), np.nan))).odometry is None


def test_poses_of_the_sensor_become_poses_of_the_base(write: Write) -> None:
    T_base_laser = SE2(0.2, -0.1, 2.0)
    T_map_base = SE2(3.0, 4.0, -1.0)
    sensor = np.tile((T_map_base @ T_base_laser).as_array(), (3, 1))
    recording = load_npz(write(true_pose=sensor, T_base_laser=T_base_laser.as_array()))
    assert recording.truth is not None
    assert_allclose(recording.truth[2], T_map_base.as_array())
    assert recording.scans[0].T_base_laser == T_base_laser


def test_jitter_of_stamps_is_sorted_in_all_arrays(write: Write) -> None:
    pose = np.array([[0.0, 0, 0], [2.0, 0, 0], [1.0, 0, 0]])
    recording = load_npz(write(stamp=[0.0, 2.0, 1.9], true_pose=pose, odom=pose, run_id=[0, 2, 1]))
    assert recording.truth is not None
    assert recording.odometry is not None
    assert recording.runs is not None
    assert [scan.ranges[0] for scan in recording.scans] == [0, 8, 4]
    assert_array_equal(recording.truth[:, 0], [0, 1, 2])
    assert_array_equal(recording.odometry.poses[:, 0], [0, 1, 2])
    assert_array_equal(recording.runs, [0, 1, 2])
    assert "sorted by stamp" in recording.notes[0]


def test_max_scans_limits_all_arrays(write: Write) -> None:
    recording = load_npz(write(true_pose=np.zeros((3, 3)), odom=np.zeros((3, 3))), max_scans=2)
    assert len(recording) == 2
    assert recording.truth is not None
    assert len(recording.truth) == 2
    with pytest.raises(ScanError, match="max_scans of at least 1"):
        load_npz(write(), max_scans=0)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"ranges": None}, "the array `ranges`"),
        ({"range_max": None}, "the array `range_max`"),
        ({"ranges": np.ones((2, 2, 2))}, r"shape \(n, beams\)"),
        ({"ranges": np.float64(3.0)}, r"shape \(n, beams\)"),
        ({"ranges": np.ones((0, 4))}, "at least one scan"),
        ({"ranges": np.ones((3, 0))}, "1 to 100000 ranges"),
        ({"ranges": np.ones((1, 100_001))}, "1 to 100000 ranges"),
        ({"ranges": np.array(["a", "b"])}, "numbers in the array `ranges`"),
        ({"ranges": np.ones((3, 4), complex)}, "numbers in the array `ranges`"),
        ({"angle_increment": 0.0}, "angle_increment 0.0 in scan 0 in .*scans.npz"),
        ({"angle_increment": np.zeros(3)}, "one number `angle_increment`"),
        ({"angle_min": np.nan}, "finite angle_min"),
        ({"range_max": 0.0}, "range_max above range_min"),
        ({"stamp": np.zeros(2)}, r"`stamp` of shape \(3,\)"),
        ({"stamp": [0.0, 5.0, 1.0]}, "a step back at scan 2"),
        ({"stamp": [0.0, np.nan, 1.0]}, "ascending"),
        ({"odom": np.zeros((3, 2))}, r"`odom` of shape \(3, 3\)"),
        ({"true_pose": np.full((3, 3), np.inf)}, "finite poses in `true_pose`"),
        ({"run_id": [0.0, np.nan, 1.0]}, "run_id below"),
        ({"T_base_laser": [0.0, np.nan, 0.0]}, "finite numbers"),
    ],
)
def test_inconsistent_arrays_are_rejected(
    write: Write, changes: dict[str, Any], message: str
) -> None:
    with pytest.raises(ScanError, match=message):
        load_npz(write(**changes))


def test_scans_without_any_return_are_valid(write: Write) -> None:
    nothing = np.array([[np.nan] * 4, [np.inf] * 4, [0.0, -1.0, -np.inf, 0.0]])
    recording = load_npz(write(ranges=nothing))
    assert not any(scan.hit.any() for scan in recording.scans)
    assert recording.scans[1].no_return.all()


def test_pickles_are_never_loaded(write: Write) -> None:
    with pytest.raises(ScanError, match="allow_pickle=False"):
        load_npz(write(ranges=np.array([{}, []], dtype=object)))


def _archive(path: Path, header: str, body: bytes) -> Path:
    text = header.encode().ljust(118 - 1) + b"\n"
    stream = b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text + body
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("ranges.npy", stream)
    return path


@pytest.mark.parametrize(
    "header",
    [
        "{'descr': '<f4', 'fortran_order': False, 'shape': (1000000000, 1000000000), }",
        "{'descr': '<f4', 'fortran_order': False, 'shape': (-1, 4), }",
        "{'descr': '<f4', 'fortran_order': False, 'shape': (1000, 1000), }",
        "{'descr': '<f4', 'fortran_order': False, }",
        "{'descr': '|O', 'fortran_order': False, 'shape': (4,), }",
        "[" * 110,
    ],
)
def test_false_headers_are_rejected(tmp_path: Path, header: str) -> None:
    with pytest.raises(ScanError):
        load_npz(_archive(tmp_path / "lie.npz", header, b"\0" * 64))


def test_an_archive_that_unpacks_to_too_much_is_rejected_first(tmp_path: Path) -> None:
    path = tmp_path / "bomb.npz"
    shape = (300_000, 1_000)  # 1.2 GB of zeros in about a megabyte
    stream = io.BytesIO()
    np.lib.format.write_array_header_1_0(
        stream, {"descr": "<f4", "fortran_order": False, "shape": shape}
    )
    zeros = bytes(1 << 20)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        archive.writestr("ranges.npy", stream.getvalue() + zeros)
    # A directory that promises what the header does, as the real bomb's would.
    data = path.read_bytes()
    size = struct.pack("<L", len(stream.getvalue()) + len(zeros))
    lie = struct.pack("<L", len(stream.getvalue()) + 4 * shape[0] * shape[1])
    path.write_bytes(data.replace(size, lie))
    start = time.process_time()
    with pytest.raises(ScanError, match="bytes in total"):
        load_npz(path)
    assert time.process_time() - start < 1.0


def test_other_files_are_rejected(tmp_path: Path) -> None:
    path = tmp_path / "scans.npz"
    with pytest.raises(ScanError, match=r"an \.npz archive that can be read"):
        load_npz(path)
    path.write_bytes(b"PK\x03\x04 not really")
    with pytest.raises(ScanError, match=r"an \.npz archive that can be read"):
        load_npz(path)


@settings(
    max_examples=2 * settings.default.max_examples,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
@given(data=st.data())
def test_damage_is_always_a_scan_error(write: Write, data: st.DataObject) -> None:
    path = write(stamp=np.arange(3.0), odom=np.zeros((3, 3)))
    content = bytearray(path.read_bytes())
    for _ in range(data.draw(st.integers(1, 4))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    path.write_bytes(content[: data.draw(st.integers(0, len(content)))] or content)
    with suppress(ScanError):
        load_npz(path)


def _recording(mounting: Mounting = Mounting.UPRIGHT) -> Recording:
    scans = tuple(
        LaserScan(
            np.linspace(1.0, 3.0, 5) + i,
            -0.5,
            0.3,
            0.1,
            9.0,
            10.0 + i,
            SE2(0.1, -0.2, 0.3),
            mounting,
        )
        for i in range(3)
    )
    return Recording(
        scans,
        odometry=Trajectory(np.array([10.0, 11.0]), np.array([[0.0, 0, 0], [1.0, 2, 3]])),
        truth=np.array([[1.0, 2.0, 3.0], [np.nan] * 3, [4.0, 5.0, -3.0]]),
        runs=np.array([0, 0, 7]),
    )


@pytest.mark.parametrize("mounting", Mounting)
def test_a_saved_recording_is_loaded_unchanged(tmp_path: Path, mounting: Mounting) -> None:
    before = _recording(mounting)
    save_recording(before, tmp_path / "a.npz")
    after = load_npz(tmp_path / "a.npz")
    for a, b in zip(before.scans, after.scans, strict=True):
        assert_array_equal(a.ranges, b.ranges)
        assert_allclose(a.points(), b.points(), atol=1e-12)
        assert (a.stamp, a.range_min, a.range_max) == (b.stamp, b.range_min, b.range_max)
    assert before.truth is not None
    assert before.odometry is not None
    assert before.runs is not None
    assert after.truth is not None
    assert after.odometry is not None
    assert after.runs is not None
    assert_allclose(before.truth, after.truth, atol=1e-12)
    assert_array_equal(before.odometry.stamps, after.odometry.stamps)
    assert_allclose(before.odometry.poses, after.odometry.poses, atol=1e-12)
    assert_array_equal(before.runs, after.runs)


def test_saving_replaces_the_file_and_leaves_no_draft(tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    path.write_text("old")
    save_recording(Recording(_recording().scans), path)
    assert [p.name for p in tmp_path.iterdir()] == ["a.npz"]
    assert load_npz(path).truth is None


def test_scans_of_two_sensors_are_rejected(tmp_path: Path) -> None:
    other = LaserScan(np.ones(3), 0.0, 0.1, 0.0, 9.0)
    with pytest.raises(ScanError, match="scans of one sensor"):
        save_recording(Recording((*_recording().scans, other)), tmp_path / "a.npz")
    assert not list(tmp_path.iterdir())


@pytest.mark.shared
def test_every_case_loads(shared: Path) -> None:
    cases = sorted((shared / "cases").glob("*/scans.npz"))
    assert cases
    for path in cases:
        recording = load_npz(path)
        assert recording.truth is not None
        assert np.isfinite(recording.truth).all()
        assert np.mean([scan.hit.mean() for scan in recording.scans]) > 0.2


def packed(**arrays) -> io.BytesIO:
    file = io.BytesIO()
    np.savez_compressed(file, **{**SENT, **arrays})
    file.seek(0)
    return file


SENT = {
    "ranges": np.array([1.0, 2.0, np.inf], np.float32),
    "angle_min": -1.0,
    "angle_increment": 0.5,
    "range_min": 0.1,
    "range_max": 8.0,
}


def test_a_sent_scan_is_read_with_its_pose_on_the_robot():
    scan = read_scan(packed(T_base_laser=[0.1, 0.2, 0.3]), 10_000)
    assert scan.ranges.tolist() == [1.0, 2.0, math.inf]
    assert scan.T_base_laser == SE2(0.1, 0.2, 0.3)


@pytest.mark.parametrize(
    "arrays",
    [
        {"ranges": np.ones((2, 3))},
        {"ranges": np.empty((0, 3))},
        {"ranges": np.zeros(1_000_000)},  # packs to a thousandth
        {"ranges": np.array([None], object)},
        {"range_max": -1.0},
    ],
)
def test_several_scans_and_large_archives_are_rejected(arrays):
    with pytest.raises(ScanError, match=r"the data sent|one by one|split"):
        read_scan(packed(**arrays), 10_000)
