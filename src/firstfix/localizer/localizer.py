"""The system: one input in, some outputs out."""

from __future__ import annotations

import itertools
import math
from collections import deque
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from firstfix.amcl.filter import start
from firstfix.amcl.initial import around_pose
from firstfix.amcl.particles import Particles
from firstfix.amcl.sensor import build_sensor
from firstfix.amcl.tracker import Track, Tracker
from firstfix.core.arguments import as_instance
from firstfix.core.estimate import Evidence, Hypothesis, Verdict
from firstfix.core.odometry import Odometry, Signal, SignalKind
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.global_localization.beams import FEWEST_HITS, usable_beams
from firstfix.global_localization.places import is_same_place
from firstfix.global_localization.scan_matcher import ScanMatcher
from firstfix.localizer.agreement import AgreementCounter, is_new_view
from firstfix.localizer.config import LocalizerConfig
from firstfix.localizer.contest import Contest, Standing
from firstfix.localizer.deciding_motion import deciding_motion
from firstfix.localizer.inputs import (
    Input,
    NewMap,
    NoMotionUpdate,
    PoseHint,
    Reset,
    check_input,
)
from firstfix.localizer.odometry_buffer import OdometryBuffer
from firstfix.localizer.outputs import Hypotheses, InitialPose, Output, Status, TrackedPose
from firstfix.localizer.pose_monitor import Fit, PoseMonitor
from firstfix.localizer.states import Event, State, next_state

# The covariance of the static stage is that of one scan in a perfect map; a track begins wider.
_BEGIN_COVARIANCE = np.diag([0.03**2, 0.03**2, np.radians(1.0) ** 2])

# A robot that stands where nothing fits sees the same again: people may go, so once a second.
_PATIENCE_S = 1.0
_MOVED_M = 0.1

# Where somebody says the robot is, it must fit nearly as well as at the best place of the map.
_AS_GOOD = 1.5
_GOOD_COST = 0.3

# Odometry may lag by so many scans: a second at 40 Hz. A scan that waits alone would starve under
# odometry that lags by more than the time from scan to scan.
_MOST_WAITING = 40

# How far a robot may be from where its track was lost and still be believed at the first word.
_STRAYED_M = 2.0


