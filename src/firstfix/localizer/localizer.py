"""The localizer: one input in, some outputs out."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from firstfix.amcl.particles import Particles
from firstfix.belief.belief import Belief
from firstfix.belief.hints import Source
from firstfix.belief.prior import Gaussian
from firstfix.belief.view import View
from firstfix.changes.counts import LEAST_EXPLAINED, ChangeCounter
from firstfix.core.arguments import as_instance
from firstfix.core.errors import InputError
from firstfix.core.estimate import Evidence, Hypothesis, Verdict
from firstfix.core.odometry import Odometry, Signal, SignalKind
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.global_localization.places import is_same_place
from firstfix.global_localization.scan_matcher import ScanMatcher
from firstfix.localizer.config import LocalizerConfig
from firstfix.localizer.deciding_motion import advise
from firstfix.localizer.hint import Hint, read_hint
from firstfix.localizer.inputs import (
    Input,
    MapHint,
    NewMap,
    PoseHint,
    PositionFix,
    Reset,
    check_input,
)
from firstfix.localizer.outputs import Hypotheses, InitialPose, Output, Status
from firstfix.localizer.place_belief import Pace, PlaceBelief, Support
from firstfix.localizer.pose_monitor import Fit
from firstfix.localizer.pose_tracker import PoseTracker, Tracked
from firstfix.localizer.scan_queue import ScanQueue
from firstfix.localizer.states import Event, State, next_state

# A robot that lost its pose is accepted at the first sure place within this distance.
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
        Folder of prepared maps; by default nothing is cached.

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
        self._scans = ScanQueue(self.config.scans)
        self._view: View | None = None
        self._unweighed: tuple[View, Tracked] | None = None
        self._lifted: set[SignalKind] = set()
        self._update_requested = False
        self._hint: Hint | None = None
        self._chosen_by: str | None = None
        self._lost_T_map_odom: SE2 | None = None  # if contradicted, and not picked up since
        self._matcher: ScanMatcher
        self._tracker: PoseTracker
        self._places: PlaceBelief
        self._changes: ChangeCounter | None = None

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
    def belief(self) -> Belief | None:
        """The belief over all places of the map; None before the first map."""
        return None if self._state is State.NO_MAP else self._places.belief

    @property
    def view(self) -> View | None:
        """The scans that were used last, moved to one time; None before the first."""
        return self._view

    @property
    def matcher(self) -> ScanMatcher | None:
        """Global localization on the map in use; None before the first map."""
        return None if self._state is State.NO_MAP else self._matcher

    @property
    def changes(self) -> ChangeCounter | None:
        """What scans contradict in the map in use; None unless `ChangesConfig` keeps days."""
        return self._changes

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
        return [*self._weigh_in_background(), *self._process(given)]

    def _process(self, given: Input) -> list[Output]:
        if isinstance(given, NewMap):
            return self._take_map(given)
        if isinstance(given, Odometry):
            return self._take_odometry(given)
        if isinstance(given, Signal):
            return self._take_signal(given)
        if self._state is State.NO_MAP:
            return [self._status(given.stamp, "no map yet")]
        if isinstance(given, LaserScan):
            complaint = self._scans.add(given)
            said = [self._status(given.stamp, complaint)] if complaint is not None else []
            return [*said, *self._use_next_scan()]
        if isinstance(given, PoseHint):
            return self._take_hint(given)
        if isinstance(given, PositionFix):
            return self._take_fix(given)
        if isinstance(given, Reset):
            return self._take_reset(given)
        if isinstance(given, MapHint):
            reason = f"there is one map: {given.source} cannot name another one"
            return [self._status(given.stamp, reason)]
        self._update_requested = True
        return [self._status(given.stamp, "the next scan will be used in any case")]

    # ---- inputs

    def _take_map(self, given: NewMap) -> list[Output]:
        matcher = ScanMatcher(
            given.grid,
            config=self.config.locate,
            cache_dir=self._cache_dir,
            fields=given.fields,
        )
        self._tracker = PoseTracker(matcher, self.config, self._rng)
        pause = self.config.monitor.rest_period_s
        self._places = PlaceBelief(matcher.fields, self.config.belief, pause)
        self._matcher = matcher
        days = self.config.changes.days_kept
        self._changes = ChangeCounter(matcher.fields, days) if days else None
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
        listed = self._places.places if self._state is not State.SEARCHING else ()
        hint = read_hint(given, listed)
        if hint is None:
            reason = f"place {given.hypothesis_id} is no longer listed: choose another one"
            return [self._status(given.stamp, reason)]
        try:
            if given.hypothesis_id is not None:
                self._places.add_prior(hint.prior)
            else:  # the robot may have been carried there: the views so far are worth nothing
                self._places.restart(hint.prior, Source.PERSON)
        except InputError as error:
            return [self._status(given.stamp, f"hint of {given.source} refused: {error}")]
        self._tracker.stop()
        self._hint, self._chosen_by = hint, None
        self._fire(Event.HINT_RECEIVED)
        reason = f"{given.source} proposes a pose: the next scan will verify it"
        return [self._status(given.stamp, reason)]

    def _take_fix(self, given: PositionFix) -> list[Output]:
        try:
            prior = Gaussian(given.T_map_base, given.covariance)
            self._places.take_fix(given.source, prior, self._scans.odometry.at(given.stamp))
        except InputError as error:
            return [self._status(given.stamp, f"{given.source} refused: {error}")]
        return []

    def _take_reset(self, given: Reset) -> list[Output]:
        # A base that was restarted in the air never reports that it was set down.
        self._lifted.clear()
        status = self._restart(given.stamp, Event.RESET, "reset requested: searching")
        if given.prior is None:
            return [status]
        try:
            self._places.restart(given.prior)
        except InputError as error:
            return [self._status(given.stamp, f"prior refused: {error}")]
        return [status]

    def _use_next_scan(self) -> list[Output]:
        view = self._scans.pop() if self._state is not State.NO_MAP else None
        if view is None:
            return []
        if isinstance(view, LaserScan):
            return [self._status(view.stamp, "a scan is older than all odometry: left out")]
        if self._state is State.LIFTED or not self._scans.is_valid(view):
            return []
        self._view = view
        steps = {
            State.SEARCHING: self._find,
            State.DISAMBIGUATING: self._find,
            State.VERIFYING_HINT: self._verify_hint,
            State.LOCALIZED: self._follow,
        }
        return steps[self._state](view)

    # ---- one scan in each state

    def _find(self, view: View) -> list[Output]:
        """Weigh all places; publish the best one when it is sure."""
        if not self._weigh(view, Pace.AT_REST_TOO):
            return []
        verdict, reason = self._places.belief.verdict, self._places.belief.reason
        best = self._places.places[0] if self._places.places else None
        is_searching = self._state is State.SEARCHING
        if best is None or verdict is Verdict.NO_MATCH:
            if not is_searching:
                self._fire(Event.CONTRADICTED)
            return [self._status(view.stamp, reason, best.evidence if best else None)]
        if verdict is Verdict.UNIQUE:
            if not self._is_plausible(best, view.T_odom_base):
                reason = "one place fits, far from where the pose was lost: waiting for more views"
                return [self._status(view.stamp, reason, best.evidence)]
            event = Event.ONE_PLACE_FITS if is_searching else Event.DECIDED
            return self._arrive(view, best, event, reason)
        if is_searching:
            self._fire(Event.SEVERAL_PLACES_FIT)
        return self._list_places(view)

    def _verify_hint(self, view: View) -> list[Output]:
        """Let the belief judge a pose that was proposed."""
        hint = self._hint
        assert hint is not None  # noqa: S101 - every way into this state brings one
        if not self._weigh(view, Pace.EVERY_SCAN) or self._places.is_blind:
            reason = f"{hint.source} proposes a pose; the sensor sees too little to verify it"
            return [self._status(view.stamp, reason)]
        verdict, places = self._places.belief.verdict, self._places.places
        if verdict is Verdict.UNIQUE and hint.matches(places[0].pose):
            explained = places[0].evidence.explained
            reason = f"{hint.source} proposed this pose; {explained:.0%} of the beams fit"
            return self._arrive(view, places[0], Event.HINT_CONFIRMED, reason)
        if verdict is Verdict.AMBIGUOUS and any(hint.matches(place.pose) for place in places):
            self._fire(Event.SEVERAL_PLACES_FIT)
            return self._list_places(view)
        reason = f"the pose proposed by {hint.source} does not explain the scan: searching"
        return [self._restart(view.stamp, Event.HINT_REJECTED, reason)]

    def _follow(self, view: View) -> list[Output]:
        tracked = self._tracker.follow(view, force_update=self._update_requested)
        self._update_requested = False
        place, fit = tracked.judgement.place, tracked.judgement.fit
        if fit is Fit.ELSEWHERE:
            away = place.pose.distance_to(tracked.pose.T_map_base)
            if not is_same_place(place.pose, tracked.pose.T_map_base):
                reason = f"found {away:.1f} m from the tracked pose"
                return self._arrive(view, place, Event.RELOCALIZED, reason)
            corrected = self._tracker.start(view.stamp, view.T_odom_base, place)
            self._places.restart()  # the wheels slipped: earlier views are not where they seem
            return [corrected, self._status(view.stamp, "corrected", place.evidence)]
        if fit is Fit.CONTRADICTED:
            explained = place.evidence.explained
            reason = f"only {explained:.0%} of the beams fit here, for too long: searching"
            return [self._restart(view.stamp, Event.CONTRADICTED, reason, place.evidence)]
        if not tracked.is_confirmed:
            reason = f"odometry has leapt, {tracked.fit_in_words}: waiting for a scan that fits"
            return [self._status(view.stamp, reason, place.evidence)]
        if self._places.tracking_pace is Pace.BACKGROUND and self._is_settled(tracked):
            self._unweighed = view, tracked  # the search takes longer than a scan: the pose first
        elif revised := self._reconsider(view, tracked):
            return revised
        if self._chosen_by is None and place.evidence.explained >= LEAST_EXPLAINED:
            self._count_changes(view, tracked)
        reason = self._unless_chosen(tracked.fit_in_words)
        return [tracked.pose, self._status(view.stamp, reason, place.evidence)]

    def _is_settled(self, tracked: Tracked) -> bool:
        return self._chosen_by is None and tracked.judgement.fit is Fit.CONSISTENT

    def _weigh_in_background(self) -> list[Output]:
        """Reconsider the pose of the scan before, which was published at once."""
        waiting, self._unweighed = self._unweighed, None
        return [] if waiting is None else self._reconsider(*waiting)

    def _count_changes(self, view: View, tracked: Tracked) -> None:
        if self._changes is not None:
            self._changes.add(view.scans, tracked.pose.T_map_base, tracked.pose.covariance)

    def _reconsider(self, view: View, tracked: Tracked) -> list[Output]:
        """Weigh all places; return what changes if the pose was wrong."""
        pace = self._places.tracking_pace if self._is_settled(tracked) else Pace.EVERY_VIEW
        if not self._weigh(view, pace):
            return []
        T_map_base = tracked.pose.T_map_base
        support = self._places.support_for(T_map_base)
        if support is Support.SAME_PLACE and self._places.is_decided_by_evidence:
            self._chosen_by = None
        if support is Support.OTHER_PLACE:
            best, reason = self._places.places[0], self._places.belief.reason
            reason = f"{best.pose.distance_to(T_map_base):.1f} m from the tracked pose {reason}"
            return self._arrive(view, best, Event.RELOCALIZED, reason)
        if support is Support.WITHDRAWN:
            self._tracker.stop()
            self._chosen_by = None
            self._fire(Event.REVOKED)
            return self._list_places(view)
        return []

    def _arrive(self, view: View, place: Hypothesis, event: Event, reason: str) -> list[Output]:
        """Publish where the robot was found, and track it from there."""
        pose = self._tracker.start(view.stamp, view.T_odom_base, place)
        if event is Event.RELOCALIZED:
            self._hint = None
        if not self._places.places or place is not self._places.places[0]:
            self._places.restart()  # found by the monitor: earlier views were taken elsewhere
        self._chosen_by = None
        if self._hint is not None and not self._places.is_decided_by_evidence:
            self._chosen_by = self._hint.source
        self._places.pose_was_published()
        self._fire(event)
        initial = InitialPose(view.stamp, pose.T_map_base, pose.covariance)
        status = self._status(view.stamp, self._unless_chosen(reason), place.evidence)
        return [initial, pose, status]

    def _restart(
        self, stamp: float, event: Event, reason: str, evidence: Evidence | None = None
    ) -> Status:
        """Discard everything about the pose, and change the state."""
        is_lost = event is Event.CONTRADICTED
        self._lost_T_map_odom = self._tracker.T_map_odom if is_lost else None
        self._tracker.stop()
        self._hint = self._chosen_by = None
        self._places.restart()
        self._scans.clear()
        self._fire(event)
        return self._status(stamp, reason, evidence)

    def _fire(self, event: Event) -> None:
        self._state = next_state(self._state, event)

    def _status(self, stamp: float, reason: str, evidence: Evidence | None = None) -> Status:
        rivals = 1 if self._state is State.LOCALIZED else 0
        if self._state is State.DISAMBIGUATING or self._chosen_by is not None:
            rivals = self._places.rivals
        elsewhere = None
        if self._state is not State.NO_MAP and not self._places.is_blind:
            elsewhere = self._places.belief.elsewhere
        return Status(stamp, self._state, reason, evidence, rivals, self._chosen_by, elsewhere)

    def _weigh(self, view: View, pace: Pace) -> bool:
        """Update the belief if a scan is due; return whether it was."""
        if self._update_requested:
            pace, self._update_requested = Pace.EVERY_SCAN, False
        return self._places.update(view.scans, view.T_odom_base, pace)

    def _is_plausible(self, place: Hypothesis, T_odom_base: SE2) -> bool:
        """Return whether a sure place may be published.

        A robot that lost its pose and was not picked up is not far away, or it has left the mapped
        area, where one scan may fit a wrong place: a place far away needs several views.
        """
        if self._lost_T_map_odom is None:
            return True
        if place.pose.distance_to(self._lost_T_map_odom @ T_odom_base) <= _STRAYED_M:
            return True
        return len(self._places.belief.window) >= self.config.monitor.decided_views

    def _change_frame(self, before: Odometry, now: Odometry) -> list[Output]:
        """Go on at the same pose in a new odometry frame; the next scan judges it."""
        if self._state is State.DISAMBIGUATING:
            # The places moved with the old frame.
            reason = "odometry jumped while several places fit: searching"
            return [self._restart(now.stamp, Event.ODOMETRY_JUMPED, reason)]
        hint = self._hint if self._state is State.VERIFYING_HINT else None
        self._places.restart(hint.prior if hint is not None else None, Source.PERSON)
        self._tracker.change_frame(before, now)
        return []

    def _list_places(self, view: View) -> list[Output]:
        """Report the places that are left, and the motion that would decide between them."""
        places, belief = self._places.places, self._places.belief
        advice, motion = advise(view.scans, places, self._places.rivals, belief.fields.grid)
        outputs: list[Output] = [
            Hypotheses(view.stamp, places, belief.elsewhere),
            self._status(view.stamp, advice or belief.reason, places[0].evidence),
        ]
        return [*outputs, motion] if motion is not None else outputs

    def _unless_chosen(self, reason: str) -> str:
        """Return a reason, or who chose the pose while the scans have not decided."""
        source = self._chosen_by
        return reason if source is None else self._places.choice_in_words(source)
