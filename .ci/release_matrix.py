#!/usr/bin/env python3
"""Installs the wheel of dist/ for every Python there is, with lowest and highest dependencies.

``make release-matrix``. Pythons are those of the variable PYTHONS, or python3.10 to python3.13 on
PATH. Each gets clean environments; in each .ci/smoke.py tries what a user would. Prints a table
(times are processor times of a whole process); the exit status is 1 if something did not work.
"""

from __future__ import annotations

import email
import json
import os
import shutil
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
NAMES = "python3.10 python3.11 python3.12 python3.13"
HEAD = (
    "Python",
    "dependencies",
    "numpy",
    "numba",
    "MiB",
    "import ms",
    "first locate s",
    "next s",
    "ok",
)


def main() -> int:
    """Try all, and print the table."""
    (wheel,) = (ROOT / "dist").glob("*.whl")
    uv = shutil.which(
        "uv", path=os.pathsep.join((str(Path(sys.executable).parent), os.environ["PATH"]))
    )
    if uv is None:
        sys.exit("expected uv next to this Python or on PATH: pip install uv")
    rows, failed = [], 0
    for name in os.environ.get("PYTHONS", NAMES).split():
        version = _version(name)
        for resolution in ("lowest-direct", "highest"):
            if version is None:
                rows.append((name, resolution, *["-"] * 6, "not found"))
                continue
            with tempfile.TemporaryDirectory(prefix="firstfix-matrix-") as folder:
                row, trouble = _try(uv, name, resolution, wheel, Path(folder) / "venv")
            rows.append((version, resolution, *row))
            failed += bool(trouble)
            print(*rows[-1], trouble, file=sys.stderr, flush=True)
    print(f"| {' | '.join(HEAD)} |", f"|{'---|' * len(HEAD)}", sep="\n")
    for row in rows:
        print(f"| {' | '.join(row)} |")
    return int(failed > 0)


def _version(name: str) -> str | None:
    ask = [name, "-c", "import platform; print(platform.python_version())"]
    try:
        return subprocess.run(ask, capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return None


def _needs(wheel: Path) -> list[str]:
    """Return what the wheel depends on: `lowest-direct` counts only what is named to uv itself."""
    with zipfile.ZipFile(wheel) as archive:
        (name,) = (name for name in archive.namelist() if name.endswith(".dist-info/METADATA"))
        needs = email.message_from_bytes(archive.read(name)).get_all("Requires-Dist", [])
    return [need for need in needs if "extra ==" not in need]


def _try(uv: str, name: str, resolution: str, wheel: Path, venv: Path) -> tuple[list[str], str]:
    """Return the cells of a row, and what went wrong."""
    python = shutil.which(name) or name
    steps = (
        (uv, "venv", "--quiet", "--python", python, venv),
        (
            uv,
            "pip",
            "install",
            "--quiet",
            "--only-binary",
            ":all:",
            "--python",
            venv / "bin/python",
            "--resolution",
            resolution,
            wheel,
            *_needs(wheel),
        ),
    )
    for step in steps:
        done = subprocess.run(
            [str(part) for part in step], capture_output=True, text=True, check=False
        )
        if done.returncode:
            return ["-"] * 6 + ["no"], done.stderr
    size = sum(path.stat().st_size for path in venv.rglob("site-packages/**/*") if path.is_file())
    smoke = [str(venv / "bin/python"), str(ROOT / ".ci/smoke.py")]
    done = subprocess.run(smoke, capture_output=True, text=True, check=False, cwd=venv)
    if done.returncode:
        return ["-"] * 2 + [f"{size / 2**20:.0f}"] + ["-"] * 3 + ["no"], done.stdout + done.stderr
    measured = json.loads(done.stdout.splitlines()[-1])
    return [
        measured["numpy"],
        measured["numba"],
        f"{size / 2**20:.0f}",
        f"{measured['import_ms']:.1f}",
        f"{measured['cold_s']:.1f}",
        f"{measured['warm_s']:.1f}",
        "yes",
    ], ""


if __name__ == "__main__":
    sys.exit(main())
