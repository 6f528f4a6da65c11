"""Kidnaps of recorded robots: pieces of drives joined, so that the truth jumps unreported."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from firstfix.core.pose_error import PoseError
from firstfix.core.recording import Recording
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.core.trajectory import Trajectory
from firstfix.lab.experiments.case import truth_at
from firstfix.lab.experiments.drive import known_odometry
from firstfix.lab.metrics.kidnap_trial import NEAR

# A piece is as long as a robot needs to be found and to be seen to be right for 10 s.
SHORTEST_S, LONGEST_S = 20.0, 30.0

# At lower scan rates a late answer cannot be distinguished from a late scan.
MOST_APART_S = 1.0

_TRIES = 200


@dataclass(frozen=True, slots=True)
class Unfit:
    """Why a recording cannot be spliced, in words."""

    why: str


def splice(recording: Recording, kidnaps: int, rng: np.random.Generator) -> Recording | Unfit:
    """Join random pieces of a recorded drive with ``kidnaps`` seams.

    Returns
    -------
    Recording or Unfit
        A drive that begins at 0 s; its runs number the pieces. Odometry stands still over a seam.
        The true poses on both sides of it are known and farther apart than `NEAR`.
    """
    if recording.odometry is None:
        return Unfit("no odometry")
    known = dict(known_odometry(recording))
    stretches = _stretches(recording, known)
    if not stretches:
        return Unfit(
            f"no drive of {SHORTEST_S:g} s with odometry and scans at most {MOST_APART_S:g} s apart"
        )
    pieces: list[NDArray[np.intp]] = []
    for _ in range(kidnaps + 1):
        piece = _draw(recording, stretches, pieces[-1] if pieces else None, rng)
        if piece is None:
            return Unfit("no two true poses that are far enough apart")
        pieces.append(piece)
    return _joined(recording, known, pieces)


def _stamps(recording: Recording) -> NDArray[np.float64]:
    return np.array([scan.stamp for scan in recording.scans])


def _stretches(recording: Recording, known: dict[int, SE2]) -> list[NDArray[np.intp]]:
    """Return the scans of every uninterrupted drive that is long enough."""
    stamps = _stamps(recording)
    has_odometry = np.isin(np.arange(len(stamps)), list(known))
    goes_on = (np.diff(stamps) <= MOST_APART_S) & has_odometry[:-1] & has_odometry[1:]
    if recording.runs is not None:
        goes_on &= np.diff(recording.runs) == 0
    pieces = np.split(np.arange(len(stamps)), np.flatnonzero(~goes_on) + 1)
    return [piece for piece in pieces if stamps[piece[-1]] - stamps[piece[0]] >= SHORTEST_S]


def _draw(
    recording: Recording,
    stretches: list[NDArray[np.intp]],
    before: NDArray[np.intp] | None,
    rng: np.random.Generator,
) -> NDArray[np.intp] | None:
    """Draw a piece that begins far from where the one before ended; None if there is none."""
    stamps = _stamps(recording)
    left = truth_at(recording, int(before[-1])) if before is not None else None
    room_s = np.array([stamps[s[-1]] - stamps[s[0]] - SHORTEST_S for s in stretches])
    # Evenly over the time at which a piece can begin; a stretch without any to spare counts too.
    chances = (room_s + 1.0) / (room_s + 1.0).sum()
    for _ in range(_TRIES):
        stretch = stretches[rng.choice(len(stretches), p=chances)]
        first, last = stamps[stretch[0]], stamps[stretch[-1]]
        begin_s = rng.uniform(first, last - SHORTEST_S)
        length_s = rng.uniform(SHORTEST_S, LONGEST_S)
        inside = (stamps[stretch] >= begin_s) & (stamps[stretch] <= begin_s + length_s)
        piece: NDArray[np.intp] = stretch[inside]
        entered = truth_at(recording, int(piece[0]))
        if entered is None or truth_at(recording, int(piece[-1])) is None:
            continue
        if left is None or not PoseError.between(left, entered).is_within(NEAR):
            return piece
    return None


def _joined(
    recording: Recording, known: dict[int, SE2], pieces: list[NDArray[np.intp]]
) -> Recording:
    stamps = _stamps(recording)
    over_s = float(np.median(np.concatenate([np.diff(stamps[piece]) for piece in pieces])))
    scans: list[LaserScan] = []
    odometry: list[SE2] = []
    at_s, T_odom_base = -over_s, SE2.identity()
    for piece in pieces:
        at_s += over_s
        # Here the odometry of the piece is moved to, so that it goes on where the last one ended.
        T_odom_piece = T_odom_base @ known[int(piece[0])].inverse()
        for i in piece.tolist():
            scan = recording.scans[i]
            scans.append(replace(scan, stamp=at_s + scan.stamp - stamps[piece[0]]))
            odometry.append(T_odom_piece @ known[i])
        at_s, T_odom_base = scans[-1].stamp, odometry[-1]
    chosen = np.concatenate(pieces)
    return Recording(
        scans=tuple(scans),
        odometry=Trajectory(
            np.array([scan.stamp for scan in scans]),
            np.array([pose.as_array() for pose in odometry]),
        ),
        truth=None if recording.truth is None else recording.truth[chosen],
        runs=np.repeat(np.arange(len(pieces)), [len(piece) for piece in pieces]),
    )
