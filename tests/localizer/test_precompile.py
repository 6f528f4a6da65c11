"""After `precompile` the first scans of a robot compile nothing."""

import subprocess
import sys
from pathlib import Path

import pytest

from firstfix.amcl.config import AmclConfig, MotionModel, SensorModel
from firstfix.localizer.inputs import Input
from firstfix.localizer.localizer import Localizer
from firstfix.localizer.outputs import Output
from firstfix.localizer.precompile import _run, precompile
from firstfix.localizer.states import State

# A robot is found in a hall, driven, lost and found again, and then in one of two equal rooms.
STORY = """
import sys
from dataclasses import replace
import numpy as np
from numba.core.dispatcher import Dispatcher
from firstfix.localizer.precompile import precompile
from firstfix.amcl.config import AmclConfig, MotionModel, SensorModel
from firstfix.core.odometry import Odometry
from firstfix.core.se2 import SE2
from firstfix.lab.simulation.lidar import Lidar
from firstfix.lab.worlds.office import office
from firstfix.lab.worlds.catalog import identical_rooms, random_free_poses
from firstfix.localizer.config import LocalizerConfig
from firstfix.localizer.inputs import NewMap, PoseHint
from firstfix.localizer.localizer import Localizer
from firstfix.localizer.states import State

sensor, motion = SensorModel(sys.argv[1]), MotionModel(sys.argv[2])
config = AmclConfig(laser_model_type=sensor, robot_model_type=motion)

def compiled():
    return {
        f"{name}.{key}": len(kernel.signatures)
        for name, module in list(sys.modules.items()) if name.startswith("firstfix.")
        for key, kernel in vars(module).items() if isinstance(kernel, Dispatcher)
    }

def handle(localizer, given):
    before = compiled()
    localizer.handle(given)
    late.update(name for name, n in compiled().items() if n != before.get(name, 0))

precompile(config)
late, states = set(), set()
lidar, rng = Lidar(beams=360), np.random.default_rng(1)
for world in (office(), identical_rooms(2)):
    localizer = Localizer(LocalizerConfig(amcl=config))
    handle(localizer, NewMap(0.0, world))
    here, there = random_free_poses(world, rng, 2, 0.5)
    for i in range(60):
        stamp, pose = 0.1 * i, (here if i < 20 else there) @ SE2(0.0, 0.0, 0.05 * i)
        handle(localizer, Odometry(stamp, SE2(0.0, 0.0, 0.05 * i)))
        handle(localizer, lidar.scan(world, pose, rng, stamp))
        states.add(localizer.state)
    handle(localizer, PoseHint(stamp, pose))
    handle(localizer, lidar.scan(world, pose, rng, stamp))
assert states == {State.DISAMBIGUATING, State.LOCALIZED}, states
assert not late, late
"""


@pytest.fixture
def afresh():
    """As in a new process."""
    _run.cache_clear()


def test_it_returns_nothing_and_leaves_no_file(
    afresh: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setenv("FIRSTFIX_CACHE_DIR", str(tmp_path))
    assert precompile(AmclConfig()) is None
    assert list(tmp_path.iterdir()) == []


def test_its_story_passes_through_finding_tracking_and_doubt(
    afresh: None, monkeypatch: pytest.MonkeyPatch
):
    """Or kernels of one of them would be left to the first scans of a robot."""
    states, handle = set(), Localizer.handle

    def record(localizer: Localizer, given: Input) -> list[Output]:
        outputs = handle(localizer, given)
        states.add(localizer.state)
        return outputs

    monkeypatch.setattr(Localizer, "handle", record)
    precompile()
    found = {State.LOCALIZED, State.DISAMBIGUATING, State.SEARCHING, State.VERIFYING_HINT}
    assert found <= states


def test_what_is_compiled_is_not_compiled_again(monkeypatch: pytest.MonkeyPatch):
    precompile()
    monkeypatch.setattr(Localizer, "handle", lambda *_: pytest.fail("it was run again"))
    precompile()
    with pytest.raises(pytest.fail.Exception):
        precompile(AmclConfig(laser_model_type=SensorModel.BEAM, max_beams=11))


@pytest.mark.slow
# Each of both once.
@pytest.mark.parametrize(("sensor", "motion"), [*zip(SensorModel, MotionModel, strict=True)])
def test_the_first_scans_of_a_robot_compile_nothing(sensor, motion):
    ended = subprocess.run(
        [sys.executable, "-c", STORY, sensor.value, motion.value],
        capture_output=True,
        text=True,
        check=False,
    )
    assert ended.returncode == 0, ended.stderr
