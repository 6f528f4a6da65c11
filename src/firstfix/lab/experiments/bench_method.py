"""What ``firstfix bench`` measures: a method of this package, another function, or given poses."""

from __future__ import annotations

import csv
import importlib
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from firstfix.core.errors import InputError
from firstfix.core.estimate import Verdict
from firstfix.core.grid import OccupancyGrid
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.global_localization.config import LocateConfig, Method
from firstfix.global_localization.scan_matcher import ScanMatcher
from firstfix.lab.metrics.outcome import Answer
from firstfix.localizer.precompile import precompile

_MOST_BYTES = 256 * 2**20
_COLUMNS = ("case", "scan", "x", "y", "yaw")
NO_ANSWER = Answer((), 0.0, Verdict.NO_MATCH)

Locate = Callable[[int, LaserScan], Answer]
"""From the index of a scan in its recording, and the scan, to an answer."""


class BenchMethod(Protocol):
    """A localizer to measure; picklable."""

    @property
    def name(self) -> str:
        """Its name in tables."""

    def compile(self) -> None:
        """Do once in a process what is not part of preparing a map."""

    def prepare(self, case: str, grid: OccupancyGrid) -> Locate:
        """Prepare the map of a case."""


@dataclass(frozen=True, slots=True)
class OwnMethod:
    """A method of this package."""

    method: Method

    @property
    def name(self) -> str:
        """Its name in tables."""
        return self.method.value

    def compile(self) -> None:
        """Compile its kernels."""
        precompile(methods=[self.method])

    def prepare(self, case: str, grid: OccupancyGrid) -> Locate:
        """Prepare a map without a cache on disk."""
        del case
        matcher = ScanMatcher(grid, method=self.method, cache_dir=None)
        return lambda _, scan: Answer.of(matcher.locate(scan))


@dataclass(frozen=True, slots=True)
class ImportedFunction:
    """A function ``locate(grid, scan)`` of a module that Python can import, or in this folder.

    It returns a pose of the base in the map (`SE2`, or x m, y m, yaw rad), a pair of pose and
    confidence (0 to 1), or None. Without a confidence, each pose counts as claimed.

    Parameters
    ----------
    name : str
        ``module:function``.
    """

    name: str

    def load(self) -> Callable[[OccupancyGrid, LaserScan], Any]:
        """Import the function.

        Raises
        ------
        InputError
            If that is impossible.
        """
        module, _, attribute = self.name.partition(":")
        here = str(Path.cwd())
        if here not in sys.path:
            sys.path.insert(0, here)
        try:
            function = getattr(importlib.import_module(module), attribute)
        except Exception as error:
            raise InputError(
                expected=f"--method {self.name} as MODULE:FUNCTION that can be imported",
                received=f"{type(error).__name__}: {error}",
                remedy="run it in the folder of the module, or install the module",
            ) from error
        if not callable(function):
            raise InputError(
                expected=f"{self.name} as a function of map and scan",
                received=type(function).__name__,
                remedy="write locate(grid, scan) and return a pose, (pose, confidence) or None",
            )
        return function  # type: ignore[no-any-return]

    def compile(self) -> None:
        """Import the module."""
        self.load()

    def prepare(self, case: str, grid: OccupancyGrid) -> Locate:
        """Return the function with the map; whatever it prepares is part of its first scan."""
        del case
        function = self.load()

        def locate(index: int, scan: LaserScan) -> Answer:
            try:
                returned = function(grid, scan)
            except Exception as error:
                raise InputError(
                    expected=f"an answer of {self.name}",
                    received=f"{type(error).__name__} at scan {index}: {error}",
                    remedy="correct the function",
                ) from error
            return self._answer(returned)

        return locate

    def _answer(self, returned: Any) -> Answer:
        try:
            if returned is None:
                return NO_ANSWER
            if isinstance(returned, SE2):
                return _claim(returned, None)
            if len(returned) == 2:
                pose, confidence = returned
                return _claim(_as_pose(pose), float(confidence))
            return _claim(_as_pose(returned), None)
        except (TypeError, ValueError, InputError) as error:
            raise InputError(
                expected=f"of {self.name} a pose x, y, yaw, (pose, confidence 0 to 1) or None",
                received=f"{returned!r:.80}",
                remedy="return one of these",
            ) from error


