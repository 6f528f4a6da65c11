"""Results of a soak: each pose against the ground truth; time, memory and log messages.

A pose is *right* within 0.5 m and 10 degrees of the true pose at the stamp of its scan. Another
pose is *stale* if the robot was just moved and the pose continues the last right one by odometry,
up to `STALE_S` after the robot stands again: the kidnap is not detected yet. All others are
*wrong*: a jump to a wrong place, or a stale pose that is kept for longer.
"""

from __future__ import annotations

import itertools
import math
from bisect import bisect_left
from collections import Counter, defaultdict
from collections.abc import Iterable
from typing import Any

import numpy as np
from soak_processes import cpu, lives, log, memory_of_lives, parts, without_numbers

from firstfix.core.angles import angle_error
from firstfix.core.se2 import SE2

RIGHT_M, RIGHT_DEG = 0.5, 10.0
STALE_S = 5.0
# A stale pose continues the one before, within what the filter changes on scans that do not fit.
_STEP_M, _STEP_RAD = 0.35, math.radians(15.0)
# Time after which a fault has no effect any more, s.
_SETTLED_S = 3.0
# Scans sent this short a time before a fault, s, may be answered after it.
_ON_THE_WAY_S = 0.5
_TOLERANCE_S = 1.0  # by which map -> odom is dated ahead
_ORDER_S = 1.0  # within which a robot executes a command

Row = dict[str, Any]


def judge(record: Row) -> Row:
    """Put the record of a soak into figures.

    Parameters
    ----------
    record : dict
        The record of `soak.py`.

    Returns
    -------
    dict
        Ready for JSON.
    """
    began = record["began"]
    truth = Truth(record["truth"])
    poses = {
        topic: Judged(truth, [row for row in record["said"] if row["topic"] == topic], topic)
        for topic in ("amcl_pose", "/tf", "initialpose")
    }
    main = poses["initialpose" if record["settings"]["mode"] == "bootstrap" else "amcl_pose"]
    faults = recoveries(record["faults"], truth, main)
    quiet = calm(faults, record["ended"])
    return {
        "settings": record["settings"],
        "machine": record["machine"],
        "seconds": record["ended"] - began,
        "poses": {topic: judged.counts for topic, judged in poses.items() if judged.rows},
        "wrong": [wrong(row, began) for judged in poses.values() for row in judged.wrong][:40],
        "stale": stale(truth, main, began),
        "lag_ms": {
            "all": spread(1e3 * row["lag"] for row in main.rows),
            "calm": spread(1e3 * row["lag"] for row in main.rows if inside(row["sent"], quiet)),
        },
        "answered_calm": answered(truth, main, quiet),
        "right_share": right_share(truth, main),
        "faults": by_kind(faults),
        "fault_list": [
            {**fault, "begin": fault["begin"] - began, "end": fault["end"] - began}
            for fault in faults
        ],
        "memory": lives(record["samples"], "node", began),
        "parts": parts(record["samples"]),
        "page": page(record, truth, quiet),
        "log": log(record["logs"]),
        "deaths": [{**death, "at": death["at"] - began} for death in record["deaths"]],
        "minutes": minutes(record, truth, main),
        "series": {
            "memory": memory_of_lives(record["samples"], began),
            "lag": [(row["at"] - began, 1e3 * row["lag"]) for row in main.rows],
        },
    }


class Truth:
    """True poses at the scans that were sent, and the times when the robot was moved."""

    def __init__(self, rows: list[Row]) -> None:
        self.scans = [row for row in rows if row["kind"] == "scan"]
        self.moved = sorted((row for row in rows if row["kind"] == "moved"), key=lambda m: m["at"])
        self._by_stamp: dict[int, list[Row]] = defaultdict(list)
        for row in self.scans:
            self._by_stamp[round(1e4 * row["stamp"])].append(row)

    def at(self, stamp: float, heard_at: float) -> Row | None:
        """Return the last scan of a stamp that was sent before; clocks that jump repeat stamps."""
        key = round(1e4 * stamp)
        near = [row for k in (key - 1, key, key + 1) for row in self._by_stamp.get(k, ())]
        return max(
            (row for row in near if row["sent"] <= heard_at), key=lambda r: r["sent"], default=None
        )

    def last_move(self, made: float) -> Row | None:
        """Return the last disturbance before a scan was taken."""
        return next((row for row in reversed(self.moved) if row["at"] <= made + 1e-3), None)


