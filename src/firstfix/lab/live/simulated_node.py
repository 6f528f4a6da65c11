"""The localizer of a simulated robot: both live in one thread, as fast as the clock on the wall."""

from __future__ import annotations

import threading
import time
import traceback
from collections.abc import Callable, Sequence

from firstfix.core.errors import InputError
from firstfix.core.grid import OccupancyGrid
from firstfix.core.se2 import SE2
from firstfix.fields.cache import cache_folder
from firstfix.lab.live.steered_robot import SimRobot
from firstfix.lab.simulation.simulation import PERIOD_S
from firstfix.localizer.inputs import Input, NewMap
from firstfix.localizer.localizer import Localizer
from firstfix.localizer.precompile import precompile
from firstfix.ros.inbox import Inbox
from firstfix.ros.node import Watcher

# After that, whatever is being thought is left alone.
_END_S = 5.0


class SimNode:
    """Lets a robot live, and a localizer find and follow it.

    A search keeps the robot waiting, not the other way round: whatever the machine, the same orders
    at the same scans lead to the same story.

    Parameters
    ----------
    grid : OccupancyGrid
        The map.
    robot : SimRobot
        Who lives in it.
    watchers : sequence of Watcher
        Who is told what came in and what it led to; in the thread of the node.
    know : callable
        Takes where the robot truly is (``T_map_base``), just before what it reports from there.
    complain : callable
        Takes what went wrong, for people.
    """

    def __init__(
        self,
        grid: OccupancyGrid,
        robot: SimRobot,
        watchers: Sequence[Watcher],
        know: Callable[[SE2], None],
        complain: Callable[[str], None],
    ) -> None:
        self._grid = grid
        self._robot = robot
        self._watchers = watchers
        self._know = know
        self._complain = complain
        self._inbox: Inbox[Input] = Inbox()
        self._localizer = Localizer(cache_dir=cache_folder())
        self._thread = threading.Thread(target=self._live, name="firstfix", daemon=True)

    def start(self) -> None:
        """Begin to live, once kernels and map are ready."""
        self._thread.start()

    def stop(self) -> None:
        """End after the present moment, unless that takes long, as compiling kernels does."""
        self._inbox.close()
        self._thread.join(_END_S)

    def give(self, given: Input) -> None:
        """Take in what the robot does not know of, such as the word of a person.

        Parameters
        ----------
        given : Input
            What happened.
        """
        self._inbox.put(given)

    def _live(self) -> None:
        precompile()
        self._try(self._handle, NewMap(0.0, self._grid))
        due = time.monotonic()
        while not self._inbox.is_closed:
            for given in self._inbox.take(max(0.0, due - time.monotonic())):
                self._try(self._handle, given)
            if time.monotonic() >= due:
                self._try(self._go_on)
                # A machine that was asleep does not run after what it missed.
                due = max(due + PERIOD_S, time.monotonic())

    def _go_on(self) -> None:
        moment = self._robot.step()
        if moment is not None:
            self._know(moment.T_map_base)
            for event in moment.events:
                self._handle(event)

    def _handle(self, given: Input) -> None:
        outputs = self._localizer.handle(given)
        for watch in self._watchers:
            watch(given, outputs, self._localizer)

    def _try(self, step: Callable[..., None], *given: Input) -> None:
        try:
            step(*given)
        except InputError as error:
            self._complain(f"{error}")
        except Exception:  # noqa: BLE001 - a robot that stopped silently would be worse
            self._complain(f"an error of firstfix itself:\n{traceback.format_exc()}")
