"""The outputs of a localizer."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from firstfix.core.estimate import Evidence, Hypothesis
from firstfix.core.grid import OccupancyGrid
from firstfix.core.se2 import SE2
from firstfix.localizer.states import State


@dataclass(frozen=True, eq=False, slots=True)
class InitialPose:
    """Where the robot has been found, at the start or again: the start of a track.

    Parameters
    ----------
    stamp : float
        Time of the scan, s.
    T_map_base : SE2
        Where.
    covariance : ndarray, shape (3, 3)
        Of x (m), y (m), yaw (rad) in the map frame.

    Examples
    --------
    >>> output = ff.InitialPose(0.1, ff.SE2(2.0, 1.5, 0.5), np.diag([1e-4, 1e-4, 1e-4]))
    >>> x, y, yaw = output.T_map_base
    """

    stamp: float
    T_map_base: SE2
    covariance: NDArray[np.float64] = field(repr=False)


@dataclass(frozen=True, eq=False, slots=True)
class TrackedPose:
    """Where the robot is at a scan.

    Parameters
    ----------
    stamp : float
        Time of the scan, s.
    T_map_base : SE2
        Where.
    covariance : ndarray, shape (3, 3)
        Of x (m), y (m), yaw (rad) in the map frame.
    T_map_odom : SE2
        Drift of the odometry.

    Examples
    --------
    >>> pose = ff.SE2(2.0, 1.5, 0.5)
    >>> output = ff.TrackedPose(0.1, pose, np.diag([1e-4, 1e-4, 1e-4]), T_map_odom=pose)
    >>> x, y, yaw = output.T_map_base
    """

    stamp: float
    T_map_base: SE2
    covariance: NDArray[np.float64] = field(repr=False)
    T_map_odom: SE2


@dataclass(frozen=True, eq=False, slots=True)
class Hypotheses:
    """The places where the robot may be.

    Parameters
    ----------
    stamp : float
        Time of the scan, s.
    places : tuple of Hypothesis
        Most likely first. Each has an `id`, which stays the same as long as the place is listed.
        While the robot rests and no other place comes up, the order stays the same, too.
    elsewhere : float
        Probability of a place that the belief does not hold: unmapped, or in another map.

    Examples
    --------
    >>> best = ff.ScanMatcher(grid).locate(scan).best
    >>> output = ff.Hypotheses(stamp=0.0, places=(best,))
    >>> [place.pose for place in output.places] == [best.pose]
    True
    """

    stamp: float
    places: tuple[Hypothesis, ...]
    elsewhere: float = 0.0


@dataclass(frozen=True, slots=True)
class MotionRequest:
    """The motion that is expected to decide between the places.

    Parameters
    ----------
    stamp : float
        Time of the scan, s.
    turn : float
        Turn first, rad, counter-clockwise.
    ahead : float
        Then drive, m; 0 to turn only.
    gain : float
        Entropy over the places that the view from there is expected to remove, nats.

    Examples
    --------
    >>> request = ff.MotionRequest(stamp=0.1, turn=1.57, ahead=0.5, gain=0.3)
    >>> f"turn {request.turn} rad, then drive {request.ahead} m"
    'turn 1.57 rad, then drive 0.5 m'
    """

    stamp: float
    turn: float
    ahead: float
    gain: float


@dataclass(frozen=True, slots=True)
class Status:
    """The state, and why.

    Parameters
    ----------
    stamp : float
        Time of the input that led to it, s.
    state : State
        The state.
    reason : str
        In words, for a person.
    evidence : Evidence or None
        How the scan agrees with the map at the pose in question.
    rivals : int
        Number of places that fit about equally well, the best or published one included: 1 where
        the evidence has decided, 0 where no place is known.
    chosen_by : str or None
        Source of the hint that chose the published pose, until the evidence decides.
    elsewhere : float or None
        Probability of a place that the belief does not hold: unmapped, or in another map; None
        before the first view.

    Examples
    --------
    >>> status = ff.Localizer().handle(ff.NewMap(0.0, grid))[0]
    >>> status.state.value
    'SEARCHING'
    """

    stamp: float
    state: State
    reason: str
    evidence: Evidence | None = None
    rivals: int = 0
    chosen_by: str | None = None
    elsewhere: float | None = None


@dataclass(frozen=True, eq=False, slots=True)
class MapSwitched:
    """The map that all later poses are in: of a site, before the first pose in that map.

    Parameters
    ----------
    stamp : float
        Time, s.
    map_id : str
        Its name.
    grid : OccupancyGrid
        The map.

    Examples
    --------
    >>> ff.MapSwitched(0.0, "ground", grid).map_id
    'ground'
    """

    stamp: float
    map_id: str
    grid: OccupancyGrid = field(repr=False)


@dataclass(frozen=True, slots=True)
class NamedMap:
    """A `MapSwitched` as incidents keep it: without the map.

    Parameters
    ----------
    stamp : float
        Time, s.
    map_id : str
        The name of the map.
    """

    stamp: float
    map_id: str


Output = MapSwitched | InitialPose | TrackedPose | Hypotheses | MotionRequest | Status
