"""What a drive contradicts in a map, for ``firstfix map changes``."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from firstfix.changes.counts import LEAST_EXPLAINED, ChangeCounter, DayCounts, is_new_view
from firstfix.core.errors import FirstfixError, InputError
from firstfix.core.estimate import Evidence
from firstfix.core.grid import OccupancyGrid
from firstfix.core.recording import Recording
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.core.trajectory import Trajectory
from firstfix.fields.map_fields import MapFields
from firstfix.global_localization.scan_matcher import ScanMatcher
from firstfix.lab.experiments.case import truth_at
from firstfix.localizer.inputs import NewMap
from firstfix.localizer.localizer import Localizer
from firstfix.localizer.outputs import Status, TrackedPose
from firstfix.localizer.replay import replay

# A year of days: a log has one or two.
_DAYS = 366

# Poses of SLAM and of other localizers: what they are good to is not in the file.
_GIVEN_COVARIANCE = np.diag([0.05**2, 0.05**2, np.radians(0.5) ** 2])

# With fewer beams at walls of the map the poses or the map are wrong, not the building.
_LEAST_AT_WALLS = 0.3
_JUDGED_FROM = 20
# From view to view.
_MOST_DRIFT_M = 0.3


class OtherBuildingError(FirstfixError):
    """Most beams contradict the map."""


@dataclass(frozen=True, eq=False, slots=True)
class Sighting:
    """The scans of one time, and where the robot was.

    Parameters
    ----------
    scans : tuple of LaserScan
        One of each sensor.
    T_map_base : SE2
        The pose.
    covariance : ndarray, shape (3, 3)
        Of x (m), y (m), yaw (rad).
    """

    scans: tuple[LaserScan, ...]
    T_map_base: SE2
    covariance: NDArray[np.float64]


def count_changes(
    grid: OccupancyGrid, recordings: Sequence[Iterator[Sighting]], done: Callable[[str], None]
) -> ChangeCounter:
    """Count what the scans of some drives confirm and contradict.

    Parameters
    ----------
    grid : OccupancyGrid
        The map.
    recordings : sequence of iterator of Sighting
        The drives, from `at_given_poses` or `where_localized`.
    done : callable
        Takes the number of views after each scan, in words.

    Raises
    ------
    OtherBuildingError
        If most beams end where the map has no wall.
    """
    counter = ChangeCounter(MapFields(grid), days_kept=_DAYS)
    for sightings in recordings:
        for sighting in sightings:
            counter.add(sighting.scans, sighting.T_map_base, sighting.covariance)
            done(f"{counter.views} views")
            if counter.views == _JUDGED_FROM:
                _check_building(counter)
    _check_building(counter)
    return counter


def at_given_poses(recording: Recording, poses: Trajectory | None) -> Iterator[Sighting]:
    """Take scans at poses that are known.

    Parameters
    ----------
    recording : Recording
        The scans.
    poses : Trajectory or None
        ``T_map_base`` over time; None for the true poses of the recording.

    Raises
    ------
    InputError
        If there are no true poses, or no scan was taken between two of the given poses.
    """
    if poses is None and recording.truth is None:
        raise InputError(
            "The log has no true poses. Leave --truth out to localize the robot, or pass its poses "
            "with --poses FILE in the TUM format."
        )
    used = 0
    for index in recording.instants():
        scan = recording.scans[index[0]]
        pose = truth_at(recording, index[0]) if poses is None else poses.at(scan.stamp)
        if pose is not None:
            used += 1
            yield Sighting(tuple(recording.scans[i] for i in index), pose, _GIVEN_COVARIANCE)
    if used == 0:
        scans = f"{recording.scans[0].stamp:.1f} to {recording.scans[-1].stamp:.1f} s"
        if poses is None:
            raise InputError("The log has no true pose at any scan. Leave --truth out.")
        given = f"{poses.stamps[0]:.1f} to {poses.stamps[-1]:.1f} s"
        raise InputError(
            f"The poses are of {given}, the scans of {scans}: they do not overlap. Pass the poses "
            "of this log, with the same clock."
        )


def where_localized(recording: Recording, grid: OccupancyGrid) -> Iterator[Sighting]:
    """Localize a robot through a drive, and take the scans of the times when its pose is known.

    The way before it was found is followed backwards from there, as long as scans fit.

    Raises
    ------
    InputError
        If the log has no odometry.
    OtherBuildingError
        If no pose was ever found.
    """
    if recording.odometry is None:
        raise InputError(
            "The log has no odometry, so the robot cannot be tracked. Pass its poses with --poses "
            "FILE in the TUM format."
        )
    groups = [tuple(recording.scans[i] for i in index) for index in recording.instants()]
    together = {scans[0].stamp: scans for scans in groups}
    localizer = Localizer()
    localizer.handle(NewMap(recording.scans[0].stamp, grid))
    reason, first = "no scan has odometry at its stamp", None
    for _, outputs in replay(recording.messages(), localizer):
        status = next((o for o in reversed(outputs) if isinstance(o, Status)), None)
        reason = status.reason if status is not None else reason
        pose = next((o for o in outputs if isinstance(o, TrackedPose)), None)
        if pose is None or pose.stamp not in together:
            continue
        first = first or pose
        if status is not None and _fits(status.evidence):
            yield Sighting(together[pose.stamp], pose.T_map_base, pose.covariance)
    if first is None or localizer.matcher is None:
        raise OtherBuildingError(
            f"The robot was found at none of {len(recording)} scans, so nothing can be said about "
            f"this map ({reason}). Check that the map is that of the building, or pass the poses "
            "with --poses FILE."
        )
    before = [scans for scans in reversed(groups) if scans[0].stamp < first.stamp]
    yield from _backwards(before, recording.odometry, first.T_map_odom, localizer.matcher)


def _backwards(
    groups: Sequence[tuple[LaserScan, ...]],
    odometry: Trajectory,
    T_map_odom: SE2,
    matcher: ScanMatcher,
) -> Iterator[Sighting]:
    """Follow a drive back in time from a known drift of the odometry; newest scans first."""
    last: SE2 | None = None
    for scans in groups:
        T_odom_base = odometry.at(scans[0].stamp)
        if T_odom_base is None or (last is not None and not is_new_view(last, T_odom_base)):
            continue
        last = T_odom_base
        expected = T_map_odom @ T_odom_base
        place = matcher.search_locally(scans[0], expected)
        if not _fits(place.evidence) or place.pose.distance_to(expected) > _MOST_DRIFT_M:
            return
        T_map_odom = place.pose @ T_odom_base.inverse()
        yield Sighting(scans, place.pose, place.covariance)


def _fits(evidence: Evidence | None) -> bool:
    return evidence is not None and evidence.explained >= LEAST_EXPLAINED


def merged_days(days: Sequence[DayCounts]) -> list[DayCounts]:
    """Return one entry for each day, oldest first, that counts the views of all.

    Raises
    ------
    InputError
        If the sizes of their maps differ.
    """
    merged: dict[int, DayCounts] = {}
    for counts in days:
        known = merged.get(counts.day)
        merged[counts.day] = counts if known is None else known.merged_with(counts)
    return [merged[day] for day in sorted(merged)]


def _check_building(counter: ChangeCounter) -> None:
    if counter.views == 0:
        raise InputError("No pose is certain enough to compare a scan with the map.")
    if counter.explained < _LEAST_AT_WALLS:
        raise OtherBuildingError(
            f"Only {counter.explained:.0%} of the beams of {counter.views} views end at walls of "
            "this map. It is probably that of another building, or the poses are not in its frame."
        )
