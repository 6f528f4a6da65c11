"""Rigid transforms of the plane."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from firstfix.core.angles import wrap
from firstfix.core.errors import InputError

# Beyond this tilt a rotation is not that of a robot on a floor.
MAX_TILT = math.radians(30.0)
# Quaternions in text files have few decimals; far from length 1 it is no quaternion.
_NORM_ERROR = 0.1


@dataclass(frozen=True, slots=True)
class SE2:
    """A pose, or the equal transform: ``T_a_b`` converts coordinates of frame b to frame a.

    Parameters
    ----------
    x, y : float
        Position of the origin of b in a, m.
    yaw : float
        Direction of the x axis of b in a, rad, counter-clockwise; stored in (-π, π].

    Examples
    --------
    >>> T_map_base = ff.SE2(2.0, 1.0, np.pi / 2)
    >>> T_base_laser = ff.SE2(0.1, 0.0, 0.0)
    >>> x, y, yaw = T_map_base @ T_base_laser
    >>> round(x, 3), round(y, 3)
    (2.0, 1.1)
    >>> T_map_base.apply(np.array([[1.0, 0.0]])).round(3)
    array([[2., 2.]])
    """

    x: float
    y: float
    yaw: float

    def __post_init__(self) -> None:
        if not (math.isfinite(self.x) and math.isfinite(self.y) and math.isfinite(self.yaw)):
            raise InputError(
                expected="a pose of finite numbers x, y, yaw",
                received=f"({self.x}, {self.y}, {self.yaw})",
                remedy="check the source of the pose",
            )
        object.__setattr__(self, "x", float(self.x))
        object.__setattr__(self, "y", float(self.y))
        object.__setattr__(self, "yaw", wrap(float(self.yaw)))

    @classmethod
    def identity(cls) -> SE2:
        """Return the identity transform."""
        return cls(0.0, 0.0, 0.0)

    @classmethod
    def from_array(cls, pose: ArrayLike) -> SE2:
        """Return the pose of an array x (m), y (m), yaw (rad), shape (3,)."""
        x, y, yaw = np.asarray(pose, np.float64).tolist()
        return cls(x, y, yaw)

    @classmethod
    def from_quaternion(cls, x: float, y: float, quaternion: Sequence[float]) -> SE2:
        """Return the pose of a position and a quaternion, as in ``geometry_msgs/Pose``.

        Parameters
        ----------
        x, y : float
            Position, m.
        quaternion : sequence of four floats
            x, y, z, w; of length 1. A tilt of up to 30 degrees is dropped.

        Raises
        ------
        InputError
            If this is no unit quaternion, or it tilts more.

        Examples
        --------
        >>> ff.SE2.from_quaternion(1.0, 2.0, (0.0, 0.0, 0.0, 1.0))
        SE2(x=1.0, y=2.0, yaw=0.0)
        """
        numbers = [float(part) for part in quaternion]
        norm = math.hypot(*numbers)
        if len(numbers) != 4 or not abs(norm - 1.0) <= _NORM_ERROR:
            raise InputError(
                expected="a quaternion x, y, z, w of length 1",
                received=f"{numbers!r:.80}",
                remedy="check the order of the numbers; no rotation is 0, 0, 0, 1",
            )
        qx, qy, qz, qw = (number / norm for number in numbers)
        if 2.0 * math.asin(min(math.hypot(qx, qy), 1.0)) > MAX_TILT:
            raise InputError(
                expected=f"a tilt of at most {math.degrees(MAX_TILT):g}° from the z axis",
                received=f"{numbers!r:.80}",
                remedy="for an upside-down sensor use Mounting.UPSIDE_DOWN",
            )
        return cls(x, y, math.atan2(2.0 * (qw * qz + qx * qy), 1.0 - 2.0 * (qy * qy + qz * qz)))

    @property
    def quaternion(self) -> tuple[float, float, float, float]:
        """The heading as a unit quaternion x, y, z, w, as in ``geometry_msgs/Pose``."""
        return 0.0, 0.0, math.sin(self.yaw / 2.0), math.cos(self.yaw / 2.0)

    def __iter__(self) -> Iterator[float]:
        """Unpack: ``x, y, yaw = pose``."""
        return iter((self.x, self.y, self.yaw))

    def __str__(self) -> str:
        # Adding zero turns -0.0 into 0.0.
        x, y = round(self.x, 2) + 0.0, round(self.y, 2) + 0.0
        return f"({x:.2f}, {y:.2f}) m {round(math.degrees(self.yaw), 1) + 0.0:.1f}°"

    def as_array(self) -> NDArray[np.float64]:
        """Return x (m), y (m), yaw (rad) as an array of shape (3,)."""
        return np.array([self.x, self.y, self.yaw])

    def __matmul__(self, other: SE2) -> SE2:
        """Compose transforms: ``T_a_c = T_a_b @ T_b_c``."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        return SE2(
            self.x + c * other.x - s * other.y,
            self.y + s * other.x + c * other.y,
            self.yaw + other.yaw,
        )

    def inverse(self) -> SE2:
        """Return the inverse: ``T_b_a`` of ``T_a_b``."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        return SE2(-c * self.x - s * self.y, s * self.x - c * self.y, -self.yaw)

    def apply(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Convert points of frame b to frame a.

        Parameters
        ----------
        points : ndarray, shape (..., 2)
            Coordinates in b, m.

        Returns
        -------
        ndarray, shape (..., 2)
            Coordinates in a, m.
        """
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        rotation = np.array([[c, -s], [s, c]])
        moved: NDArray[np.float64] = points @ rotation.T + np.array([self.x, self.y])
        return moved

    def rotation_jacobian(self) -> NDArray[np.float64]:
        """Return the matrix, shape (3, 3), that rotates (dx, dy, dyaw) from frame b to frame a."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])

    def distance_to(self, other: SE2) -> float:
        """Return the distance between the two origins, m."""
        return math.hypot(self.x - other.x, self.y - other.y)
