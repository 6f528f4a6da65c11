"""Tracking a log for ``firstfix track``: where to begin, and where the robot was at every scan."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import Enum
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from firstfix.amcl.config import AmclConfig
from firstfix.core.errors import FirstfixError, InputError
from firstfix.core.grid import OccupancyGrid
from firstfix.core.recording import Recording
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.fields.map_fields import MapFields
from firstfix.global_localization.prior import Prior
from firstfix.io.recalled_pose import recall
from firstfix.io.saved_pose import SavedPose, load_pose, map_key
from firstfix.lab.experiments.case import truth_at
from firstfix.lab.experiments.drive import Drive, Sight, known_odometry, plan_drive
from firstfix.lab.experiments.drive_tracking import (
    GIVEN_START,
    TRUE_START,
    TrackedScan,
    check_start,
    follow_drive,
    make_tracker,
)
from firstfix.localizer.config import LocalizerConfig
from firstfix.localizer.inputs import NewMap, Reset
from firstfix.localizer.localizer import Localizer
from firstfix.localizer.outputs import InitialPose, Output, Status, TrackedPose
from firstfix.localizer.replay import replay
from firstfix.ros.node_config import NodeConfig
from firstfix.ros.parameters import load_node_config
from firstfix.ros.pose_memory import PoseKeeper

TRUTH = "truth"
SEARCH = "search"


class Origin(Enum):
    """Where the first pose comes from; the values are those of the JSON."""

    GIVEN = "given"
    SAVED = "saved"
    PARAMETERS = "parameters"
    TRUTH = "truth"
    SEARCH = "search"


@dataclass(frozen=True, slots=True)
class Start:
    """The pose to begin at.

    Parameters
    ----------
    origin : Origin
        Where the pose comes from.
    T_map_base : SE2 or None
        The pose at the first scan that has odometry; None for the first true pose, or a search.
    covariance : ndarray, shape (3, 3)
        Of x (m), y (m), yaw (rad).
    note : str
        Describes the start.
    """

    origin: Origin
    T_map_base: SE2 | None
    covariance: NDArray[np.float64]
    note: str


def load_config(params: Path | None, seed: int | None) -> NodeConfig:
    """Return the parameters in a file of Nav2, section ``amcl``; the defaults without a file.

    A ``seed`` replaces ``random_seed``.

    Raises
    ------
    InputError
        If the file cannot be used.
    """
    config = NodeConfig() if params is None else load_node_config(params)
    if seed is None:
        return config
    amcl = replace(config.localizer.amcl, random_seed=seed)
    return replace(config, localizer=replace(config.localizer, amcl=amcl))


def choose_start(
    requested: SE2 | Path | str | None,
    grid: OccupancyGrid,
    recording: Recording,
    config: NodeConfig,
) -> Start:
    """Choose where to begin: as requested, else as the parameters say, else at the first true pose.

    Parameters
    ----------
    requested : SE2, Path, str or None
        A pose, the file of a saved pose, `SEARCH`, `TRUTH`, or None.
    grid : OccupancyGrid
        The map.
    recording : Recording
        The log.
    config : NodeConfig
        set_initial_pose and initial_pose.

    Raises
    ------
    InputError
        If no start is known, a saved pose is stale or belongs to another map, or the start is
        outside the map.
    """
    known_odometry(recording)  # no start helps without odometry
    if requested == SEARCH:
        start = Start(Origin.SEARCH, None, TRUE_START, "searching the whole map")
    elif isinstance(requested, Path):
        start = _saved(requested, grid, recording)
    elif isinstance(requested, SE2):
        start = Start(Origin.GIVEN, requested, GIVEN_START, "starting at the pose given")
    elif requested is None and config.set_initial_pose:
        words = "starting at initial_pose of the parameters"
        start = Start(Origin.PARAMETERS, config.initial_pose, GIVEN_START, words)
    else:
        start = _true(recording, is_asked_for=requested is not None)
    if start.T_map_base is not None:
        check_start(grid, start.T_map_base)
    return start


class NeverFoundError(FirstfixError):
    """No pose was published at any scan of a log."""


@dataclass(frozen=True, eq=False, slots=True)
class TrackedLog:
    """A log that was tracked.

    Parameters
    ----------
    start : Start
        Where tracking began.
    drive : Drive
        The scans that were tracked.
    tracked : list of TrackedScan
        The pose at each of them.
    """

    start: Start
    drive: Drive
    tracked: list[TrackedScan]


def track_log(
    recording: Recording,
    grid: OccupancyGrid,
    start: Start,
    config: AmclConfig,
    done: Callable[[str], None],
    keeper: PoseKeeper | None,
    prior: Prior | None = None,
) -> TrackedLog:
    """Track a log, after a search if the start asks for one.

    Parameters
    ----------
    recording : Recording
        Scans with odometry.
    grid : OccupancyGrid
        The map.
    start : Start
        From `choose_start`.
    config : AmclConfig
        Settings of the filter.
    done : callable
        Takes the progress after every scan, in words.
    keeper : PoseKeeper or None
        Saves the pose now and then (not during a search) and at the end.
    prior : Prior, optional
        Of the pose at the first scan of a search.

    Raises
    ------
    NeverFoundError
        If a search finds the robot at no scan.
    """
    key = map_key(grid)
    if start.origin is Origin.SEARCH:
        drive, tracked = search_and_follow(recording, grid, config, done, prior)
    else:
        drive = plan_drive(recording, start.T_map_base)
        check_start(grid, drive.begin_at)
        rng, tracker, tracked = np.random.default_rng(config.seed), make_tracker(grid, config), []
        for scan in follow_drive(drive, tracker, config, start.covariance, rng, MapFields(grid)):
            tracked.append(scan)
            if keeper is not None:
                keeper.offer(_saved_pose(scan, key))
            done(f"{scan.particles} particles")
    if keeper is not None:
        keeper.save(_saved_pose(tracked[-1], key))
    return TrackedLog(start, drive, tracked)


def search_and_follow(
    recording: Recording,
    grid: OccupancyGrid,
    config: AmclConfig,
    done: Callable[[str], None],
    prior: Prior | None = None,
) -> tuple[Drive, list[TrackedScan]]:
    """Replay a log to a localizer that searches the whole map.

    ``done`` takes the state after every scan.

    Returns
    -------
    tuple of Drive and list of TrackedScan
        The scans with a published pose, and these poses. `begin_at` is set where the robot was
        found, or found again.

    Raises
    ------
    NeverFoundError
        If no pose was published.
    """
    odometry = dict(known_odometry(recording))
    index_at = {scan.stamp: i for i, scan in enumerate(recording.scans)}
    instant_of = {i: n for n, group in enumerate(recording.instants()) for i in group}
    localizer = Localizer(LocalizerConfig(amcl=config))
    began_at = recording.scans[0].stamp
    localizer.handle(NewMap(began_at, grid))
    if prior is not None:
        localizer.handle(Reset(began_at, prior))
    tracked: list[TrackedScan] = []
    reason, cpu_s = "no scan has odometry at its stamp", 0.0
    began = time.process_time()
    for given, outputs in replay(recording.messages(), localizer):
        cpu_s += time.process_time() - began
        reason = next((o.reason for o in reversed(outputs) if isinstance(o, Status)), reason)
        for output in outputs:
            # A scan of a sensor with another clock has the stamp of odometry.
            if isinstance(output, TrackedPose) and output.stamp in index_at:
                index = index_at[output.stamp]
                before = tracked[-1].sight.index if tracked else -1
                found = _found_in(outputs)
                sight = Sight(
                    index=index,
                    scan=recording.scans[index],
                    T_odom_base=odometry[index],
                    truth=truth_at(recording, index),
                    begin_at=found.T_map_base if found is not None else None,
                    same_run=found is None
                    and instant_of.get(index, index) - instant_of.get(before, index) == 1,
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
        skipped=max(0, len(recording.instants()) - len(tracked)),
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
    after = sum(group[0] >= first.index for group in recording.instants())
    silent = after - len(tracked)
    notes = [f"found after {waited:.1f} s, at scan {first.index}"]
    if again:
        notes.append(f"found elsewhere {again} more time(s)")
    if silent:
        notes.append(f"no pose for {silent} scan(s) in between")
    return tuple(notes)


def _true(recording: Recording, *, is_asked_for: bool) -> Start:
    if recording.truth is None or not np.isfinite(recording.truth).all(axis=1).any():
        raise InputError(
            expected="a log that knows true poses" if is_asked_for else "a pose to start at",
            received="a log that knows none" if is_asked_for else "none, and a log without truth",
            remedy="let it be found by --start search, or give it by --start X,Y,YAW in metres and "
            "radians",
        )
    return Start(Origin.TRUTH, None, TRUE_START, "starting at the first true pose of the log")


def _saved(path: Path, grid: OccupancyGrid, recording: Recording) -> Start:
    saved = load_pose(path)
    index, T_odom_base = known_odometry(recording)[0]
    recalled = recall(
        saved,
        now=recording.scans[index].stamp,
        T_odom_base=T_odom_base,
        map_key=map_key(grid),
        max_age_s=math.inf,  # naming the file confirms that it is valid
    )
    if recalled.T_map_base is None:
        raise InputError(
            expected="a saved pose that still holds at the first scan",
            received=f"{path}: {recalled.reason}",
            remedy="run `firstfix locate --json`, and give its `pose`: --start X,Y,YAW",
        )
    # The robot may have been nudged since, which a covariance of millimetres excludes.
    covariance = saved.covariance + TRUE_START
    words = f"starting at the pose of {path}, {recalled.outcome.value} ({recalled.reason})"
    return Start(Origin.SAVED, recalled.T_map_base, covariance, words)


def _saved_pose(tracked: TrackedScan, key: str) -> SavedPose:
    return SavedPose(
        T_map_base=tracked.T_map_base,
        covariance=tracked.covariance,
        stamp=tracked.sight.scan.stamp,
        T_odom_base=tracked.sight.T_odom_base,
        map_key=key,
    )
