"""What viewers may see at one moment."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from firstfix.amcl.particles import Particles
from firstfix.core.estimate import Evidence, Hypothesis
from firstfix.core.grid import OccupancyGrid
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.global_localization.scan_matcher import ScanMatcher
from firstfix.localizer.outputs import MotionRequest
from firstfix.localizer.states import State


@dataclass(frozen=True, eq=False, slots=True)
class ActiveMap:
    """The map in use.

    Parameters
    ----------
    name : str
        Its name, for people and requests.
    key : str
        What tells it from others.
    grid : OccupancyGrid
        The map.
    matcher : ScanMatcher
        Prepared for it.
    """

    name: str
    key: str
    grid: OccupancyGrid
    matcher: ScanMatcher


@dataclass(frozen=True, eq=False, slots=True)
class RegisteredScan:
    """A scan where it was believed to be taken."""

    scan: LaserScan
    T_map_base: SE2


@dataclass(frozen=True, eq=False, slots=True)
class ParticleCloud:
    """A belief, and the pose that was taken from it when it was new."""

    particles: Particles
    T_map_base: SE2


@dataclass(frozen=True, eq=False, slots=True)
class Snapshot:
    """All that changes from scan to scan; frozen, so that any thread may read it.

    Parameters
    ----------
    map : ActiveMap or None
        The map in use.
    stamp : float
        Time of the newest input that led to something, s.
    state : State
        The state.
    reason : str
        Why, in words.
    pose : SE2 or None
        ``T_map_base``, while there is one belief.
    covariance : ndarray, shape (3, 3), or None
        Of it.
    hypotheses : tuple of Hypothesis
        While there are several.
    evidence : Evidence or None
        How the scan agrees with the map.
    motion : MotionRequest or None
        What would decide between the hypotheses.
    scan : RegisteredScan or None
        The newest scan that was believed to be somewhere.
    particles : ParticleCloud or None
        The particles.
    cpu_ms : float or None
        Processor time for a scan, median of the last ones, ms.
    time_to_fix_s : float or None
        Of the last search that found the robot.
    truth : SE2 or None
        ``T_map_base`` of a simulated robot.
    paused : bool
        True while its clock stands still.
    """

    map: ActiveMap | None = None
    stamp: float = 0.0
    state: State = State.NO_MAP
    reason: str = "no map yet"
    pose: SE2 | None = None
    covariance: NDArray[np.float64] | None = None
    hypotheses: tuple[Hypothesis, ...] = ()
    evidence: Evidence | None = None
    motion: MotionRequest | None = None
    scan: RegisteredScan | None = None
    particles: ParticleCloud | None = None
    cpu_ms: float | None = None
    time_to_fix_s: float | None = None
    truth: SE2 | None = None
    paused: bool = False
