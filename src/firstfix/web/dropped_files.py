"""``POST /v1/locate-files``: a map and a log of a viewer are located, and nothing is kept."""

from __future__ import annotations

import asyncio
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

from starlette.concurrency import run_in_threadpool
from starlette.exceptions import HTTPException
from starlette.requests import Request

from firstfix.core.errors import InputError
from firstfix.io.maps.map_server import save_map
from firstfix.web.file_worker import IMAGE_SUFFIXES, MAP_SUFFIXES, WRONG_INPUT
from firstfix.web.request_body import read_body
from firstfix.web.snapshot import ActiveMap

MOST_FILES = 3
MOST_FILE_BYTES = 64 * 2**20
_BODY_TIMEOUT_S = 120.0
_SEARCH_TIMEOUT_S = 60.0
_LONGEST_NAME = 100


@dataclass(frozen=True, slots=True)
class _Part:
    """One file of a body."""

    name: str
    size: int


class DroppedFiles:
    """Locates one scan of the files of one viewer at a time, in a process of its own."""

    def __init__(self) -> None:
        self._is_busy = False

    async def locate(self, request: Request, active_map: ActiveMap | None) -> bytes:
        """Answer a request whose body is the files, one after another.

        Parameters
        ----------
        request : Request
            ``?file=NAME:BYTES`` for each file of the body, in order, and ``index``. A log without
            a map is located in the map in use.
        active_map : ActiveMap or None
            The map in use.

        Returns
        -------
        bytes
            `firstfix.web.messages.LocatedFiles` as JSON.

        Raises
        ------
        HTTPException
            503 while another request runs, 413 if the files are too large.
        InputError
            If they cannot be used.
        """
        if self._is_busy:
            raise HTTPException(
                503, "Other files are being located. Try again in a moment.", {"retry-after": "5"}
            )
        self._is_busy = True
        try:
            parts, index = _parts(request), _index(request)
            body = await read_body(request, MOST_FILE_BYTES, _BODY_TIMEOUT_S)
            with tempfile.TemporaryDirectory(prefix="firstfix-") as folder:
                await run_in_threadpool(_write, Path(folder), parts, body, active_map)
                del body
                return await _run(folder, index)
        finally:
            self._is_busy = False


def _parts(request: Request) -> list[_Part]:
    given = request.query_params.getlist("file")
    if not 1 <= len(given) <= MOST_FILES:
        raise InputError(f"Send 1 to {MOST_FILES} files: YAML and image of a map, and a log.")
    parts = [_part(text) for text in given]
    if len({part.name.lower() for part in parts}) < len(parts):
        raise InputError("Two files have the same name.")
    return parts


def _part(text: str) -> _Part:
    name, _, size = text.rpartition(":")
    is_name = 0 < len(name) <= _LONGEST_NAME and not name.startswith(".") and name.isprintable()
    if not is_name or any(mark in name for mark in "/\\:"):
        raise InputError("A file must have a plain name, without folders, of at most 100 letters.")
    if not (size.isascii() and size.isdecimal() and len(size) <= 10):
        raise InputError(f"The size of {name!r:.60} must be a number of bytes.")
    return _Part(name, int(size))


def _index(request: Request) -> int:
    given = request.query_params.get("index", "0")
    if not (given.isascii() and given.isdecimal() and len(given) <= 6):
        raise InputError("index must be a whole number from 0.")
    return int(given)


def _write(folder: Path, parts: list[_Part], body: bytes, active_map: ActiveMap | None) -> None:
    if sum(part.size for part in parts) != len(body):
        raise InputError("The sizes of the files do not add up to the body.")
    start = 0
    for part in parts:
        (folder / part.name).write_bytes(body[start : start + part.size])
        start += part.size
    suffixes = {Path(part.name).suffix.lower() for part in parts}
    if not suffixes & {*MAP_SUFFIXES, *IMAGE_SUFFIXES} and active_map is not None:
        save_map(active_map.grid, folder / "map of the robot.yaml")


async def _run(folder: str, index: int) -> bytes:
    worker = await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", "firstfix.web.file_worker", folder, f"{index}"),
        stdin=asyncio.subprocess.DEVNULL,
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.PIPE,
    )
    try:
        answer, complaint = await asyncio.wait_for(worker.communicate(), _SEARCH_TIMEOUT_S)
    except asyncio.TimeoutError:
        raise InputError(f"The search took more than {_SEARCH_TIMEOUT_S:g} s.") from None
    finally:
        if worker.returncode is None:
            worker.kill()
            await worker.wait()
    if worker.returncode == WRONG_INPUT:
        raise InputError(complaint.decode(errors="replace"))
    if worker.returncode != 0:
        raise InputError("The files cannot be used: reading them failed. Check them with firstfix.")
    return answer
