"""``firstfix track --start search``: nobody says where the robot is, at the start or ever."""

from __future__ import annotations

import time
from collections.abc import Callable

from firstfix.amcl.config import AmclConfig
from firstfix.core.errors import FirstfixError
from firstfix.core.grid import OccupancyGrid
from firstfix.core.recording import Recording
from firstfix.core.scan import LaserScan
from firstfix.lab.experiments.case import truth_at
from firstfix.lab.experiments.drive import Drive, Sight, known_odometry
from firstfix.lab.experiments.drive_tracking import TrackedScan
from firstfix.localizer.config import LocalizerConfig
from firstfix.localizer.inputs import NewMap
from firstfix.localizer.localizer import Localizer
from firstfix.localizer.outputs import InitialPose, Output, Status, TrackedPose
from firstfix.localizer.replay import replay


class NeverFoundError(FirstfixError):
    """A log at no scan of which a pose could be published."""


def search_and_follow(
    recording: Recording, grid: OccupancyGrid, config: AmclConfig, done: Callable[[str], None]
) -> tuple[Drive, list[TrackedScan]]:
    """Replay a log to a localizer.

    Parameters
    ----------
    recording : Recording
        Scans with odometry.
    grid : OccupancyGrid
        The map.
    config : AmclConfig
        Settings of the dynamic stage.
    done : callable
        Told the state after every scan.

    Returns
    -------
    tuple of Drive and list of TrackedScan
        The scans at which a pose was published, and these poses. Every one of these scans was used,
        be it only to judge the pose; `begin_at` is where the robot was found, or found again.

    Raises
    ------
    NeverFoundError
        If there is none.
    """
    odometry = dict(known_odometry(recording))
    index_at = {scan.stamp: i for i, scan in enumerate(recording.scans)}
    localizer = Localizer(LocalizerConfig(amcl=config))
    localizer.handle(NewMap(recording.scans[0].stamp, grid))
    tracked: list[TrackedScan] = []
    reason, cpu_s = "no scan has odometry at its stamp", 0.0
    began = time.process_time()
    for given, outputs in replay(recording.messages(), localizer):
        cpu_s += time.process_time() - began
        reason = next((o.reason for o in reversed(outputs) if isinstance(o, Status)), reason)
        for output in outputs:
            if isinstance(output, TrackedPose):
                index = index_at[output.stamp]
                before = tracked[-1].sight.index if tracked else None
                found = _found_in(outputs)
                sight = Sight(
                    index=index,
                    scan=recording.scans[index],
                    T_odom_base=odometry[index],
                    truth=truth_at(recording, index),
                    begin_at=found.T_map_base if found is not None else None,
                    same_run=found is None and before == index - 1,
                )
                tracked.append(_tracked(sight, output, localizer, cpu_s))
                cpu_s = 0.0
        if isinstance(given, LaserScan):
            done(localizer.state.value)
        began = time.process_time()
    if not tracked:
        raise NeverFoundError(f"found at none of {len(recording)} scans: {reason}")
    return Drive(
        sights=tuple(scan.sight for scan in tracked),
        skipped=len(recording) - len(tracked),
        notes=_notes(recording, tracked),
    ), tracked


def _tracked(sight: Sight, output: TrackedPose, localizer: Localizer, cpu_s: float) -> TrackedScan:
    particles = localizer.particles
    return TrackedScan(
        sight=sight,
        T_map_base=output.T_map_base,
        covariance=output.covariance,
        T_map_odom=output.T_map_odom,
        updated=True,
        particles=len(particles) if particles is not None else 0,
        elsewhere=0.0,
        cpu_s=cpu_s,
    )


def _found_in(outputs: list[Output]) -> InitialPose | None:
    return next((output for output in outputs if isinstance(output, InitialPose)), None)


def _notes(recording: Recording, tracked: list[TrackedScan]) -> tuple[str, ...]:
    first = tracked[0].sight
    waited = first.scan.stamp - recording.scans[0].stamp
    again = sum(scan.sight.begin_at is not None for scan in tracked) - 1
    silent = len(recording) - first.index - len(tracked)
    told = [f"found after {waited:.1f} s, at scan {first.index}"]
    if again:
        told.append(f"found elsewhere {again} more time(s)")
    if silent:
        told.append(f"no pose for {silent} scan(s) in between")
    return tuple(told)
