"""Many planar poses at once."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from firstfix.core.angles import angle_error, wrap
from firstfix.core.se2 import SE2


def chain(poses: NDArray[np.float64], T_b_c: SE2) -> NDArray[np.float64]:
    """Chain each of many poses with one transform: ``T_a_c = T_a_b @ T_b_c``.

    Parameters
    ----------
    poses : ndarray, shape (n, 3)
        ``T_a_b``: x (m), y (m), yaw (rad); NaN rows stay NaN.
    T_b_c : SE2
        The transform that follows.

    Returns
    -------
    ndarray, shape (n, 3)
        ``T_a_c``, yaw in (-π, π].
    """
    c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    return np.column_stack(
        [
            poses[:, 0] + c * T_b_c.x - s * T_b_c.y,
            poses[:, 1] + s * T_b_c.x + c * T_b_c.y,
            wrap(poses[:, 2] + T_b_c.yaw),
        ]
    )


def alike(a: SE2, b: SE2, *, distance: float, angle: float) -> bool:
    """Say whether two poses differ by at most a distance (m) and an angle (rad)."""
    return a.distance_to(b) <= distance and angle_error(a.yaw, b.yaw) <= angle
