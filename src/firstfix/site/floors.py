"""The localizer of a robot in a site: it finds the map, tracks the robot, and changes floors."""

from __future__ import annotations

from enum import Enum
from pathlib import Path

from firstfix.amcl.particles import Particles
from firstfix.belief.belief import Belief
from firstfix.belief.prior import Near
from firstfix.belief.view import View
from firstfix.changes.counts import ChangeCounter
from firstfix.core.errors import FirstfixError
from firstfix.core.estimate import Verdict
from firstfix.core.odometry import Odometry, Signal, SignalKind
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.global_localization.scan_matcher import ScanMatcher
from firstfix.localizer.config import LocalizerConfig
from firstfix.localizer.inputs import (
    Input,
    MapHint,
    NewMap,
    PoseHint,
    Reset,
    check_input,
)
from firstfix.localizer.localizer import Localizer
from firstfix.localizer.outputs import InitialPose, MapSwitched, Output, Status, TrackedPose
from firstfix.localizer.scan_queue import ScanQueue
from firstfix.localizer.states import State
from firstfix.site.arrival import Candidate, MapLocalizers, confirm
from firstfix.site.lifts import lift_at, sees_same_floor
from firstfix.site.query import SitePrior
from firstfix.site.ride import Ride, is_clear
from firstfix.site.site import Site
from firstfix.site.site_search import SiteSearch

# Without a view for so long a lift may have moved, s.
_GAP_S = 1.0

# A jump of the tracked pose by this is no correction: the robot may be in another map.
_JUMP_M = 1.0


class Phase(Enum):
    """What is open: the map, the floor of a lift, or nothing."""

    SEARCHING = "any place of any map"
    RIDING = "in a lift, or just out of it: one place of each of its floors"
    TRACKING = "one place"


