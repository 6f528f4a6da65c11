"""A buffer of transforms, looked up at the stamp of a scan; the part of tf2 that a node needs."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections import deque
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from firstfix.io.ros_messages.incoming import FARTHEST_M, StampedTransform
from firstfix.io.ros_messages.transforms import inverse, matrix

KEPT_S = 10.0
"""How long moving transforms are kept, s; the same as in tf2."""


@dataclass(frozen=True, slots=True)
class LookupFailure:
    """Why a transform is unknown.

    Parameters
    ----------
    why : str
        For people: the missing link or time.
    later : bool
        True if newer transforms will make it known.
    """

    why: str
    later: bool = False


@dataclass(eq=False, slots=True)
class _Edge:
    """``T_parent_child`` of one child: one if it is fixed, else those of the last seconds."""

    parent: str
    fixed: bool
    moves: deque[StampedTransform] = field(default_factory=deque)

    def add(self, new: StampedTransform) -> None:
        if self.fixed or not self.moves or new.stamp > self.moves[-1].stamp:
            if self.fixed:
                self.moves.clear()
            self.moves.append(new)
        else:
            # Two nodes publish one link, or a message was late.
            at = bisect_left(self.moves, new.stamp, key=_stamp)
            if self.moves[at].stamp == new.stamp:
                self.moves[at] = new
            else:
                self.moves.insert(at, new)
        while self.moves[-1].stamp - self.moves[0].stamp > KEPT_S:
            self.moves.popleft()


class TransformBuffer:
    """Frames of one robot; the newest parent of a frame is used."""

    def __init__(self) -> None:
        self._edges: dict[str, _Edge] = {}

    def add(self, transform: StampedTransform) -> None:
        """Add a transform from ``tf``; messages may arrive out of order.

        Parameters
        ----------
        transform : StampedTransform
            Ignored if a number is not finite, or beyond `FARTHEST_M`.
        """
        self._add(transform, fixed=False)

    def add_static(self, transform: StampedTransform) -> None:
        """Add a transform from ``tf_static``."""
        self._add(transform, fixed=True)

    def discard_moving(self) -> None:
        """Discard all but the fixed transforms: the clock was set back."""
        self._edges = {child: edge for child, edge in self._edges.items() if edge.fixed}

    @property
    def frames(self) -> tuple[str, ...]:
        """All frames, sorted."""
        return tuple(sorted({*self._edges, *(edge.parent for edge in self._edges.values())}))

    def newest(self, target: str, source: str) -> float | LookupFailure:
        """Return the last time at which a transform is known.

        Parameters
        ----------
        target, source : str
            Frames.

        Returns
        -------
        float or LookupFailure
            s; infinite if all links are fixed.
        """
        links = self.links(target, source)
        if isinstance(links, LookupFailure):
            return links
        edges = [self._edges[frame] for frame in links]
        return min((e.moves[-1].stamp for e in edges if not e.fixed), default=math.inf)

    def links(self, target: str, source: str) -> tuple[str, ...] | LookupFailure:
        """Return the links between two frames.

        Parameters
        ----------
        target, source : str
            Frames.

        Returns
        -------
        tuple of str or LookupFailure
            The child of each.
        """
        branches = self._branches(target, source)
        return branches if isinstance(branches, LookupFailure) else (*branches[0], *branches[1])

    def at(self, target: str, source: str, stamp: float) -> NDArray[np.float64] | LookupFailure:
        """Chain transforms at a time, interpolated where they move.

        Parameters
        ----------
        target, source : str
            Frames.
        stamp : float
            Time, s.

        Returns
        -------
        ndarray, shape (4, 4), or LookupFailure
            ``T_target_source`` in space.
        """
        branches = self._branches(target, source)
        if isinstance(branches, LookupFailure):
            return branches
        T_top = []
        for branch in branches:
            T_top_frame = np.eye(4)
            for frame in branch:
                link = self._link(frame, stamp)
                if isinstance(link, LookupFailure):
                    return link
                T_top_frame = link @ T_top_frame
            T_top.append(T_top_frame)
        T_top_target, T_top_source = T_top
        return inverse(T_top_target) @ T_top_source

    def _add(self, new: StampedTransform, *, fixed: bool) -> None:
        is_finite = all(map(math.isfinite, (new.stamp, *new.rotation)))
        if not (is_finite and all(abs(v) <= FARTHEST_M for v in new.translation)):
            return
        edge = self._edges.get(new.child)
        if edge is None or edge.parent != new.parent or edge.fixed != fixed:
            edge = self._edges[new.child] = _Edge(new.parent, fixed)
        edge.add(new)

    def _branches(self, target: str, source: str) -> tuple[list[str], list[str]] | LookupFailure:
        """Return the frames from each of two up to their lowest common ancestor, without it."""
        up = {frame: self._ancestors(frame) for frame in (target, source)}
        above_target = set(up[target])
        top = next((frame for frame in up[source] if frame in above_target), None)
        if top is not None:
            return up[target][: up[target].index(top)], up[source][: up[source].index(top)]
        lost = [frame for frame in up if len(up[frame]) == 1 and frame not in self.frames]
        if lost:
            listed = ", ".join(self.frames) or "none"
            return LookupFailure(
                f"no transform has the frame {' and '.join(lost)}; known frames: {listed}"
            )
        below = [f"{frame} (below {frames[-1]})" for frame, frames in up.items()]
        return LookupFailure(f"no transforms join {' and '.join(below)}")

    def _ancestors(self, frame: str) -> list[str]:
        """Return a frame and its ancestors, up to the root, or around a loop once."""
        frames = [frame]
        while (edge := self._edges.get(frames[-1])) is not None and edge.parent not in frames:
            frames.append(edge.parent)
        return frames

    def _link(self, frame: str, stamp: float) -> NDArray[np.float64] | LookupFailure:
        edge = self._edges[frame]
        moves = edge.moves
        if edge.fixed:
            return matrix(moves[0])
        at = bisect_left(moves, stamp, key=_stamp)
        link = f"the transform from {edge.parent} to {frame}"
        if at == len(moves):
            late = stamp - moves[-1].stamp
            return LookupFailure(f"{link} is {late:.3f} s older than the scan", later=True)
        if moves[at].stamp == stamp:
            return matrix(moves[at])
        if at == 0:
            return LookupFailure(
                f"{link} is known only from {moves[0].stamp - stamp:.3f} s later on"
            )
        return matrix(_between(moves[at - 1], moves[at], stamp))


def _stamp(transform: StampedTransform) -> float:
    return transform.stamp


def _between(a: StampedTransform, b: StampedTransform, stamp: float) -> StampedTransform:
    """Interpolate: a straight line, and the shorter arc between the rotations."""
    share = (stamp - a.stamp) / (b.stamp - a.stamp)
    p, q = np.array(a.rotation), np.array(b.rotation)
    if p @ q < 0.0:
        q = -q
    angle = math.acos(min(1.0, float(p @ q)))
    if angle > 1e-6:
        p, q = p * math.sin((1.0 - share) * angle), q * math.sin(share * angle)
    else:
        p, q = p * (1.0 - share), q * share
    rotation = p + q
    x, y, z, w = (rotation / np.linalg.norm(rotation)).tolist()
    t = [u + share * (v - u) for u, v in zip(a.translation, b.translation, strict=True)]
    return StampedTransform(a.parent, a.child, stamp, (t[0], t[1], t[2]), (x, y, z, w))
