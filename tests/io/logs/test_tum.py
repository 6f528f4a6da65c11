"""Trajectories as `evo` reads them: what is written comes back, and nothing else comes in."""

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from firstfix.core.angles import angle_error
from firstfix.core.errors import InputError
from firstfix.core.trajectory import Trajectory
from firstfix.io.logs import tum
from firstfix.io.logs.tum import load_trajectory, save_trajectory

PATH = Trajectory(
    np.array([1.0, 1700000000.1234567]), np.array([[1.5, -2.0, 0.0], [0.1, 1e-30, math.pi / 2]])
)
FINITE = st.floats(allow_nan=False, allow_infinity=False)


@pytest.fixture
def load(tmp_path):
    def load(text: str | bytes) -> Trajectory:
        (tmp_path / "t.tum").write_bytes(text.encode() if isinstance(text, str) else text)
        return load_trajectory(tmp_path / "t.tum")

    return load


def test_lines_have_the_format_of_tum(tmp_path):
    save_trajectory(PATH, tmp_path / "t.tum")
    comment, first, second = (tmp_path / "t.tum").read_text().splitlines()
    assert comment == "# timestamp tx ty tz qx qy qz qw"
    assert first == "1.000000000 1.5 -2.0 0.0 0.0 0.0 0.0 1.0"
    assert second.startswith("1700000000.123456717 0.1 1e-30 0.0 0.0 0.0 0.70710678118654")
    # As evo does: eight columns separated by one space.
    table = np.loadtxt(tmp_path / "t.tum", delimiter=" ")
    assert table.shape == (2, 8)
    assert_array_equal(table[:, 0], PATH.stamps)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.lists(FINITE, min_size=1, max_size=5).map(sorted),
    st.lists(st.tuples(FINITE, FINITE, st.floats(-10.0, 10.0)), min_size=5, max_size=5),
)
def test_a_saved_trajectory_is_loaded_unchanged(tmp_path, stamps, poses):
    saved = Trajectory(np.array(stamps), np.array(poses[: len(stamps)]))
    save_trajectory(saved, tmp_path / "t.tum")
    loaded = load_trajectory(tmp_path / "t.tum")
    assert_array_equal(loaded.stamps, saved.stamps)
    assert_array_equal(loaded.poses[:, :2], saved.poses[:, :2])
    assert angle_error(loaded.poses[:, 2], saved.poses[:, 2]).max() < 1e-14


def test_comments_blank_lines_and_white_space_are_skipped(load):
    text = b"# by an author, \xe9\r\n\r\n  1 2 3 4 0 0 0 1  \r\n#\n\n2\t3 4 0 0 0 0 -1"
    assert_array_equal(load(text).poses, [[2, 3, 0], [3, 4, 0]])


def test_a_quaternion_of_few_digits_is_normalised(load):
    yaw = load("0 0 0 0 0 0 0.71 0.71").poses[0, 2]
    assert yaw == pytest.approx(math.pi / 2)


