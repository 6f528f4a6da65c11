"""Figures of the processes of a soak: memory, processor time, log messages."""

from __future__ import annotations

import itertools
import re
from collections import Counter, defaultdict
from typing import Any

import numpy as np

# Shorter lives do not show growth of memory, s.
_LONG_LIFE_S = 300.0

Row = dict[str, Any]


def lives(samples: list[Row], who: str, began: float) -> list[Row]:
    """Return memory, threads and files over each life of a process, in order."""
    grouped: dict[int, list[Row]] = defaultdict(list)
    for sample in samples:
        if sample["who"] == who:
            grouped[sample["pid"]].append(sample)
    found = []
    for life in grouped.values():
        at, memory = np.array([(s["at"], s["rss_mb"]) for s in life]).T
        settled = at > at[0] + 60.0
        slope = None
        if at[-1] - at[0] > _LONG_LIFE_S:
            slope = float(np.polyfit(at[settled] / 3600.0, memory[settled], 1)[0])
        found.append(
            {
                "from_s": float(at[0] - began),
                "seconds": float(at[-1] - at[0]),
                "mb_after_a_minute": float(memory[settled][0]) if settled.any() else None,
                "mb_at_the_end": float(memory[-1]),
                "mb_most": float(memory.max()),
                "mb_an_hour": slope,
                "threads_most": max(s["threads"] for s in life),
                "threads_at_the_end": life[-1]["threads"],
                "files_most": max(s["files"] for s in life),
                "files_at_the_end": life[-1]["files"],
            }
        )
    return found


def memory_of_lives(samples: list[Row], began: float) -> list[list[tuple[float, float]]]:
    """Return time and memory of the node, a list for each of its lives."""
    grouped: dict[int, list[tuple[float, float]]] = defaultdict(list)
    for sample in samples:
        if sample["who"] == "node":
            grouped[sample["pid"]].append((sample["at"] - began, sample["rss_mb"]))
    return list(grouped.values())


def parts(samples: list[Row]) -> list[Row]:
    """Return the processor time of each process, as a fraction of a core, and its memory."""
    found = []
    for who in sorted({sample["who"] for sample in samples}):
        own = [sample for sample in samples if sample["who"] == who]
        found.append({"who": who, "cpu": cpu(own), "mb_most": max(s["rss_mb"] for s in own)})
    return found


def cpu(samples: list[Row]) -> float:
    """Return the processor time of successive lives as a fraction of a core."""
    used = passed = 0.0
    for a, b in itertools.pairwise(samples):
        if a["pid"] == b["pid"]:
            used, passed = used + b["cpu_s"] - a["cpu_s"], passed + b["at"] - a["at"]
    return used / passed if passed else 0.0


_SAID = re.compile(r"\[(DEBUG|INFO|WARN|ERROR|FATAL)\] \[[\d.]+\]: (.*)")
_FOLDERS = re.compile(r"(?<![\w:/])(/[\w.-]+)+/(?=[\w.-])")
_COLOUR = re.compile(r"\x1b\[[\d;]*m")


def log(logs: list[list[str]]) -> list[Row]:
    """Count the log messages of the processes, without those of level INFO."""
    counted: Counter[tuple[str, str, str]] = Counter()
    for who, text in logs:
        # Paths of this machine do not belong in a report.
        for line in _FOLDERS.sub("", _COLOUR.sub("", text)).splitlines():
            found = _SAID.match(line.strip())
            level, said = found.groups() if found else ("", line.strip())
            if said and level not in ("DEBUG", "INFO"):
                counted[who, level, without_numbers(said)[:160]] += 1
    return [
        {"who": who, "level": level, "text": text, "n": n}
        for (who, level, text), n in sorted(
            counted.items(), key=lambda item: (item[0][0], -item[1])
        )
        if who != "roscore"
    ]


def without_numbers(text: str) -> str:
    """Replace numbers, so that messages that differ only in numbers are equal."""
    return re.sub(r"\d+(\.\d+)?(e[+-]?\d+)?", "N", text)
