"""A CARMEN log, sorted into scans, odometry and parameters."""

from __future__ import annotations

import math
from array import array
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from firstfix.core.errors import InputError, ScanError
from firstfix.io.logs.carmen_lines import PARSERS, ScanLine
from firstfix.io.logs.log_lines import LogLines


class CarmenLog:
    """What was found in a log, for one kind of scan line; filled line by line.

    Parameters
    ----------
    kinds : tuple of str
        Kinds of scan lines, best liked first; the best one that turns up is kept.
    most : int
        Number of scans after which there is nothing more to look for.

    Attributes
    ----------
    kind : str
        The kind that is kept.
    scans : list of ScanLine
        In the order of the file.
    params : dict of str to float
        PARAM lines with a number.
    malformed, seen : int
        Numbers of lines.
    cut : bool
        Whether a gzipped log ended before its end.
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
        """Whether further lines cannot change anything that was asked for."""
        return len(self.scans) >= self._most and self.kind == self._kinds[0]

    @property
    def odometry(self) -> NDArray[np.float64]:
        """The ODOM lines: stamp (s), x (m), y (m), yaw (rad), shape (n, 4)."""
        return np.array(self._odometry, np.float64).reshape(-1, 4)

    def take(self, line: str) -> None:
        """Take in the next line; a malformed one is counted."""
        self.seen += 1
        fields = line.split()
        word = fields[0] if fields else ""
        try:
            if word in self._kinds:
                self._take_scan(word, fields, line)
            elif word == "ODOM":
                self._take_odometry(fields)
            elif word == "PARAM":
                self._take_param(fields)
            elif word == "NEFF":
                self.slam = True
        except (ValueError, LookupError, InputError):
            self.malformed += 1

    def _take_scan(self, kind: str, fields: list[str], line: str) -> None:
        scan = PARSERS[kind](fields)
        if not line.endswith("\n") and math.isnan(scan.stamps[1]):
            raise ValueError("cut off")  # perhaps within a number
        if kind != self.kind or not self.scans:
            # From here on, kinds that are liked less are not even parsed.
            self._kinds = self._kinds[: self._kinds.index(kind) + 1]
            self.kind, self.scans = kind, []
        if len(self.scans) < self._most:
            self.scans.append(scan)

    def _take_odometry(self, fields: list[str]) -> None:
        x, y, yaw, stamp = (float(fields[i]) for i in (1, 2, 3, 7))
        if all(map(math.isfinite, (stamp, x, y, yaw))):
            self._odometry.extend((stamp, x, y, yaw))

    def _take_param(self, fields: list[str]) -> None:
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
        Kinds of scan lines, best liked first.
    most : int
        Number of scans that are enough.

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
    lines = LogLines(path)
    for line in lines:
        log.take(line)
        if log.complete:
            break
    log.cut = lines.cut
    if not log.scans:
        raise ScanError(
            expected=f"lines of {' or '.join(kinds)}",
            received=f"none in the {log.seen} lines of {path} ({log.malformed} malformed)",
            remedy="check that it is a CARMEN log, or choose another kind of scan line",
        )
    return log


def _is_number(word: str) -> bool:
    try:
        return math.isfinite(float(word))
    except ValueError:
        return False
