"""The conductor of the belief: Markov localization over the whole map, carried by its search."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from firstfix.belief.config import BeliefConfig
from firstfix.belief.elsewhere import missed_log_odds, rival_cost, with_missed
from firstfix.belief.enter import propose
from firstfix.belief.evidence import EXPONENT, shares
from firstfix.belief.hints import Hint, Source, hint_logs, log_anywhere
from firstfix.belief.joint import carried_at, joint_log_likelihoods, power_of
from firstfix.belief.judge import Judgement, Rule, judge, withheld
from firstfix.belief.lead import leads
from firstfix.belief.merge import merge
from firstfix.belief.misses import count_misses, has_missed_enough
from firstfix.belief.place import listed_places
from firstfix.belief.planar import between, compose, in_cells, to_map
from firstfix.belief.rejoin import rejoin
from firstfix.belief.remember import remembered
from firstfix.belief.tracks import Tracks, at_rest, follow, look_again, trace_back
from firstfix.belief.view import Link, Observation, View
from firstfix.belief.without_priors import is_hinted, share_without_programs, shares_by_views
from firstfix.core.estimate import Hypothesis, SearchReport, Verdict
from firstfix.core.se2 import SE2
from firstfix.fields.map_fields import MapFields
from firstfix.global_localization.beams import FEWEST_HITS
from firstfix.global_localization.prior import Prior, check_prior
from firstfix.global_localization.search import Candidates

# A view brings news where the robot has moved or turned by this much.
NEWS_M = 0.3
NEWS_RAD = math.radians(15.0)

# Less than this is rest: the scans of one place become one.
REST_M = 0.05
REST_RAD = math.radians(2.0)

# A place with a smaller share is dropped. One that comes back is weighed by all views again.
NEGLIGIBLE = 1e-6
# By the law of one view: something that was moved speaks against the true place in many of them.
_LEAST_HELD_LOG = math.log(NEGLIGIBLE) / EXPONENT

# Best places whose beams are all compared.
CAREFUL_PLACES = 24

_NOTHING_SEEN = Judgement(Verdict.NO_MATCH, "no view yet: waiting for the first scan", None)


@dataclass(frozen=True, eq=False)
class Belief:
    """All places where the robot may be, given the latest views. Made by `begin`.

    Parameters
    ----------
    fields : MapFields
        The prepared map.
    config : BeliefConfig
        Settings.
    hints : tuple of Hint
        Priors, and where odometry was when they were given.
    window : tuple of Observation
        The views that are judged together, oldest first.
    tracks : Tracks
        The places, most likely first, each with its past.
    probabilities : ndarray, shape (n,)
        Of the places.
    elsewhere : float
        Probability of a place that is not held: outside, unmapped, in another map, dropped, missed.
    missed : float
        The part of it that belongs to places of the map: see `elsewhere.missed_log_odds`.
    odometry : SE2
        ``T_odom_base`` to which the places are predicted.
    judgement : Judgement
        The verdict, the reason and the favourite behind it.
    search : SearchReport
        What the latest search did.
    next_id : int
        First id that no place has had.
    misses : int
        Views in a row that the best place does not explain though others do.
    carried_at : int
        The view of the window since which the robot is elsewhere; 0 if it has stayed.
    """

    fields: MapFields
    config: BeliefConfig
    hints: tuple[Hint, ...]
    window: tuple[Observation, ...]
    tracks: Tracks
    probabilities: NDArray[np.float64]
    elsewhere: float
    odometry: SE2
    judgement: Judgement
    search: SearchReport
    missed: float = 0.0
    next_id: int = 0
    misses: int = 0
    carried_at: int = 0

    @property
    def verdict(self) -> Verdict:
        """Whether the best place may be published."""
        return self.judgement.verdict

    @property
    def held(self) -> float:
        """Probability that is left if no place of the map was missed."""
        return 1.0 - self.missed

    @property
    def possible(self) -> int:
        """Number of places that are still possible. More are held, to be compared with the best."""
        return int(np.count_nonzero(self.probabilities >= NEGLIGIBLE))

    @property
    def reason(self) -> str:
        """The verdict in words, for a person."""
        return self.judgement.reason

    @cached_property
    def evidence(self) -> NDArray[np.float64]:
        """Probabilities of the places by the views alone, priors left out, shape (n,)."""
        if not self.window:
            return np.empty(0)
        return shares_by_views(
            self.tracks, self.probabilities, self.missed, self.window[-1], self.hints, self.fields
        )

    @cached_property
    def poses(self) -> NDArray[np.float64]:
        """``T_map_base`` of all places now, shape (n, 3): x (m), y (m), yaw (rad)."""
        if not self.window:
            return np.empty((0, 3))
        return to_map(self._carried(self.tracks.now), self.fields.grid)

    @cached_property
    def places(self) -> tuple[Hypothesis, ...]:
        """The places worth listing, most likely first, with covariance and evidence."""
        if not self.window:
            return ()
        seen = self.window[-1]
        step = seen.views[-1].T_odom_base.inverse() @ self.odometry
        return listed_places(self.tracks, self.probabilities, seen, step, self.fields)

    def _carried(self, poses: NDArray[np.float64]) -> NDArray[np.float64]:
        now = in_cells(self.odometry, self.fields.grid.resolution)
        return compose(poses, between(self.window[-1].odometry, now))


def begin(
    fields: MapFields, prior: Prior | None = None, config: BeliefConfig | None = None
) -> Belief:
    """Begin with a belief that knows nothing but the map and a prior.

    Parameters
    ----------
    fields : MapFields
        The prepared map.
    prior : Prior, optional
        Of the pose at the first view.
    config : BeliefConfig, optional
        Settings.

    Returns
    -------
    Belief
        Without places: all of its mass is elsewhere.

    Raises
    ------
    InputError
        If the prior does not fit the map.
    """
    belief = Belief(
        fields=fields,
        config=config or BeliefConfig(),
        hints=(),
        window=(),
        tracks=Tracks.none(),
        probabilities=np.empty(0),
        elsewhere=1.0,
        odometry=SE2.identity(),
        judgement=_NOTHING_SEEN,
        search=SearchReport(poses=0, searched=0.0, proven=False),
    )
    return belief if prior is None else with_prior(belief, prior, None)


def with_prior(
    belief: Belief, prior: Prior, T_odom_base: SE2 | None, source: Source = Source.MEASURED
) -> Belief:
    """Add a prior, such as a person's hint; it counts from the next view on.

    Parameters
    ----------
    belief : Belief
        The belief.
    prior : Prior
        Of the pose of the base in the map.
    T_odom_base : SE2 or None
        Odometry at the time for which it holds; None for that of the next view.
    source : Source
        Who gives it.

    Returns
    -------
    Belief
        With the prior.

    Raises
    ------
    InputError
        If the prior does not fit the map.
    """
    check_prior(prior, belief.fields.grid)
    anchor = None if T_odom_base is None else in_cells(T_odom_base, belief.fields.grid.resolution)
    return replace(belief, hints=(*belief.hints, Hint(prior, anchor, source)))


def brings_news(belief: Belief, T_odom_base: SE2) -> bool:
    """Tell whether the robot has moved enough since the latest view for a new one."""
    if not belief.window:
        return True
    step = belief.window[-1].views[-1].T_odom_base.inverse() @ T_odom_base
    return math.hypot(step.x, step.y) >= NEWS_M or abs(step.yaw) >= NEWS_RAD


def predict(belief: Belief, T_odom_base: SE2) -> Belief:
    """Move all places with the odometry.

    Parameters
    ----------
    belief : Belief
        The belief.
    T_odom_base : SE2
        Odometry now.

    Returns
    -------
    Belief
        The same places, moved; nothing is weighed.
    """
    return replace(belief, odometry=T_odom_base)


def update(belief: Belief, view: View, found: Candidates | None = None) -> Belief:
    """Weigh all places by a view, and let in the places that the view itself proposes.

    Parameters
    ----------
    belief : Belief
        The belief.
    view : View
        Scans and odometry of one time. A view from where the latest was taken joins it.
    found : Candidates, optional
        Where a search of several maps together has found the view in this one; by default the map
        is searched.

    Returns
    -------
    Belief
        The belief after the view; with too few beams on surfaces, only predicted.
    """
    fields, config = belief.fields, belief.config
    belief = _anchored(predict(belief, view.T_odom_base))
    hits = Observation((view,), fields.grid.resolution).hits
    if hits < FEWEST_HITS:
        return _blind(belief, hits)
    window, held = _followed(belief, view)
    entering, search = propose(window, belief.hints, belief.next_id, fields, config, found)
    rival = rival_cost(entering, fields.grid.resolution)
    window = (*window[:-1], replace(window[-1], rival_cost=rival))
    held = rejoin(held, entering, window, fields)
    tracks = held.joined_by(_with_past(entering, window, belief))

    tracks, _ = _ranked(tracks, window, belief)
    best, others = tracks.split(CAREFUL_PLACES)
    tracks = look_again(best, window, fields).joined_by(others)
    tracks, logs = _ranked(tracks, window, belief)

    listed, _ = shares(logs, power_of(window))
    kept = logs >= logs.max(initial=-math.inf) + _LEAST_HELD_LOG * power_of(window)
    tracks = tracks.take(kept)
    probabilities, missed = _with_missed(listed[kept], tracks, window, belief)
    rule = Rule(
        config.sure_probability,
        hinted=is_hinted(tracks, window[-1], belief.hints, fields),
        evidence=share_without_programs(tracks, probabilities, window[-1], belief.hints, fields),
        missed=missed,
    )
    judgement = judge(
        tracks.costs, tracks.ids, probabilities, window, belief.judgement.favourite, rule
    )
    if judgement.is_new and not (rule.hinted or leads(tracks, window, fields, config)):
        judgement = withheld(judgement)
    return replace(
        belief,
        window=window,
        tracks=tracks,
        probabilities=probabilities,
        elsewhere=max(0.0, 1.0 - float(probabilities.sum())),
        judgement=judgement,
        search=search,
        missed=missed,
        next_id=belief.next_id + len(entering),
        misses=count_misses(belief.misses, judgement, tracks, entering, window[-1]),
        carried_at=carried_at(tracks, probabilities, window),
    )


def _anchored(belief: Belief) -> Belief:
    """Let the priors that wait for a view hold for this one."""
    now = in_cells(belief.odometry, belief.fields.grid.resolution)
    return replace(
        belief,
        hints=tuple(
            replace(hint, odometry=now) if hint.odometry is None else hint for hint in belief.hints
        ),
    )


def _blind(belief: Belief, hits: int) -> Belief:
    if belief.window:
        return belief
    reason = (
        f"only {hits} beams measured a surface, {FEWEST_HITS} are needed: blocked sensor, open "
        "space, or limits range_min and range_max that do not fit it"
    )
    return replace(belief, judgement=Judgement(Verdict.NO_MATCH, reason, None))


def _followed(belief: Belief, view: View) -> tuple[tuple[Observation, ...], Tracks]:
    """Add a view to the window, and carry the tracks to it."""
    fields, window, tracks = belief.fields, belief.window, belief.tracks
    seen = Observation((view,), fields.grid.resolution, link=view.link)
    if not window:
        return (seen,), Tracks.none()
    if view.link is not Link.BROKEN and rests(window[-1], view):
        joined = window[-1].joined_by(view)
        return (*window[:-1], joined), at_rest(tracks, joined, fields)
    forgotten = belief.carried_at
    if has_missed_enough(belief.misses, window, belief.judgement.favourite):
        forgotten = len(window) - 1
    if forgotten > 0:
        window, tracks = window[forgotten:], tracks.over(slice(forgotten, None))
    elif len(window) >= belief.config.window:
        kept = remembered(window, belief.config)
        window, tracks = tuple(window[i] for i in kept), tracks.over(kept)
    if not window:
        return (seen,), Tracks.none()
    return (*window, seen), follow(tracks, window[-1], seen, fields)


def rests(newest: Observation, view: View) -> bool:
    """Tell whether a view is taken where the latest was, so that it joins it."""
    step = newest.views[-1].T_odom_base.inverse() @ view.T_odom_base
    moved = math.hypot(step.x, step.y) > REST_M or abs(step.yaw) > REST_RAD
    return not moved and newest.same_sensors(view)


def _with_past(entering: Tracks, window: tuple[Observation, ...], belief: Belief) -> Tracks:
    """Give places that enter their poses and costs at the earlier views, newest first."""
    for i in range(len(window) - 2, -1, -1):
        entering = trace_back(entering, window[i], window[i + 1], belief.fields)
        logs = joint_log_likelihoods(entering, window[i:], belief.config)
        entering = entering.take(logs >= logs.max(initial=-math.inf) + math.log(NEGLIGIBLE))
    return entering


def _ranked(
    tracks: Tracks, window: tuple[Observation, ...], belief: Belief
) -> tuple[Tracks, NDArray[np.float64]]:
    """Merge tracks to places, most likely first, and return their log-likelihoods."""
    grid = belief.fields.grid
    logs = joint_log_likelihoods(tracks, window, belief.config)
    logs += hint_logs(tracks.now, window[-1], belief.hints, grid)
    favourite = belief.judgement.favourite
    known = (favourite.id if favourite is not None else -1, belief.next_id)
    most = belief.config.places
    kept, names = merge(tracks.now, logs, tracks.ids, known, grid.resolution, most)
    return tracks.take(kept).named(names), logs[kept]


def _with_missed(
    listed: NDArray[np.float64], tracks: Tracks, window: tuple[Observation, ...], belief: Belief
) -> tuple[NDArray[np.float64], float]:
    """Leave room for places that are not held; priors hold for these, too."""
    if len(tracks) == 0:
        return listed, 0.0
    grid = belief.fields.grid
    best = float(hint_logs(tracks.now[:1], window[-1], belief.hints, grid)[0])
    prior = log_anywhere(window[-1], belief.hints, belief.fields) - best
    return with_missed(listed, missed_log_odds(tracks, window, belief.config) + prior)
