"""A process that compiles kernels says so once."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = """
import numpy as np
from firstfix.fields.clearance import chessboard_clearance
for _ in range(2):
    chessboard_clearance(np.zeros((10, 10), bool))
"""


def run(cache: Path) -> str:
    """Return what a process that uses a kernel writes to stderr."""
    ended = subprocess.run(
        [sys.executable, "-c", SCRIPT],
        env={**os.environ, "NUMBA_CACHE_DIR": str(cache)},
        capture_output=True,
        text=True,
        check=True,
    )
    return ended.stderr


@pytest.mark.slow
def test_only_the_first_process_compiles_and_logs_one_line(tmp_path: Path) -> None:
    first = run(tmp_path)
    assert first.startswith("Compiling kernels, once on this machine")
    assert str(tmp_path) in first
    assert first.count("\n") == 1
    assert run(tmp_path) == ""
