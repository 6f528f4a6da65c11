"""Playing the story of `firstfix demo`: a simulated robot, and the localizer that follows it."""

from __future__ import annotations

import time
from collections.abc import Iterator

from firstfix.core.grid import OccupancyGrid
from firstfix.core.odometry import Signal, SignalKind
from firstfix.lab.scenarios.disturbances import CarryTo, Teleport
from firstfix.lab.scenarios.episodes import DemoStep
from firstfix.lab.scenarios.phases import DriveTo, Stand
from firstfix.lab.scenarios.scenario import Scenario, run
from firstfix.lab.simulation.simulation import Disturbance
from firstfix.localizer.inputs import NewMap
from firstfix.localizer.localizer import Localizer
from firstfix.localizer.outputs import InitialPose, Output, Status, TrackedPose
from firstfix.localizer.precompile import small_room
from firstfix.localizer.replay import replay

# A robot wakes, drives to two goals, is picked up and carried, drives on, and is somewhere else
# all of a sudden without that a wheel or a switch would have told.
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


def warm_up() -> None:
    """Load or compile all kernels that a story needs, by a short one in a small room."""
    for _ in run_demo(small_room(), 0, Localizer()):
        pass


def run_demo(grid: OccupancyGrid, seed: int, localizer: Localizer) -> Iterator[DemoStep]:
    """Play the script in a building and hand all that the robot reports to a localizer.

    Parameters
    ----------
    grid : OccupancyGrid
        The building, and the map of it.
    seed : int
        Another seed, another story.
    localizer : Localizer
        New; it gets the map first.

    Yields
    ------
    DemoStep
        One a scan.
    """
    localizer.handle(NewMap(0.0, grid))
    episode = 0
    lifted: set[SignalKind] = set()
    for moment in run(Scenario(SCRIPT), grid, seed):
        began = time.process_time()
        outputs: list[Output] = []
        for event, answers in replay(iter(moment.events), localizer):
            outputs += answers
            if isinstance(event, Signal) and event.kind.means_lifted:
                # Carried: the episode begins with the first sensor that notices.
                episode += event.active and not lifted
                (lifted.add if event.active else lifted.discard)(event.kind)
        cpu_s = time.process_time() - began
        if moment.disturbance is Disturbance.TELEPORTED:
            episode += 1
        tracked = [output for output in outputs if isinstance(output, TrackedPose)]
        found = [output for output in outputs if isinstance(output, InitialPose)]
        told = [output for output in outputs if isinstance(output, Status)]
        yield DemoStep(
            stamp=moment.stamp,
            truth=moment.T_map_base,
            published=tracked[-1].T_map_base if tracked else None,
            initial=found[-1].T_map_base if found else None,
            state=localizer.state.value,
            reason=told[-1].reason if told else "",
            episode=episode,
            lifted=bool(lifted),
            cpu_s=cpu_s,
        )
