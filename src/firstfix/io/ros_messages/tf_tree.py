"""The fixed transforms and the odometry of a whole log."""

from __future__ import annotations

import math
from array import array
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from firstfix.core.se2 import SE2
from firstfix.core.trajectory import Trajectory
from firstfix.io.ros_messages.incoming import StampedTransform, planar
from firstfix.io.ros_messages.poses import chain
from firstfix.io.ros_messages.transforms import flat, inverse, matrix

BASE_NAMES = ("base_link", "base_footprint")

# ROS 1 bags repeat static transforms on /tf, and a suspension adds some play. Less than half a
# cell of a fine map (2 cm) and a degree cannot be seen in a scan.
MAX_PLAY_M = 0.02
MAX_PLAY_RAD = math.radians(1.0)


@dataclass(eq=False, slots=True)
class _Edge:
    """One parent-child pair: its first transform, whether it moved, and the whole path."""

    first: StampedTransform
    fixed: bool
    path: array[float] = field(default_factory=lambda: array("d"))


class TransformTree:
    """Transforms of a log: added one by one, then looked up.

    Frames are fixed to each other if the transform between them never changed by more than
    `MAX_PLAY_M` and `MAX_PLAY_RAD`. Those whose parent is an odometry frame (``odom`` in its
    name) count as moving even if the robot stood still.
    """

    def __init__(self) -> None:
        self._edges: dict[tuple[str, str], _Edge] = {}

    def add(self, transforms: Iterable[StampedTransform]) -> None:
        """Add transforms, in any order."""
        for new in transforms:
            if is_odometry_frame(new.parent):
                self.add_odometry((new,))
                continue
            edge = self._edges.get((new.parent, new.child))
            if edge is None:
                self._edges[new.parent, new.child] = _Edge(new, fixed=_is_known(new))
            elif edge.fixed:
                edge.fixed = _alike(edge.first, new)

    def add_odometry(self, transforms: Iterable[StampedTransform]) -> None:
        """Add transforms that are odometry, whatever the names of their frames."""
        for new in transforms:
            edge = self._edges.setdefault((new.parent, new.child), _Edge(new, fixed=False))
            edge.fixed = False
            edge.path.extend((new.stamp, *planar(new)))

    def fixed(self, target: str, source: str) -> NDArray[np.float64] | None:
        """Chain fixed transforms, whatever direction they were published in.

        Parameters
        ----------
        target, source : str
            Frames.

        Returns
        -------
        ndarray, shape (4, 4), or None
            ``T_target_source`` in space; None if the frames are not fixed to each other.
        """
        reached = {target: np.eye(4)}
        front = [target]
        while front and source not in reached:
            frame = front.pop()
            for neighbour, T_frame_neighbour in self._neighbours(frame):
                if neighbour not in reached:
                    reached[neighbour] = reached[frame] @ T_frame_neighbour
                    front.append(neighbour)
        return reached.get(source)

    def base_of(self, laser: str) -> str | None:
        """Return the frame of the robot to which a sensor is fixed.

        Parameters
        ----------
        laser : str
            Frame of the sensor.

        Returns
        -------
        str or None
            A ``base_link``, else a ``base_footprint`` (in any namespace), else a frame that
            odometry moves; None if the sensor is fixed to none of them.
        """
        return next((f for f in self.bases(laser) if self.fixed(f, laser) is not None), None)

    def bases(self, *others: str) -> list[str]:
        """Return the frames that may be the robot: first those by name, then those that move.

        Parameters
        ----------
        *others : str
            Frames that count though no transform has them.
        """
        frames = sorted({*others, *(frame for key in self._edges for frame in key)})
        named = [f for name in BASE_NAMES for f in frames if f.rpartition("/")[2] == name]
        return named + sorted(child for (_, child), edge in self._edges.items() if edge.path)

    def odometry(self, base: str) -> Trajectory | None:
        """Return the odometry of the base.

        Parameters
        ----------
        base : str
            A frame of the robot.

        Returns
        -------
        Trajectory or None
            ``T_odom_base`` in the order of the stamps, each stamp once; None where no odometry
            frame moves the base or a frame fixed to it.
        """
        paths = [key for key, edge in self._edges.items() if edge.path]
        for parent, child in sorted(paths, key=lambda key: (key[1] != base, *key)):
            T_child_base = self.fixed(child, base)
            if T_child_base is not None:
                return _trajectory(self._edges[parent, child].path, flat(T_child_base))
        return None

    def _neighbours(self, frame: str) -> Iterator[tuple[str, NDArray[np.float64]]]:
        for (parent, child), edge in self._edges.items():
            if edge.fixed and parent == frame:
                yield child, matrix(edge.first)
            elif edge.fixed and child == frame:
                yield parent, inverse(matrix(edge.first))


def is_odometry_frame(name: str) -> bool:
    """Return whether a name is that of an odometry frame: ``odom``, ``robot1/odom_combined``."""
    return "odom" in name.rpartition("/")[2]


def _trajectory(path: array[float], T_child_base: SE2) -> Trajectory | None:
    rows = np.array(path, np.float64).reshape(-1, 4)
    rows = rows[np.isfinite(rows).all(axis=1)]
    stamps, first = np.unique(rows[:, 0], return_index=True)
    return Trajectory(stamps, chain(rows[first, 1:], T_child_base)) if len(stamps) else None


def _is_known(transform: StampedTransform) -> bool:
    return all(map(math.isfinite, (*transform.translation, *transform.rotation)))


def _alike(a: StampedTransform, b: StampedTransform) -> bool:
    # q and -q are one rotation; half its angle is the angle between quaternions.
    cosine = abs(sum(p * q for p, q in zip(a.rotation, b.rotation, strict=True)))
    return math.dist(a.translation, b.translation) <= MAX_PLAY_M and cosine >= math.cos(
        MAX_PLAY_RAD / 2.0
    )
