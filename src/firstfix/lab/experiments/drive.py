"""The scans of a recording that can be tracked, and where to begin."""

from __future__ import annotations

from dataclasses import dataclass, replace

from firstfix.core.errors import ScanError
from firstfix.core.recording import Recording
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.lab.experiments.case import truth_at


@dataclass(frozen=True, slots=True)
class Sight:
    """The scans of one time of a drive, with odometry and truth at the stamp of the first sensor.

    Parameters
    ----------
    index : int
        Of the scan in its recording.
    scan : LaserScan
        The scan.
    T_odom_base : SE2
        Odometry.
    truth : SE2 or None
        ``T_map_base``; None if it is unknown.
    begin_at : SE2 or None
        ``T_map_base`` of a new start; None to continue from the scan before.
    same_run : bool
        False if the robot moved unobserved since the scan before.
    others : tuple of LaserScan
        Those of the other sensors, moved by odometry to its stamp.
    """

    index: int
    scan: LaserScan
    T_odom_base: SE2
    truth: SE2 | None
    begin_at: SE2 | None
    same_run: bool
    others: tuple[LaserScan, ...] = ()


@dataclass(frozen=True, slots=True)
class Drive:
    """The scans of a recording that can be followed.

    Parameters
    ----------
    sights : tuple of Sight
        At least one, in the order of stamps; the first has a pose to begin at.
    skipped : int
        Scans left out: without odometry at their stamp, or before the first true pose.
    notes : tuple of str
        What was left out or assumed, in words, for a person.
    """

    sights: tuple[Sight, ...]
    skipped: int
    notes: tuple[str, ...]

    @property
    def begin_at(self) -> SE2:
        """Where to begin, ``T_map_base`` at the first scan."""
        pose = self.sights[0].begin_at
        assert pose is not None  # noqa: S101 - ensured by `plan_drive`
        return pose


def plan_drive(recording: Recording, start: SE2 | None) -> Drive:
    """Decide which scans to track and where to begin.

    Between two runs of a recording the robot moved unobserved. A run begins at the true pose of its
    first scan if it is known; otherwise odometry bridges the gap.

    Parameters
    ----------
    recording : Recording
        Scans with odometry.
    start : SE2 or None
        ``T_map_base`` at the first scan that has odometry; None to begin at the first true pose.

    Raises
    ------
    ScanError
        If no scan has odometry, or no true pose is known where one is needed.
    """
    known = dict(known_odometry(recording))
    groups = [[i for i in group if i in known] for group in recording.instants()]
    usable = [group for group in groups if group]
    if not usable:
        raise ScanError("No scan of the first topic has odometry at its stamp. Leave it out.")
    first = usable[0][0] if start is not None else _first_true(recording, usable)
    begun = next(n for n, group in enumerate(usable) if group[0] == first)
    sights: list[Sight] = []
    for index, *others in usable[begun:]:
        T_odom_base = known[index]
        truth = truth_at(recording, index)
        before = sights[-1].index if sights else None
        same_run = before is not None and _is_same_run(recording, before, index)
        begin_at = None if same_run else truth
        if before is None and start is not None:
            begin_at = start
        moved = tuple(_moved(recording.scans[i], T_odom_base, known[i]) for i in others)
        scan = recording.scans[index]
        sights.append(Sight(index, scan, T_odom_base, truth, begin_at, same_run, moved))
    return Drive(
        sights=tuple(sights),
        skipped=len(groups) - len(sights),
        notes=_notes(sights, len(groups) - len(usable), begun),
    )


def _moved(scan: LaserScan, T_odom_base: SE2, T_odom_then: SE2) -> LaserScan:
    """Return a scan with the pose of its sensor seen from where the base is at another time."""
    return replace(scan, T_base_laser=T_odom_base.inverse() @ T_odom_then @ scan.T_base_laser)


def known_odometry(recording: Recording) -> list[tuple[int, SE2]]:
    """Return index and ``T_odom_base`` of the scans at whose stamp there is odometry, at least one.

    Raises
    ------
    ScanError
        If there is none.
    """
    odometry = recording.odometry
    if odometry is None:
        why = "".join(f" ({note})" for note in recording.notes)
        raise ScanError(
            expected="a log with odometry",
            received=f"one of scans alone{why}",
            remedy="record /tf and /tf_static, or /odom, with the scans "
            "(.npz: an array `odom` [n, 3])",
        )
    known = [(i, odometry.at(scan.stamp)) for i, scan in enumerate(recording.scans)]
    usable = [(i, T_odom_base) for i, T_odom_base in known if T_odom_base is not None]
    if not usable:
        scans = recording.scans
        raise ScanError(
            expected="odometry at the stamps of the scans",
            received=f"scans from {scans[0].stamp:.3f} s to {scans[-1].stamp:.3f} s with odometry "
            f"from {odometry.stamps[0]:.3f} s to {odometry.stamps[-1]:.3f} s",
            remedy="record both by one clock (is use_sim_time set on one node only?)",
        )
    return usable


def _first_true(recording: Recording, usable: list[list[int]]) -> int:
    for index, *_ in usable:
        if truth_at(recording, index) is not None:
            return index
    raise ScanError(
        expected="a log that knows true poses",
        received="one that does not, at no scan with odometry",
        remedy="give the pose to start at; `firstfix locate --json` finds it",
    )


def _is_same_run(recording: Recording, before: int, index: int) -> bool:
    return recording.runs is None or bool(recording.runs[before] == recording.runs[index])


def _notes(sights: list[Sight], blind: int, early: int) -> tuple[str, ...]:
    new = [sight for sight in sights[1:] if not sight.same_run]
    anew = sum(sight.begin_at is not None for sight in new)
    counted = (
        (blind, "scan(s) have no odometry at their stamp and are left out"),
        (early, "scan(s) before the first true pose are left out"),
        (anew, "further run(s) of the log restart at the true pose of their first scan"),
        (
            len(new) - anew,
            "further run(s) begin without a true pose: odometry bridges the gap",
        ),
    )
    return tuple(f"{count} {words}" for count, words in counted if count)
