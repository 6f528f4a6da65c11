"""A real ROS 1 around a test: its master, the node as users start it, a robot, and watchers."""

from __future__ import annotations

import contextlib
import importlib.util
import itertools
import json
import math
import os
import random
import shutil
import signal
import socket
import subprocess
import sys
import time
import xmlrpc.client
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from firstfix.core.angles import angle_error
from firstfix.core.se2 import SE2

HERE = Path(__file__).parent
# Debian's tools run on Debian's Python.
PATH = os.pathsep.join(["/usr/bin", os.environ.get("PATH", "")])
TOOLS = ("roscore", "rosmaster", "roslaunch", "rosbag")
# A master alone takes a quarter of the time of one with all that belongs to it.
MASTER, WITH_ROSOUT = ("rosmaster", "--core"), ("roscore",)
# In a fresh checkout, kernels are compiled first, by several processes at a time.
PATIENCE_S = 240.0
_POLL_S = 0.05
# Until a program that does not end when it is asked to is killed.
_KINDNESS_S = 15.0
# Stamps of messages have nanoseconds, and seconds as a float have less.
_ROUNDED_S = 1e-5

Line = dict[str, Any]


def why_missing() -> str | None:
    """Return what ROS 1 needs and this machine lacks."""
    if importlib.util.find_spec("rospy") is None:
        return f"no rospy in {sys.executable}"
    lacking = [tool for tool in TOOLS if shutil.which(tool, path=PATH) is None]
    return f"no {', '.join(lacking)} in PATH" if lacking else None


def wait_until(
    condition: Callable[[], Any], what: Callable[[], str], seconds: float = PATIENCE_S
) -> Any:
    """Wait for something true, and return it; fail with `what` where it does not come."""
    deadline = time.monotonic() + seconds
    while not (found := condition()):
        assert time.monotonic() < deadline, f"not within {seconds:g} s: {what()}"
        time.sleep(_POLL_S)
    return found


