"""Test an installed firstfix, and print the figures as a line of JSON.

Run by the Python of the environment, outside the checkout. Everything through the installed
command, as a user would; only the tiny map and its scan are made from Python.
"""

from __future__ import annotations

import importlib.metadata
import json
import math
import os
import subprocess
import sys
import tempfile
from pathlib import Path

WHERE = (2.0, 2.0, 0.5)
MAKE = f"""
import numpy as np
import firstfix as ff
from firstfix.lab.worlds.catalog import identical_rooms

grid = identical_rooms(1)
ff.save_map(grid, "map.yaml")
scan = ff.Lidar().scan(grid, ff.SE2{WHERE}, np.random.default_rng(0))
ff.save_recording(ff.Recording((scan,)), "scan.npz")
"""
IMPORT = """
import sys, time
start = time.process_time()
import firstfix
print(time.process_time() - start)
assert "numpy" not in sys.modules
"""
PROGRAM = Path(sys.executable).parent / "firstfix"


def output_of(*command: str | Path) -> str:
    """Return the output of a command; a failure is an error."""
    done = subprocess.run(
        [str(part) for part in command], capture_output=True, text=True, check=False
    )
    if done.returncode:
        raise SystemExit(f"{command}: status {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout


def timed(*command: str | Path) -> tuple[str, float]:
    """Return the output of a command, and its processor time."""
    before = os.times()
    answer = output_of(*command)
    after = os.times()
    return answer, sum(after[2:4]) - sum(before[2:4])


def main() -> None:
    """Try it all in an empty folder, with an empty cache."""
    os.chdir(tempfile.mkdtemp(prefix="firstfix-smoke-"))
    os.environ["FIRSTFIX_CACHE_DIR"] = str(Path("cache").resolve())
    version = importlib.metadata.version("firstfix")
    assert output_of(PROGRAM, "--version").split() == ["firstfix", version]
    for command in ("locate", "track", "map", "bench", "demo", "serve", "doctor"):
        assert "--help" in output_of(PROGRAM, command, "--help")
    import_s = min(float(output_of(sys.executable, "-c", IMPORT)) for _ in range(5))

    output_of(sys.executable, "-c", MAKE)
    _, cold_s = timed(PROGRAM, "locate", "map.yaml", "scan.npz", "--json")
    answer, warm_s = timed(PROGRAM, "locate", "map.yaml", "scan.npz", "--json")
    found = json.loads(answer)
    assert found["verdict"] == "UNIQUE"
    assert math.dist(found["pose"], WHERE) < 0.05

    doctor = output_of(PROGRAM, "doctor")
    assert "ready after" in doctor
    output_of(sys.executable, "-c", "import firstfix.web.server")
    output_of(PROGRAM, "demo", "--headless")
    figures = {"import_ms": 1e3 * import_s, "cold_s": cold_s, "warm_s": warm_s}
    for package in ("numpy", "numba"):
        figures[package] = importlib.metadata.version(package)
    sys.stdout.write(json.dumps(figures) + "\n")


if __name__ == "__main__":
    main()
