"""What the page shows at one moment."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from firstfix.amcl.particles import Particles
from firstfix.belief.belief import Belief
from firstfix.changes.counts import ChangeCounter
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
        Hash of its content.
    grid : OccupancyGrid
        The map.
    matcher : ScanMatcher
        Prepared for it.
    changes : ChangeCounter or None
        What scans contradict in it, if that is kept.
    """

    name: str
    key: str
    grid: OccupancyGrid
    matcher: ScanMatcher
    changes: ChangeCounter | None = None


@dataclass(frozen=True, eq=False, slots=True)
class RegisteredScan:
    """The scan of each sensor, and the pose of the robot at which they are drawn."""

    scans: tuple[LaserScan, ...]
    T_map_base: SE2

    @property
    def scan(self) -> LaserScan:
        """The scan of the first sensor."""
        return self.scans[0]


@dataclass(frozen=True, eq=False, slots=True)
class ParticleCloud:
    """Particles of the filter, and its pose estimate when they were last updated."""

    particles: Particles
    T_map_base: SE2


class AmclStart(Enum):
    """Whether a plain AMCL runs beside the localizer, and where it starts."""

    OFF = "off"
    POSE = "pose"  # the last pose that was published
    UNIFORM = "uniform"  # all free space


@dataclass(frozen=True, eq=False, slots=True)
class AmclEstimate:
    """The pose of a plain AMCL (``T_map_base``), and its covariance, shape (3, 3)."""

    T_map_base: SE2
    covariance: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class SimulationStatus:
    """What viewers can change in the simulation: world, sensor, clock, cover, AMCL, and a goal.

    The `path` to a goal has its corners in the map frame, m; it is empty if there is no goal.
    """

    world: str
    sensor: str
    is_paused: bool = False
    is_covered: bool = False
    amcl: AmclStart = AmclStart.OFF
    path: tuple[tuple[float, float], ...] = ()


@dataclass(frozen=True, eq=False, slots=True)
class Snapshot:
    """Everything that changes from scan to scan. Frozen, so that any thread may read it.

    Parameters
    ----------
    map : ActiveMap or None
        The map in use.
    stamp : float
        Time of the last input with an output, s.
    state : State
        The state.
    reason : str
        Why, in words.
    pose : SE2 or None
        ``T_map_base`` while the robot is localized.
    covariance : ndarray, shape (3, 3), or None
        Of x (m), y (m), yaw (rad) in the map frame.
    hypotheses : tuple of Hypothesis
        The places that fit, while there are several.
    rivals : int
        Places that fit about equally well, the best or published one included.
    chosen_by : str or None
        Source of the hint that chose the pose, until the evidence decides.
    evidence : Evidence or None
        How the scan agrees with the map.
    motion : MotionRequest or None
        The motion that would decide between the hypotheses.
    scan : RegisteredScan or None
        The last scan with a pose.
    particles : ParticleCloud or None
        The particles of the filter.
    belief : Belief or None
        Probabilities of all places of the map.
    cpu_ms : float or None
        Processor time for a scan, median of the last ones, ms.
    time_to_fix_s : float or None
        Duration of the last successful search, s.
    truth : SE2 or None
        ``T_map_base`` of a simulated robot.
    simulation : SimulationStatus or None
        None for a real robot.
    amcl : AmclEstimate or None
        What a plain AMCL believes, where one runs beside the localizer.
    """

    map: ActiveMap | None = None
    stamp: float = 0.0
    state: State = State.NO_MAP
    reason: str = "no map yet"
    pose: SE2 | None = None
    covariance: NDArray[np.float64] | None = None
    hypotheses: tuple[Hypothesis, ...] = ()
    rivals: int = 0
    chosen_by: str | None = None
    evidence: Evidence | None = None
    motion: MotionRequest | None = None
    scan: RegisteredScan | None = None
    particles: ParticleCloud | None = None
    belief: Belief | None = None
    cpu_ms: float | None = None
    time_to_fix_s: float | None = None
    truth: SE2 | None = None
    simulation: SimulationStatus | None = None
    amcl: AmclEstimate | None = None