class Judged:
    """The poses of one topic, in the order of arrival."""

    def __init__(self, truth: Truth, said: list[Row], topic: str) -> None:
        self.rows: list[Row] = []
        self.unknown = 0
        before: Row | None = None
        for told in said:
            stamp = told["stamp"] - (_TOLERANCE_S if topic == "/tf" else 0.0)
            scan = truth.at(stamp, told["at"])
            if scan is None:
                self.unknown += 1
                continue
            T_odom_base, told_pose = SE2(*scan["odom"]), SE2(*told["pose"])
            T_map_base = told_pose @ T_odom_base if topic == "/tf" else told_pose
            row = {
                "topic": topic,
                "at": told["at"],
                "stamp": stamp,
                "sent": scan["sent"],
                "made": scan["made"],
                "lag": told["at"] - scan["sent"],
                "pose": T_map_base,
                "truth": SE2(*scan["pose"]),
                "odom": T_odom_base,
                "life": scan["life"],
                "phase": scan["phase"],
            }
            row["move"] = truth.last_move(row["made"])
            row["verdict"] = verdict(row, before)
            self.rows.append(row)
            before = row

    @property
    def counts(self) -> dict[str, int]:
        """Return the number of poses of each verdict."""
        counted = Counter(row["verdict"] for row in self.rows)
        return {name: counted[name] for name in ("right", "stale", "wrong")} | {
            "of no known scan": self.unknown
        }

    @property
    def wrong(self) -> list[Row]:
        """The wrong poses."""
        return [row for row in self.rows if row["verdict"] == "wrong"]


def errors(row: Row) -> tuple[float, float]:
    """Return how far a pose is from the truth, m and degrees."""
    off = math.degrees(angle_error(row["pose"].yaw, row["truth"].yaw))
    return row["pose"].distance_to(row["truth"]), off


def verdict(row: Row, before: Row | None) -> str:
    """Judge a pose, given the one before."""
    metres, degrees = errors(row)
    if metres <= RIGHT_M and degrees <= RIGHT_DEG:
        return "right"
    move = row["move"]
    if move is None or before is None or row["made"] > move["until"] + STALE_S:
        return "wrong"
    # The pose before was right until then, or was itself stale.
    was_fine = before["verdict"] == "stale" or before["verdict"] == "right"
    return "stale" if was_fine and goes_on(before, row) else "wrong"


def goes_on(before: Row, row: Row) -> bool:
    """Return whether a pose continues the one before by odometry."""
    expected: SE2 = before["pose"]
    if before["life"] == row["life"]:  # else odometry was restarted
        expected = expected @ (before["odom"].inverse() @ row["odom"])
    turned = angle_error(expected.yaw, row["pose"].yaw)
    stepped = expected.distance_to(row["pose"])
    return stepped <= _STEP_M and turned <= _STEP_RAD


def wrong(row: Row, began: float) -> Row:
    """Describe a wrong pose."""
    metres, degrees = errors(row)
    move = row["move"]
    return {
        "topic": row["topic"],
        "at_s": row["at"] - began,
        "off_m": metres,
        "off_deg": degrees,
        "phase": row["phase"],
        "moved": None if move is None else move["how"],
        "since_moved_s": None if move is None else row["made"] - move["until"],
        "pose": row["pose"].as_array().tolist(),
        "truth": row["truth"].as_array().tolist(),
    }


def stale(truth: Truth, main: Judged, began: float) -> list[Row]:
    """List, for each time that the robot was moved, how long the old pose was published."""
    listed = []
    for move in truth.moved:
        own = [r["made"] for r in main.rows if r["verdict"] == "stale" and r["move"] is move]
        held_s = max(own) - move["at"] if own else 0.0
        listed.append(
            {"at": move["at"] - began, "how": move["how"], "poses": len(own), "held_s": held_s}
        )
    return listed


def recoveries(faults: list[Row], truth: Truth, main: Judged) -> list[Row]:
    """Add to each fault when the pose was right again."""
    found = []
    right = [row for row in main.rows if row["verdict"] == "right"]
    for fault, after in zip(faults, [*faults[1:], None], strict=True):
        over = fault["end"]
        for move in truth.moved:
            if fault["begin"] - 0.05 <= move["at"] <= fault["end"] + _ORDER_S:
                over = max(over, move["until"])
        first = next((row for row in right if row["sent"] > over), None)
        found.append(
            {
                **fault,
                "over": over,
                "right_after_s": None if first is None else first["at"] - over,
                "in_time": first is not None and (after is None or first["at"] < after["begin"]),
            }
        )
    return found


