"""Recordings from CARMEN logs."""

import gzip
import math
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from firstfix.core.errors import ScanError
from firstfix.core.scan import Mounting
from firstfix.core.se2 import SE2
from firstfix.io.logs import carmen_log
from firstfix.io.logs.carmen import load_carmen
from firstfix.io.logs.checks import SORTED_AHEAD

Write = Callable[..., Path]


@pytest.fixture
def write(tmp_path: Path) -> Write:
    """Return a function that writes lines into a log."""

    def write(*lines: str, name: str = "a.log", end: str = "\n") -> Path:
        content = ("\n".join(lines) + end).encode()
        path = tmp_path / name
        path.write_bytes(gzip.compress(content) if name.endswith(".gz") else content)
        return path

    return write


def old_laser(
    ranges: str | list[float] = "1 2 3",
    laser: str = "0 0 0",
    robot: str = "0 0 0",
    stamp: str = "1.5",
    kind: str = "FLASER",
) -> str:
    words = ranges.split() if isinstance(ranges, str) else [f"{r:g}" for r in ranges]
    return f"{kind} {len(words)} {' '.join(words)} {laser} {robot} {stamp} host {stamp}"


def robot_laser(
    stamp: str = "1.5", laser: str = "0.1 0 0", robot: str = "0 0 0", limit: str = "81.92"
) -> str:
    config = f"0 -1.0 2.0 0.5 {limit} 0.01 0"
    return (
        f"ROBOTLASER1 {config} 5 1 2 80.5 81.91 3 2 0.5 0.5 {laser} {robot} "
        f"0.1 0.2 0.3 0.4 0.5 {stamp} host {stamp}"
    )


def driven(n: int, kind: str = "FLASER") -> list[str]:
    return [
        old_laser(robot=f"{i} 0 0", laser=f"{i} 0 0", stamp=f"{i}", kind=kind) for i in range(n)
    ]


@pytest.mark.parametrize(
    ("n", "first", "step", "last"),
    [
        (180, -90.0, 1.0, 89.0),
        (181, -90.0, 1.0, 90.0),
        (360, -90.0, 0.5, 89.5),
        (361, -90.0, 0.5, 90.0),
        (400, -50.0, 0.25, 49.75),
        (401, -50.0, 0.25, 50.0),
        (91, -90.0, 2.0, 90.0),
    ],
)
def test_beams_of_an_old_line_are_known_from_their_number(
    write: Write, n: int, first: float, step: float, last: float
) -> None:
    scan = load_carmen(write(old_laser([1.0] * n))).scans[0]
    assert len(scan) == n
    assert_allclose(np.degrees([scan.bearings[0], scan.bearings[-1]]), [first, last])
    assert math.degrees(scan.angle_increment) == pytest.approx(step)
    assert scan.mounting is Mounting.UPRIGHT


def test_a_single_beam_is_a_scan(write: Write) -> None:
    assert len(load_carmen(write(old_laser("2.5"))).scans[0]) == 1


def test_eighty_metres_and_more_mean_that_nothing_came_back(write: Write) -> None:
    scan = load_carmen(write(old_laser("79.9 80 81.83 81.91 0"))).scans[0]
    assert_array_equal(scan.hit, [True, False, False, False, False])
    assert_array_equal(scan.no_return, [False, True, True, True, False])


def test_a_log_can_set_a_nearer_limit_but_no_farther_one(write: Write) -> None:
    near = write("PARAM robot_front_laser_max 8.1 nohost 0", old_laser("8.0 8.15"))
    assert_array_equal(load_carmen(near).scans[0].no_return, [False, True])
    far = write("PARAM robot_front_laser_max 100 nohost 0", old_laser("8.0 81.83"))
    assert_array_equal(load_carmen(far).scans[0].no_return, [False, True])


