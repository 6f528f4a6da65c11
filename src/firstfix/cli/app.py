"""The command line: which commands there are, and what their ends mean.

Exit status: 0 done; 1 no answer where a pose was asked for; 2 wrong input, one sentence on
stderr; 130 interrupted.
"""

from __future__ import annotations

import gc
import logging
import os
import signal
import sys
import threading
from collections.abc import Sequence
from typing import Annotated

import typer

from firstfix import __version__
from firstfix.cli.bench import bench
from firstfix.cli.case import case_app
from firstfix.cli.demo import demo
from firstfix.cli.doctor import cache_advice, doctor
from firstfix.cli.fleet import fleet_app
from firstfix.cli.locate import locate
from firstfix.cli.map import map_app
from firstfix.cli.nodes import AFTER_DASHES, PASSED_ON, dds, ros1, ros2
from firstfix.cli.replay import replay
from firstfix.cli.serve import serve
from firstfix.cli.site import site_app
from firstfix.cli.track import track
from firstfix.cli.usage import PlainUsage
from firstfix.core.errors import FirstfixError

WRONG_INPUT = 2
# The worker thread of a node; a node that stops waits for it only a few seconds.
WORKER = "firstfix"

app = typer.Typer(
    name="firstfix",
    help="Find a robot anywhere in its map from one 2D LIDAR scan, without motion.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode="markdown",  # paragraphs flow, and what stands in brackets stays
    context_settings={"help_option_names": ["-h", "--help"]},
)
app.command(cls=PlainUsage)(locate)
app.command(cls=PlainUsage)(track)
app.command(cls=PlainUsage)(replay)
app.command(cls=PlainUsage)(bench)
app.add_typer(case_app, name="case")
app.add_typer(map_app, name="map")
app.add_typer(site_app, name="site")
app.add_typer(fleet_app, name="fleet")
app.command(cls=PlainUsage)(demo)
app.command(cls=PlainUsage, context_settings=AFTER_DASHES)(serve)
app.command(cls=PlainUsage, context_settings=PASSED_ON)(ros1)
app.command(cls=PlainUsage, context_settings=PASSED_ON)(ros2)
app.command(cls=PlainUsage)(dds)
app.command(cls=PlainUsage)(doctor)


def _show_version(asked: bool) -> None:
    if asked:
        typer.echo(f"firstfix {__version__}")
        raise typer.Exit


@app.callback()
def options(
    _version: Annotated[
        bool,
        typer.Option("--version", callback=_show_version, is_eager=True, help="Print the version."),
    ] = False,
) -> None:
    """Find a robot anywhere in its map from one 2D LIDAR scan, without motion."""


def run(arguments: Sequence[str] | None = None) -> int:
    """Run a command line, by default that of the process, and return the exit status."""
    try:
        app(args=None if arguments is None else list(arguments), prog_name="firstfix")
    except FirstfixError as error:
        # One line, whatever a file's content put into the sentence.
        typer.echo(f"firstfix: {' '.join(str(error).split())}", err=True)
        return WRONG_INPUT
    except RuntimeError as error:
        sentence = cache_advice(error)
        if sentence is None:
            raise
        typer.echo(f"firstfix: {sentence}", err=True)
        return WRONG_INPUT
    except SystemExit as end:
        return end.code if isinstance(end.code, int) else int(end.code is not None)
    return 0


def main() -> None:
    """Run the command line of this process."""
    # Loading numba makes a million objects that live to the end: looking through them for garbage
    # again and again, and once more at exit, takes a third of a short command's time.
    gc.set_threshold(200_000, 20, 100)
    if not sys.stderr.isatty():  # in a pipe no progress is shown
        logging.getLogger("firstfix.kernels").addHandler(logging.NullHandler())
    status = run()
    # A second Ctrl-C must not interrupt the end of the interpreter, whose default is to die of it.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    gc.freeze()
    if any(thread.name == WORKER for thread in threading.enumerate()):
        # It is in the compiler and would crash when the interpreter ends.
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(status)
    sys.exit(status)
