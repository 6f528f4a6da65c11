"""A viewer of the live page without a browser: its WebSocket, and the messages of the server."""

from __future__ import annotations

import json
import struct
from functools import partial

from websockets.sync.client import ClientConnection
from websockets.sync.client import connect as connect_sync

PATIENCE_S = 240.0

# A client that stops reading does not receive the answer to its close frame.
connect = partial(connect_sync, max_queue=None, close_timeout=2.0)


def kind_of(message: str | bytes) -> str:
    if isinstance(message, bytes):
        return {1: "scan", 2: "particles", 3: "belief"}[message[0]]
    return json.loads(message)["type"]


def stamp_of(message: str | bytes) -> float:
    if isinstance(message, bytes):
        return struct.unpack_from("<d", message, 8)[0]
    return json.loads(message)["stamp"]


def next_of(viewer: ClientConnection, kind: str) -> dict:
    """Wait for the next message of a kind."""
    while True:
        message = viewer.recv(PATIENCE_S)
        if kind_of(message) == kind:
            return json.loads(message) if isinstance(message, str) else {"frame": message}