@pytest.mark.parametrize("yaw", [-3.0, -0.5, 0.0, 1.0, math.pi])
@pytest.mark.parametrize("tilt_deg", [0.0, 3.0, -4.9])
def test_a_small_tilt_keeps_the_heading(load, yaw, tilt_deg):
    # A rotation by yaw about z of a robot that pitches: q = q_yaw * q_pitch.
    c, s, cp, sp = (f(a / 2) for a in (yaw, math.radians(tilt_deg)) for f in (math.cos, math.sin))
    loaded = load(f"0 0 0 0 {-s * sp} {c * sp} {s * cp} {c * cp}")
    assert angle_error(float(loaded.poses[0, 2]), yaw) < 1e-9


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("1 2 3 4 0 0 1", "eight finite numbers"),
        ("1 2 3 4 0 0 0 1 9", "eight finite numbers"),
        ("1,2,3,4,0,0,0,1", "eight finite numbers"),
        ("1 2 nan 4 0 0 0 1", "eight finite numbers"),
        ("1 2 inf 4 0 0 0 1", "eight finite numbers"),
        ("1 2 1e999 4 0 0 0 1", "eight finite numbers"),
        ("1_0 2 3 4 0 0 0 1", "eight finite numbers"),
        ("٣ 2 3 4 0 0 0 1", "eight finite numbers"),
        ("word", "eight finite numbers"),
        ("1 2 3 4 0 0 0 0", "quaternion"),
        ("1 2 3 4 0 0 0 5", "of length 5"),
        ("1 2 3 4 0 0 1e200 1e200", "quaternion"),
        ("1 2 3 4 0.7071 0 0 0.7071", "a tilt of 90.0°"),
        ("1 2 3 4 1 0 0 0", "a tilt of 180.0°"),
        ("1 2 3 4 0 0.05 0 0.9987", "a tilt of 5.7°"),
        ("-1 2 3 4 0 0 0 1", "-1.0 after 0.0"),
        ("1" * 5000, "lines of at most 4096 bytes"),
    ],
)
def test_an_invalid_line_is_reported_with_its_number(load, line, message):
    with pytest.raises(InputError, match=message) as caught:
        load(f"# comment\n0 0 0 0 0 0 0 1\n{line}\n")
    assert "line 3 of " in caught.value.received
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("text", ["", "# only a comment\n", "\n\n"])
def test_a_file_without_poses_is_rejected(load, text):
    with pytest.raises(InputError, match="at least one pose"):
        load(text)


def test_a_trajectory_without_poses_is_not_saved(tmp_path):
    with pytest.raises(InputError, match="at least one pose"):
        save_trajectory(Trajectory(np.empty(0), np.empty((0, 3))), tmp_path / "t.tum")
    assert not (tmp_path / "t.tum").exists()


def test_too_many_poses_are_rejected(load, monkeypatch):
    monkeypatch.setattr(tum, "MAX_POSES", 3)
    assert len(load("0 0 0 0 0 0 0 1\n" * 3)) == 3
    with pytest.raises(InputError, match="at most 3 poses"):
        load("0 0 0 0 0 0 0 1\n" * 4)


def test_an_endless_line_is_rejected_early(load):
    with pytest.raises(InputError, match="line 1 of"):
        load(bytes(10_000_000))


@pytest.mark.parametrize("name", ["missing.tum", "."])
def test_paths_without_a_file_are_rejected(tmp_path, name):
    with pytest.raises(InputError, match="expected a TUM trajectory, received no file"):
        load_trajectory(tmp_path / name)


def test_an_error_while_writing_leaves_the_old_file(tmp_path, monkeypatch):
    save_trajectory(PATH, tmp_path / "t.tum")

    def refuse(*_args):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", refuse)
    with pytest.raises(InputError, match="No space left"):
        save_trajectory(Trajectory(np.zeros(1), np.zeros((1, 3))), tmp_path / "t.tum")
    assert_array_equal(load_trajectory(tmp_path / "t.tum").stamps, PATH.stamps)
    assert [path.name for path in tmp_path.iterdir()] == ["t.tum"]


def test_a_missing_folder_is_rejected(tmp_path: Path):
    with pytest.raises(InputError, match="No such file"):
        save_trajectory(PATH, tmp_path / "no folder" / "t.tum")


WORDS = st.sampled_from(["0", "1", "-1", "0.5", "nan", "1e308", "#", "x", "\n", "\0", "1e-320"])


@settings(
    max_examples=2 * settings.default.max_examples,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
@given(st.binary(max_size=80) | st.lists(WORDS, max_size=24).map(lambda w: " ".join(w).encode()))
def test_any_bytes_are_read_or_rejected_in_one_line(load, data):
    refusal = ""
    try:
        load(data)
    except InputError as error:
        refusal = str(error)
    assert "\n" not in refusal
