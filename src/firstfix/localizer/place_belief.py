"""The belief over all places of one map: when it is updated, and what is listed of it."""

from __future__ import annotations

import math
from dataclasses import replace
from enum import Enum

import numpy as np

from firstfix.belief.belief import (
    NEWS_M,
    NEWS_RAD,
    REST_M,
    REST_RAD,
    begin,
    predict,
    update,
    with_prior,
)
from firstfix.belief.config import BeliefConfig
from firstfix.belief.hints import Source
from firstfix.belief.judge import MOST_MISSED, STAYING_PROBABILITY
from firstfix.belief.link import link, nearly_all_goes_on
from firstfix.belief.view import Link, View
from firstfix.core.estimate import Hypothesis, Verdict
from firstfix.core.scan import Scans, as_scans
from firstfix.core.se2 import SE2
from firstfix.fields.map_fields import MapFields
from firstfix.global_localization.beams import FEWEST_HITS
from firstfix.global_localization.places import is_same_place
from firstfix.global_localization.prior import Prior
from firstfix.global_localization.sensors import joint_beams
from firstfix.global_localization.verdict import count_rivals
from firstfix.localizer.pose_monitor import Fit

# In the background a view each two metres watches a tracked pose at little cost.
_BACKGROUND_M = 2.0
_BACKGROUND_RAD = math.radians(120.0)

# A published pose is young until so many views have confirmed it. More than twice as many do not
# count: what is known from long ago was known in another part of the map.
_CONFIRMING_VIEWS = 4
_MOST_CREDIT = 2 * _CONFIRMING_VIEWS

# A young pose with less probability than this in two consecutive views is withdrawn. An old one is
# not: where the map is wrong, other places fit better for metres.
# Any pose is, if the scans do not fit there either: the robot was carried away.
_WITHDRAWN_SHARE = 0.05
_WITHDRAWING_VIEWS = 2

# Views of a robot that creeps are nearly one view, and would fill the belief's window.
_CREEPING_PAUSES = 5.0


class Pace(Enum):
    """How often a scan is used."""

    EVERY_SCAN = "every scan"
    EVERY_VIEW = "after 0.3 m or 15 degrees"
    AT_REST_TOO = "every view, and now and then while the robot rests"
    BACKGROUND = "after 2 m or 120 degrees"


class Support(Enum):
    """How the belief supports a pose that has been published."""

    SAME_PLACE = "the most likely place"
    OTHER_PLACE = "another place is sure"
    OPEN = "undecided"
    WITHDRAWN = "too unlikely"


