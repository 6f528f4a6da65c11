"""A node or a message converter with its records, for tests without a transport."""

from __future__ import annotations

from typing import Any

from recorder import Recorder, Speaker, wait_for

from firstfix.localizer.states import State
from firstfix.ros.channels import Channel
from firstfix.ros.exact_stamps import ExactStamps
from firstfix.ros.message_converter import MessageConverter
from firstfix.ros.node import Node
from firstfix.ros.node_config import NodeConfig


class Running:
    """A node, its recorder, and all inputs and outputs of its localizer."""

    def __init__(self, recorder: Recorder, **parameters: Any) -> None:
        self.recorder = recorder
        self.handled: list[tuple[Any, list[Any]]] = []
        self.state = State.NO_MAP
        # Most tests send single scans.
        config = NodeConfig(**({"scan_timeout": 0.0} | parameters))
        self.node = Node(config, recorder, [self._watch])
        self.receive = self.node.receive

    def _watch(self, given: Any, outputs: list[Any], localizer: Any) -> None:
        self.handled.append((given, outputs))
        self.state = localizer.state

    def given(self, kind: type) -> list[Any]:
        """Return the inputs of one type."""
        return [given for given, _ in self.handled if isinstance(given, kind)]

    def wait_until_handled(self, kind: type, n: int = 1) -> None:
        """Wait for a number of inputs of one type."""
        wait_for(lambda: len(self.given(kind)) >= n)

    def introduce(self, robot: Speaker) -> None:
        """Send map and transform of the laser, then odometry and a scan."""
        self.receive(Channel.MAP, robot.map())
        self.receive(Channel.TF_STATIC, robot.fixed())
        robot.report(self.receive)


class Converter:
    """A message converter, and its warnings."""

    def __init__(self, **parameters: Any) -> None:
        self.warnings: list[tuple[str, str]] = []
        self._converter = MessageConverter(NodeConfig(**parameters), ExactStamps(), self._warn)
        self.convert = self._converter.convert
        self.restore_map = self._converter.restore_map

    def _warn(self, subject: str, text: str) -> None:
        self.warnings.append((subject, text))

    @property
    def last(self) -> str:
        """The last warning."""
        return self.warnings[-1][1]

    @property
    def waiting(self) -> int:
        """Number of scans that wait for a transform."""
        return len(self._converter._waiting)
