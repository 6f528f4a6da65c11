"""What a localizer has to say."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from firstfix.core.estimate import Evidence, Hypothesis
from firstfix.core.se2 import SE2
from firstfix.localizer.states import State


@dataclass(frozen=True, eq=False, slots=True)
class InitialPose:
    """The robot has been found, at the start or anew; for whoever tracks from here.

    Parameters
    ----------
    stamp : float
        Time of the scan, s.
    T_map_base : SE2
        Where.
    covariance : ndarray, shape (3, 3)
        Of x (m), y (m), yaw (rad) in the map frame.
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
    """

    stamp: float
    places: tuple[Hypothesis, ...]


@dataclass(frozen=True, slots=True)
class MotionRequest:
    """A motion after which the places would look different.

    Parameters
    ----------
    stamp : float
        Time of the scan, s.
    turn : float
        Turn first, rad, counter-clockwise.
    ahead : float
        Then drive, m; 0 to turn only.
    gain : float
        Share of the beams by which the best place would differ from the most similar other one.
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
    """

    stamp: float
    state: State
    reason: str
    evidence: Evidence | None = None
    rivals: int = 0
    chosen_by: str | None = None


Output = InitialPose | TrackedPose | Hypotheses | MotionRequest | Status
