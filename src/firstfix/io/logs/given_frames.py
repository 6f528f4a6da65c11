"""What a person states about the frames of a log that the log does not state itself."""

from __future__ import annotations

from dataclasses import dataclass

from firstfix.core.points import DEFAULT_BAND_M
from firstfix.core.scan import Mounting
from firstfix.core.se2 import SE2


@dataclass(frozen=True, slots=True)
class GivenFrames:
    """Frames and pose of a sensor; what is None comes from the transforms of the log.

    Parameters
    ----------
    T_base_laser : SE2 or None
        Pose of the sensor on the robot.
    mounting : Mounting
        Which way up it is; used with ``T_base_laser`` only.
    base : str or None
        Frame of the robot.
    laser : str or None
        Frame of the sensor, in place of the one in its messages.
    band : tuple of float
        Lowest and highest height above the base of 3D points that are used, m.
    """

    T_base_laser: SE2 | None = None
    mounting: Mounting = Mounting.UPRIGHT
    base: str | None = None
    laser: str | None = None
    band: tuple[float, float] = DEFAULT_BAND_M

    @property
    def any(self) -> bool:
        """True if something is given."""
        return any(part is not None for part in (self.T_base_laser, self.base, self.laser))
