"""The command line as a process of its own."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

Files = tuple[Path, Path]


def command(*arguments: object) -> list[str]:
    return [sys.executable, "-m", "firstfix", *(str(argument) for argument in arguments)]


def test_a_program_reads_json_from_a_pipe_and_nothing_else(
    unique: Files, cache_of_its_own: Path
) -> None:
    ended = subprocess.run(command("locate", *unique, "--json"), capture_output=True, check=True)
    assert any(cache_of_its_own.iterdir())  # and not the user's
    assert json.loads(ended.stdout)["verdict"] == "UNIQUE"
    assert ended.stderr == b""


def test_wrong_input_is_one_line_and_exit_2() -> None:
    ended = subprocess.run(
        command("locate", "no.yaml", "no.npz"), capture_output=True, text=True, check=False
    )
    assert (ended.returncode, ended.stdout) == (2, "")
    assert ended.stderr.startswith("firstfix: expected ")
    assert ended.stderr.count("\n") == 1


def test_help_loads_nothing_heavy() -> None:
    script = "import sys; from firstfix.cli.app import run; run(['--version']); print(*sys.modules)"
    ended = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    assert not {"numba", "matplotlib", "rosbags", "PIL"} & set(ended.stdout.split())


@pytest.mark.slow
def test_a_reader_that_leaves_early_is_no_error(unique: Files) -> None:
    process = subprocess.Popen(
        command("locate", *unique, "--all", "--json"),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    assert process.stdout is not None
    assert process.stderr is not None
    process.stdout.close()
    errors = process.stderr.read()
    process.stderr.close()
    process.wait(timeout=240)
    assert errors == b""


def test_ctrl_c_ends_with_130_and_no_traceback(unique: Files) -> None:
    # Interrupted where it surely is at work: a signal after some seconds would be a bet.
    # What runs in the background inherits that SIGINT is ignored: undo that first.
    script = (
        "import _thread, signal, sys; from firstfix.cli.app import run; "
        "signal.signal(signal.SIGINT, signal.default_int_handler); "
        "from firstfix.io.maps import map_server; "
        "map_server.load_map = lambda path: _thread.interrupt_main(); "
        f"sys.exit(run(['locate', {str(unique[0])!r}, {str(unique[1])!r}]))"
    )
    ended = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=False
    )
    assert ended.returncode == 130
    assert "Traceback" not in ended.stderr


def test_ctrl_c_at_the_end_of_a_process_is_too_late() -> None:
    """As the second of two, when the command has ended."""
    program = (
        "import atexit, os, signal\n"
        "from firstfix.cli import app\n"
        "app.run = lambda: 0\n"
        "atexit.register(lambda: os.kill(os.getpid(), signal.SIGINT))\n"
        "app.main()\n"
    )
    ended = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=False
    )
    assert (ended.returncode, ended.stderr) == (0, "")