class PlaceBelief:
    """Holds the belief of one map.

    Parameters
    ----------
    fields : MapFields
        The prepared map.
    config : BeliefConfig
        Settings of the belief.
    rest_period_s : float
        Time between two updates while the robot rests, s.
    """

    def __init__(self, fields: MapFields, config: BeliefConfig, rest_period_s: float) -> None:
        self._fields = fields
        self._config = config
        self._rest_period_s = rest_period_s
        self._used_at: tuple[float, SE2] | None = None
        self._places: tuple[Hypothesis, ...] = ()
        self._credit = 0  # views that have confirmed the published pose
        self._views_against = 0
        self._views_lost = 0  # in a row that neither the belief nor the monitor puts there
        self._fixes: dict[str, Prior] = {}  # by their source
        self._latest: tuple[View, ...] = ()  # two of them
        self._link = Link.UNKNOWN  # of all scans since the latest view of the belief
        self.belief = begin(fields, None, config)

    @property
    def is_blind(self) -> bool:
        """True if no scan so far had enough beams on surfaces."""
        return not self.belief.window

    @property
    def places(self) -> tuple[Hypothesis, ...]:
        """The places worth listing at the last update, most likely first, with stable ids."""
        return self._places

    @property
    def rivals(self) -> int:
        """Number of places that fit about as well as the best one, priors left out."""
        return count_rivals(self.belief.evidence) if len(self.belief.evidence) else 0

    @property
    def is_decided_by_evidence(self) -> bool:
        """True if the most likely place is sure with all priors left out."""
        shares = self.belief.evidence
        least = self._config.sure_probability * (1.0 - MOST_MISSED)
        return len(shares) > 0 and bool(shares[0] >= least)

    def choice_in_words(self, source: str) -> str:
        """Say who chose a pose, and that the scans have not decided."""
        rivals = self.rivals
        fit = f"{rivals} places fit equally well" if rivals > 1 else "the scans do not decide yet"
        return f"chosen by {source}; {fit}"

    def restart(self, prior: Prior | None = None, source: Source = Source.MEASURED) -> None:
        """Discard all views.

        Parameters
        ----------
        prior : Prior, optional
            Of the pose at the next view.
        source : Source
            Who gives it.

        Raises
        ------
        InputError
            If the prior does not fit the map. The belief stays as it was.
        """
        fresh = begin(self._fields, None, self._config)
        if prior is not None:
            fresh = with_prior(fresh, prior, None, source)
        # A number that was given to a place is never given to another one.
        self.belief = replace(fresh, next_id=self.belief.next_id)
        self._used_at, self._places = None, ()

    def add_prior(self, prior: Prior) -> None:
        """Add a person's prior of the present pose.

        Raises
        ------
        InputError
            If the prior does not fit the map. The belief stays as it was.
        """
        self.belief = with_prior(self.belief, prior, self.belief.odometry, Source.PERSON)

    def take_fix(self, source: str, prior: Prior, T_odom_base: SE2 | None) -> None:
        """Add a prior in place of the one before of its source.

        Parameters
        ----------
        source : str
            Where it comes from.
        prior : Prior
            Of the pose at ``T_odom_base``.
        T_odom_base : SE2 or None
            Odometry at that time; None for the next view.

        Raises
        ------
        InputError
            If the prior does not fit the map. The belief stays as it was.
        """
        before = self._fixes.get(source)
        kept = tuple(hint for hint in self.belief.hints if hint.prior is not before)
        self.belief = with_prior(replace(self.belief, hints=kept), prior, T_odom_base)
        self._fixes[source] = prior

    def watch(self, view: View) -> None:
        """Compare each view with the one before: the robot may have been carried."""
        self._latest = (*self._latest[-1:], view)
        now = link(*self._latest) if len(self._latest) > 1 else Link.UNKNOWN
        if now is Link.BROKEN:
            self._break_off()
        elif now is Link.UNKNOWN and self._link is Link.GOES_ON:
            self._link = now

    def suspect_kidnap(self) -> None:
        """Take it that the robot may have been carried, unless the newest scan denies it."""
        if len(self._latest) < 2 or not nearly_all_goes_on(*self._latest):
            self._break_off()

    def _break_off(self) -> None:
        self._credit, self._link = 0, Link.BROKEN

    def update(self, scans: Scans, T_odom_base: SE2, pace: Pace) -> bool:
        """Predict, and weigh all places by a scan if one is due.

        Parameters
        ----------
        scans : LaserScan or sequence of LaserScan
            The scan, or one of each sensor.
        T_odom_base : SE2
            Odometry at the scan.
        pace : Pace
            When a scan is due.

        Returns
        -------
        bool
            True if the scan was used.
        """
        view = View(as_scans(scans), T_odom_base, self._link)
        moved = self._has_moved(T_odom_base, REST_M, REST_RAD)
        if not self._is_due(view.stamp, T_odom_base, pace):
            self.belief = predict(self.belief, T_odom_base)
            return False
        self._used_at = view.stamp, T_odom_base
        self.belief = update(self.belief, view)
        listed = self.belief.places
        self._places = listed if moved else _in_order_of(self._places, listed)
        is_used = _hits(view) >= FEWEST_HITS
        self._link = Link.GOES_ON if is_used else self._link
        return self.is_blind or is_used

    def pose_was_published(self) -> None:
        """Watch closely at first: the pose may be wrong."""
        self._credit = self._views_against = self._views_lost = 0

    def doubt_pose(self) -> None:
        """Weigh the next scan, and watch a settled pose as closely as a new one."""
        if self.tracking_pace is Pace.BACKGROUND:
            self._credit, self._used_at = 0, None

    @property
    def tracking_pace(self) -> Pace:
        """How often to weigh all places while a pose is tracked."""
        is_settled = self._credit >= _CONFIRMING_VIEWS and self._views_against == 0
        return Pace.BACKGROUND if is_settled else Pace.EVERY_VIEW

    def would_begin_at(self, T_map_base: SE2, view: View) -> bool:
        """Tell whether a belief without a past would be sure of this place by one view."""
        fresh = update(begin(self._fields, None, self._config), view)
        is_sure = fresh.verdict is Verdict.UNIQUE
        return is_sure and is_same_place(SE2.from_array(fresh.poses[0]), T_map_base)

    def still_holds(self, T_map_base: SE2) -> bool:
        """Tell whether the robot must be here, though its newest scans do not fit.

        True if it has not been carried for as many views as are judged together, and if all of them
        speak for this place.
        """
        latest = self.belief.window[-self._config.window :]
        goes_on = all(seen.link is Link.GOES_ON for seen in latest)
        return len(latest) == self._config.window and goes_on and self.prefers(T_map_base)

    def prefers(self, T_map_base: SE2) -> bool:
        """Tell whether this is more likely than all other places together, by odometry."""
        belief = self.belief
        if len(belief.poses) == 0 or belief.probabilities[0] < STAYING_PROBABILITY:
            return False
        return is_same_place(SE2.from_array(belief.poses[0]), T_map_base)

    def support_for(self, T_map_base: SE2, fit: Fit) -> Support:
        """Compare a published pose with the belief; call it once after each update.

        Parameters
        ----------
        T_map_base : SE2
            The pose.
        fit : Fit
            How the newest scan fits there.

        Returns
        -------
        Support
            OTHER_PLACE and WITHDRAWN need several consecutive views.
        """
        poses = [SE2.from_array(pose) for pose in self.belief.poses]
        here = [is_same_place(pose, T_map_base) for pose in poses]
        if here and here[0]:
            self._credit = min(self._credit + 1, _MOST_CREDIT)
            self._views_against = self._views_lost = 0
            return Support.SAME_PLACE
        is_sure_elsewhere = self.belief.verdict is Verdict.UNIQUE
        share = float(self.belief.probabilities[here].sum())
        # Of what is held: that a place was missed speaks neither for the pose nor against it.
        held = self.belief.held
        is_unlikely = share < _WITHDRAWN_SHARE * held
        is_against = is_unlikely and self.belief.elsewhere < 1.0 - 0.5 * held
        self._views_against = self._views_against + 1 if is_against else 0
        is_lost = is_unlikely and fit is Fit.DOUBTFUL
        self._views_lost = self._views_lost + 1 if is_lost else 0
        if is_sure_elsewhere and 2 * self._views_against > self._credit:
            return Support.OTHER_PLACE
        is_young = self._credit < _CONFIRMING_VIEWS
        against = max(self._views_against if is_young else 0, self._views_lost)
        if against >= _WITHDRAWING_VIEWS:
            return Support.WITHDRAWN
        return Support.OPEN

    def _is_due(self, stamp: float, T_odom_base: SE2, pace: Pace) -> bool:
        if self._used_at is None or pace is Pace.EVERY_SCAN:
            return True
        if pace is Pace.BACKGROUND:
            return self._has_moved(T_odom_base, _BACKGROUND_M, _BACKGROUND_RAD)
        if self._has_moved(T_odom_base, NEWS_M, NEWS_RAD):
            return True
        if pace is Pace.EVERY_VIEW:
            return False
        creeps = self._has_moved(T_odom_base, REST_M, REST_RAD)
        pause = self._rest_period_s * (_CREEPING_PAUSES if creeps else 1.0)
        return not 0.0 <= stamp - self._used_at[0] < pause

    def _has_moved(self, T_odom_base: SE2, distance: float, angle: float) -> bool:
        if self._used_at is None:
            return True
        step = self._used_at[1].inverse() @ T_odom_base
        return math.hypot(step.x, step.y) >= distance or abs(step.yaw) >= angle


def _in_order_of(
    before: tuple[Hypothesis, ...], listed: tuple[Hypothesis, ...]
) -> tuple[Hypothesis, ...]:
    """Return the earlier list if the rivals are the same: at rest nothing new is known of them."""
    if not before or _rival_ids(before) != _rival_ids(listed):
        return listed
    return before


def _rival_ids(places: tuple[Hypothesis, ...]) -> frozenset[int | None]:
    rivals = count_rivals(np.array([place.probability for place in places]))
    likeliest = sorted(places, key=lambda place: -place.probability)[:rivals]
    return frozenset(place.id for place in likeliest)


def _hits(view: View) -> int:
    return int(np.count_nonzero(joint_beams(view.scans)[1].hit))
