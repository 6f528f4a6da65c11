"""The inputs of a localizer; each carries its own time."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from firstfix.core.arguments import as_instance, as_pose
from firstfix.core.errors import InputError
from firstfix.core.grid import OccupancyGrid
from firstfix.core.odometry import Odometry, Signal
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.fields.map_fields import MapFields
from firstfix.global_localization.prior import Prior


@dataclass(frozen=True, eq=False, slots=True)
class NewMap:
    """The map; a later one replaces it.

    Parameters
    ----------
    stamp : float
        Time, s.
    grid : OccupancyGrid
        The map.
    map_id : str
        Its name, such as that of a floor. The localizer does not use it; nodes publish it.
    fields : MapFields or None
        The map with its fields, where it has been prepared.

    Examples
    --------
    >>> outputs = ff.Localizer().handle(ff.NewMap(0.0, grid))
    >>> outputs[0].state
    <State.SEARCHING: 'SEARCHING'>
    """

    stamp: float
    grid: OccupancyGrid
    map_id: str = ""
    fields: MapFields | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        as_instance(OccupancyGrid, self.grid, "grid")


@dataclass(frozen=True, slots=True)
class PoseHint:
    """A proposed pose, good to about a metre and 40 degrees; the next scan verifies it.

    Parameters
    ----------
    stamp : float
        Time, s.
    T_map_base : SE2
        The pose.
    source : str
        Where it comes from, in the words that people will read.
    radius, angle : float
        How far the pose may be off, m and rad.
    hypothesis_id : int or None
        The place of the last `Hypotheses` that is meant. Its pose at present replaces
        `T_map_base`; if the place is no longer listed, the hint is refused.

    Examples
    --------
    >>> hint = ff.PoseHint(0.0, ff.SE2(2.0, 1.5, 0.5), source="the operator")
    >>> outputs = ff.Localizer().handle(hint)
    """

    stamp: float
    T_map_base: SE2
    source: str = "a person"
    hypothesis_id: int | None = None
    radius: float = 1.0
    angle: float = math.radians(40.0)

    def __post_init__(self) -> None:
        object.__setattr__(self, "T_map_base", as_pose(self.T_map_base, "T_map_base"))


@dataclass(frozen=True, eq=False, slots=True)
class PositionFix:
    """A pose that something else has measured, such as a fiducial, a beacon or a dock.

    It is a prior: it adds to what the scans say, and strong evidence of the scans overrules it. The
    newest fix of a source replaces the one before.

    Parameters
    ----------
    stamp : float
        Time, s.
    T_map_base : SE2
        The pose.
    covariance : ndarray, shape (3, 3)
        Of x (m), y (m), yaw (rad) in the map frame.
    source : str
        Where it comes from, in the words that people will read.

    Examples
    --------
    >>> fix = ff.PositionFix(0.0, ff.SE2(2.0, 1.5, 0.5), np.diag([0.04, 0.04, 0.1]), "the dock")
    >>> outputs = ff.Localizer().handle(fix)
    """

    stamp: float
    T_map_base: SE2
    covariance: NDArray[np.float64] = field(repr=False)
    source: str = "a position fix"

    def __post_init__(self) -> None:
        object.__setattr__(self, "T_map_base", as_pose(self.T_map_base, "T_map_base"))


@dataclass(frozen=True, slots=True)
class Reset:
    """Discard the pose and everything seen so far, and search.

    Parameters
    ----------
    stamp : float
        Time, s.
    prior : Prior or None
        What is known of the pose: `Near`, `Region`, `AnyOf`, `All`.

    Examples
    --------
    >>> outputs = ff.Localizer().handle(ff.Reset(stamp=0.0))
    """

    stamp: float
    prior: Prior | None = None


@dataclass(frozen=True, slots=True)
class NoMotionUpdate:
    """Use the next scan although the robot has not moved.

    Parameters
    ----------
    stamp : float
        Time, s.

    Examples
    --------
    >>> localizer = ff.Localizer()
    >>> outputs = localizer.handle(ff.NoMotionUpdate(stamp=0.0))
    """

    stamp: float


@dataclass(frozen=True, slots=True)
class MapHint:
    """The map in which the robot is said to be, such as by a lift; the scans verify it.

    Only a `SiteLocalizer` has several maps.

    Parameters
    ----------
    stamp : float
        Time, s.
    map_id : str
        The map.
    source : str
        Where it comes from, in the words that people will read.
    T_map_base : SE2, optional
        The pose there, known to a metre and 40 degrees, as in a `PoseHint`.

    Examples
    --------
    >>> hint = ff.MapHint(12.0, "first", source="the lift")
    >>> ff.Localizer().handle(hint)[0].state
    <State.NO_MAP: 'NO_MAP'>
    """

    stamp: float
    map_id: str
    source: str = "a person"
    T_map_base: SE2 | None = None


Input = (
    NewMap
    | LaserScan
    | Odometry
    | Signal
    | PoseHint
    | PositionFix
    | Reset
    | NoMotionUpdate
    | MapHint
)


def check_input(given: object) -> None:
    """Raise InputError if a value is no input of a localizer."""
    if not isinstance(given, Input):
        raise InputError(
            expected="an input: NewMap, LaserScan, Odometry, Signal, PoseHint, PositionFix, "
            "Reset, NoMotionUpdate or MapHint",
            received=type(given).__name__,
            remedy="wrap it, such as ff.NewMap(stamp, grid) for a map",
        )
