"""The processes of a soak: starting, killing, figures and output of each."""

from __future__ import annotations

import contextlib
import itertools
import json
import os
import signal
import socket
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "robots"))

from ros1_lab import Master, Program

from firstfix.io.maps.map_server import save_map
from firstfix.lab.worlds.catalog import WORLDS

HERE = Path(__file__).parent


class Part(Program):
    """A program of the system, with figures while it runs."""

    @property
    def pid(self) -> int:
        """Its process."""
        return self._process.pid

    def figures(self) -> dict[str, float] | None:
        """Return memory (MB), processor time (s), threads and open files; None once it is dead."""
        try:
            return {
                "rss_mb": self.memory_mb,
                "cpu_s": self.cpu_s,
                "threads": len([*Path(f"/proc/{self.pid}/task").iterdir()]),
                "files": len([*Path(f"/proc/{self.pid}/fd").iterdir()]),
            }
        except (OSError, IndexError):
            return None


class Core(Master):
    """A roscore that can be killed with all its parts, and restarts at the same address."""

    def kill(self) -> None:
        """End it as a power cut does."""
        if self._program is None:
            return
        own = self._program._process.pid
        for pid in [own, *children(own)]:
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        self._program.wait()
        self._program.end()
        self._program = None


def children(pid: int) -> list[int]:
    """Return the processes below one."""
    found = []
    for path in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):
            after_name = path.read_text(encoding="utf-8", errors="replace").rpartition(")")[2]
            if int(after_name.split()[1]) == pid:
                child = int(path.parent.name)
                found += [child, *children(child)]
    return found


class System:
    """All processes; starts and kills each."""

    def __init__(self, folder: Path, world: str, mode: str, seed: int) -> None:
        self._folder, self._world, self._mode = folder, world, mode
        self.core = Core(folder)
        self.core.environment["FIRSTFIX_CACHE_DIR"] = str(folder / "cache")
        self._map = save_map(WORLDS[world](), folder / f"{world}.yaml")
        with socket.create_server(("127.0.0.1", 0)) as probe:
            self._port = probe.getsockname()[1]
        self.truth, self.said, self.seen = (
            folder / f"{name}.jsonl" for name in ("truth", "said", "seen")
        )
        self.saved_pose = folder / "pose.json"
        self._seeds = itertools.count(seed)
        self._numbers = itertools.count()
        self.parts: dict[str, Part] = {}

    def start_node(self) -> None:
        """Start the node with its page, as in `docs/live.md`."""
        arguments = [f"_mode:={self._mode}", f"_saved_pose_file:={self.saved_pose}"]
        command = ["-m", "firstfix", "serve", self._map, "--robot", "ros1", "--port", self._port]
        self._start("node", *command, "--", *arguments)

    def start_robot(self, *start: float) -> None:
        """Start the robot, at a place (x, y, yaw) or anywhere."""
        command = [HERE / "soak_robot.py", self._world, next(self._seeds), self.truth]
        self._start("robot", *command, *(["--start", *start] if start else []))

    def start_observer(self) -> None:
        """Start the observer of the node."""
        self._start("observer", HERE / "soak_observer.py", "ros", self.said)

    def start_viewer(self) -> None:
        """Start the viewer of the page."""
        url = f"ws://127.0.0.1:{self._port}/v1/live"
        self._start("viewer", HERE / "soak_observer.py", "page", self.seen, url)

    def command(self, **order: Any) -> None:
        """Send a command to the robot, if it runs."""
        if "robot" in self.parts:
            with contextlib.suppress(OSError):
                self.parts["robot"].command(**order)

    def kill(self, name: str) -> None:
        """Kill a process that needs no time for it."""
        part = self.parts.pop(name)
        with contextlib.suppress(ProcessLookupError):
            part.send(signal.SIGKILL)
        part.wait()
        part.end()

    def where_the_robot_died(self) -> list[float]:
        """Return the last true pose."""
        last = [0.0, 0.0, 0.0]
        for line in whole_lines(self.truth):
            last = line.get("pose", last)
        return last

    def end(self) -> None:
        """End all, the node first and by SIGINT."""
        for name in list(self.parts):
            self.parts.pop(name).end()
        self.core.end()

    def logs(self) -> Iterator[tuple[str, str]]:
        """Return the log of each process."""
        for path in sorted(self._folder.glob("log-*")):
            name = path.stem.split("-")[1]
            yield name, path.read_text(encoding="utf-8", errors="replace")

    def _start(self, name: str, *command: Any) -> None:
        log = self._folder / f"log-{name}-{next(self._numbers):03d}.txt"
        words = [sys.executable, *map(str, command)]
        self.parts[name] = Part(words, self.core.environment, log)


def whole_lines(path: Path) -> list[dict[str, Any]]:
    """Read lines of JSON; a last one that was cut off by a kill is left out."""
    text = path.read_text(encoding="utf-8") if path.exists() else ""
    return [json.loads(line) for line in text.rpartition("\n")[0].splitlines()]
