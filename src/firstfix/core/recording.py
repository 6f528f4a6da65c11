"""A log of a drive: scans, odometry and, where known, ground truth."""

from __future__ import annotations

import heapq
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from firstfix.core.arguments import as_instance
from firstfix.core.deskew import deskew
from firstfix.core.errors import ScanError
from firstfix.core.odometry import Odometry
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.core.trajectory import Trajectory

MOST_APART_S = 0.15
"""Scans of two sensors that are farther apart in time are not judged together."""


@dataclass(frozen=True, eq=False)
class Recording:
    """The scans of a log in the order of their stamps, with odometry and ground truth if known.

    Parameters
    ----------
    scans : tuple of LaserScan
        At least one.
    odometry : Trajectory or None
        ``T_odom_base`` over time, if the log has it.
    truth : ndarray, shape (n_scans, 3), or None
        ``T_map_base`` at each scan: x (m), y (m), yaw (rad); NaN rows where unknown.
    runs : ndarray of int, shape (n_scans,), or None
        Number of the uninterrupted drive that each scan belongs to.
    sensors : ndarray of int, shape (n_scans,), or None
        Number of the sensor of each scan, from 0, where there are several.
    notes : tuple of str
        Assumptions of the reader, and what it left out, in words.

    Raises
    ------
    ScanError
        If there is no scan, or the shape of truth, runs or sensors does not match the scans.
    InputError
        If a scan is not a LaserScan.

    Examples
    --------
    >>> recording = ff.Recording((scan,))
    >>> recording
    <Recording 1 scans in 0.0 s>
    >>> [type(message).__name__ for message in recording.messages()]
    ['LaserScan']
    """

    scans: tuple[LaserScan, ...]
    odometry: Trajectory | None = None
    truth: NDArray[np.float64] | None = None
    runs: NDArray[np.int64] | None = None
    sensors: NDArray[np.int64] | None = None
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        scans = tuple(as_instance(LaserScan, scan, "scans") for scan in self.scans)
        object.__setattr__(self, "scans", scans)
        n = len(scans)
        if n == 0:
            raise ScanError(
                expected="at least one scan",
                received="an empty log",
                remedy="check the scan topic or the log",
            )
        for name, array, shape in (
            ("truth", self.truth, (n, 3)),
            ("runs", self.runs, (n,)),
            ("sensors", self.sensors, (n,)),
        ):
            if array is not None and array.shape != shape:
                raise ScanError(
                    expected=f"{name} of shape {shape} for {n} scans",
                    received=f"shape {array.shape}",
                    remedy=f"give one row of {name} for every scan",
                )

    def __len__(self) -> int:
        return len(self.scans)

    def __repr__(self) -> str:
        duration = self.scans[-1].stamp - self.scans[0].stamp
        has = {"odometry": self.odometry, "ground truth": self.truth}
        known = [name for name, value in has.items() if value is not None]
        extras = f", with {' and '.join(known)}" if known else ""
        return f"<Recording {len(self)} scans in {duration:.1f} s{extras}>"

    def instants(self) -> list[tuple[int, ...]]:
        """Return the scans that were taken together, as indices.

        Returns
        -------
        list of tuple of int
            For each scan of the first sensor: itself, and the scan of each other sensor that is
            nearest in time, where it is within `MOST_APART_S`.
        """
        if self.sensors is None:
            return [(i,) for i in range(len(self))]
        stamps = np.array([scan.stamp for scan in self.scans])
        groups = [np.flatnonzero(self.sensors == sensor) for sensor in np.unique(self.sensors)]
        first, others = groups[0].tolist(), groups[1:]
        nearest = [
            [group[np.abs(stamps[group] - stamps[i]).argmin()] for i in first] for group in others
        ]
        return [
            (i, *(int(j) for j in together if abs(stamps[j] - stamps[i]) <= MOST_APART_S))
            for i, *together in zip(first, *nearest, strict=True)
        ]

    def deskewed(self) -> Recording:
        """Return the recording with scans straightened by its odometry, where it has one.

        See Also
        --------
        firstfix.deskew : For one scan.
        """
        if self.odometry is None:
            return self
        return replace(self, scans=tuple(deskew(scan, self.odometry) for scan in self.scans))

    def messages(self) -> Iterator[Odometry | LaserScan]:
        """Return odometry and scans in the order of their stamps, as a robot sends them.

        Yields
        ------
        Odometry or LaserScan
            Inputs of a `Localizer`. At equal stamps the odometry comes first. Without odometry
            there are scans only.
        """
        scans: Iterator[Odometry | LaserScan] = iter(self.scans)
        yield from heapq.merge(self._odometry_messages(), scans, key=_stamp)

    def _odometry_messages(self) -> Iterator[Odometry | LaserScan]:
        if self.odometry is not None:
            for stamp, pose in zip(self.odometry.stamps.tolist(), self.odometry.poses, strict=True):
                yield Odometry(stamp, SE2.from_array(pose))


def _stamp(message: Odometry | LaserScan) -> float:
    return message.stamp