class SiteLocalizer:
    """Finds a robot in one of many maps, tracks it there, and notices when a lift has moved it.

    There is no clock, thread or socket, as in `Localizer`. A pose is published only in a map that
    is sure, after a `MapSwitched` that names it. In a lift whose door is closed no pose is
    published: a cabin looks the same on every floor.

    Parameters
    ----------
    site : Site
        The maps, and the lifts between them.
    config : LocalizerConfig, optional
        Settings in every map.
    cache_dir : Path, optional
        Folder of prepared maps; by default nothing is cached.

    Examples
    --------
    >>> _ = ff.save_map(grid, "ground.yaml")
    >>> localizer = ff.SiteLocalizer(ff.Site.load("."))
    >>> outputs = localizer.handle(ff.Odometry(0.0, (0.0, 0.0, 0.0)))
    >>> outputs += localizer.handle(scan)
    >>> [type(output).__name__ for output in outputs]
    ['MapSwitched', 'InitialPose', 'TrackedPose', 'Status']
    >>> localizer.map_id
    'ground'
    """

    def __init__(
        self, site: Site, config: LocalizerConfig | None = None, cache_dir: Path | None = None
    ) -> None:
        self.site = site
        self.config = config or LocalizerConfig()
        self._localizers = MapLocalizers(site, self.config, cache_dir)
        self._scans = ScanQueue(self.config.scans)
        self._phase = Phase.SEARCHING
        self._search = self._new_search(None)
        self._lifted: set[SignalKind] = set()
        self._localizer: Localizer | None = None  # of the map in use
        self._map_id: str | None = None
        self._T_map_odom = SE2.identity()
        self._view_at: float | None = None  # stamp of the last view
        self._ride: Ride | None = None  # under way, or just over
        self._hinted: str | None = None  # the map that is searched first
        self._candidate: Candidate | None = None
        self._state = State.SEARCHING

    @property
    def state(self) -> State:
        """The state, as that of a `Localizer`."""
        if self._phase is Phase.TRACKING and self._localizer is not None:
            return self._localizer.state
        return State.LIFTED if self._lifted else self._state

    @property
    def map_id(self) -> str | None:
        """The map in use: the last that was named; None before the first."""
        return self._map_id

    @property
    def is_riding(self) -> bool:
        """True in a lift that may move, and until it is sure on which floor the robot came out."""
        ride = self._ride if self._phase is Phase.RIDING else None
        return ride is not None and ride.probation is None

    @property
    def particles(self) -> Particles | None:
        """The particles of the tracked pose; None while there is none."""
        return self._tracking.particles if self._tracking is not None else None

    @property
    def belief(self) -> Belief | None:
        """The belief over the places of the map in use; None while the map is not sure."""
        return self._tracking.belief if self._tracking is not None else None

    @property
    def matcher(self) -> ScanMatcher | None:
        """Global localization on the map in use; None before the first map."""
        return None if self._localizer is None else self._localizer.matcher

    @property
    def view(self) -> View | None:
        """The view that the localizer of the map in use has used last; None before the first."""
        return None if self._localizer is None else self._localizer.view

    @property
    def changes(self) -> ChangeCounter | None:
        """What scans contradict in the map in use; None unless `ChangesConfig` keeps days."""
        return None if self._localizer is None else self._localizer.changes

    def handle(self, given: Input) -> list[Output]:
        """Process one input.

        Parameters
        ----------
        given : Input
            As `Localizer.handle`, and `MapHint`. Maps come from the site, not from `NewMap`.

        Returns
        -------
        list of Output
            What the input led to, in order; often nothing.

        Raises
        ------
        InputError
            If the value is not an input.
        """
        check_input(given)
        if isinstance(given, LaserScan):
            complaint = self._scans.add(given)
            said = [self._status(given.stamp, complaint)] if complaint is not None else []
            return [*said, *self._use_next_view()]
        if isinstance(given, Odometry):
            return self._take_odometry(given)
        if isinstance(given, Signal):
            return self._take_signal(given)
        if isinstance(given, MapHint):
            return self._take_map_hint(given)
        if isinstance(given, Reset):
            self._lifted.clear()
            known = None if given.prior is None or self._map_id is None else given.prior
            prior = None if known is None else {f"{self._map_id}": known}
            return self._start_search(given.stamp, "reset requested: searching all maps", prior)
        if isinstance(given, NewMap):
            return [self._status(given.stamp, "the maps are those of the site: a map was ignored")]
        if self._tracking is not None:
            return self._of_localizer(given, self._tracking)
        if isinstance(given, PoseHint) and self._map_id is not None:
            prior = {self._map_id: Near(given.T_map_base, given.radius, given.angle)}
            reason = f"{given.source} proposes a pose in {self._map_id}: the next scan verifies it"
            return self._start_search(given.stamp, reason, prior)
        return [self._status(given.stamp, "the map is not known yet")]

    # ---- inputs

    @property
    def _tracking(self) -> Localizer | None:
        return self._localizer if self._phase is Phase.TRACKING else None

    def _take_odometry(self, given: Odometry) -> list[Output]:
        has_jumped = self._scans.add_odometry(given)
        if has_jumped and self._phase is Phase.RIDING:
            return self._start_search(given.stamp, "odometry jumped in a lift: searching all maps")
        if has_jumped and self._phase is Phase.SEARCHING:
            self._search = self._new_search(None)
            self._hinted = None
        if self._tracking is None:
            return self._use_next_view()
        return [*self._of_localizer(given, self._tracking), *self._use_next_view()]

    def _take_signal(self, given: Signal) -> list[Output]:
        if not given.kind.means_lifted:
            return []
        if given.active:
            self._lifted.add(given.kind)
            reason = f"{given.kind.value}: waiting until the robot is set down"
            return self._start_search(given.stamp, reason)
        self._lifted.discard(given.kind)
        self._scans.discard_until(given.stamp)
        return [] if self._lifted else [self._status(given.stamp, "set down: searching all maps")]

    def _take_map_hint(self, given: MapHint) -> list[Output]:
        named, source = given.map_id, given.source
        if named not in self.site.map_ids:
            reason = f"{source} names the map {named!r:.60}, which cannot be used in this site"
            return [self._status(given.stamp, reason)]
        if self._phase is Phase.TRACKING and named == self._map_id:
            return [self._status(given.stamp, f"{source} names the map in use")]
        if self._ride is not None and self._ride.lift.leads_to(named):
            self._begin_ride(Ride(self.site, self._ride.lift, named))
            reason = f"{source} says that this is {named}: the next view verifies it"
            return [self._open(given.stamp, reason)]
        reason = f"{source} says that this is {named}: searching there first"
        prior = None
        if given.T_map_base is not None:
            known = PoseHint(given.stamp, given.T_map_base)  # its defaults
            prior = Near(known.T_map_base, known.radius, known.angle)
        said = self._start_search(given.stamp, reason, {named: prior})
        self._hinted = named
        return said

    def _use_next_view(self) -> list[Output]:
        view = self._scans.pop()
        if view is None or self._lifted:
            return []
        if isinstance(view, LaserScan):
            return [self._status(view.stamp, "a scan is older than all odometry: left out")]
        if not self._scans.is_valid(view):
            return []
        was_blind = self._view_at is not None and view.stamp - self._view_at > _GAP_S
        self._view_at = view.stamp
        if self._phase is Phase.SEARCHING:
            return self._find(view)
        if self._phase is Phase.RIDING:
            return self._weigh_floors(view, self._ride)
        return self._follow(view, was_blind=was_blind)

    # ---- one view in each phase

    def _find(self, view: View) -> list[Output]:
        """Ask the whole site; hand over to the localizer of a map when one place is left."""
        if self._candidate is not None:
            return self._await(view, self._candidate, "the whole site")
        try:
            result = self._search.ask(view)
        except FirstfixError as error:
            return self._start_search(view.stamp, f"{error}")
        if result is None:
            return []
        best = result.best
        if result.verdict is Verdict.UNIQUE and best is not None and result.map_id is not None:
            if self._hinted is None and not is_clear(self.site, result.map_id, best.pose, view):
                reason = f"{result.map_id} fits best, but another floor differs in little"
                return [self._open(view.stamp, reason)]
            found = self._localizers.propose(
                result.map_id, best.pose, view, "the search of all maps"
            )
            return self._await(view, found, result.reason)
        self._state = State.DISAMBIGUATING if result.hypotheses else State.SEARCHING
        if result.verdict is Verdict.NO_MATCH:
            self._state = State.SEARCHING
        return [self._status(view.stamp, result.reason)]

    def _begin_ride(self, ride: Ride) -> Ride:
        self._phase, self._ride, self._candidate = Phase.RIDING, ride, None
        return ride

    def _weigh_floors(self, view: View, ride: Ride | None) -> list[Output]:
        """Weigh the floors of a lift; hand over to the localizer of a map when one is left."""
        assert ride is not None  # noqa: S101 - every way into this phase brings one
        weighed = ride.weigh(view, self._T_map_odom @ view.T_odom_base)
        self._T_map_odom = weighed.T_map_base @ view.T_odom_base.inverse()
        if weighed.is_refuted:
            return self._start_search(view.stamp, f"{weighed.reason}: searching all maps")
        if weighed.chosen is None:
            self._candidate = None
            return [self._open(view.stamp, weighed.reason)]
        map_id, T_map_base = weighed.chosen
        if self._candidate is None or self._candidate.map_id != map_id:
            name = ride.lift.transition.id
            self._candidate = self._localizers.propose(map_id, T_map_base, view, name)
        return self._await(view, self._candidate, weighed.reason)

    def _await(self, view: View, candidate: Candidate, reason: str) -> list[Output]:
        """Publish the pose of a candidate once its localizer has verified it."""
        outputs = confirm(candidate, view)
        if outputs:
            return self._switch(view, candidate, outputs)
        self._candidate = candidate
        if candidate.localizer.state is State.SEARCHING:
            said = f"the place in {candidate.map_id} does not explain the scan: searching all maps"
            return self._start_search(view.stamp, said)
        return [self._open(view.stamp, f"probably in {candidate.map_id}: {reason}")]

    def _switch(self, view: View, candidate: Candidate, outputs: list[Output]) -> list[Output]:
        if self._phase is Phase.RIDING and self._ride is not None:
            self._ride.end_at(candidate.map_id)
        self._phase, self._localizer = Phase.TRACKING, candidate.localizer
        self._candidate = self._hinted = None
        self._note_pose(outputs)
        if candidate.map_id == self._map_id:
            return outputs
        self._map_id = candidate.map_id
        return [MapSwitched(view.stamp, self._map_id, self.site.grid(self._map_id)), *outputs]

    def _follow(self, view: View, *, was_blind: bool) -> list[Output]:
        """Give a view to the localizer of the map, unless it may be on another floor."""
        localizer = self._localizer
        assert localizer is not None  # noqa: S101 - the phase needs one
        T_map_base = self._T_map_odom @ view.T_odom_base
        lift = lift_at(self.site.transitions, f"{self._map_id}", T_map_base)
        if lift is not None and localizer.state is State.LOCALIZED:
            fields = self.site.fields(f"{self._map_id}")
            if was_blind or not sees_same_floor(view, lift, T_map_base, fields):
                return self._weigh_floors(view, self._begin_ride(Ride(self.site, lift)))
        ride = self._ride
        if ride is not None and not ride.is_still_likely(f"{self._map_id}", view):
            self._begin_ride(ride)
            return [self._open(view.stamp, "another floor fits better now")]
        if ride is not None and ride.belief is None and lift is None:
            self._ride = None
        outputs: list[Output] = []
        for scan in view.scans:
            outputs += self._of_localizer(scan, localizer)
        return outputs

    def _of_localizer(self, given: Input, localizer: Localizer) -> list[Output]:
        """Return the outputs of the localizer of the map, or search all maps if it is lost."""
        before = localizer.state
        outputs = localizer.handle(given)
        was_tracked = before is State.LOCALIZED
        is_lost = localizer.state is State.SEARCHING or (
            was_tracked and localizer.state is State.DISAMBIGUATING
        )
        has_jumped = was_tracked and any(
            isinstance(output, InitialPose) and self._is_jump(output.T_map_base)
            for output in outputs
        )
        if is_lost or has_jumped:
            return self._start_search(given.stamp, f"lost in {self._map_id}: searching all maps")
        self._note_pose(outputs)
        return outputs

    def _is_jump(self, T_map_base: SE2) -> bool:
        last = self._scans.odometry.last
        return last is None or (
            (self._T_map_odom @ last.T_odom_base).distance_to(T_map_base) > _JUMP_M
        )

    def _note_pose(self, outputs: list[Output]) -> None:
        for output in outputs:
            if isinstance(output, TrackedPose):
                self._T_map_odom = output.T_map_odom

    def _start_search(
        self, stamp: float, reason: str, prior: SitePrior | None = None
    ) -> list[Output]:
        self._phase, self._state = Phase.SEARCHING, State.SEARCHING
        self._search = self._new_search(prior)
        self._ride = self._candidate = self._hinted = None
        return [self._status(stamp, reason)]

    def _new_search(self, prior: SitePrior | None) -> SiteSearch:
        return SiteSearch(self.site, prior, self.config.monitor.rest_period_s)

    def _open(self, stamp: float, reason: str) -> Status:
        """Say that no pose can be published, because the map is not sure."""
        self._state = State.DISAMBIGUATING
        return self._status(stamp, reason)

    def _status(self, stamp: float, reason: str) -> Status:
        return Status(stamp, self.state, reason)


AnyLocalizer = Localizer | SiteLocalizer
"""A localizer of one map, or of many: both have the same inputs, outputs and properties."""