class Program:
    """A process and its output."""

    def __init__(self, command: list[str], environment: dict[str, str], log: Path) -> None:
        self._log = log
        self._name = " ".join(Path(part).name for part in command[:5])
        with log.open("wb") as out:
            self._process = subprocess.Popen(
                command,
                bufsize=0,
                stdin=subprocess.PIPE,
                stdout=out,
                stderr=subprocess.STDOUT,
                env=environment,
            )

    @property
    def output(self) -> str:
        """All of stdout and stderr so far."""
        return self._log.read_text(encoding="utf-8", errors="replace")

    @property
    def is_running(self) -> bool:
        """False after the end."""
        return self._process.poll() is None

    @property
    def memory_mb(self) -> float:
        """Resident memory."""
        status = Path(f"/proc/{self._process.pid}/status").read_text(encoding="ascii")
        return int(status.partition("VmRSS:")[2].split()[0]) / 1024

    @property
    def cpu_s(self) -> float:
        """Processor time so far."""
        fields = Path(f"/proc/{self._process.pid}/stat").read_text(encoding="ascii").split()
        return (int(fields[13]) + int(fields[14])) / os.sysconf("SC_CLK_TCK")

    def command(self, **what: Any) -> None:
        """Write a line to its stdin."""
        assert self._process.stdin is not None
        self._process.stdin.write(json.dumps(what).encode() + b"\n")

    def wait_for_output(self, text: str) -> None:
        """Wait until its output contains a text."""
        wait_until(
            lambda: text in self.output or not self.is_running,
            lambda: f"{self._name} never printed {text!r}, but: {self.output}",
        )
        assert text in self.output, f"{self._name} ended: {self.output}"

    def send(self, what: signal.Signals) -> None:
        """Send a signal."""
        self._process.send_signal(what)

    def wait(self, seconds: float = PATIENCE_S) -> int:
        """Wait for its end, and return its exit status."""
        wait_until(
            lambda: not self.is_running, lambda: f"{self._name} goes on: {self.output}", seconds
        )
        return self._process.returncode

    def end(self) -> None:
        """End it by SIGINT: roscore and roslaunch end the processes that they started."""
        assert self._process.stdin is not None
        self._process.stdin.close()
        self._process.terminate()
        try:
            self._process.wait(_KINDNESS_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()


class Master:
    """A master, at an address of its own."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._uri = f"http://127.0.0.1:{_free_port()}"
        self._starts = itertools.count()
        self._program: Program | None = None
        self.environment = {
            **os.environ,
            "PATH": PATH,
            "ROS_MASTER_URI": self._uri,
            "ROS_IP": "127.0.0.1",
            "ROS_HOME": str(folder / "home"),
            "ROS_LOG_DIR": str(folder / "log"),
            "PYTHONUNBUFFERED": "1",
        }

    def start(self, program: Sequence[str] = MASTER) -> None:
        """Start it, without waiting: nodes wait for it."""
        tool, *options = program
        path = str(shutil.which(tool, path=PATH))
        command = [path, *options, "-p", self._uri.rpartition(":")[2]]
        log = self._folder / f"master-{next(self._starts)}.log"
        self._program = Program(command, self.environment, log)

    def end(self) -> None:
        """End it with all its parts, as a crash or a reboot of its computer would."""
        if self._program is not None:
            self._program.end()
            self._program = None

    def set(self, parameter: str, value: Any) -> None:
        """Set a parameter."""
        self._ask("setParam", parameter, value)

    def get(self, parameter: str) -> Any:
        """Return a parameter."""
        return self._ask("getParam", parameter)

    def pid_of(self, node: str) -> int:
        """Return the process id that a node reports; 0 without an answer."""
        uri = self._ask("lookupNode", node)
        with contextlib.suppress(OSError), xmlrpc.client.ServerProxy(uri) as asked:
            answer: Any = asked.getPid("/lab")
            return int(answer[2])
        return 0

    def publishers(self, topic: str) -> list[str]:
        """Return the nodes that publish a topic."""
        published = self._ask("getSystemState")[0]
        return next((nodes for name, nodes in published if name == topic), [])

    def _ask(self, call: str, *arguments: Any) -> Any:
        return wait_until(lambda: self._answer(call, *arguments), lambda: "no master")[0]

    def _answer(self, call: str, *arguments: Any) -> list[Any]:
        """Return the answer, alone in a list; nothing while there is no master."""
        with contextlib.suppress(OSError), xmlrpc.client.ServerProxy(self._uri) as master:
            return [getattr(master, call)("/lab", *arguments)[2]]
        return []


def _free_port() -> int:
    # Below those that the system gives to others meanwhile.
    for port in random.sample(range(20_000, 30_000), 100):
        with socket.socket() as probe, contextlib.suppress(OSError):
            probe.bind(("127.0.0.1", port))
            return port
    raise AssertionError("no free port")


class Watcher:
    """The messages of topics, as written by `ros1_watcher.py`."""

    def __init__(self, path: Path, program: Program) -> None:
        self._path = path
        self._program = program

    def end(self) -> None:
        """Stop listening."""
        self._program.end()

    def lines(
        self, topic: str, after: float = 0.0, about_after: float = 0.0, **expected: Any
    ) -> list[Line]:
        """Return messages since a time, stamped at a time or later, with certain values."""
        if not self._path.exists():
            return []
        # The last line may be half written.
        whole = self._path.read_text(encoding="utf-8").rpartition("\n")[0]
        return [
            line
            for line in map(json.loads, whole.splitlines())
            if line["topic"] == topic
            and line["at"] > after
            and line["stamp"] >= about_after
            and all(line.get(key) == value for key, value in expected.items())
        ]

    def wait_for(self, topic: str, after: float = 0.0, **expected: Any) -> Line:
        """Wait for such a line, and return the first."""
        found: list[Line] = wait_until(
            lambda: self.lines(topic, after, **expected),
            lambda: (
                f"no {topic} with {expected}, but {self.lines(topic, after)[-3:]}; "
                f"watcher: {self._program.output}"
            ),
        )
        return found[0]


class Error(NamedTuple):
    """How far two poses are apart."""

    metres: float
    degrees: float

    @property
    def is_small(self) -> bool:
        """As near as a robot must be found."""
        return self.metres < 0.2 and self.degrees < 3.0


def apart(line: Line, T_map_base: SE2) -> Error:
    """Compare a received pose with another one."""
    x, y, yaw = line["pose"]
    metres = math.hypot(x - T_map_base.x, y - T_map_base.y)
    return Error(metres, math.degrees(angle_error(yaw, T_map_base.yaw)))


class Lab:
    """One test: a master and programs, all ended with it."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.master = Master(folder)
        self._programs: list[Program] = []
        self._truth = folder / "truth.jsonl"

    def start(self, *command: Any) -> Program:
        """Start a program of ROS, or one that is named by its path."""
        first, *rest = map(str, command)
        log = self.folder / f"program-{len(self._programs)}.log"
        command_line = [shutil.which(first, path=PATH) or first, *rest]
        program = Program(command_line, self.master.environment, log)
        self._programs.append(program)
        return program

    def node(self, *arguments: Any) -> Program:
        """Start firstfix as users do."""
        return self.start(sys.executable, "-m", "firstfix", "ros1", *arguments)

    def robot(self, script: str, *arguments: Any) -> Program:
        """Start a robot of `scripts`."""
        return self.start(sys.executable, HERE / "ros1_robot.py", script, self._truth, *arguments)

    def watch(self, *topics: str) -> Watcher:
        """Listen to topics."""
        path = self.folder / f"watched-{len(self._programs)}.jsonl"
        program = self.start(sys.executable, HERE / "ros1_watcher.py", path, *topics)
        return Watcher(path, program)

    def truth_at(self, stamp: float) -> SE2:
        """Return where the robot was at a scan."""
        # A message may be here before the line of its scan.
        poses = wait_until(lambda: self._truth_from(stamp), lambda: "no truth so late")
        return SE2(*poses[0][1:])

    def error_of(self, line: Line) -> Error:
        """Return the error of a received pose."""
        return apart(line, self.truth_at(line["stamp"]))

    def end(self) -> None:
        """End everything."""
        for program in self._programs:
            program.send(signal.SIGTERM)  # all at a time, which is faster
        for program in self._programs:
            program.end()
        self.master.end()

    def _truth_from(self, stamp: float) -> list[list[float]]:
        whole = self._truth.read_text(encoding="utf-8").rpartition("\n")[0]
        poses = map(json.loads, whole.splitlines())
        later = [pose for pose in poses if pose[0] >= stamp - _ROUNDED_S]
        assert not later or later[0][0] <= stamp + _ROUNDED_S, "the stamp is not that of a scan"
        return later
