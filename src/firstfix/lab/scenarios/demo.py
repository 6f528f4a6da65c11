"""The scenario of ``firstfix demo``, and its episodes judged by the truth."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from firstfix.core.estimate import Hypothesis
from firstfix.core.grid import OccupancyGrid
from firstfix.core.odometry import Signal, SignalKind
from firstfix.core.pose_error import PoseError
from firstfix.core.se2 import SE2
from firstfix.lab.metrics.outcome import is_found
from firstfix.lab.scenarios.disturbances import CarryTo, Teleport
from firstfix.lab.scenarios.phases import DriveTo, Stand
from firstfix.lab.scenarios.scenario import Scenario, run
from firstfix.lab.simulation.simulation import Disturbance
from firstfix.localizer.inputs import NewMap
from firstfix.localizer.localizer import Localizer
from firstfix.localizer.outputs import Hypotheses, InitialPose, Output, TrackedPose
from firstfix.localizer.replay import replay

# The robot wakes up, drives to two goals, is carried away and drives on. Then it is teleported, and
# no sensor reports it.
SCRIPT = (
    Stand(2.0),
    DriveTo(),
    DriveTo(),
    CarryTo(seconds=4.0),
    Stand(3.0),
    DriveTo(),
    Teleport(),
    Stand(3.0),
    DriveTo(),
)


# A place fits about as well as the best one with at least this part of its probability.
_COMPARABLE = 0.5


@dataclass(frozen=True, slots=True)
class DemoStep:
    """One scan of the demo.

    Parameters
    ----------
    stamp : float
        Time, s.
    truth : SE2
        ``T_map_base``.
    published : SE2 or None
        The published pose.
    initial : SE2 or None
        The pose at which the robot was found with this scan.
    episode : int
        Number of kidnaps so far.
    lifted : bool
        True while a wheel-drop sensor reports that the robot is lifted.
    cpu_s : float
        Processor time of the localizer, s.
    places : tuple of Hypothesis
        The places that fit, most likely first; empty if a pose is published.
    """

    stamp: float
    truth: SE2
    published: SE2 | None
    initial: SE2 | None
    episode: int
    lifted: bool
    cpu_s: float
    places: tuple[Hypothesis, ...] = ()

    @property
    def is_right(self) -> bool:
        """True if a pose was published, and it is the true one."""
        return self.published is not None and is_found(self.published, self.truth)


@dataclass(frozen=True, slots=True)
class Episode:
    """The time from the start, or from a kidnap, to the next kidnap.

    Parameters
    ----------
    began_s : float
        Time of the first scan on the floor, s.
    truth : SE2
        ``T_map_base`` at that time.
    noticed_s : float or None
        Time from then until the old pose was given up, s; 0 if before; None if never.
    found_s : float or None
        Time from then until the right pose was published, s; None if never.
    found_error_m, found_error_deg : float
        Error of that pose; NaN if there was none.
    wrong_finds : int
        How often a wrong pose was published as found.
    kept : float
        Share of the scans after it was found with a right pose, 0 to 1; NaN if there is none.
    rmse_m, rmse_deg : float
        Errors of all poses after it was found; NaN if there is none.
    equal_places : tuple of Hypothesis
        If no pose was ever published: the places that fitted about equally well at the end, the
        true one among them; else empty.
    """

    began_s: float
    truth: SE2
    noticed_s: float | None
    found_s: float | None
    found_error_m: float
    found_error_deg: float
    wrong_finds: int
    kept: float
    rmse_m: float
    rmse_deg: float
    equal_places: tuple[Hypothesis, ...] = ()

    @property
    def is_tracked(self) -> bool:
        """True if the robot was found at the right place only, and tracked to the end."""
        return self.found_s is not None and self.wrong_finds == 0 and self.kept > 0.99

    @property
    def is_correctly_ambiguous(self) -> bool:
        """True if several places fitted equally well, the true one too, and none was published."""
        return len(self.equal_places) > 1


def run_demo(grid: OccupancyGrid, seed: int, localizer: Localizer) -> Iterator[DemoStep]:
    """Run the demo in a building; a new localizer gets the map, then all that the robot reports."""
    localizer.handle(NewMap(0.0, grid))
    episode = 0
    lifted: set[SignalKind] = set()
    places: tuple[Hypothesis, ...] = ()
    for moment in run(Scenario(SCRIPT), grid, seed):
        began = time.process_time()
        outputs: list[Output] = []
        for event, answers in replay(iter(moment.events), localizer):
            outputs += answers
            if isinstance(event, Signal) and event.kind.means_lifted:
                # The episode of a carried robot begins with the first sensor that notices.
                episode += event.active and not lifted
                (lifted.add if event.active else lifted.discard)(event.kind)
        cpu_s = time.process_time() - began
        if moment.disturbance is Disturbance.TELEPORTED:
            episode += 1
        tracked = [output for output in outputs if isinstance(output, TrackedPose)]
        found = [output for output in outputs if isinstance(output, InitialPose)]
        listed = [output for output in outputs if isinstance(output, Hypotheses)]
        if tracked or listed:
            places = () if tracked else listed[-1].places
        yield DemoStep(
            stamp=moment.stamp,
            truth=moment.T_map_base,
            published=tracked[-1].T_map_base if tracked else None,
            initial=found[-1].T_map_base if found else None,
            episode=episode,
            lifted=bool(lifted),
            cpu_s=cpu_s,
            places=places,
        )


def summarize_episodes(steps: Sequence[DemoStep]) -> list[Episode]:
    """Sum up each episode, in order; the steps are in the order of their stamps."""
    numbers = sorted({step.episode for step in steps})
    return [_summarize([step for step in steps if step.episode == number]) for number in numbers]


def _summarize(steps: list[DemoStep]) -> Episode:
    seeing = [step for step in steps if not step.lifted] or steps
    began = seeing[0].stamp
    given_up = [step for step in seeing if step.published is None or step.is_right]
    found = next((i for i, step in enumerate(seeing) if step.is_right), None)
    after = seeing[found:] if found is not None else []
    errors = [
        PoseError.between(step.published, step.truth)
        for step in after
        if step.published is not None
    ]
    metres = np.array([error.metres for error in errors])
    degrees = np.degrees([error.radians for error in errors])
    return Episode(
        began_s=began,
        truth=seeing[0].truth,
        noticed_s=given_up[0].stamp - began if given_up else None,
        found_s=seeing[found].stamp - began if found is not None else None,
        found_error_m=float(metres[0]) if len(metres) else math.nan,
        found_error_deg=float(degrees[0]) if len(degrees) else math.nan,
        wrong_finds=sum(
            step.initial is not None and not is_found(step.initial, step.truth) for step in steps
        ),
        kept=sum(step.is_right for step in after) / len(after) if after else math.nan,
        rmse_m=float(np.sqrt(np.mean(np.square(metres)))) if len(metres) else math.nan,
        rmse_deg=float(np.sqrt(np.mean(np.square(degrees)))) if len(degrees) else math.nan,
        equal_places=_equal_places(seeing),
    )


def _equal_places(steps: list[DemoStep]) -> tuple[Hypothesis, ...]:
    last = steps[-1]
    if any(step.published is not None for step in steps):
        return ()
    best = max((place.probability for place in last.places), default=0.0)
    equal = tuple(p for p in last.places if p.probability >= _COMPARABLE * best)
    return equal if any(is_found(place.pose, last.truth) for place in equal) else ()
