"""Trajectories in the format of the TUM RGB-D benchmark, which `evo` reads.

A line is ``timestamp tx ty tz qx qy qz qw``, separated by spaces, in seconds and metres; lines
that begin with ``#`` are comments.
"""

from __future__ import annotations

import math
import os
from array import array
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from firstfix.core.errors import InputError
from firstfix.core.trajectory import Trajectory
from firstfix.io.atomic_files import check_is_file, replace_file, show, unreachable

# Fourteen hours at 100 Hz, 160 MB in memory.
MAX_POSES = 5_000_000
# Eight numbers of 17 digits are 200 characters; a float64 written out has up to 330.
MAX_LINE_BYTES = 4096
# A robot on a ramp, or a slightly tilted tracker; beyond, yaw has little meaning.
MAX_TILT = math.radians(5.0)
# Files with three decimals are within a thousandth of one.
_NORM_ERROR = 0.1

_HEADER = b"# timestamp tx ty tz qx qy qz qw\n"


def save_trajectory(trajectory: Trajectory, path: str | os.PathLike[str]) -> None:
    """Write a trajectory, completely or not at all.

    Parameters
    ----------
    trajectory : Trajectory
        Poses over time. Stamps and coordinates are written exactly, yaw within rounding and in
        (-π, π].
    path : path-like
        An existing file is replaced.

    Raises
    ------
    InputError
        If there is no pose, or the file cannot be written; an old file is then unchanged.

    Examples
    --------
    >>> path = ff.Trajectory([0.0, 1.0], [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    >>> ff.save_trajectory(path, "path.tum")
    """
    if len(trajectory) == 0:
        raise _empty("a trajectory without poses", "record at least one pose")
    replace_file(Path(path), _lines(trajectory))


def load_trajectory(path: str | os.PathLike[str]) -> Trajectory:
    """Read a trajectory; height, and a tilt up to `MAX_TILT`, are ignored.

    Parameters
    ----------
    path : path-like
        The file.

    Returns
    -------
    Trajectory
        At least one pose.

    Raises
    ------
    InputError
        If the file cannot be read, or a line is not a planar pose with a stamp in order.

    Examples
    --------
    >>> path = ff.Trajectory([0.0, 1.0], [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    >>> ff.save_trajectory(path, "path.tum")
    >>> ff.load_trajectory("path.tum")
    <Trajectory 2 poses in 1.0 s>
    """
    path = Path(path)
    numbers = array("d")
    last = -math.inf
    for line_number, words in _rows(path):
        where = f"line {line_number} of {path}"
        stamp, *pose = _planar(words, where)
        if stamp < last:
            raise InputError(
                expected="stamps in ascending order",
                received=f"{stamp!r} after {last!r} in {where}",
                remedy="sort the lines by their first number",
            )
        if len(numbers) >= 4 * MAX_POSES:
            raise InputError(
                expected=f"at most {MAX_POSES} poses",
                received=f"more of them in {path}",
                remedy="cut the file into parts",
            )
        last = stamp
        numbers.extend((stamp, *pose))
    if not numbers:
        raise _empty(f"none in {path}", "check that it is the right file")
    table = np.frombuffer(numbers).reshape(-1, 4)
    return Trajectory(table[:, 0], table[:, 1:])


def _lines(trajectory: Trajectory) -> Iterator[bytes]:
    yield _HEADER
    for stamp, pose in zip(trajectory.stamps, trajectory.poses, strict=True):
        x, y, yaw = pose.tolist()
        # The shortest digits that give this float64 back, but at least the usual nine.
        when = np.format_float_positional(stamp, min_digits=9)
        qz, qw = math.sin(yaw / 2.0), math.cos(yaw / 2.0)
        yield f"{when} {x!r} {y!r} 0.0 0.0 0.0 {qz!r} {qw!r}\n".encode()


def _rows(path: Path) -> Iterator[tuple[int, list[bytes]]]:
    """Yield the number and the words of every line that has any."""
    check_is_file(path, "a TUM trajectory")
    try:
        with path.open("rb") as stream:
            number = 0
            while line := stream.readline(MAX_LINE_BYTES + 1):
                number += 1
                if len(line) > MAX_LINE_BYTES:
                    raise InputError(
                        expected=f"lines of at most {MAX_LINE_BYTES} bytes",
                        received=f"a longer one, line {number} of {path}",
                        remedy="check that it is a TUM trajectory",
                    )
                words = line.split()
                if words and not words[0].startswith(b"#"):
                    yield number, words
    except OSError as error:
        raise unreachable(path, error) from error


def _planar(words: list[bytes], where: str) -> tuple[float, float, float, float]:
    """Return stamp (s), x, y (m) and yaw (rad) of a line."""
    try:
        # Python would take 1_0 for ten.
        numbers = [math.nan if b"_" in word else float(word) for word in words]
    except ValueError:
        numbers = []
    if len(numbers) != 8 or not all(map(math.isfinite, numbers)):
        raise InputError(
            expected="eight finite numbers 'timestamp tx ty tz qx qy qz qw'",
            received=f"{show(b' '.join(words).decode('ascii', 'replace'))} in {where}",
            remedy="separate them by spaces, and begin comments with #",
        )
    stamp, x, y, _, *quaternion = numbers
    return stamp, x, y, _yaw(quaternion, where)


def _yaw(quaternion: list[float], where: str) -> float:
    norm = math.hypot(*quaternion)
    if abs(norm - 1.0) > _NORM_ERROR:
        raise InputError(
            expected="a quaternion qx qy qz qw of length 1",
            received=f"one of length {norm:g} in {where}",
            remedy="check the order of the columns",
        )
    qx, qy, qz, qw = (number / norm for number in quaternion)
    tilt = 2.0 * math.asin(min(math.hypot(qx, qy), 1.0))
    if tilt > MAX_TILT:
        raise InputError(
            expected=f"a rotation about the z axis, tilted by at most {math.degrees(MAX_TILT):g}°",
            received=f"a tilt of {math.degrees(tilt):.1f}° in {where}",
            remedy="turn the trajectory into a frame whose z axis points up",
        )
    return math.atan2(2.0 * (qw * qz + qx * qy), 1.0 - 2.0 * (qy * qy + qz * qz))


def _empty(received: str, remedy: str) -> InputError:
    return InputError(expected="at least one pose", received=received, remedy=remedy)
