"""What figures of a benchmark depend on besides the code: machine, versions, commit, date."""

from __future__ import annotations

import os
import platform
import re
from datetime import datetime, timezone
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

_PACKAGES = ("firstfix", "numpy", "numba", "llvmlite")
_COMMIT = re.compile(r"[0-9a-f]{40}")


def this_machine() -> dict[str, Any]:
    """Describe the machine and the software; what is unknown is None.

    Keys: ``date`` (UTC), ``cpu``, ``cores`` (usable by this process), ``memory_gb``, ``system``,
    ``python``, versions of packages, ``commit``.
    """
    return {
        "date": datetime.now(timezone.utc).date().isoformat(),
        "cpu": _cpu(),
        "cores": _cores(),
        "memory_gb": _memory_gb(),
        "system": f"{platform.system()} {platform.machine()}",
        "python": platform.python_version(),
        **{name: _version(name) for name in _PACKAGES},
        "commit": commit_of(Path(__file__)),
    }


def machine_text(machine: dict[str, Any]) -> str:
    """Put `this_machine` into one paragraph."""
    parts = [
        f"{machine['cores']} cores of {machine['cpu']}",
        f"{machine['memory_gb']} GB" if machine["memory_gb"] is not None else "memory not known",
        machine["system"],
        f"Python {machine['python']}",
        *(f"{name} {machine[name]}" for name in _PACKAGES if machine[name] is not None),
        f"commit {machine['commit'] or 'not known'}",
    ]
    return f"Measured on {machine['date']}: {', '.join(parts)}."


def commit_of(inside: Path) -> str | None:
    """Return the first ten digits of the commit that a checkout is at; None outside of one."""
    git = next((p / ".git" for p in inside.resolve().parents if (p / ".git").is_dir()), None)
    if git is None:
        return None
    head = _text(git / "HEAD")
    if not head.startswith("ref: "):
        return _short(head)
    name = head.removeprefix("ref: ").strip()
    packed = (line.split() for line in _text(git / "packed-refs").splitlines())
    known = {parts[1]: parts[0] for parts in packed if len(parts) == 2}
    return _short(_text(git / name) or known.get(name, ""))


def _short(text: str) -> str | None:
    found = _COMMIT.match(text.strip())
    return found.group()[:10] if found else None


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8", errors="replace")
    except OSError:
        return ""


def _cpu() -> str:
    found = re.search(r"^model name\s*:\s*(.+)$", _text(Path("/proc/cpuinfo")), re.MULTILINE)
    return found.group(1) if found else platform.processor() or platform.machine()


def _cores() -> int:
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _memory_gb() -> int | None:
    found = re.search(r"^MemTotal:\s*(\d+) kB", _text(Path("/proc/meminfo")), re.MULTILINE)
    return round(int(found.group(1)) * 1024 / 1e9) if found else None


def _version(name: str) -> str | None:
    try:
        return version(name)
    except PackageNotFoundError:
        return None
