"""The tracked pose: a particle filter follows it, a monitor judges it, a refinement sharpens it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from firstfix.amcl.filter import start
from firstfix.amcl.initial import around_pose
from firstfix.amcl.particles import Particles
from firstfix.amcl.sensor import build_sensor
from firstfix.amcl.tracker import Track, Tracker
from firstfix.belief.view import View
from firstfix.core.estimate import Hypothesis
from firstfix.core.odometry import Odometry
from firstfix.core.scan import LaserScan, Scans
from firstfix.core.se2 import SE2
from firstfix.global_localization.places import is_same_place
from firstfix.global_localization.scan_matcher import ScanMatcher
from firstfix.localizer.config import LocalizerConfig
from firstfix.localizer.outputs import TrackedPose
from firstfix.localizer.pose_fusion import SharpPose, hold, sharpen
from firstfix.localizer.pose_monitor import Fit, Judgement, PoseMonitor

# The covariance of a search is that of one scan in a perfect map; the filter starts wider.
_START_COVARIANCE = np.diag([0.03**2, 0.03**2, np.radians(1.0) ** 2])

# The particles are brought back to a pose that fits so much better.
_BETTER = 0.75


@dataclass(frozen=True, slots=True)
class Tracked:
    """One scan of a tracked robot.

    Parameters
    ----------
    pose : TrackedPose
        The pose at the scan.
    judgement : Judgement
        How the scan fits there.
    is_confirmed : bool
        False after a leap of the odometry, until a scan fits again: do not publish the pose.
    """

    pose: TrackedPose
    judgement: Judgement
    is_confirmed: bool

    @property
    def fit_in_words(self) -> str:
        """How the scan fits, for a person."""
        explained = f"{self.judgement.place.evidence.explained:.0%} of the beams fit"
        if self.judgement.fit is Fit.UNINFORMATIVE:
            return "the sensor sees too little: following odometry"
        return explained if self.judgement.fit is Fit.CONSISTENT else f"doubtful: only {explained}"


class PoseTracker:
    """Tracks one robot in one map.

    Parameters
    ----------
    matcher : ScanMatcher
        Global localization on the map.
    config : LocalizerConfig
        Settings.
    rng : numpy.random.Generator
        Source of randomness.
    """

    def __init__(
        self, matcher: ScanMatcher, config: LocalizerConfig, rng: np.random.Generator
    ) -> None:
        self._matcher = matcher
        self._config = config
        self._rng = rng
        sensor = build_sensor(matcher.fields.grid, config.amcl)
        self._filter = Tracker(sensor, config.amcl, _inject_nothing)
        self._track: Track | None = None
        self._sharp: SharpPose | None = None  # as published at the last scan
        self._monitor = PoseMonitor(matcher, config.monitor)
        self._has_leapt = False  # and no scan has fitted since

    @property
    def particles(self) -> Particles | None:
        """The particles; None while nothing is tracked."""
        return self._track.state.particles if self._track is not None else None

    @property
    def T_map_odom(self) -> SE2 | None:
        """Drift of the odometry; None while nothing is tracked."""
        return self._track.T_map_odom if self._track is not None else None

    def start(self, stamp: float, T_odom_base: SE2, place: Hypothesis) -> TrackedPose:
        """Track from a place where the robot has been found.

        Parameters
        ----------
        stamp : float
            Time of the scan that found it, s.
        T_odom_base : SE2
            Odometry at the scan.
        place : Hypothesis
            The place.
        """
        covariance = place.covariance + _START_COVARIANCE
        self._track = self._begun(place.pose, place.covariance, T_odom_base)
        self._monitor = PoseMonitor(self._matcher, self._config.monitor)
        self._has_leapt = False
        self._sharp = SharpPose(place.pose, covariance, T_odom_base)
        return TrackedPose(stamp, place.pose, covariance, place.pose @ T_odom_base.inverse())

    def stop(self) -> None:
        """Track nothing."""
        self._track = self._sharp = None

    def follow(self, view: View, *, force_update: bool) -> Tracked:
        """Update the filter by a scan, judge the pose, sharpen it.

        Parameters
        ----------
        view : View
            The scan, or one of each sensor, with the odometry.
        force_update : bool
            True to use the scan although the robot has not moved.
        """
        assert self._track is not None  # noqa: S101 - `start` comes first
        scans, T_odom_base = view.scans, view.T_odom_base
        step = self._filter.update if force_update else self._filter.follow
        self._track = step(self._track, T_odom_base, scans, self._rng, view.unconfirmed)
        estimate = self._estimate(self._track, T_odom_base)
        (fitting,) = self._matcher.score_poses(scans, [estimate.T_map_base])
        if fitting.score > self._config.monitor.doubtful_cost:
            estimate, fitting = self._recalled(scans, estimate, fitting)
        judgement = self._monitor.judge(
            scans, T_odom_base, estimate.T_map_base, estimate.covariance, fitting
        )
        if judgement.fit is Fit.CONSISTENT:
            self._has_leapt = False
            sharp = sharpen(estimate, scans, self._matcher.fields, self._sharp)
        else:
            sharp = hold(estimate, self._sharp)
        self._sharp = sharp
        T_map_odom = sharp.T_map_base @ T_odom_base.inverse()
        found = sharp.covariance_on(self._matcher.fields.grid)
        pose = TrackedPose(view.stamp, sharp.T_map_base, found, T_map_odom)
        return Tracked(pose, judgement, is_confirmed=not self._has_leapt)

    def _estimate(self, track: Track, T_odom_base: SE2) -> SharpPose:
        covariance = track.state.estimate.covariance
        return SharpPose(track.T_map_odom @ T_odom_base, covariance, T_odom_base)

    def _recalled(
        self, scans: Scans, estimate: SharpPose, fitting: Hypothesis
    ) -> tuple[SharpPose, Hypothesis]:
        """Bring particles that people or a wrong map have led away back to the sharp pose."""
        if self._sharp is None:
            return estimate, fitting
        T_odom_base = estimate.T_odom_base
        carried = self._sharp.carried(T_odom_base)
        (kept,) = self._matcher.score_poses(scans, [carried.T_map_base])
        has_left = not estimate.agrees(carried.T_map_base, carried.covariance)
        is_same = is_same_place(estimate.T_map_base, carried.T_map_base)
        if not is_same or kept.score >= (1.0 if has_left else _BETTER) * fitting.score:
            return estimate, fitting
        self._track = self._begun(carried.T_map_base, carried.covariance, T_odom_base)
        return self._estimate(self._track, T_odom_base), kept

    def _begun(self, T_map_base: SE2, covariance: NDArray[np.float64], T_odom_base: SE2) -> Track:
        n = self._config.amcl.max_particles
        particles = around_pose(T_map_base, covariance + _START_COVARIANCE, n, self._rng)
        return Track(start(particles), T_odom_base)

    def doubt_odometry(self) -> None:
        """Publish no pose until a scan fits: the odometry has leapt."""
        self._has_leapt = True

    def change_frame(self, before: Odometry, now: Odometry) -> None:
        """Go on at the same pose after the odometry has jumped from one message to the next."""
        if self._track is None:
            return
        T_map_base = self._track.T_map_odom @ before.T_odom_base
        T_filter_base = self._track.state.estimate.pose.inverse() @ T_map_base
        # The odometry of the last update, had its frame always been the new one.
        self._track = replace(self._track, T_odom_base=now.T_odom_base @ T_filter_base.inverse())
        self._sharp = None
        self._monitor = PoseMonitor(self._matcher, self._config.monitor)


def _inject_nothing(
    _: tuple[LaserScan, ...], __: int, ___: np.random.Generator
) -> NDArray[np.float64]:
    """Inject no particles: the monitor finds by search what augmented MCL draws at random."""
    return np.empty((0, 3))
