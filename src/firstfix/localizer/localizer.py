"""The localizer: one input in, some outputs out."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from firstfix.amcl.particles import Particles
from firstfix.belief.belief import Belief
from firstfix.belief.view import View
from firstfix.changes.counts import ChangeCounter
from firstfix.core.arguments import as_instance
from firstfix.core.errors import InputError
from firstfix.core.odometry import Odometry, Signal, SignalKind
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.global_localization.scan_matcher import ScanMatcher
from firstfix.localizer.checked_odometry import CheckedOdometry
from firstfix.localizer.config import LocalizerConfig
from firstfix.localizer.inputs import (
    Input,
    MapHint,
    NewMap,
    PoseHint,
    PositionFix,
    Reset,
    check_input,
)
from firstfix.localizer.map_localization import MapLocalization
from firstfix.localizer.outputs import Output, Status, TrackedPose
from firstfix.localizer.scan_queue import ScanQueue
from firstfix.localizer.states import Event, State


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
        self._cache_dir = cache_dir
        self._rng = np.random.default_rng(self.config.amcl.seed)
        self._scans = ScanQueue(self.config.scans)
        self._odometry = CheckedOdometry()
        self._view: View | None = None
        self._lifted: set[SignalKind] = set()
        self._in_map: MapLocalization | None = None

    @property
    def state(self) -> State:
        """The state; only events in the table of `firstfix.localizer.states` change it."""
        return State.NO_MAP if self._in_map is None else self._in_map.state

    def __repr__(self) -> str:
        grid = "" if self.matcher is None else f" in {self.matcher.fields.grid!r}"
        return f"<Localizer {self.state.value}{grid}>"

    @property
    def particles(self) -> Particles | None:
        """The particles of the tracked pose; None while there is none."""
        return None if self._in_map is None else self._in_map.tracker.particles

    @property
    def belief(self) -> Belief | None:
        """The belief over all places of the map; None before the first map."""
        return None if self._in_map is None else self._in_map.places.belief

    @property
    def view(self) -> View | None:
        """The scans that were used last, moved to one time; None before the first."""
        return self._view

    @property
    def matcher(self) -> ScanMatcher | None:
        """Global localization on the map in use; None before the first map."""
        return None if self._in_map is None else self._in_map.matcher

    @property
    def changes(self) -> ChangeCounter | None:
        """What scans contradict in the map in use; None unless `ChangesConfig` keeps days."""
        return None if self._in_map is None else self._in_map.changes

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
        earlier = [] if self._in_map is None else self._in_map.weigh_in_background()
        return [*self._for_the_base(earlier), *self._for_the_base(self._process(given))]

    def _for_the_base(self, outputs: list[Output]) -> list[Output]:
        """Say the drift of the odometry as it comes, without our corrections."""
        T_checked_odom = self._odometry.T_checked_odom
        return [
            replace(output, T_map_odom=output.T_map_odom @ T_checked_odom)
            if isinstance(output, TrackedPose)
            else output
            for output in outputs
        ]

    def _process(self, given: Input) -> list[Output]:
        if isinstance(given, NewMap):
            return self._take_map(given)
        if self._in_map is None:
            return self._prepare(given)
        if isinstance(given, Odometry):
            return self._take_odometry(given, self._in_map)
        if isinstance(given, Signal):
            return self._take_signal(given, self._in_map)
        if isinstance(given, LaserScan):
            complaint = self._scans.add(given)
            said = [self._in_map.status(given.stamp, complaint)] if complaint is not None else []
            return [*said, *self._use_next_scan(self._in_map)]
        if isinstance(given, PoseHint):
            return self._in_map.take_hint(given)
        if isinstance(given, PositionFix):
            return self._in_map.take_fix(given, self._checked(given.stamp))
        if isinstance(given, Reset):
            return self._take_reset(given, self._in_map)
        if isinstance(given, MapHint):
            reason = f"there is one map: {given.source} cannot name another one"
            return [self._in_map.status(given.stamp, reason)]
        self._in_map.request_update()
        return [self._in_map.status(given.stamp, "the next scan will be used in any case")]

    def _prepare(self, given: Input) -> list[Output]:
        """Keep what holds for any map."""
        if isinstance(given, Odometry):
            self._scans.add_odometry(given)
            return []
        if isinstance(given, Signal):
            self._note(given)
            return []
        return [Status(given.stamp, State.NO_MAP, "no map yet")]

    def _take_map(self, given: NewMap) -> list[Output]:
        in_map = MapLocalization(
            given, self.state, self._scans, self.config, self._cache_dir, self._rng
        )
        self._in_map = in_map
        self._scans.clear()
        if not self._lifted:
            return [in_map.status(given.stamp, "map received: searching")]
        reason = "map received: waiting until the robot is set down"
        return [in_map.restart(given.stamp, Event.PICKED_UP, reason)]

    def _take_odometry(self, given: Odometry, in_map: MapLocalization) -> list[Output]:
        before = self._scans.odometry.last
        has_leapt = self._scans.odometry.leaps(given)
        has_jumped = self._scans.add_odometry(given)
        if has_leapt or has_jumped:
            in_map.tracker.doubt_odometry()
        if has_jumped and before is not None:
            T_odom_base = self._odometry.T_checked_odom @ before.T_odom_base
            self._odometry.restart()
            return in_map.change_frame(replace(before, T_odom_base=T_odom_base), given)
        return self._use_next_scan(in_map)

    def _take_signal(self, given: Signal, in_map: MapLocalization) -> list[Output]:
        if not given.kind.means_lifted:
            return []
        self._note(given)
        if given.active:
            reason = f"{given.kind.value}: waiting until the robot is set down"
            return [in_map.restart(given.stamp, Event.PICKED_UP, reason)]
        if self._lifted or self.state is not State.LIFTED:
            return []
        in_map.set_down()
        return [in_map.status(given.stamp, "set down: waiting for the next scan")]

    def _note(self, given: Signal) -> None:
        if not given.kind.means_lifted:
            return
        if given.active:
            self._lifted.add(given.kind)
        else:
            self._lifted.discard(given.kind)
            self._scans.discard_until(given.stamp)  # scans taken in the air

    def _take_reset(self, given: Reset, in_map: MapLocalization) -> list[Output]:
        # A base that was restarted in the air never reports that it was set down.
        self._lifted.clear()
        status = in_map.restart(given.stamp, Event.RESET, "reset requested: searching")
        if given.prior is None:
            return [status]
        try:
            in_map.places.restart(given.prior)
        except InputError as error:
            return [in_map.status(given.stamp, f"prior refused: {error}")]
        return [status]

    def _use_next_scan(self, in_map: MapLocalization) -> list[Output]:
        view = self._scans.pop()
        if view is None:
            return []
        if isinstance(view, LaserScan):
            reason = "a scan is older than all odometry: left out"
            return [in_map.status(view.stamp, reason)]
        if self.state is State.LIFTED or not self._scans.is_valid(view):
            return []
        self._view = self._odometry.check(view)
        return in_map.use(self._view)

    def _checked(self, stamp: float) -> SE2 | None:
        T_odom_base = self._scans.odometry.at(stamp)
        return None if T_odom_base is None else self._odometry.T_checked_odom @ T_odom_base
