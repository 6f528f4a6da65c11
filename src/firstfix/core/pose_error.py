"""The error of an estimated pose."""

from __future__ import annotations

from dataclasses import dataclass

from firstfix.core.angles import angle_error
from firstfix.core.se2 import SE2


@dataclass(frozen=True, slots=True)
class PoseError:
    """Distance of a pose from the ground truth.

    Parameters
    ----------
    metres : float
        Position error, m; inf without a pose.
    radians : float
        Heading error, rad, at least 0; inf without a pose.
    """

    metres: float
    radians: float

    @classmethod
    def between(cls, pose: SE2, truth: SE2) -> PoseError:
        """Return the error of a pose."""
        return cls(pose.distance_to(truth), angle_error(pose.yaw, truth.yaw))

    def is_within(self, tolerance: PoseError) -> bool:
        """Return whether position and heading error are both below a tolerance."""
        return self.metres < tolerance.metres and self.radians < tolerance.radians
