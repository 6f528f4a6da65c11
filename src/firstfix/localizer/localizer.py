"""The localizer: one input in, some outputs out."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from firstfix.amcl.particles import Particles
from firstfix.core.arguments import as_instance
from firstfix.core.estimate import Evidence, Hypothesis, LocateResult, Verdict
from firstfix.core.odometry import Odometry, Signal, SignalKind
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.global_localization.beams import FEWEST_HITS, usable_beams
from firstfix.global_localization.places import is_same_place
from firstfix.global_localization.scan_matcher import ScanMatcher
from firstfix.localizer.agreement import AgreementCounter, is_new_view
from firstfix.localizer.config import LocalizerConfig
from firstfix.localizer.contest import Contest, Standing
from firstfix.localizer.deciding_motion import FARTHEST_M, deciding_motion
from firstfix.localizer.inputs import Input, NewMap, NoMotionUpdate, PoseHint, Reset, check_input
from firstfix.localizer.outputs import Hypotheses, InitialPose, Output, Status
from firstfix.localizer.pose_monitor import Fit
from firstfix.localizer.pose_tracker import PoseTracker, Tracked
from firstfix.localizer.scan_queue import ScanQueue
from firstfix.localizer.states import Event, State, next_state

# A robot that rests where nothing fits sees the same again. People may go, so search once a second.
_RETRY_S = 1.0
_RETRY_M = 0.1

# A hint is confirmed if the scan fits there nearly as well as at the best place of the map.
_AS_GOOD = 1.5
_GOOD_COST = 0.3

# A robot that lost its pose is accepted at the first UNIQUE scan within this distance.
_STRAYED_M = 2.0


class Localizer:
    """Finds a robot, tracks it, notices when it was carried away, and finds it again.

    There is no clock, thread or socket: time is in the inputs. The same inputs give the same
    outputs.

    Parameters
    ----------
    config : LocalizerConfig, optional
        Settings.
    cache_dir : Path, optional
        Folder of prepared maps; by default every map is prepared anew.

    Examples
    --------
    >>> localizer = ff.Localizer()
    >>> outputs = localizer.handle(ff.NewMap(0.0, grid))
    >>> outputs += localizer.handle(ff.Odometry(0.0, (0.0, 0.0, 0.0)))
    >>> outputs += localizer.handle(scan)
    >>> [type(output).__name__ for output in outputs]
    ['Status', 'InitialPose', 'TrackedPose', 'Status']
    >>> localizer.state
    <State.LOCALIZED: 'LOCALIZED'>
    """

    def __init__(
        self, config: LocalizerConfig | None = None, cache_dir: Path | None = None
    ) -> None:
        self.config = as_instance(LocalizerConfig, config or LocalizerConfig(), "config")
        self._state = State.NO_MAP
        self._cache_dir = cache_dir
        self._rng = np.random.default_rng(self.config.amcl.seed)
        self._scans = ScanQueue()
        self._lifted: set[SignalKind] = set()
        self._update_requested = False
        self._hint: PoseHint | None = None
        self._chosen_by: str | None = None
        self._contest: Contest | None = None
        self._ids = itertools.count(1)
        self._compared_at = 0.0  # when the places were last compared
        self._nothing_fitted_at: tuple[float, SE2] | None = None
        self._lost_T_map_odom: SE2 | None = None  # if contradicted, and not picked up since
        self._agreement = AgreementCounter()
        self._agreed_at: SE2 | None = None
        self._matcher: ScanMatcher
        self._tracker: PoseTracker

    @property
    def state(self) -> State:
        """The state; only events in the table of `firstfix.localizer.states` change it."""
        return self._state

    def __repr__(self) -> str:
        grid = "" if self.matcher is None else f" in {self.matcher.fields.grid!r}"
        return f"<Localizer {self.state.value}{grid}>"

    @property
    def particles(self) -> Particles | None:
        """The particles of the tracked pose; None while there is none."""
        return None if self._state is State.NO_MAP else self._tracker.particles

    @property
    def matcher(self) -> ScanMatcher | None:
        """Global localization on the map in use; None before the first map."""
        return None if self._state is State.NO_MAP else self._matcher

    def handle(self, given: Input) -> list[Output]:
        """Process one input.

        Parameters
        ----------
        given : Input
            A map, scan, odometry message, signal of the base, hint or request. Scans and odometry
            may come in any order as long as each kind is in the order of its stamps: a scan waits
            until odometry reaches its stamp; if it reaches several at once, the newest is used.

        Returns
        -------
        list of Output
            What the input led to, in order; often nothing.

        Raises
        ------
        InputError
            If the value is not an input.
        MapError
            If a new map cannot be searched. The state stays as it was.
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
            self._scans.add(given)
            return self._use_next_scan()
        if isinstance(given, PoseHint):
            return self._take_hint(given)
        if isinstance(given, Reset):
            # A base that was restarted in the air never reports that it was set down.
            self._lifted.clear()
            return [self._restart(given.stamp, Event.RESET, "reset requested: searching")]
        return self._take_update_request(given)

    # ---- inputs

    def _take_map(self, given: NewMap) -> list[Output]:
        matcher = ScanMatcher(given.grid, config=self.config.locate, cache_dir=self._cache_dir)
        self._tracker = PoseTracker(matcher, self.config, self._rng)
        self._matcher = matcher
        status = self._restart(given.stamp, Event.MAP_RECEIVED, "map received: searching")
        if not self._lifted:
            return [status]
        reason = "map received: waiting until the robot is set down"
        return [self._restart(given.stamp, Event.PICKED_UP, reason)]

    def _take_odometry(self, given: Odometry) -> list[Output]:
        before = self._scans.odometry.last
        has_leapt = self._scans.odometry.leaps(given)
        has_jumped = self._scans.add_odometry(given)
        if self._state is State.NO_MAP:
            return []
        if has_leapt or has_jumped:
            self._tracker.doubt_odometry()
        if has_jumped and before is not None:
            return self._change_frame(before, given)
        return self._use_next_scan()

    def _take_signal(self, given: Signal) -> list[Output]:
        if not given.kind.means_lifted:
            return []
        if not given.active:
            return self._take_release(given)
        self._lifted.add(given.kind)
        if self._state is State.NO_MAP:
            return []
        reason = f"{given.kind.value}: waiting until the robot is set down"
        return [self._restart(given.stamp, Event.PICKED_UP, reason)]

    def _take_release(self, given: Signal) -> list[Output]:
        self._lifted.discard(given.kind)
        self._scans.discard_until(given.stamp)  # scans taken in the air
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
        self._tracker.stop()
        self._hint, self._chosen_by = given, None
        self._fire(Event.HINT_RECEIVED)
        reason = f"{given.source} proposes a pose: the next scan will verify it"
        return [self._status(given.stamp, reason)]

    def _take_update_request(self, given: NoMotionUpdate) -> list[Output]:
        self._update_requested = True
        self._nothing_fitted_at = None
        return [self._status(given.stamp, "the next scan will be used in any case")]

    def _use_next_scan(self) -> list[Output]:
        ready = self._scans.pop() if self._state is not State.NO_MAP else None
        if ready is None:
            return []
        scan, T_odom_base = ready
        if T_odom_base is None:
            return [self._status(scan.stamp, "a scan is older than all odometry: left out")]
        if self._state is State.LIFTED or not self._scans.is_valid(scan):
            return []
        steps = {
            State.SEARCHING: self._search,
            State.DISAMBIGUATING: self._disambiguate,
            State.VERIFYING_HINT: self._verify_hint,
            State.LOCALIZED: self._follow,
        }
        return steps[self._state](scan, T_odom_base)

    # ---- one scan in each state

    def _search(self, scan: LaserScan, T_odom_base: SE2) -> list[Output]:
        if not self._is_worth_searching(scan, T_odom_base):
            return []
        result = self._matcher.locate(scan)
        best = result.best
        self._nothing_fitted_at = None
        if best is None or result.verdict is Verdict.NO_MATCH:
            self._nothing_fitted_at = scan.stamp, T_odom_base
            evidence = best.evidence if best is not None else None
            return [self._status(scan.stamp, result.reason, evidence)]
        if result.verdict is Verdict.UNIQUE:
            if not self._is_plausible(T_odom_base, best):
                reason = "one place fits, far from where the pose was lost: waiting for more views"
                return [self._status(scan.stamp, reason, best.evidence)]
            return self._arrive(scan, T_odom_base, best, Event.ONE_PLACE_FITS, result.reason)
        self._contest = self._contest_of(result.hypotheses, T_odom_base)
        self._compared_at = scan.stamp
        self._fire(Event.SEVERAL_PLACES_FIT)
        return self._list_places(scan, self._contest)

    def _disambiguate(self, scan: LaserScan, T_odom_base: SE2) -> list[Output]:
        contest = self._contest
        assert contest is not None  # noqa: S101 - every way into this state begins one
        if contest.brings_news(T_odom_base) or self._update_requested:
            standing = contest.look(scan, T_odom_base)
        elif not 0.0 <= scan.stamp - self._compared_at < self.config.monitor.rest_period_s:
            standing = contest.look_at_rest(scan, T_odom_base)
        else:
            return []
        self._update_requested, self._compared_at = False, scan.stamp
        best = contest.places[0]
        if standing is Standing.WON:
            reason = f"one place is left; {best.evidence.explained:.0%} of the beams fit there"
            return self._arrive(scan, T_odom_base, best, Event.DECIDED, reason)
        if standing is Standing.LOST:
            reason = "no remaining place explains the scans: searching"
            return [self._restart(scan.stamp, Event.CONTRADICTED, reason)]
        return self._list_places(scan, contest)

    def _verify_hint(self, scan: LaserScan, T_odom_base: SE2) -> list[Output]:
        hint = self._hint
        assert hint is not None  # noqa: S101 - every way into this state brings one
        if np.count_nonzero(usable_beams(scan).hit) < FEWEST_HITS:
            reason = f"{hint.source} proposes a pose; the sensor sees too little to verify it"
            return [self._status(scan.stamp, reason)]
        self._hint = None
        place = self._matcher.search_locally(scan, hint.T_map_base)
        result = self._matcher.locate(scan)
        if not self._explains(place, result):
            reason = f"the pose proposed by {hint.source} does not explain the scan: searching"
            return [self._restart(scan.stamp, Event.HINT_REJECTED, reason, place.evidence)]
        contest = self._contest
        reason = (
            f"{hint.source} proposed this pose; {place.evidence.explained:.0%} of the beams fit"
        )
        outputs = self._arrive(scan, T_odom_base, place, Event.HINT_CONFIRMED, reason)
        if result.verdict is Verdict.UNIQUE:
            return outputs
        self._contest = contest or self._contest_of((*result.hypotheses, place), T_odom_base)
        self._chosen_by = hint.source
        return [*outputs[:-1], self._status(scan.stamp, self._choice(), place.evidence)]

    def _follow(self, scan: LaserScan, T_odom_base: SE2) -> list[Output]:
        tracked = self._tracker.follow(scan, T_odom_base, force_update=self._update_requested)
        self._update_requested = False
        place, fit = tracked.judgement.place, tracked.judgement.fit
        away = place.pose.distance_to(tracked.pose.T_map_base)
        if fit is Fit.ELSEWHERE:
            if not is_same_place(place.pose, tracked.pose.T_map_base):
                reason = f"found {away:.1f} m from the tracked pose"
                return self._arrive(scan, T_odom_base, place, Event.RELOCALIZED, reason)
            corrected = self._tracker.start(scan.stamp, T_odom_base, place)
            return [corrected, self._status(scan.stamp, "corrected", place.evidence)]
        if fit is Fit.CONTRADICTED:
            explained = place.evidence.explained
            reason = f"only {explained:.0%} of the beams fit here, for too long: searching"
            return [self._restart(scan.stamp, Event.CONTRADICTED, reason, place.evidence)]
        if not tracked.is_confirmed:
            reason = f"odometry has leapt, {_fit_words(tracked)}: waiting for a scan that fits"
            return [self._status(scan.stamp, reason, place.evidence)]
        if self._contest is not None and fit is Fit.CONSISTENT:
            T_map_base = tracked.pose.T_map_base
            other = self._weigh_choice(scan, T_odom_base, T_map_base, self._contest)
            if other is not None:
                reason = f"the scans fit another place than the one chosen by {self._chosen_by}"
                return self._arrive(scan, T_odom_base, other, Event.RELOCALIZED, reason)
        reason = self._choice() if self._chosen_by is not None else _fit_words(tracked)
        return [tracked.pose, self._status(scan.stamp, reason, place.evidence)]

    # ---- steps

    def _arrive(
        self, scan: LaserScan, T_odom_base: SE2, place: Hypothesis, event: Event, reason: str
    ) -> list[Output]:
        """Publish where the robot was found, and track it from there."""
        pose = self._tracker.start(scan.stamp, T_odom_base, place)
        self._contest = self._chosen_by = None
        self._fire(event)
        initial = InitialPose(scan.stamp, pose.T_map_base, pose.covariance)
        return [initial, pose, self._status(scan.stamp, reason, place.evidence)]

    def _restart(
        self, stamp: float, event: Event, reason: str, evidence: Evidence | None = None
    ) -> Status:
        """Discard everything about the pose, and change the state."""
        is_contradicted = event is Event.CONTRADICTED
        self._lost_T_map_odom = self._tracker.T_map_odom if is_contradicted else None
        self._tracker.stop()
        self._agreement.clear()
        self._agreed_at = self._nothing_fitted_at = None
        self._hint = self._contest = self._chosen_by = None
        self._scans.clear()
        self._fire(event)
        return self._status(stamp, reason, evidence)

    def _fire(self, event: Event) -> None:
        self._state = next_state(self._state, event)

    def _status(self, stamp: float, reason: str, evidence: Evidence | None = None) -> Status:
        rivals = 1 if self._state is State.LOCALIZED else 0
        if self._contest is not None:
            rivals = self._contest.rivals
        return Status(stamp, self._state, reason, evidence, rivals, self._chosen_by)

    def _is_plausible(self, T_odom_base: SE2, place: Hypothesis) -> bool:
        """Return whether a UNIQUE place may be published.

        A robot that lost its pose and was not picked up is not far away, or it has left the mapped
        area. A place far away needs several agreeing scans from different poses.
        """
        if self._lost_T_map_odom is None:
            return True
        if place.pose.distance_to(self._lost_T_map_odom @ T_odom_base) <= _STRAYED_M:
            return True
        config = self.config.monitor
        if self._agreed_at is not None and not is_new_view(self._agreed_at, T_odom_base, config):
            return False
        self._agreed_at = T_odom_base
        return self._agreement.count(place.pose, T_odom_base) >= config.decided_views

    def _is_worth_searching(self, scan: LaserScan, T_odom_base: SE2) -> bool:
        """Return whether a scan may fit somewhere although the last one fitted nowhere."""
        if self._nothing_fitted_at is None:
            return True
        stamp, T_odom_then = self._nothing_fitted_at
        moved = T_odom_then.distance_to(T_odom_base) >= _RETRY_M
        return moved or not 0.0 <= scan.stamp - stamp < _RETRY_S

    def _explains(self, place: Hypothesis, result: LocateResult) -> bool:
        """Return whether a hinted place fits nearly as well as the best place of the map."""
        best = result.best or place
        is_elsewhere = result.verdict is Verdict.UNIQUE and not is_same_place(place.pose, best.pose)
        is_as_good = place.score <= _AS_GOOD * max(best.score, _GOOD_COST)
        fits = place.score <= self.config.monitor.doubtful_cost
        return is_as_good and fits and not is_elsewhere

    def _change_frame(self, before: Odometry, now: Odometry) -> list[Output]:
        """Go on at the same pose in a new odometry frame; the next scan judges it."""
        if self._state is State.DISAMBIGUATING:
            # The places moved with the old frame.
            reason = "odometry jumped while several places fit: searching"
            return [self._restart(now.stamp, Event.ODOMETRY_JUMPED, reason)]
        self._contest = None
        self._tracker.change_frame(before, now)
        return []

    # ---- several places

    def _contest_of(self, places: Sequence[Hypothesis], T_odom_base: SE2) -> Contest:
        return Contest(tuple(places), T_odom_base, self._matcher, self.config.monitor, self._ids)

    def _list_places(self, scan: LaserScan, contest: Contest) -> list[Output]:
        places, rivals = contest.places, contest.rivals
        motion = deciding_motion(scan, places, self._matcher.fields.grid)
        if rivals <= 1:
            reason = f"the best place has a probability of {places[0].probability:.0%}"
        elif motion is not None:
            reason = f"{rivals} places fit about equally well; motion would decide"
        else:
            reason = f"{rivals} places look identical to this sensor; no motion of up to "
            reason += f"{FARTHEST_M:.0f} m would decide"
        outputs: list[Output] = [
            Hypotheses(scan.stamp, places),
            self._status(scan.stamp, reason, places[0].evidence),
        ]
        return [*outputs, motion] if motion is not None else outputs

    def _listed_place(self, hypothesis_id: int) -> Hypothesis | None:
        places = self._contest.places if self._contest is not None else ()
        return next((place for place in places if place.id == hypothesis_id), None)

    def _weigh_choice(
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


def _fit_words(tracked: Tracked) -> str:
    explained = tracked.judgement.place.evidence.explained
    if tracked.judgement.fit is Fit.UNINFORMATIVE:
        return "the sensor sees too little: following odometry"
    doubt = "" if tracked.judgement.fit is Fit.CONSISTENT else "doubtful: only "
    return f"{doubt}{explained:.0%} of the beams fit"