def by_kind(faults: list[Row]) -> list[Row]:
    """Group faults by kind."""
    kinds: dict[str, list[Row]] = defaultdict(list)
    for fault in faults:
        kinds[fault["kind"]].append(fault)
    return [
        {
            "kind": kind,
            "n": len(group),
            "lasted_s": float(np.median([f["end"] - f["begin"] for f in group])),
            "right_after_s": spread(f["right_after_s"] for f in group),
            "next_came_first": sum(not f["in_time"] for f in group),
        }
        for kind, group in sorted(kinds.items())
    ]


def calm(faults: list[Row], ended: float) -> list[tuple[float, float]]:
    """Return the times without a fault and without the effects of one."""
    spans = []
    for fault, after in zip(faults, [*faults[1:], None], strict=True):
        if fault["in_time"]:
            begin = fault["over"] + max(_SETTLED_S, fault["right_after_s"])
            spans.append((begin, (ended if after is None else after["begin"]) - _ON_THE_WAY_S))
    return [span for span in spans if span[1] > span[0]]


def inside(at: float, spans: list[tuple[float, float]]) -> bool:
    """Return whether a time is in one of the spans."""
    i = bisect_left(spans, (at, math.inf)) - 1
    return i >= 0 and spans[i][0] <= at <= spans[i][1]


def answered(truth: Truth, main: Judged, quiet: list[tuple[float, float]]) -> Row:
    """Count the scans of calm times that have a pose."""
    told = {row["stamp"] for row in main.rows}
    keys = {round(1e4 * stamp) for stamp in told}
    sent = [scan for scan in truth.scans if inside(scan["sent"], quiet)]
    have = [s for s in sent if any(round(1e4 * s["stamp"]) + d in keys for d in (-1, 0, 1))]
    return {"scans": len(sent), "with a pose": len(have)}


def right_share(truth: Truth, main: Judged) -> float:
    """Return the fraction of all sent scans with a right published pose."""
    right = [row for row in main.rows if row["verdict"] == "right"]
    return len(right) / max(1, len(truth.scans))


def spread(values: Iterable[float | None]) -> Row | None:
    """Return median, p99 and maximum of the known values; None if there is none."""
    known = [value for value in values if value is not None]
    if not known:
        return None
    median, p99 = np.percentile(known, [50.0, 99.0]).tolist()
    return {"n": len(known), "median": median, "p99": p99, "max": max(known)}


def page(record: Row, truth: Truth, quiet: list[tuple[float, float]]) -> Row:
    """Return which frames a viewer of the page received, and which it missed."""
    seen = [row for row in record["seen"] if row["at"] >= record["began"]]
    states = [row for row in seen if row["what"] == "state"]
    at = [row["at"] for row in states]
    gaps = [(a, b) for a, b in itertools.pairwise(at) if b - a > 1.0]
    lags = []
    for row in states:
        scan = truth.at(row["stamp"], row["at"])
        if scan is not None and inside(scan["sent"], quiet):
            lags.append(1e3 * (row["at"] - scan["sent"]))
    in_calm = [b - a for a, b in gaps if any(begin <= a and b <= end for begin, end in quiet)]
    return {
        "states": len(states),
        "connections": sum(row["what"] == "open" for row in seen),
        "cuts": dict(Counter(row["why"] for row in seen if row["what"] == "cut")),
        "gaps_s": spread(b - a for a, b in gaps),
        "gaps_calm_s": spread(in_calm),
        "lag_calm_ms": spread(lags),
        "complaints": dict(
            Counter(without_numbers(r["text"]) for r in seen if r["what"] == "complaint")
        ),
    }


def minutes(record: Row, truth: Truth, main: Judged) -> list[Row]:
    """Put each minute into figures."""
    began, listed = record["began"], []
    for i in range(math.ceil((record["ended"] - began) / 60.0 - 0.01)):
        span = [(began + 60.0 * i, began + 60.0 * (i + 1))]
        own = [row for row in main.rows if inside(row["at"], span)]
        node = [s for s in record["samples"] if s["who"] == "node" and inside(s["at"], span)]
        counted = Counter(row["verdict"] for row in own)
        seen = [r["at"] for r in record["seen"] if r["what"] == "state" and inside(r["at"], span)]
        listed.append(
            {
                "minute": i + 1,
                "rss_mb": max((s["rss_mb"] for s in node), default=None),
                "cpu": cpu(node),
                "scans_hz": sum(inside(s["sent"], span) for s in truth.scans) / 60.0,
                "poses_hz": len(own) / 60.0,
                "lag_ms": spread(1e3 * row["lag"] for row in own),
                **{name: counted[name] for name in ("right", "stale", "wrong")},
                "faults": sum(inside(f["begin"], span) for f in record["faults"]),
                "page_gap_s": float(np.diff(seen).max()) if len(seen) > 1 else None,
            }
        )
    return listed
