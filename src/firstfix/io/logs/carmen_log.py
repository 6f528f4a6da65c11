"""The lines of a CARMEN log: scans, odometry and parameters."""

from __future__ import annotations

import gzip
import math
import zlib
from array import array
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from firstfix.core.errors import InputError, ScanError
from firstfix.core.scan import MAX_BEAMS
from firstfix.core.se2 import SE2
from firstfix.io.logs.checks import unreadable

# Ten characters a reading; a longer line is not a scan, and must not be read into memory.
MAX_LINE_BYTES = 10 * MAX_BEAMS
# Some hundred hours of a SICK; a small .gz that unpacks to more is an attack.
MAX_LOG_BYTES = 2**30

# CARMEN's own limit for the SICK lasers of its time (`maximum_range = 80.0` where it reads
# FLASER). They report codes from 81.83 m (0x1FF7) up for no return.
SICK_RANGE_MAX = 80.0


@dataclass(frozen=True, eq=False, slots=True)
class ScanLine:
    """One scan.

    Parameters
    ----------
    ranges : ndarray of float32, shape (n,)
        m.
    angle_min, angle_increment : float
        rad.
    range_max : float
        m.
    laser_pose, robot_pose : SE2
        In the odometry frame; a SLAM program may have corrected that of the laser.
    stamps : tuple of float
        Time of the scan and of its logging, s; NaN if missing.
    """

    ranges: NDArray[np.float32]
    angle_min: float
    angle_increment: float
    range_max: float
    laser_pose: SE2
    robot_pose: SE2
    stamps: tuple[float, float]


def parse_old_laser(fields: list[str]) -> ScanLine:
    """Parse FLASER or RLASER: n, ranges, laser pose, robot pose, stamp, host, stamp.

    The line does not say where the beams point. As CARMEN does, 180 beams are 181 at 1° from
    -90° without the last one, 360 are 361 at 0.5°; 400 and 401 are the 100° mode at 0.25°, here
    centred (CARMEN starts that at -90° too, which no SICK does); any other number spans 180°.

    Raises
    ------
    ValueError, LookupError, InputError
        If the line is malformed.
    """
    n = _count(fields[1], least=1)
    field_of_view, steps = {
        180: (180.0, 180),
        360: (180.0, 360),
        400: (100.0, 400),
        401: (100.0, 400),
    }.get(n, (180.0, max(n - 1, 1)))
    return _scan_line(
        ranges=fields[2 : 2 + n],
        angles=(-math.radians(field_of_view) / 2.0, math.radians(field_of_view) / steps),
        range_max=SICK_RANGE_MAX,
        poses=fields[2 + n : 8 + n],
        tail=fields[8 + n :],
    )


def parse_robot_laser(fields: list[str]) -> ScanLine:
    """Parse ROBOTLASER1: config, n, ranges, m, remissions, poses, motion, stamp, host, stamp."""
    n = _count(fields[8], least=1)
    m = _count(fields[9 + n], least=0)
    after = 10 + n + m
    return _scan_line(
        ranges=fields[9 : 9 + n],
        angles=(float(fields[2]), float(fields[4])),
        # Logs declare 81.92 m for a SICK, above its own codes for no return.
        range_max=min(float(fields[5]), SICK_RANGE_MAX),
        poses=fields[after : after + 6],
        tail=fields[after + 11 :],
    )


_PARSERS: dict[str, Callable[[list[str]], ScanLine]] = {
    "FLASER": parse_old_laser,
    "ROBOTLASER1": parse_robot_laser,
    "RLASER": parse_old_laser,
}


KINDS = tuple(_PARSERS)
"""Kinds of scan lines in order of preference."""


def _scan_line(
    *,
    ranges: list[str],
    angles: tuple[float, float],
    range_max: float,
    poses: list[str],
    tail: list[str],
) -> ScanLine:
    x, y, yaw, robot_x, robot_y, robot_yaw = map(float, poses)
    with np.errstate(over="ignore"):
        return ScanLine(
            ranges=np.array(ranges, dtype=np.float32),
            angle_min=angles[0],
            angle_increment=angles[1],
            range_max=range_max,
            laser_pose=SE2(x, y, yaw),
            robot_pose=SE2(robot_x, robot_y, robot_yaw),
            stamps=(_stamp(tail, 0), _stamp(tail, 2)),
        )


def _count(word: str, *, least: int) -> int:
    n = int(word)
    if not least <= n <= MAX_BEAMS:
        raise ValueError(f"{n} readings")
    return n


def _stamp(tail: list[str], index: int) -> float:
    return float(tail[index]) if index < len(tail) else math.nan


