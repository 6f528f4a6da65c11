"""Following a drive with the dynamic stage, scan by scan."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from firstfix.amcl.config import AmclConfig
from firstfix.amcl.initial import around_pose, free_poses
from firstfix.amcl.sensor import build_sensor
from firstfix.amcl.tracker import Track, Tracker
from firstfix.belief.view import View
from firstfix.core.errors import InputError
from firstfix.core.grid import OccupancyGrid
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.fields.map_fields import MapFields
from firstfix.lab.experiments.drive import Drive, Sight
from firstfix.localizer.checked_odometry import CheckedOdometry
from firstfix.localizer.pose_fusion import SharpPose, sharpen


def spread(sigma_m: float, sigma_deg: float) -> NDArray[np.float64]:
    """Return the covariance of x (m), y (m), yaw (rad) for standard deviations in m and degrees."""
    return np.diag([sigma_m**2, sigma_m**2, math.radians(sigma_deg) ** 2])


# Poses of SLAM, which most "true" ones are, lie this close to the walls of a map.
TRUE_START = spread(0.1, 5.0)
# What Nav2 assumes of a pose that a person clicks.
GIVEN_START = spread(0.5, 15.0)


@dataclass(frozen=True, eq=False, slots=True)
class TrackedScan:
    """The tracked pose at a scan, and its cost.

    Parameters
    ----------
    sight : Sight
        The scan.
    T_map_base : SE2
        The tracked pose.
    covariance : ndarray, shape (3, 3)
        Of x (m), y (m), yaw (rad) in the map frame.
    T_map_odom : SE2
        Drift of the odometry.
    updated : bool
        True if the filter used the scan; else odometry moved the pose of the last update.
    particles : int
        Number of particles.
    elsewhere : float
        Share of the particles' weight that is not at this place, 0 to 1.
    cpu_s : float
        Processor time, s.
    """

    sight: Sight
    T_map_base: SE2
    covariance: NDArray[np.float64]
    T_map_odom: SE2
    updated: bool
    particles: int
    elsewhere: float
    cpu_s: float


def make_tracker(grid: OccupancyGrid, config: AmclConfig) -> Tracker:
    """Prepare the dynamic stage for a map; recovery, if asked for, draws from all free space."""

    def anywhere(_: tuple[LaserScan, ...], n: int, rng: np.random.Generator) -> NDArray[np.float64]:
        return free_poses(grid, n, rng)

    return Tracker(build_sensor(grid, config), config, anywhere)


def follow_drive(
    drive: Drive,
    tracker: Tracker,
    config: AmclConfig,
    start_covariance: NDArray[np.float64],
    rng: np.random.Generator,
    fields: MapFields | None = None,
) -> Iterator[TrackedScan]:
    """Track a drive with the filter.

    Parameters
    ----------
    drive : Drive
        The scans, and where to begin.
    tracker : Tracker
        The filter for the map.
    config : AmclConfig
        Its settings; a start draws max_particles.
    start_covariance : ndarray, shape (3, 3)
        Of the first start, x (m), y (m), yaw (rad); later starts have `TRUE_START`.
    rng : numpy.random.Generator
        Source of randomness.
    fields : MapFields, optional
        The prepared map, to refine each pose as a localizer does; None keeps the filter's poses.
    """
    track: Track | None = None
    sharp: SharpPose | None = None
    covariance, odometry = start_covariance, CheckedOdometry()
    for sight in drive.sights:
        scans, before = (sight.scan, *sight.others), track
        cpu = time.thread_time()
        if sight.begin_at is not None:
            odometry.restart()
        view = odometry.check(View(scans, sight.T_odom_base))
        T_odom_base = view.T_odom_base
        if sight.begin_at is not None:
            particles = around_pose(sight.begin_at, covariance, config.max_particles, rng)
            track = tracker.begin(particles, T_odom_base, scans, rng)
            covariance, sharp = TRUE_START, None
        else:
            assert track is not None  # noqa: S101 - the first scan of a drive has a start
            track = tracker.follow(track, T_odom_base, scans, rng, view.unconfirmed)
        T_map_odom, found = track.T_map_odom, track.state.estimate.covariance
        if fields is not None:
            filtered = SharpPose(T_map_odom @ T_odom_base, found, T_odom_base)
            sharp = sharpen(filtered, scans, fields, sharp)
            T_map_odom = sharp.T_map_base @ T_odom_base.inverse()
            found = sharp.covariance_on(fields.grid)
        yield TrackedScan(
            sight=sight,
            T_map_base=T_map_odom @ T_odom_base,
            covariance=found,
            T_map_odom=T_map_odom @ odometry.T_checked_odom,
            updated=track is not before,
            particles=len(track.state.particles),
            elsewhere=track.state.elsewhere,
            cpu_s=time.thread_time() - cpu,
        )


def check_start(grid: OccupancyGrid, T_map_base: SE2) -> None:
    """Refuse a start outside the map, from where nothing can be followed.

    Raises
    ------
    InputError
        If it is outside.
    """
    column, row = grid.to_cells(np.array([T_map_base.x, T_map_base.y])).tolist()
    if 0.0 <= column < grid.width and 0.0 <= row < grid.height:
        return
    size = np.array([grid.width, grid.height]) * grid.resolution
    corners = grid.T_map_grid.apply(np.array([[0, 0], [1, 0], [0, 1], [1, 1]]) * size)
    (west, south), (east, north) = corners.min(axis=0).tolist(), corners.max(axis=0).tolist()
    raise InputError(
        expected=f"a start in the map, x {west:.2f} to {east:.2f} m, "
        f"y {south:.2f} to {north:.2f} m",
        received=f"x {T_map_base.x:.2f} m, y {T_map_base.y:.2f} m",
        remedy="check the pose, and that map and log are of one building",
    )