@dataclass(frozen=True, slots=True)
class Estimates:
    """Poses that another program has computed for scans of cases.

    Parameters
    ----------
    path : Path
        CSV with the columns ``case`` (folder name), ``scan`` (index in scans.npz), ``x``, ``y``
        (m), ``yaw`` (rad): pose of the base in the map; optional ``confidence`` (0 to 1). Scans
        that are not in it have no answer.
    """

    path: Path

    @property
    def name(self) -> str:
        """Its name in tables."""
        return self.path.stem

    def compile(self) -> None:
        """Do nothing: the poses are there."""

    def prepare(self, case: str, grid: OccupancyGrid) -> Locate:
        """Read the estimates of a case."""
        del grid
        answers = read_estimates(self.path).get(case, {})
        return lambda index, _: answers.get(index, NO_ANSWER)


def parse_method(text: str) -> BenchMethod:
    """Read the name of one of our methods, or ``module:function``.

    Raises
    ------
    InputError
        If it is neither.
    """
    if ":" in text:
        function = ImportedFunction(text)
        function.load()
        return function
    try:
        return OwnMethod(Method(text))
    except ValueError:
        raise InputError(
            expected=f"--method {', '.join(method.value for method in Method)}, or MODULE:FUNCTION",
            received=repr(text),
            remedy="choose one of them",
        ) from None


def read_estimates(path: Path) -> dict[str, dict[int, Answer]]:
    """Read the file that `Estimates` describes: answers by case and scan.

    Raises
    ------
    InputError
        If the file cannot be read, lacks a column, or a line of it is damaged.
    """
    try:
        if path.stat().st_size > _MOST_BYTES:
            raise InputError(f"{path} is larger than {_MOST_BYTES >> 20} MB. Split it by case.")
        with path.open(newline="", encoding="utf-8") as file:
            rows = csv.DictReader(file)
            missing = [name for name in _COLUMNS if name not in (rows.fieldnames or ())]
            if missing:
                raise InputError(
                    expected=f"{path} with the columns {', '.join(_COLUMNS)}",
                    received=f"none named {', '.join(missing)}",
                    remedy="write a header line; `confidence` is optional",
                )
            answers: dict[str, dict[int, Answer]] = {}
            for row in rows:
                index, answer = _read_row(row, path, rows.line_num)
                if answers.setdefault(row["case"], {}).setdefault(index, answer) is not answer:
                    raise InputError(
                        f"{path}, line {rows.line_num}: scan {index} of case {row['case']} is "
                        "there twice. Keep one pose of each scan."
                    )
            return answers
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InputError(
            expected=f"{path} as CSV",
            received=f"{type(error).__name__}: {error}",
            remedy="write UTF-8 text with a header line",
        ) from None


def _read_row(row: dict[str, str], path: Path, line: int) -> tuple[int, Answer]:
    try:
        confidence = row.get("confidence") or None
        pose = _as_pose([float(row[name]) for name in ("x", "y", "yaw")])
        answer = _claim(pose, None if confidence is None else float(confidence))
        return int(row["scan"]), answer
    except (TypeError, ValueError, InputError) as error:
        raise InputError(
            expected=f"numbers in line {line} of {path}: scan index, x, y (m), yaw (rad), "
            "confidence (0 to 1)",
            received=f"{error}",
            remedy="correct or remove the line",
        ) from None


def _as_pose(values: Any) -> SE2:
    if isinstance(values, SE2):
        return values
    pose = np.asarray(values, np.float64)
    if pose.shape != (3,) or not np.isfinite(pose).all():
        raise ValueError(f"{values!r:.60} is not x, y, yaw")
    return SE2.from_array(pose)


def _claim(pose: SE2, confidence: float | None) -> Answer:
    """Count a pose as claimed if its confidence would make it UNIQUE here."""
    if confidence is None:
        return Answer((pose,), 1.0, Verdict.UNIQUE)
    if not 0.0 <= confidence <= 1.0:
        raise ValueError(f"confidence {confidence!r} is not between 0 and 1")
    is_sure = confidence >= LocateConfig().unique_probability
    return Answer((pose,), confidence, Verdict.UNIQUE if is_sure else Verdict.AMBIGUOUS)