class Localizer:
    """Finds a robot, follows it, notices when it was carried away, and finds it again.

    No clock, no thread, no socket: time is in the inputs. The same inputs give the same outputs.

    Parameters
    ----------
    config : LocalizerConfig, optional
        Settings.
    cache_dir : Path, optional
        Folder of prepared maps; by default every map is prepared anew.
    """

    def __init__(
        self, config: LocalizerConfig | None = None, cache_dir: Path | None = None
    ) -> None:
        self.config = as_instance(LocalizerConfig, config or LocalizerConfig(), "config")
        self._state = State.NO_MAP
        self._cache_dir = cache_dir
        self._rng = np.random.default_rng(self.config.amcl.seed)
        self._odometry = OdometryBuffer()
        self._has_leapt = False  # and no scan has fitted since
        self._waiting: deque[LaserScan] = deque(maxlen=_MOST_WAITING)
        self._lifted: set[SignalKind] = set()
        self._stands_since = -math.inf
        self._found_nothing_at: tuple[float, SE2] | None = None
        self._update_asked = False
        self._looked_at = 0.0
        self._hint: PoseHint | None = None
        self._lost_track: SE2 | None = None  # T_map_odom, if contradicted and not picked up since
        self._last_agreed_at: SE2 | None = None
        self._agreement = AgreementCounter()
        self._track: Track | None = None
        self._matcher: ScanMatcher
        self._tracker: Tracker
        self._monitor: PoseMonitor
        self._contest: Contest | None = None
        self._chosen_by: str | None = None
        self._ids = itertools.count(1)

    @property
    def state(self) -> State:
        """The state; only events in the table of `firstfix.localizer.states` change it."""
        return self._state

    def __repr__(self) -> str:
        grid = "" if self.matcher is None else f" in {self.matcher.fields.grid!r}"
        return f"<Localizer {self.state.value}{grid}>"

    @property
    def particles(self) -> Particles | None:
        """The belief; None while there is none."""
        return self._track.state.particles if self._track is not None else None

    @property
    def matcher(self) -> ScanMatcher | None:
        """The static stage on the map in use; None before the first map."""
        return None if self._state is State.NO_MAP else self._matcher

    def handle(self, given: Input) -> list[Output]:
        """Take in what happened.

        Parameters
        ----------
        given : Input
            A map, scan, odometry message, signal of the base, hint or request. Scans and odometry
            may come in any order as long as each kind is in the order of its stamps: a scan waits
            until odometry reaches its stamp; if it reaches several at once, the newest is used.

        Returns
        -------
        list of Output
            What there is to say about it, in order; often nothing.

        Raises
        ------
        InputError
            If this is no input.
        MapError
            If a new map cannot be searched. The state is that of before.
        """
        check_input(given)
        if isinstance(given, NewMap):
            return self._take_map(given)
        if isinstance(given, Odometry):
            return self._take_odometry(given)
        if isinstance(given, Signal):
            return self._take_signal(given)
        if self._state is State.NO_MAP:
            return [self._status(given.stamp, "no map yet")]
        if isinstance(given, LaserScan):
            self._waiting.append(given)
            return self._take_waiting_scan()
        if isinstance(given, PoseHint):
            return self._take_hint(given)
        if isinstance(given, Reset):
            # A base that was restarted in the air never reports that it was set down.
            self._lifted.clear()
            return [self._forget(given.stamp, Event.RESET, "reset requested: searching")]
        return self._take_update_request(given)

    # ---- inputs

    def _take_map(self, given: NewMap) -> list[Output]:
        matcher = ScanMatcher(given.grid, config=self.config.locate, cache_dir=self._cache_dir)
        sensor = build_sensor(given.grid, self.config.amcl)
        self._matcher = matcher
        self._tracker = Tracker(sensor, self.config.amcl, self._no_injection)
        status = self._forget(given.stamp, Event.MAP_RECEIVED, "map received: searching")
        if not self._lifted:
            return [status]
        reason = "map received: waiting until the robot is set down"
        return [self._forget(given.stamp, Event.PICKED_UP, reason)]

    def _take_odometry(self, given: Odometry) -> list[Output]:
        before = self._odometry.last
        has_leapt = self._odometry.leaps(given)
        has_jumped = self._odometry.add(given)
        self._has_leapt |= has_leapt or has_jumped
        if not has_jumped:
            return self._take_waiting_scan()
        self._waiting.clear()  # of the clock or the frame before
        self._stands_since = min(self._stands_since, given.stamp)
        return self._follow_jump(before, given)

    def _take_signal(self, given: Signal) -> list[Output]:
        if not given.kind.means_lifted:
            return []
        if not given.active:
            return self._take_release(given)
        self._lifted.add(given.kind)
        if self._state is State.NO_MAP:
            return []
        reason = f"{given.kind.value}: waiting until the robot is set down"
        return [self._forget(given.stamp, Event.PICKED_UP, reason)]

    def _take_release(self, given: Signal) -> list[Output]:
        self._lifted.discard(given.kind)
        self._stands_since = given.stamp
        self._waiting.clear()  # scans taken in the air
        if self._lifted or self._state is not State.LIFTED:
            return []
        self._fire(Event.SET_DOWN)
        if self._hint is not None:
            self._fire(Event.HINT_RECEIVED)
        return [self._status(given.stamp, "set down: waiting for the next scan")]

    def _take_hint(self, given: PoseHint) -> list[Output]:
        if given.hypothesis_id is not None:
            place = self._listed_place(given.hypothesis_id)
            if place is None:
                reason = f"place {given.hypothesis_id} is no longer listed: choose another one"
                return [self._status(given.stamp, reason)]
            given = replace(given, T_map_base=place.pose)
        self._track = self._chosen_by = None
        self._hint = given
        self._fire(Event.HINT_RECEIVED)
        reason = f"{given.source} proposes a pose: the next scan will verify it"
        return [self._status(given.stamp, reason)]

    def _take_update_request(self, given: NoMotionUpdate) -> list[Output]:
        self._update_asked = True
        self._found_nothing_at = None
        return [self._status(given.stamp, "the next scan will be used in any case")]

    def _take_waiting_scan(self) -> list[Output]:
        last = self._odometry.last
        if last is None or self._state is State.NO_MAP:
            return []
        reached = [scan for scan in self._waiting if scan.stamp <= last.stamp]
        if not reached:
            return []
        for scan in reached:  # not only the first: one stamp from the future must not block all
            self._waiting.remove(scan)
        scan = reached[-1]
        T_odom_base = self._odometry.at(scan.stamp)
        if T_odom_base is None:
            reason = "a scan is older than the odometry that is known: left out"
            return [self._status(scan.stamp, reason)]
        if self._lifted or scan.stamp < self._stands_since:
            return []
        if self._state is State.SEARCHING:
            return self._search(scan, T_odom_base)
        if self._state is State.VERIFYING_HINT:
            return self._verify_hint(scan, T_odom_base)
        if self._state is State.DISAMBIGUATING:
            return self._decide(scan, T_odom_base)
        return self._follow(scan, T_odom_base)

    # ---- states

    def _search(self, scan: LaserScan, T_odom_base: SE2) -> list[Output]:
        if not self._worth_searching(scan, T_odom_base):
            return []
        result = self._matcher.locate(scan)
        best = result.best
        self._found_nothing_at = None
        if best is None or result.verdict is Verdict.NO_MATCH:
            self._found_nothing_at = scan.stamp, T_odom_base
            evidence = best.evidence if best is not None else None
            return [self._status(scan.stamp, result.reason, evidence)]
        if result.verdict is Verdict.UNIQUE:
            if not self._believable(T_odom_base, best):
                reason = "one place fits, far from where the track was lost: waiting for more"
                return [self._status(scan.stamp, reason, best.evidence)]
            return self._arrive(scan, T_odom_base, best, Event.ONE_PLACE_FITS, result.reason)
        self._contest = self._contest_of(result.hypotheses, T_odom_base)
        self._looked_at = scan.stamp
        self._fire(Event.SEVERAL_PLACES_FIT)
        return self._publish_places(scan, self._contest, result.reason)

    def _decide(self, scan: LaserScan, T_odom_base: SE2) -> list[Output]:
        contest = self._contest
        assert contest is not None  # noqa: S101 - every way into this state begins one
        if contest.brings_news(T_odom_base) or self._update_asked:
            standing = contest.look(scan, T_odom_base)
        elif not 0.0 <= scan.stamp - self._looked_at < self.config.monitor.rest_period_s:
            standing = contest.look_at_rest(scan, T_odom_base)
        else:
            return []
        self._update_asked, self._looked_at = False, scan.stamp
        best = contest.places[0]
        if standing is Standing.WON:
            reason = f"one place is left; {best.evidence.explained:.0%} of the beams fit there"
            return self._arrive(scan, T_odom_base, best, Event.DECIDED, reason)
        if standing is Standing.LOST:
            reason = "no remaining place explains the scans: searching"
            return [self._forget(scan.stamp, Event.CONTRADICTED, reason)]
        reason = f"the best place has a probability of {best.probability:.0%}"
        if contest.rivals > 1:
            reason = f"{contest.rivals} places fit about as well; motion would decide"
        return self._publish_places(scan, contest, reason)

    def _verify_hint(self, scan: LaserScan, T_odom_base: SE2) -> list[Output]:
        hint = self._hint
        assert hint is not None  # noqa: S101 - every way into this state brings one
        if np.count_nonzero(usable_beams(scan).hit) < FEWEST_HITS:
            reason = f"{hint.source} proposes a pose; the sensor sees too little to verify it"
            return [self._status(scan.stamp, reason)]
        self._hint = None
        place = self._matcher.search_locally(scan, hint.T_map_base)
        result = self._matcher.locate(scan)
        best = result.best or place
        known = is_same_place(place.pose, best.pose)
        elsewhere = result.verdict is Verdict.UNIQUE and not known
        as_good = place.score <= _AS_GOOD * max(best.score, _GOOD_COST)
        if as_good and not elsewhere and place.score <= self.config.monitor.doubtful_cost:
            contest = None
            if result.verdict is not Verdict.UNIQUE:
                contest = self._contest or self._contest_of(
                    (*result.hypotheses, place), T_odom_base
                )
            fit = f"{place.evidence.explained:.0%} of the beams fit there"
            reason = f"{hint.source} proposed this pose; {fit}"
            outputs = self._arrive(scan, T_odom_base, place, Event.HINT_CONFIRMED, reason)
            if contest is None:
                return outputs
            self._contest, self._chosen_by = contest, hint.source
            return [*outputs[:-1], self._status(scan.stamp, self._choice(), place.evidence)]
        reason = f"the pose proposed by {hint.source} does not explain the scan: searching"
        return [self._forget(scan.stamp, Event.HINT_REJECTED, reason, place.evidence)]

    def _follow(self, scan: LaserScan, T_odom_base: SE2) -> list[Output]:
        track = self._move(scan, T_odom_base)
        T_map_base = track.T_map_odom @ T_odom_base
        judged = self._monitor.judge(scan, T_odom_base, T_map_base)
        if judged.fit is Fit.ELSEWHERE:
            if is_same_place(judged.place.pose, T_map_base):
                return self._correct(scan, T_odom_base, judged.place)
            reason = f"found {judged.place.pose.distance_to(T_map_base):.1f} m from the track"
            return self._arrive(scan, T_odom_base, judged.place, Event.RELOCALIZED, reason)
        evidence = judged.place.evidence
        if judged.fit is Fit.CONTRADICTED:
            reason = f"only {evidence.explained:.0%} of the beams fit here, for too long: searching"
            return [self._forget(scan.stamp, Event.CONTRADICTED, reason, evidence)]
        said = f"{evidence.explained:.0%} of the beams fit"
        self._has_leapt &= judged.fit is not Fit.CONSISTENT
        if self._has_leapt:
            reason = f"odometry has leapt, and only {said} since: waiting for more"
            return [self._status(scan.stamp, reason, evidence)]
        reason = {
            Fit.CONSISTENT: said,
            Fit.UNINFORMATIVE: "the sensor sees too little to tell: going on by odometry",
        }.get(judged.fit, f"doubtful: only {said}")
        if self._contest is not None and judged.fit is Fit.CONSISTENT:
            other = self._reconsider(scan, T_odom_base, T_map_base, self._contest)
            if other is not None:
                reason = f"the scans fit another place than the one chosen by {self._chosen_by}"
                return self._arrive(scan, T_odom_base, other, Event.RELOCALIZED, reason)
            reason = self._choice() if self._chosen_by is not None else reason
        covariance = track.state.estimate.covariance
        return [
            TrackedPose(scan.stamp, T_map_base, covariance, track.T_map_odom),
            self._status(scan.stamp, reason, evidence),
        ]

    # ---- steps

    def _arrive(
        self, scan: LaserScan, T_odom_base: SE2, place: Hypothesis, event: Event, reason: str
    ) -> list[Output]:
        """Tell that the robot is found, and follow from there."""
        tracked = self._settle(scan, T_odom_base, place)
        self._contest = self._chosen_by = None
        self._fire(event)
        return [
            InitialPose(scan.stamp, place.pose, tracked.covariance),
            tracked,
            self._status(scan.stamp, reason, place.evidence),
        ]

    def _correct(self, scan: LaserScan, T_odom_base: SE2, place: Hypothesis) -> list[Output]:
        """Put a track right that is a little off; the robot was neither lost nor found."""
        tracked = self._settle(scan, T_odom_base, place)
        return [tracked, self._status(scan.stamp, "put right", place.evidence)]

    def _settle(self, scan: LaserScan, T_odom_base: SE2, place: Hypothesis) -> TrackedPose:
        """Begin a track at a place."""
        covariance = place.covariance + _BEGIN_COVARIANCE
        n = self.config.amcl.max_particles
        self._has_leapt = False
        self._track = Track(start(around_pose(place.pose, covariance, n, self._rng)), T_odom_base)
        self._monitor = PoseMonitor(self._matcher, self.config.monitor)
        T_map_odom = place.pose @ T_odom_base.inverse()
        return TrackedPose(scan.stamp, place.pose, covariance, T_map_odom)

    def _believable(self, T_odom_base: SE2, place: Hypothesis) -> bool:
        """Tell whether a UNIQUE place may be published.

        A robot that lost its track and was not picked up is not far, or it has left the mapped
        area: for a place far away, several scans from different places must speak.
        """
        if self._lost_track is None:
            return True
        if place.pose.distance_to(self._lost_track @ T_odom_base) <= _STRAYED_M:
            return True
        before = self._last_agreed_at
        if before is not None and not is_new_view(before, T_odom_base, self.config.monitor):
            return False
        self._last_agreed_at = T_odom_base
        return self._agreement.count(place.pose, T_odom_base) >= self.config.monitor.decided_views

    def _worth_searching(self, scan: LaserScan, T_odom_base: SE2) -> bool:
        """Tell whether a scan may say what the last, which fitted nowhere, did not."""
        if self._found_nothing_at is None:
            return True
        stamp, T_odom_then = self._found_nothing_at
        moved = T_odom_then.distance_to(T_odom_base) >= _MOVED_M
        return moved or not 0.0 <= scan.stamp - stamp < _PATIENCE_S

    def _move(self, scan: LaserScan, T_odom_base: SE2) -> Track:
        assert self._track is not None  # noqa: S101 - the states that follow have one
        step = self._tracker.update if self._update_asked else self._tracker.follow
        self._update_asked = False
        self._track = step(self._track, T_odom_base, scan, self._rng)
        return self._track

    def _forget(
        self, stamp: float, event: Event, reason: str, evidence: Evidence | None = None
    ) -> Status:
        contradicted = event is Event.CONTRADICTED and self._track is not None
        self._lost_track = self._track.T_map_odom if contradicted and self._track else None
        self._last_agreed_at = None
        self._found_nothing_at = None
        self._agreement.clear()
        self._track = self._hint = self._contest = self._chosen_by = None
        self._waiting.clear()
        self._fire(event)
        return self._status(stamp, reason, evidence)

    def _fire(self, event: Event) -> None:
        self._state = next_state(self._state, event)

    def _status(self, stamp: float, reason: str, evidence: Evidence | None = None) -> Status:
        rivals = 1 if self._state is State.LOCALIZED else 0
        if self._contest is not None:
            rivals = self._contest.rivals
        return Status(stamp, self._state, reason, evidence, rivals, self._chosen_by)

    def _contest_of(self, places: Sequence[Hypothesis], T_odom_base: SE2) -> Contest:
        return Contest(tuple(places), T_odom_base, self._matcher, self.config.monitor, self._ids)

    def _publish_places(self, scan: LaserScan, contest: Contest, reason: str) -> list[Output]:
        places = contest.places
        motion = deciding_motion(scan, places, self._matcher.fields.grid)
        outputs: list[Output] = [
            Hypotheses(scan.stamp, places),
            self._status(scan.stamp, reason, places[0].evidence),
        ]
        return [*outputs, motion] if motion is not None else outputs

    def _listed_place(self, hypothesis_id: int) -> Hypothesis | None:
        places = self._contest.places if self._contest is not None else ()
        return next((place for place in places if place.id == hypothesis_id), None)

    def _reconsider(
        self, scan: LaserScan, T_odom_base: SE2, T_map_base: SE2, contest: Contest
    ) -> Hypothesis | None:
        """Weigh a pose that a person chose against its rivals; return another place that won."""
        if not contest.brings_news(T_odom_base):
            return None
        standing = contest.look(scan, T_odom_base)
        if standing is Standing.LOST:
            result = self._matcher.locate(scan)
            self._contest = self._contest_of(result.hypotheses, T_odom_base)
        if standing is not Standing.WON:
            return None
        best = contest.places[0]
        if not is_same_place(best.pose, T_map_base):
            return best
        self._contest = self._chosen_by = None
        return None

    def _choice(self) -> str:
        """Say who chose the pose, and what the scans say."""
        rivals = self._contest.rivals if self._contest is not None else 1
        fit = f"{rivals} places fit equally well" if rivals > 1 else "the scans do not decide yet"
        return f"chosen by {self._chosen_by}; {fit}"

    def _follow_jump(self, before: Odometry | None, now: Odometry) -> list[Output]:
        """Go on at the same pose in a new odometry frame; the next scan will tell whether."""
        if self._state is State.DISAMBIGUATING:
            # The places moved with the old frame.
            reason = "odometry jumped while several places fit: searching"
            return [self._forget(now.stamp, Event.ODOMETRY_JUMPED, reason)]
        self._contest = None
        if self._track is None or before is None:
            return []
        T_map_base = self._track.T_map_odom @ before.T_odom_base
        T_before_now = self._track.state.estimate.pose.inverse() @ T_map_base
        # Odometry that would have brought the track here, had its frame always been the new one.
        self._track = Track(self._track.state, now.T_odom_base @ T_before_now.inverse())
        self._monitor = PoseMonitor(self._matcher, self.config.monitor)
        return []

    @staticmethod
    def _no_injection(_: LaserScan, __: int, ___: np.random.Generator) -> NDArray[np.float64]:
        """Nothing: what augmented recovery guesses at random, the monitor finds by search."""
        return np.empty((0, 3))
