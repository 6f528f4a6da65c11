"""Processor time per scan, and the time to the first fix."""

from __future__ import annotations

import statistics
import time
from collections import deque

from firstfix.core.scan import LaserScan
from firstfix.localizer.inputs import Input, NewMap
from firstfix.localizer.outputs import InitialPose, Output
from firstfix.localizer.states import State

_SCANS = 50


class TimingStatistics:
    """Measures the localizer's thread, which must make all calls."""

    def __init__(self) -> None:
        self.time_to_fix_s: float | None = None
        self._cpu_s: deque[float] = deque(maxlen=_SCANS)
        self._spent_s = 0.0
        self._left_at_s = 0.0
        self._began: float | None = None

    @property
    def cpu_ms(self) -> float | None:
        """Processor time per scan, with the inputs before it: median of the last scans, ms."""
        return 1e3 * statistics.median(self._cpu_s) if self._cpu_s else None

    def end_input(self, given: Input, outputs: list[Output], state: State) -> None:
        """Count an input and its outputs; ``state`` is the state before it."""
        self._spent_s += time.thread_time() - self._left_at_s
        if isinstance(given, NewMap) or state in {State.LOCALIZED, State.NO_MAP, State.LIFTED}:
            self._began = None
        elif isinstance(given, LaserScan) and self._began is None:
            self._began = given.stamp
        for output in outputs:
            if isinstance(output, InitialPose) and self._began is not None:
                # From the first scan to the scan of the fix, and the processor time since then.
                self.time_to_fix_s = output.stamp - self._began + self._spent_s
                self._began = None
        if isinstance(given, LaserScan):
            self._cpu_s.append(self._spent_s)
        if isinstance(given, LaserScan | NewMap):
            self._spent_s = 0.0

    def start_input(self) -> None:
        """Start the measurement of the next input."""
        self._left_at_s = time.thread_time()
