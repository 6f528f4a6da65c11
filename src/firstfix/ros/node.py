"""A node without its transport: hear, think in a thread of its own, say."""

from __future__ import annotations

import math
import threading
import time
import traceback
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from firstfix.core.errors import InputError, MapError
from firstfix.core.scan import LaserScan
from firstfix.fields.cache import cache_folder
from firstfix.global_localization.searchable import check_searchable
from firstfix.io.maps.map_server import load_map
from firstfix.localizer.config import LocalizerConfig
from firstfix.localizer.inputs import Input, NewMap
from firstfix.localizer.localizer import Localizer
from firstfix.localizer.outputs import Output
from firstfix.localizer.precompile import precompile
from firstfix.ros.channels import Heard, heard_topics
from firstfix.ros.inbox import Inbox
from firstfix.ros.message_converter import MessageConverter
from firstfix.ros.node_config import NodeConfig
from firstfix.ros.output_publisher import OutputPublisher
from firstfix.ros.pose_memory import PoseMemory
from firstfix.ros.transport import Severity, Transport

Watcher = Callable[[Input, list[Output], Localizer], None]

# One sentence on one subject is said that often at most.
_REPEAT_S = 10.0
# How often the worker looks what is missing, s.
_LOOK_S = 5.0
# The end does not wait longer than that for a thought, such as the compiler's, s.
_END_S = 3.0


class Node:
    """The localizer of a robot, fed by callbacks of any thread.

    Parameters
    ----------
    config : NodeConfig
        Settings.
    transport : Transport
        What messages are made with and sent to; called from the worker only.
    watchers : sequence of Watcher
        Who else is told what came in and what it led to, such as the live page; from the worker.
    """

    def __init__(
        self, config: NodeConfig, transport: Transport, watchers: Sequence[Watcher] = ()
    ) -> None:
        self._config = config
        self._transport = transport
        self._watchers = watchers
        self._inbox: Inbox[tuple[Heard, Any]] = Inbox()
        self._intake = MessageConverter(config.amcl, self.complain)
        self._announcer = OutputPublisher(config, transport)
        self._memory = PoseMemory(config, transport.log)
        self._localizer = Localizer(LocalizerConfig(amcl=config.amcl), cache_folder())
        self._said_at: dict[str, float] = {}
        self._heard: set[Heard] = set()
        self.misses_since = math.inf  # when topics were last missed; inf: nobody passes them on
        self._own_map: NewMap | None = None
        self._worker = threading.Thread(target=self._work, name="firstfix", daemon=True)

    def start(self) -> None:
        """Begin to think; kernels and map are made ready first.

        Raises
        ------
        InputError
            If the file of the map cannot be used.
        """
        if self._config.yaml_filename:
            grid = load_map(Path(self._config.yaml_filename))
            check_searchable(grid)
            self._own_map = NewMap(0.0, grid)
        self.misses_since = time.monotonic()
        self._worker.start()

    def stop(self) -> None:
        """End, after what is being thought now, unless that takes long."""
        self._inbox.close()
        if self._worker.is_alive():
            self._worker.join(_END_S)

    def hear(self, heard: Heard, message: Any = None) -> None:
        """Take in a message or a request; returns at once.

        Parameters
        ----------
        heard : Heard
            What it is.
        message : message
            None for a request.
        """
        is_scan = heard is Heard.SCAN or isinstance(message, LaserScan)
        put = self._inbox.put_scan if is_scan else self._inbox.put
        put((heard, message))

    def give(self, given: Input) -> None:
        """Take in what needs no conversion, such as the word of a person on the live page.

        Parameters
        ----------
        given : Input
            What happened.
        """
        self.hear(Heard.INPUT, given)

    def complain(self, subject: str, text: str, gravity: Severity = Severity.WARNING) -> None:
        """Write a warning, unless there was one on this subject a moment ago.

        Parameters
        ----------
        subject : str
            What it is about.
        text : str
            For people.
        gravity : Severity, optional
            How grave it is.
        """
        now = time.monotonic()
        if now - self._said_at.get(subject, -_REPEAT_S) >= _REPEAT_S:
            self._said_at[subject] = now
            self._transport.log(gravity, text)

    def _work(self) -> None:
        self._try(self._make_ready)
        while not self._inbox.is_closed:
            self._take_all(self._inbox.take(_LOOK_S))
            if time.monotonic() - self.misses_since >= _LOOK_S:
                self._say_what_is_missing()
        self._try(self._memory.close)

    def _make_ready(self) -> None:
        precompile(self._config.amcl)
        if self._own_map is not None:
            self._give(self._intake.use_map(self._own_map))

    def _take_all(self, items: list[tuple[Heard, Any]]) -> None:
        for heard, message in items:
            if self._inbox.is_closed:
                return
            self._heard.add(Heard.SCAN if isinstance(message, LaserScan) else heard)
            self._try(self._take, heard, message)

    def _take(self, heard: Heard, message: Any) -> None:
        if heard is Heard.INITIAL_POSE and self._announcer.is_own(message):
            return
        self._give(self._intake.take(heard, message))

    def _give(self, inputs: list[Input]) -> None:
        for given in inputs:
            self._handle(given)
            hint = self._memory.hint_after(given)
            if hint is not None:
                self._handle(hint)

    def _handle(self, given: Input) -> None:
        try:
            outputs = self._localizer.handle(given)
        except MapError:
            self._intake.take_back_map()
            raise
        self._announcer.announce(outputs, self._localizer.particles)
        self._memory.keep(outputs)
        for watch in self._watchers:
            watch(given, outputs, self._localizer)

    def _try(self, step: Any, *given: Any) -> None:
        """Do something that must not end the node, whatever came over the wire."""
        try:
            step(*given)
        except InputError as error:
            # Not by its text, which may have another number each time.
            self.complain(f"{type(error).__name__} {given[:1]}", f"{error}")
        except Exception:  # noqa: BLE001 - a node that died silently would be worse
            text = f"an error of firstfix itself:\n{traceback.format_exc()}"
            self.complain("error", text, Severity.ERROR)

    def _say_what_is_missing(self) -> None:
        """Name the topics that were silent since the last look; whether others spoke or not."""
        self.misses_since = time.monotonic()
        topics = heard_topics(self._config)
        for heard in (Heard.MAP, Heard.SCAN):
            if heard in topics and heard not in self._heard:
                topic = topics[heard]
                text = f"nothing heard on {topic.name} ({topic.type_name}) for {_LOOK_S:.0f} s"
                self.complain(heard.value, text)
        # A map is told once; what is wrong with odometry, every scan tells.
        self._heard &= {Heard.MAP}


MakeNode = Callable[[NodeConfig, Transport], Node]