def test_a_new_line_has_the_bearings_of_its_beams(write: Write) -> None:
    recording = load_carmen(write(robot_laser()))
    scan = recording.scans[0]
    assert_allclose(scan.bearings, [-1.0, -0.5, 0.0, 0.5, 1.0])
    assert_allclose(scan.ranges, [1, 2, 80.5, 81.91, 3])
    assert_array_equal(scan.no_return, [False, False, True, True, False])
    assert scan.stamp == 1.5
    assert scan.T_base_laser == SE2(0.1, 0.0, 0.0)
    nearer = load_carmen(write(robot_laser(limit="2.5"))).scans[0]
    assert_array_equal(nearer.no_return, [False, False, True, True, True])


def test_odometry_is_the_robot_pose_of_the_scan_lines(write: Write) -> None:
    recording = load_carmen(write(*driven(3)))
    assert recording.odometry is not None
    assert_array_equal(recording.odometry.stamps, [0, 1, 2])
    assert_array_equal(recording.odometry.poses[:, 0], [0, 1, 2])
    assert recording.truth is None


def test_odom_lines_fill_in_where_scan_lines_never_move(write: Write) -> None:
    odom = [f"ODOM {i} 0 0 0 0 0 {i}.5 host {i}.5" for i in (0, 2, 1)]
    recording = load_carmen(write(old_laser(stamp="0.5"), *odom, old_laser(stamp="2")))
    assert recording.odometry is not None
    assert_array_equal(recording.odometry.stamps, [0.5, 1.5, 2.5])
    assert_array_equal(recording.odometry.poses[:, 0], [0, 1, 2])


def test_named_offsets_place_the_laser(write: Write) -> None:
    log = write(
        "PARAM robot_frontlaser_offset 0.3 nohost 0",
        "PARAM robot_frontlaser_side_offset -0.1 nohost 0",
        "PARAM robot_frontlaser_angular_offset 0.5 nohost 0",
        old_laser(),
    )
    assert load_carmen(log).scans[0].T_base_laser == SE2(0.3, -0.1, 0.5)


def test_a_steady_difference_of_the_poses_places_the_laser(write: Write) -> None:
    T_base_laser = SE2(0.2, 0.0, 0.0)
    lines = ["PARAM robot_frontlaser_offset 0.0 nohost 0"]
    for i in range(5):
        robot = SE2(float(i), 1.0, 0.4 * i)
        laser = robot @ T_base_laser
        poses = [f"{p.x} {p.y} {p.yaw}" for p in (laser, robot)]
        lines.append(old_laser(laser=poses[0], robot=poses[1], stamp=str(i)))
    recording = load_carmen(write(*lines))
    assert_allclose(recording.scans[0].T_base_laser.as_array(), T_base_laser.as_array(), atol=1e-9)
    assert recording.notes == ()


def test_corrected_poses_do_not_place_the_laser(write: Write) -> None:
    lines = [old_laser(laser=f"{1.1 * i} 0 0", robot=f"{i} 0 0", stamp=str(i)) for i in range(30)]
    # A reader that stopped at the second scan would take the correction for an offset.
    for recording in (load_carmen(write(*lines[1:])), load_carmen(write(*lines[1:]), max_scans=2)):
        assert recording.scans[0].T_base_laser == SE2.identity()
        assert "corrected" in recording.notes[0]
    recording = load_carmen(write("PARAM robot_frontlaser_offset 0.0 nohost 0", *lines))
    assert recording.notes == ()


def test_a_rear_laser_looks_backwards(write: Write) -> None:
    rear = old_laser("1 2 3", kind="RLASER")
    scan = load_carmen(write(rear, old_laser("5")), kind="RLASER").scans[0]
    assert scan.T_base_laser == SE2(0.0, 0.0, math.pi)
    assert_allclose(scan.points()[1], [-2.0, 0.0], atol=1e-9)
    log = write("PARAM robot_rearlaser_offset -0.3 nohost 0", rear)
    assert load_carmen(log).scans[0].T_base_laser == SE2(-0.3, 0.0, math.pi)
    log = write(old_laser(laser=f"-0.25 0 {math.pi}", kind="RLASER"))
    assert load_carmen(log).scans[0].T_base_laser == SE2(-0.25, 0.0, math.pi)


