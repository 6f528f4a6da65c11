"""When the scans of several sensors belong together, and whether their clocks agree."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, field
from statistics import median

from firstfix.core.scan import LaserScan

# Scans of one instant are at most this far apart: a bit more than half the shorter period, so that
# every scan of two sensors that are not synchronised has a partner.
_SHARE_OF_PERIOD = 0.6
_MOST_APART_S = 0.1

# A sensor that is silent for so many periods is not waited for.
_SILENT_PERIODS = 3.0
_PERIODS = 5

# Scans of one robot arrive with about the same delay. The median over so many shows the clock.
_ARRIVALS = 10
_CLOCK_S = 0.25


@dataclass(slots=True)
class Clock:
    """When a sensor sends, and how old its scans are on arrival, s."""

    last: float
    periods: deque[float] = field(default_factory=lambda: deque(maxlen=_PERIODS))
    delays: deque[float] = field(default_factory=lambda: deque(maxlen=_ARRIVALS))

    @property
    def period(self) -> float:
        """Usual time between two scans, s; infinite before the second."""
        return median(self.periods) if self.periods else math.inf

    @property
    def delay(self) -> float:
        """Usual age of a scan on arrival, s; NaN before it is known."""
        return median(self.delays) if len(self.delays) == _ARRIVALS else math.nan


class SensorClocks:
    """The rates and the clocks of the sensors of a robot."""

    def __init__(self) -> None:
        self._clocks: dict[str, Clock] = {}
        self._reported: set[str] = set()

    @property
    def are_several(self) -> bool:
        """True if there is more than one sensor."""
        return len(self._clocks) > 1

    @property
    def apart_s(self) -> float:
        """Largest time between two scans of one instant, s."""
        shortest = min((clock.period for clock in self._clocks.values()), default=math.inf)
        return min(_MOST_APART_S, _SHARE_OF_PERIOD * shortest)

    def note(self, scan: LaserScan, now: float | None) -> None:
        """Note the arrival of a scan while the newest odometry has the stamp ``now``."""
        clock = self._clocks.setdefault(scan.sensor, Clock(scan.stamp))
        if scan.stamp > clock.last:
            clock.periods.append(scan.stamp - clock.last)
        clock.last = scan.stamp
        if now is not None:
            clock.delays.append(now - scan.stamp)

    def expects(self, sensor: str, stamp: float) -> bool:
        """Return whether a sensor is about to send a scan of an instant."""
        clock = self._clocks[sensor]
        is_due = clock.last + clock.period <= stamp + self.apart_s
        return is_due and stamp <= clock.last + _SILENT_PERIODS * clock.period

    def missing(self, scans: list[LaserScan]) -> bool:
        """Return whether an instant still lacks the scan of a sensor."""
        there = {scan.sensor for scan in scans}
        stamp = max(scan.stamp for scan in scans)
        return any(self.expects(name, stamp) for name in self._clocks if name not in there)

    def differs(self, sensor: str) -> bool:
        """Return whether the clock of a sensor differs from that of the odometry, others' not."""
        return abs(self._behind_s(sensor)) > _CLOCK_S

    def complaint(self, sensor: str) -> str | None:
        """Say once, in one sentence, that the clock of a sensor differs."""
        if sensor in self._reported or not self.differs(sensor):
            return None
        self._reported.add(sensor)
        behind_s = self._behind_s(sensor)
        side = "behind" if behind_s > 0.0 else "ahead of"
        return (
            f"the clock of {sensor or 'the laser'} is {abs(behind_s):.2f} s {side} that of "
            f"{self._reference() or 'the other laser'}: its scans are used apart, while the robot "
            "rests; synchronise the clocks"
        )

    def _behind_s(self, sensor: str) -> float:
        """Return by how much a clock is behind the one that agrees best with odometry, s."""
        if not self.are_several:
            return 0.0
        behind = self._clocks[sensor].delay - self._clocks[self._reference()].delay
        return 0.0 if math.isnan(behind) else behind

    def _reference(self) -> str:
        def distance(name: str) -> float:
            delay = self._clocks[name].delay
            return math.inf if math.isnan(delay) else abs(delay)

        return min(sorted(self._clocks), key=distance)
