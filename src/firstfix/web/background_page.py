"""The page of a real robot, served in a background thread of its node's process."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from socket import socket

from firstfix.core.errors import InputError
from firstfix.localizer.inputs import Input
from firstfix.ros.node import Node, Watcher
from firstfix.ros.node_config import NodeConfig
from firstfix.ros.transport import Transport
from firstfix.web.access_control import AccessPolicy
from firstfix.web.command_executor import CommandExecutor
from firstfix.web.page import Page
from firstfix.web.server import make_server
from firstfix.web.snapshot_store import SnapshotStore

_END_S = 5.0


class BackgroundPage:
    """Context manager that serves the page; `make_node` makes the node that it shows.

    Parameters
    ----------
    robot : str
        ros1, ros2 or dds.
    map_name : str
        Name of the map; empty: maps bring their own, as those of a site.
    access : AccessPolicy
        Who may see the page, and who may steer.
    listening : socket
        The open port.
    watchers : sequence of Watcher
        Others that watch the node.
    """

    def __init__(
        self,
        robot: str,
        map_name: str,
        access: AccessPolicy,
        listening: socket,
        watchers: Sequence[Watcher] = (),
    ) -> None:
        self._store = SnapshotStore(map_name)
        self._watchers = watchers
        self._node: Node | None = None
        self._server = make_server(
            Page(
                robot,
                self._store,
                CommandExecutor(self._store, self.give),
                access,
                incidents=lambda: None if self._node is None else self._node.incidents,
            )
        )
        serve = {"sockets": [listening]}
        self._thread = threading.Thread(
            target=self._server.run, kwargs=serve, name="page", daemon=True
        )

    def __enter__(self) -> BackgroundPage:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._server.should_exit = True
        self._thread.join(_END_S)

    def make_node(self, config: NodeConfig, transport: Transport) -> Node:
        """Make the node that the page shows from now on.

        Parameters
        ----------
        config : NodeConfig
            Its settings.
        transport : Transport
            Its middleware.

        Returns
        -------
        Node
            Not started yet.
        """
        self._node = Node(config, transport, [self._store, *self._watchers])
        return self._node

    def give(self, given: Input) -> None:
        """Queue an input for the node.

        Raises
        ------
        InputError
            If there is no node yet.
        """
        if self._node is None:
            raise InputError(
                "The node is not configured yet. Configure it: "
                "ros2 lifecycle set /firstfix configure"
            )
        self._node.give(given)
