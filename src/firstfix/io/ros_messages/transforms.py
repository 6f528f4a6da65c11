"""3D transforms as matrices, and their projection onto the floor."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from firstfix.core.se2 import SE2
from firstfix.io.ros_messages.incoming import StampedTransform


def matrix(transform: StampedTransform) -> NDArray[np.float64]:
    """Return ``T_parent_child`` of a transform, shape (4, 4)."""
    x, y, z, w = transform.rotation
    T = np.eye(4)
    T[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    T[:3, 3] = transform.translation
    return T


def inverse(T: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the inverse of a rigid transform, shape (4, 4)."""
    inverse = np.eye(4)
    inverse[:3, :3] = T[:3, :3].T
    inverse[:3, 3] = -T[:3, :3].T @ T[:3, 3]
    return inverse


def flat(T: NDArray[np.float64]) -> SE2:
    """Project a 3D transform, shape (4, 4), onto the floor: x, y and the yaw of its x axis."""
    return SE2(float(T[0, 3]), float(T[1, 3]), math.atan2(T[1, 0], T[0, 0]))