def test_the_front_laser_is_preferred_wherever_it_turns_up(write: Write) -> None:
    log = write(old_laser("9", kind="RLASER"), robot_laser(), old_laser("7 7"), robot_laser())
    assert len(load_carmen(log).scans[0]) == 2
    assert len(load_carmen(log)) == 1
    assert len(load_carmen(log, kind="ROBOTLASER1")) == 2
    assert len(load_carmen(log, kind="RLASER").scans[0]) == 1
    assert len(load_carmen(write(old_laser("9", kind="RLASER"), robot_laser())).scans[0]) == 5


def test_an_unknown_kind_is_reported(write: Write) -> None:
    with pytest.raises(ScanError, match="FLASER, ROBOTLASER1, RLASER"):
        load_carmen(write(old_laser()), kind="/scan")


def test_gzipped_logs_read_the_same(write: Write) -> None:
    plain = load_carmen(write(*driven(4)))
    packed = load_carmen(write(*driven(4), name="a.log.gz"))
    assert [s.stamp for s in plain.scans] == [s.stamp for s in packed.scans]


def test_scans_come_in_the_order_of_their_stamps(write: Write) -> None:
    lines = driven(3)
    recording = load_carmen(write(lines[0], lines[2], lines[1]))
    assert [scan.stamp for scan in recording.scans] == [0, 1, 2]
    assert recording.odometry is not None
    assert_array_equal(recording.odometry.poses[:, 0], [0, 1, 2])
    assert "sorted by stamp" in recording.notes[0]


def test_without_times_the_number_of_a_scan_counts(write: Write) -> None:
    bare = "FLASER 2 1 1 0 0 0 0 0 0"
    recording = load_carmen(write(bare, bare, bare))
    assert [scan.stamp for scan in recording.scans] == [0, 1, 2]
    assert "no times" in recording.notes[0]


def test_the_stamp_of_the_logger_replaces_a_constant_one(write: Write) -> None:
    lines = [f"FLASER 1 1 0 0 0 0 0 0 0.0 host {t}" for t in (3.5, 4.5)]
    assert [scan.stamp for scan in load_carmen(write(*lines)).scans] == [3.5, 4.5]


def test_malformed_lines_are_skipped_and_counted(write: Write) -> None:
    good = driven(3)
    bad = [
        "FLASER",
        "FLASER x 1 2",
        "FLASER 0 0 0 0 0 0 0 1 h 1",
        "FLASER 99999999999 1",
        "FLASER 3 1 2 three 0 0 0 0 0 0 1 h 1",
        "FLASER 1 1 0 0 nan 0 0 0 1 h 1",
        "ODOM 1 2",
        "PARAM",
    ]
    recording = load_carmen(write(good[0], *bad, good[1], "\xff\x00 ???", "", good[2]))
    assert len(recording) == 3
    assert recording.notes == ("8 of 13 lines are malformed and were skipped",)


@pytest.mark.parametrize("kept", range(8, 40, 3))
def test_a_last_line_that_was_cut_is_dropped(write: Write, kept: int) -> None:
    lines = driven(2)
    recording = load_carmen(write(lines[0], old_laser(stamp="4321.5")[:kept], end=""))
    assert len(recording) == 1 or recording.scans[1].stamp == 4321.5


def test_a_log_that_ends_without_a_line_end_is_whole(write: Write) -> None:
    assert len(load_carmen(write(*driven(2), end=""))) == 2


def test_a_truncated_gzip_log_keeps_the_lines_before_the_cut(write: Write) -> None:
    rng = np.random.default_rng(1)
    path = write(*(old_laser(list(rng.uniform(1, 9, 180))) for _ in range(200)), name="a.log.gz")
    path.write_bytes(path.read_bytes()[:-5000])
    recording = load_carmen(path)
    assert 100 < len(recording) < 200
    assert "cut off" in " ".join(recording.notes)


