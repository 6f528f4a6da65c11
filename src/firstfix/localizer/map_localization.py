"""Localization in one map: search, disambiguation, verification of hints, tracking."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from firstfix.belief.hints import Source
from firstfix.belief.prior import Gaussian
from firstfix.belief.view import View
from firstfix.changes.counts import LEAST_EXPLAINED, ChangeCounter
from firstfix.core.errors import InputError
from firstfix.core.estimate import Evidence, Hypothesis, Verdict
from firstfix.core.odometry import Odometry
from firstfix.core.se2 import SE2
from firstfix.global_localization.places import is_same_place
from firstfix.global_localization.scan_matcher import ScanMatcher
from firstfix.localizer.config import LocalizerConfig
from firstfix.localizer.deciding_motion import advise
from firstfix.localizer.hint import Hint, read_hint
from firstfix.localizer.inputs import NewMap, PoseHint, PositionFix
from firstfix.localizer.outputs import Hypotheses, InitialPose, Output, Status
from firstfix.localizer.place_belief import Pace, PlaceBelief, Support
from firstfix.localizer.pose_monitor import Fit, is_slip
from firstfix.localizer.pose_tracker import PoseTracker, Tracked
from firstfix.localizer.scan_queue import ScanQueue
from firstfix.localizer.states import Event, State, next_state

# A robot that lost its pose is accepted at the first sure place within this distance.
_STRAYED_M = 2.0


class MapLocalization:
    """The pose of the robot in one map, and the state: searched, verified, tracked, revoked.

    `Localizer` receives the inputs; this class decides what a view, a hint or a restart changes.

    Parameters
    ----------
    given : NewMap
        The map.
    state : State
        The state before the map.
    scans : ScanQueue
        The scans that wait. Those from before a restart are discarded.
    config : LocalizerConfig
        Settings.
    cache_dir : Path or None
        Folder of prepared maps.
    rng : numpy.random.Generator
        Source of randomness.

    Raises
    ------
    MapError
        If the map cannot be searched.
    """

    def __init__(
        self,
        given: NewMap,
        state: State,
        scans: ScanQueue,
        config: LocalizerConfig,
        cache_dir: Path | None,
        rng: np.random.Generator,
    ) -> None:
        self.matcher = ScanMatcher(
            given.grid, config=config.locate, cache_dir=cache_dir, fields=given.fields
        )
        self.tracker = PoseTracker(self.matcher, config, rng)
        self.places = PlaceBelief(self.matcher.fields, config.belief, config.monitor.rest_period_s)
        days = config.changes.days_kept
        self.changes = ChangeCounter(self.matcher.fields, days) if days else None
        self._config = config
        self._scans = scans
        self.state = next_state(state, Event.MAP_RECEIVED)
        self._unweighed: tuple[View, Tracked] | None = None
        self._update_requested = False
        self._hint: Hint | None = None
        self._chosen_by: str | None = None
        self._lost_T_map_odom: SE2 | None = None  # if contradicted, and not picked up since

    def request_update(self) -> None:
        """Use the next scan in any case."""
        self._update_requested = True

    def use(self, view: View) -> list[Output]:
        """Use a view of a robot on the floor: what it means depends on the state."""
        self.places.watch(view)
        steps = {
            State.SEARCHING: self._find,
            State.DISAMBIGUATING: self._find,
            State.VERIFYING_HINT: self._verify_hint,
            State.LOCALIZED: self._follow,
        }
        return steps[self.state](view)

    def take_hint(self, given: PoseHint) -> list[Output]:
        """Let the next views judge a pose that a person or a program proposes."""
        listed = self.places.places if self.state is not State.SEARCHING else ()
        hint = read_hint(given, listed)
        if hint is None:
            reason = f"place {given.hypothesis_id} is no longer listed: choose another one"
            return [self.status(given.stamp, reason)]
        try:
            if given.hypothesis_id is not None:
                self.places.add_prior(hint.prior)
            else:  # the robot may have been carried there: the views so far are worth nothing
                self.places.restart(hint.prior, Source.PERSON)
        except InputError as error:
            return [self.status(given.stamp, f"hint of {given.source} refused: {error}")]
        self.tracker.stop()
        self._hint, self._chosen_by = hint, None
        self._fire(Event.HINT_RECEIVED)
        reason = f"{given.source} proposes a pose: the next scan will verify it"
        return [self.status(given.stamp, reason)]

    def take_fix(self, given: PositionFix, T_odom_base: SE2 | None) -> list[Output]:
        """Add a measured position, and the odometry at its time if that is known, to the belief."""
        try:
            prior = Gaussian(given.T_map_base, given.covariance)
            self.places.take_fix(given.source, prior, T_odom_base)
        except InputError as error:
            return [self.status(given.stamp, f"{given.source} refused: {error}")]
        return []

    def restart(
        self, stamp: float, event: Event, reason: str, evidence: Evidence | None = None
    ) -> Status:
        """Discard everything about the pose, and change the state."""
        is_lost = event is Event.CONTRADICTED
        self._lost_T_map_odom = self.tracker.T_map_odom if is_lost else None
        self.tracker.stop()
        self._hint = self._chosen_by = None
        self.places.restart()
        self._scans.clear()
        self._fire(event)
        return self.status(stamp, reason, evidence)

    def set_down(self) -> None:
        """Go on after the robot was lifted; a hint that was given meanwhile is verified."""
        self._fire(Event.SET_DOWN)
        if self._hint is not None:
            self._fire(Event.HINT_RECEIVED)

    def change_frame(self, before: Odometry, now: Odometry) -> list[Output]:
        """Go on at the same pose in a new odometry frame; the next scan judges it."""
        if self.state is State.DISAMBIGUATING:
            # The places moved with the old frame.
            reason = "odometry jumped while several places fit: searching"
            return [self.restart(now.stamp, Event.ODOMETRY_JUMPED, reason)]
        hint = self._hint if self.state is State.VERIFYING_HINT else None
        self.places.restart(hint.prior if hint is not None else None, Source.PERSON)
        self.tracker.change_frame(before, now)
        return []

    def weigh_in_background(self) -> list[Output]:
        """Reconsider the pose of the scan before, which was published at once."""
        waiting, self._unweighed = self._unweighed, None
        return [] if waiting is None else self._reconsider(*waiting)

    def status(self, stamp: float, reason: str, evidence: Evidence | None = None) -> Status:
        """Describe the state, and why."""
        rivals = 1 if self.state is State.LOCALIZED else 0
        if self.state is State.DISAMBIGUATING or self._chosen_by is not None:
            rivals = self.places.rivals
        elsewhere = None if self.places.is_blind else self.places.belief.elsewhere
        return Status(stamp, self.state, reason, evidence, rivals, self._chosen_by, elsewhere)

    def _find(self, view: View) -> list[Output]:
        """Weigh all places; publish the best one when it is sure."""
        if not self._weigh(view, Pace.AT_REST_TOO):
            return []
        verdict, reason = self.places.belief.verdict, self.places.belief.reason
        best = self.places.places[0] if self.places.places else None
        is_searching = self.state is State.SEARCHING
        if best is None or verdict is Verdict.NO_MATCH:
            if not is_searching:
                self._fire(Event.CONTRADICTED)
            return [self.status(view.stamp, reason, best.evidence if best else None)]
        if verdict is Verdict.UNIQUE:
            if not self._is_plausible(best, view.T_odom_base):
                reason = "one place fits, far from where the pose was lost: waiting for more views"
                return [self.status(view.stamp, reason, best.evidence)]
            event = Event.ONE_PLACE_FITS if is_searching else Event.DECIDED
            return self._arrive(view, best, event, reason)
        if is_searching:
            self._fire(Event.SEVERAL_PLACES_FIT)
        return self._list_places(view)

    def _verify_hint(self, view: View) -> list[Output]:
        """Let the belief judge a pose that was proposed."""
        hint = self._hint
        assert hint is not None  # noqa: S101 - every way into this state brings one
        if not self._weigh(view, Pace.EVERY_SCAN) or self.places.is_blind:
            reason = f"{hint.source} proposes a pose; the sensor sees too little to verify it"
            return [self.status(view.stamp, reason)]
        verdict, places = self.places.belief.verdict, self.places.places
        if verdict is Verdict.UNIQUE and hint.matches(places[0].pose):
            explained = places[0].evidence.explained
            reason = f"{hint.source} proposed this pose; {explained:.0%} of the beams fit"
            return self._arrive(view, places[0], Event.HINT_CONFIRMED, reason)
        if verdict is Verdict.AMBIGUOUS and any(hint.matches(place.pose) for place in places):
            self._fire(Event.SEVERAL_PLACES_FIT)
            return self._list_places(view)
        reason = f"the pose proposed by {hint.source} does not explain the scan: searching"
        return [self.restart(view.stamp, Event.HINT_REJECTED, reason)]

    def _follow(self, view: View) -> list[Output]:
        tracked = self.tracker.follow(view, force_update=self._update_requested)
        self._update_requested = False
        place, fit = tracked.judgement.place, tracked.judgement.fit
        if tracked.judgement.has_jumped:
            self.places.suspect_kidnap()
        if fit is Fit.ELSEWHERE:
            if not is_same_place(place.pose, tracked.pose.T_map_base):
                return self._move(view, place, tracked)
            corrected = self.tracker.start(view.stamp, view.T_odom_base, place)
            if not self.places.prefers(place.pose):
                self.places.restart()  # the wheels slipped: earlier views are not where they seem
            return [corrected, self.status(view.stamp, "corrected", place.evidence)]
        if fit is Fit.CONTRADICTED:
            if held := self._hold(view, tracked):
                return held
            explained = place.evidence.explained
            reason = f"only {explained:.0%} of the beams fit here, for too long: searching"
            return [self.restart(view.stamp, Event.CONTRADICTED, reason, place.evidence)]
        if not tracked.is_confirmed:
            reason = f"odometry has leapt, {tracked.fit_in_words}: waiting for a scan that fits"
            return [self.status(view.stamp, reason, place.evidence)]
        if tracked.judgement.is_sudden:
            self.places.doubt_pose()
        if self.places.tracking_pace is Pace.BACKGROUND and self._is_settled(tracked):
            self._unweighed = view, tracked  # the search takes longer than a scan: the pose first
        elif revised := self._reconsider(view, tracked):
            return revised
        if self._chosen_by is None and place.evidence.explained >= LEAST_EXPLAINED:
            self._count_changes(view, tracked)
        reason = self._unless_chosen(tracked.fit_in_words)
        return [tracked.pose, self.status(view.stamp, reason, place.evidence)]

    def _move(self, view: View, place: Hypothesis, tracked: Tracked) -> list[Output]:
        """Go where single scans put the robot; far away, if they do so by more than one thing."""
        is_near = is_slip(tracked.pose.T_map_base, place.pose)
        if not is_near and not self.places.would_begin_at(place.pose, view):
            self._weigh(view, Pace.EVERY_SCAN)
            return self._withdraw(view)
        away = place.pose.distance_to(tracked.pose.T_map_base)
        reason = f"found {away:.1f} m from the tracked pose"
        return self._arrive(view, place, Event.RELOCALIZED, reason)

    def _hold(self, view: View, tracked: Tracked) -> list[Output]:
        """Go on where the belief puts the robot, if not it has changed but what is around it."""
        if self._chosen_by is not None or not self._weigh(view, Pace.EVERY_SCAN):
            return []
        if not self.places.still_holds(tracked.pose.T_map_base):
            return []
        best = self.places.places[0]
        # Its own covariance is that of a scan that fits nowhere near: too wide to start from.
        there = tracked.pose
        held = replace(best, pose=there.T_map_base, covariance=there.covariance)
        pose = self.tracker.start(view.stamp, view.T_odom_base, held)
        reason = f"only {best.evidence.explained:.0%} of the beams fit, but the views before do"
        return [pose, self.status(view.stamp, reason, best.evidence)]

    def _is_settled(self, tracked: Tracked) -> bool:
        return self._chosen_by is None and tracked.judgement.fit is Fit.CONSISTENT

    def _count_changes(self, view: View, tracked: Tracked) -> None:
        if self.changes is not None:
            self.changes.add(view.scans, tracked.pose.T_map_base, tracked.pose.covariance)

    def _reconsider(self, view: View, tracked: Tracked) -> list[Output]:
        """Weigh all places; return what changes if the pose was wrong."""
        pace = self.places.tracking_pace if self._is_settled(tracked) else Pace.EVERY_VIEW
        if not self._weigh(view, pace):
            return []
        T_map_base = tracked.pose.T_map_base
        support = self.places.support_for(T_map_base, tracked.judgement.fit)
        if support is Support.SAME_PLACE and self.places.is_decided_by_evidence:
            self._chosen_by = None
        if support is Support.OTHER_PLACE:
            best, reason = self.places.places[0], self.places.belief.reason
            reason = f"{best.pose.distance_to(T_map_base):.1f} m from the tracked pose {reason}"
            return self._arrive(view, best, Event.RELOCALIZED, reason)
        return self._withdraw(view) if support is Support.WITHDRAWN else []

    def _withdraw(self, view: View) -> list[Output]:
        """Stop tracking, and go on with all places that the belief holds."""
        self._lost_T_map_odom = self.tracker.T_map_odom
        self.tracker.stop()
        self._chosen_by = None
        if self.places.places and self.places.belief.verdict is not Verdict.NO_MATCH:
            self._fire(Event.REVOKED)
            return self._list_places(view)
        self._fire(Event.CONTRADICTED)
        return [self.status(view.stamp, self.places.belief.reason)]

    def _arrive(self, view: View, place: Hypothesis, event: Event, reason: str) -> list[Output]:
        """Publish where the robot was found, and track it from there."""
        pose = self.tracker.start(view.stamp, view.T_odom_base, place)
        if event is Event.RELOCALIZED:
            self._hint = None
        if not self.places.places or place is not self.places.places[0]:
            self.places.restart()  # found by the monitor: earlier views were taken elsewhere
        self._chosen_by = None
        if self._hint is not None and not self.places.is_decided_by_evidence:
            self._chosen_by = self._hint.source
        self.places.pose_was_published()
        self._fire(event)
        initial = InitialPose(view.stamp, pose.T_map_base, pose.covariance)
        status = self.status(view.stamp, self._unless_chosen(reason), place.evidence)
        return [initial, pose, status]

    def _list_places(self, view: View) -> list[Output]:
        """Report the places that are left, and the motion that would decide between them."""
        places, belief = self.places.places, self.places.belief
        advice, motion = advise(view.scans, places, self.places.rivals, belief.fields.grid)
        outputs: list[Output] = [
            Hypotheses(view.stamp, places, belief.elsewhere),
            self.status(view.stamp, advice or belief.reason, places[0].evidence),
        ]
        return [*outputs, motion] if motion is not None else outputs

    def _unless_chosen(self, reason: str) -> str:
        """Return a reason, or who chose the pose while the scans have not decided."""
        source = self._chosen_by
        return reason if source is None else self.places.choice_in_words(source)

    def _fire(self, event: Event) -> None:
        self.state = next_state(self.state, event)

    def _weigh(self, view: View, pace: Pace) -> bool:
        """Update the belief if a scan is due; return whether it was."""
        if self._update_requested:
            pace, self._update_requested = Pace.EVERY_SCAN, False
        return self.places.update(view.scans, view.T_odom_base, pace)

    def _is_plausible(self, place: Hypothesis, T_odom_base: SE2) -> bool:
        """Return whether a sure place may be published.

        A robot that lost its pose and was not picked up is not far away, or it has left the mapped
        area, where one scan may fit a wrong place: a place far away needs several views.
        """
        if self._lost_T_map_odom is None:
            return True
        if place.pose.distance_to(self._lost_T_map_odom @ T_odom_base) <= _STRAYED_M:
            return True
        return len(self.places.belief.window) >= self._config.monitor.decided_views
