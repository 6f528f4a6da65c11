"""The command line as a person meets it: on a terminal, with help and completion."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

Files = tuple[Path, Path]


def on_a_terminal(*arguments: object, **environment: str) -> tuple[int, str]:
    """Run a command on a pseudo-terminal; return its exit status, and what the terminal got."""
    pty = pytest.importorskip("pty")
    leader, follower = pty.openpty()
    process = subprocess.Popen(
        [sys.executable, "-m", "firstfix", *(str(argument) for argument in arguments)],
        stdin=follower,
        stdout=follower,
        stderr=follower,
        env={**os.environ, "TERM": "xterm-256color", "COLUMNS": "120", **environment},
    )
    os.close(follower)
    received = b""
    try:
        while part := os.read(leader, 65536):
            received += part
    except OSError:  # Linux reports the end like this
        pass
    os.close(leader)
    return process.wait(), received.decode()


GREEN, YELLOW = "\x1b[1;32m", "\x1b[1;33m"


@pytest.mark.slow
def test_a_terminal_shows_the_verdict_in_colour_and_a_table(unique: Files, alike: Files) -> None:
    status, shown = on_a_terminal("locate", *unique)
    assert status == 0
    assert f"{GREEN}UNIQUE" in shown
    assert "to prepare the map" in shown
    status, shown = on_a_terminal("locate", *alike)
    assert status == 1
    assert f"{YELLOW}AMBIGUOUS" in shown
    assert "through wall" in shown
    _, plain = on_a_terminal("locate", *unique, NO_COLOR="1")
    assert "\x1b[1;32m" not in plain


def test_the_time_to_prepare_the_map_is_apart(cli, unique: Files) -> None:
    (line,) = [line for line in cli("locate", *unique).out.splitlines() if "time" in line[:5]]
    assert re.fullmatch(
        r"time +\S+ s, after \S+ s to load the kernels and \S+ s to prepare the map", line
    )


@pytest.mark.parametrize("command", ["locate", "track", "serve", "map check", "site locate"])
def test_usage_lines_have_no_braces(cli, command: str) -> None:
    usage = cli(*command.split(), "--help").out.split("\n\n")[0]
    assert "Usage: firstfix" in usage
    assert "{" not in usage


@pytest.mark.parametrize(("shell", "words"), [("bash", "complete -o"), ("zsh", "compdef")])
def test_completion_is_installed(tmp_path: Path, shell: str, words: str) -> None:
    ended = subprocess.run(
        [sys.executable, "-m", "firstfix", "--install-completion", shell],
        env={
            **os.environ,
            "HOME": str(tmp_path),
            "_TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION": "1",
        },
        capture_output=True,
        text=True,
        check=False,
    )
    assert ended.returncode == 0, ended.stderr
    written = "".join(path.read_text() for path in tmp_path.rglob("*") if path.is_file())
    assert words in written
    assert "firstfix" in written


def test_completion_completes_a_command() -> None:
    environment = {
        "_FIRSTFIX_COMPLETE": "complete_bash",
        "COMP_WORDS": "firstfix loc",
        "COMP_CWORD": "1",
    }
    ended = subprocess.run(
        [sys.executable, "-m", "firstfix"],
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=False,
    )
    assert ended.stdout.split() == ["locate"]


def test_bench_prints_json_and_nothing_else(cli, cases: Path) -> None:
    ended = cli("bench", cases / "unique", "--limit", 1, "--json")
    assert ended.status == 0
    assert json.loads(ended.out)["cases"]
