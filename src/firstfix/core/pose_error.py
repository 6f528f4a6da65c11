"""The error of an estimated pose."""

from __future__ import annotations

from dataclasses import dataclass

from firstfix.core.angles import angle_error
from firstfix.core.se2 import SE2


@dataclass(frozen=True, slots=True)
class PoseError:
    """Distance of a pose from the truth.

    Parameters
    ----------
    metres : float
        Of position, m; inf where there is no pose.
    radians : float
        Of heading, rad, never negative; inf where there is no pose.
    """

    metres: float
    radians: float

    @classmethod
    def between(cls, pose: SE2, truth: SE2) -> PoseError:
        """Measure the error of a pose against the truth."""
        return cls(pose.distance_to(truth), angle_error(pose.yaw, truth.yaw))

    def is_within(self, tolerance: PoseError) -> bool:
        """Tell whether both parts are below those of a tolerance."""
        return self.metres < tolerance.metres and self.radians < tolerance.radians