def test_poses_that_slam_wrote_are_reported(write: Write) -> None:
    assert "SLAM" in load_carmen(write(*driven(2), "NEFF 14.2")).notes[0]


@pytest.mark.parametrize(
    "content", [b"", b"hello\nworld\n", b"\x00" * 5000, b"ODOM 1 2 3 4 5 6 7\n"]
)
def test_a_log_without_a_scan_is_rejected_with_counts(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "a.log"
    path.write_bytes(content)
    with pytest.raises(ScanError, match=r"none in the \d+ lines of .*a\.log"):
        load_carmen(path)


def test_a_file_that_is_not_packed_is_reported(tmp_path: Path) -> None:
    path = tmp_path / "a.log.gz"
    path.write_text(old_laser())
    with pytest.raises(ScanError, match="a CARMEN log that can be read"):
        load_carmen(path)


def test_max_scans_limits_the_lines_that_are_read(write: Write) -> None:
    path = write(*driven(2 + SORTED_AHEAD), "x" * (carmen_log.MAX_LINE_BYTES + 9))
    recording = load_carmen(path, max_scans=2)
    assert len(recording) == 2
    assert recording.odometry is not None
    assert len(recording.odometry) == 2
    with pytest.raises(ScanError, match="in lines of at most"):
        load_carmen(path)


def test_the_first_scans_are_the_first_by_stamp(write: Write) -> None:
    late = [3.0, 0.0, 5.0, 1.0, 4.0, 2.0, 6.0]
    path = write(*(old_laser(robot=f"{t} 0 0", laser=f"{t} 0 0", stamp=str(t)) for t in late))
    for n in range(1, len(late) + 1):
        recording = load_carmen(path, max_scans=n)
        assert [scan.stamp for scan in recording.scans] == sorted(late)[:n]
        assert recording.odometry is not None
        assert recording.odometry.poses[:, 0].tolist() == sorted(late)[:n]
        assert "sorted by stamp" in recording.notes[-1]


def test_a_log_that_unpacks_to_too_much_fails(
    write: Write, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(carmen_log, "MAX_LOG_BYTES", 10_000)
    path = write(*("# nothing" for _ in range(5_000)), name="a.log.gz")
    assert path.stat().st_size < 1000
    with pytest.raises(ScanError, match="at most 10000 bytes"):
        load_carmen(path)


def test_an_invalid_scan_is_reported_with_its_place(write: Write) -> None:
    log = write(old_laser(), robot_laser().replace(" 0.5 81.92", " 0 81.92"))
    with pytest.raises(ScanError, match=r"angle_increment 0.0 in scan 0 in .*a\.log"):
        load_carmen(log, kind="ROBOTLASER1")


@settings(deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data(), name=st.sampled_from(["a.log", "a.log.gz"]))
def test_damage_is_always_a_scan_error(write: Write, data: st.DataObject, name: str) -> None:
    path = write("PARAM robot_frontlaser_offset 0.1 h 0", robot_laser(), *driven(3), name=name)
    content = bytearray(path.read_bytes())
    for _ in range(data.draw(st.integers(1, 4))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    path.write_bytes(content[: data.draw(st.integers(0, len(content)))] or content)
    with suppress(ScanError):
        load_carmen(path)


@pytest.mark.shared
def test_a_real_log_equals_the_case_of_its_building(shared: Path) -> None:
    recording = load_carmen(shared / "bags" / "intel.carmen.log.gz")
    case = np.load(shared / "cases" / "intel_lab" / "scans.npz")
    assert len(recording) == 910
    angles = (float(case["angle_min"]), float(case["angle_increment"]))
    by_stamp = {scan.stamp: scan for scan in recording.scans}
    for ranges, stamp in zip(case["ranges"], case["stamp"].tolist(), strict=True):
        scan = by_stamp[stamp]
        assert (scan.angle_min, scan.angle_increment) == angles
        assert np.array_equal(scan.ranges[scan.hit], ranges[np.isfinite(ranges)])