class CarmenLog:
    """Content of a log for one kind of scan line; filled line by line.

    Parameters
    ----------
    kinds : tuple of str
        Kinds of scan lines in order of preference; the best one in the log is kept.
    most : int
        Number of scans that are sufficient.

    Attributes
    ----------
    kind : str
        The kept kind.
    scans : list of ScanLine
        In the order of the file.
    params : dict of str to float
        PARAM lines with a number.
    malformed, seen : int
        Numbers of lines.
    cut : bool
        Whether a gzipped log is truncated.
    slam : bool
        Whether GMapping wrote the log: its poses are SLAM poses, not odometry.
    """

    def __init__(self, kinds: tuple[str, ...], most: int) -> None:
        self.kind = kinds[-1]
        self.scans: list[ScanLine] = []
        self.params: dict[str, float] = {}
        self.malformed = self.seen = 0
        self.cut = self.slam = False
        self._kinds = kinds
        self._most = most
        self._odometry = array("d")

    @property
    def complete(self) -> bool:
        """Whether further lines cannot change the result."""
        return len(self.scans) >= self._most and self.kind == self._kinds[0]

    @property
    def odometry(self) -> NDArray[np.float64]:
        """The ODOM lines: stamp (s), x (m), y (m), yaw (rad), shape (n, 4)."""
        return np.array(self._odometry, np.float64).reshape(-1, 4)

    def add(self, line: str) -> None:
        """Parse the next line; malformed ones are counted."""
        self.seen += 1
        fields = line.split()
        word = fields[0] if fields else ""
        try:
            if word in self._kinds:
                self._add_scan(word, fields, line)
            elif word == "ODOM":
                self._add_odometry(fields)
            elif word == "PARAM":
                self._add_param(fields)
            elif word == "NEFF":
                self.slam = True
        except (ValueError, LookupError, InputError):
            self.malformed += 1

    def _add_scan(self, kind: str, fields: list[str], line: str) -> None:
        scan = _PARSERS[kind](fields)
        if not line.endswith("\n") and math.isnan(scan.stamps[1]):
            raise ValueError("cut off")  # possibly within a number
        if kind != self.kind or not self.scans:
            # From here on, kinds of lower preference are not parsed.
            self._kinds = self._kinds[: self._kinds.index(kind) + 1]
            self.kind, self.scans = kind, []
        if len(self.scans) < self._most:
            self.scans.append(scan)

    def _add_odometry(self, fields: list[str]) -> None:
        x, y, yaw, stamp = (float(fields[i]) for i in (1, 2, 3, 7))
        if all(map(math.isfinite, (stamp, x, y, yaw))):
            self._odometry.extend((stamp, x, y, yaw))

    def _add_param(self, fields: list[str]) -> None:
        name, value = fields[1:3]
        if "laser" in name and _is_number(value):
            self.params[name] = float(value)


def read_log(path: Path, kinds: tuple[str, ...], most: int) -> CarmenLog:
    """Read a log as far as needed.

    Parameters
    ----------
    path : Path
        The log; gzipped if its name ends in ``.gz``.
    kinds : tuple of str
        Kinds of scan lines in order of preference.
    most : int
        Number of scans that are sufficient.

    Returns
    -------
    CarmenLog
        With at least one scan.

    Raises
    ------
    ScanError
        If the file cannot be read or holds no scan of these kinds.
    """
    log = CarmenLog(kinds, most)
    try:
        for line in _lines(path):
            log.add(line)
            if log.complete:
                break
    except EOFError:
        log.cut = True  # the lines before the cut are valid
    except (OSError, zlib.error) as error:
        raise unreadable(path, "a CARMEN log", error) from error
    if not log.scans:
        raise ScanError(
            expected=f"lines of {' or '.join(kinds)}",
            received=f"none in the {log.seen} lines of {path} ({log.malformed} malformed)",
            remedy="check that it is a CARMEN log, or choose another kind of scan line",
        )
    return log


def _lines(path: Path) -> Iterator[str]:
    left = MAX_LOG_BYTES
    is_packed = path.suffix.lower() == ".gz"
    with gzip.open(path) if is_packed else path.open("rb") as stream:
        while line := stream.readline(MAX_LINE_BYTES + 1):
            left -= len(line)
            if len(line) > MAX_LINE_BYTES or left < 0:
                raise ScanError(
                    expected=f"at most {MAX_LOG_BYTES} bytes in lines of at most {MAX_LINE_BYTES}",
                    received=f"more in {path}",
                    remedy="check that it is a CARMEN log, or cut it into parts",
                )
            yield line.decode("ascii", errors="replace")


def _is_number(word: str) -> bool:
    try:
        return math.isfinite(float(word))
    except ValueError:
        return False
