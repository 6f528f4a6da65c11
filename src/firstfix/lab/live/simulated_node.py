"""The node of a simulated robot: robot and localizer share one thread and run in real time."""

from __future__ import annotations

import threading
import time
import traceback
from collections.abc import Callable, Sequence

from firstfix.core.errors import InputError
from firstfix.core.se2 import SE2
from firstfix.fields.cache import cache_folder
from firstfix.io.incident_files import IncidentFolder, incident_folder
from firstfix.lab.live.plain_amcl import PlainAmcl
from firstfix.lab.live.simulated_robot import SimulatedRobot
from firstfix.lab.simulation.simulation import PERIOD_S, Moment
from firstfix.localizer.config import LocalizerConfig
from firstfix.localizer.inputs import Input, NewMap, Reset
from firstfix.localizer.localizer import Localizer
from firstfix.localizer.outputs import MapSwitched, Output, TrackedPose
from firstfix.localizer.precompile import precompile
from firstfix.ros.inbox import Inbox
from firstfix.ros.incident_keeper import IncidentKeeper
from firstfix.ros.node import Watcher
from firstfix.ros.node_config import NodeConfig
from firstfix.site.floors import AnyLocalizer, SiteLocalizer
from firstfix.site.site import Site
from firstfix.web.snapshot import AmclStart
from firstfix.web.snapshot_store import SnapshotStore

# Longest wait for the present step at the end.
_END_S = 5.0
# What is kept for an incident, as on a real robot, s.
_KEPT_S = NodeConfig().incident_seconds


class SimulatedNode:
    """Advances a simulated robot, and localizes it.

    A search delays the robot. So the same commands at the same scans give the same result on every
    machine.

    Parameters
    ----------
    robot : SimulatedRobot
        The robot, with its world.
    store : SnapshotStore
        Receives inputs, outputs and the true pose, in the thread of the node.
    warn : callable
        Receives what went wrong, as text.
    watchers : sequence of Watcher
        Others that watch the localizer.
    config : LocalizerConfig, optional
        Settings of the localizer.
    site : Site, optional
        The maps in one of which the robot is; by default only that of its world.
    """

    def __init__(
        self,
        robot: SimulatedRobot,
        store: SnapshotStore,
        warn: Callable[[str], None],
        watchers: Sequence[Watcher] = (),
        config: LocalizerConfig | None = None,
        site: Site | None = None,
    ) -> None:
        self._robot = robot
        self._store = store
        self._warn = warn
        self.incidents = IncidentKeeper(_KEPT_S, IncidentFolder(incident_folder()), warn)
        self._watchers: tuple[Watcher, ...] = (store, self.incidents, *watchers)
        self._inbox: Inbox[Input] = Inbox()
        self._starts = robot.starts
        self._amcl: PlainAmcl | None = None
        self._path = robot.status.path
        self._known: SE2 | None = None  # the last published pose
        self._config = config
        self._site = site
        self._localizer = self._new_localizer()
        self._thread = threading.Thread(target=self._run, name="firstfix", daemon=True)

    def start(self) -> None:
        """Start the thread; it precompiles the kernels first."""
        self._thread.start()

    def stop(self) -> None:
        """Stop after the present step, unless that takes long, as compiling does."""
        self._inbox.close()
        self._thread.join(_END_S)
        self.incidents.close()

    def give(self, given: Input) -> None:
        """Queue an input for the localizer; thread-safe."""
        self._inbox.put(given)

    def _run(self) -> None:
        precompile()
        self._try(self._begin)
        due = time.monotonic()
        while not self._inbox.is_closed:
            for given in self._inbox.take(max(0.0, due - time.monotonic())):
                self._try(self._handle, given)
            if time.monotonic() >= due:
                self._try(self._advance)
                # After a suspension of the machine, missed steps are not made up for.
                due = max(due + PERIOD_S, time.monotonic())

    def _advance(self) -> None:
        moment = self._robot.step()
        if self._robot.starts != self._starts:
            self._restart()
        elif moment is not None:
            self._follow_with_amcl(moment)
            self._show_path()
            self._store.set_truth(moment.T_map_base)
            self._store.skip_time()  # of the simulation
            for event in moment.events:
                self._handle(event)

    def _show_path(self) -> None:
        """Show that a goal was reached."""
        status = self._robot.status
        if status.path != self._path:
            self._path = status.path
            self._store.set_simulation(status)

    def _follow_with_amcl(self, moment: Moment) -> None:
        start = self._robot.status.amcl
        if start is AmclStart.OFF:
            self._store.set_amcl(None)
            self._amcl = None
            return
        if self._amcl is None or self._amcl.start is not start:
            self._amcl = PlainAmcl(self._robot.grid, start)
        self._amcl.follow(moment.events, self._known)
        self._store.set_amcl(self._amcl.estimate)

    def _restart(self) -> None:
        """Begin again in a world, whose clock starts at zero."""
        self._starts = self._robot.starts
        self._amcl = self._known = None
        self._localizer = self._new_localizer()
        if self._site is None:
            self._store.set_map_name(self._robot.status.world)
        self._begin()

    def _begin(self) -> None:
        """Give the localizer its map, unless it has those of a site."""
        self._handle(NewMap(0.0, self._robot.grid) if self._site is None else Reset(0.0))

    def _new_localizer(self) -> AnyLocalizer:
        if self._site is None:
            return Localizer(self._config, cache_dir=cache_folder())
        return SiteLocalizer(self._site, self._config, cache_folder())

    def _handle(self, given: Input) -> None:
        outputs = self._localizer.handle(given)
        for output in outputs:
            if isinstance(output, TrackedPose):
                self._known = output.T_map_base
            elif isinstance(output, MapSwitched):
                self._tell(NewMap(output.stamp, output.grid, output.map_id), [])
        self._tell(given, outputs)

    def _tell(self, given: Input, outputs: list[Output]) -> None:
        for watch in self._watchers:
            watch(given, outputs, self._localizer)

    def _try(self, step: Callable[..., None], *given: Input) -> None:
        try:
            step(*given)
        except InputError as error:
            self._warn(f"{error}")
        except Exception:  # noqa: BLE001 - a robot that stopped silently would be worse
            self._warn(f"Internal error of firstfix:\n{traceback.format_exc()}")
