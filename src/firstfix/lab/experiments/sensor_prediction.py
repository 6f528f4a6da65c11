"""How often one scan, one turn in place and one metre of driving are enough in a map."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from firstfix.belief.belief import Belief, begin, update
from firstfix.belief.view import View
from firstfix.core.angles import FULL_TURN
from firstfix.core.deskew import deskew
from firstfix.core.estimate import Hypothesis, Verdict
from firstfix.core.grid import OccupancyGrid
from firstfix.core.pose_error import PoseError
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.core.trajectory import Trajectory
from firstfix.fields.cache import cache_folder
from firstfix.fields.raycast import expected_ranges
from firstfix.global_localization.beams import FEWEST_HITS
from firstfix.global_localization.scan_matcher import ScanMatcher
from firstfix.global_localization.searchable import check_searchable
from firstfix.lab.metrics.outcome import FOUND
from firstfix.lab.simulation.floor import Floor
from firstfix.lab.simulation.furniture import furnished
from firstfix.lab.simulation.rigs import SWEEP_S, Rig, Shutter
from firstfix.lab.simulation.robot import Kobuki
from firstfix.lab.simulation.wheels import Wheels
from firstfix.lab.worlds.catalog import random_free_poses

_TURN_STEP = math.radians(20.0)
_TURN = round(FULL_TURN / _TURN_STEP)
_DRIVE_STEPS_M = (0.35, 0.35, 0.3)
# The robot faces a direction in which it can drive this far, if there is one.
_ROOM_M = sum(_DRIVE_STEPS_M) + 0.4
_DIRECTIONS = 16
# Motion skews the scans of a LIDAR that turns.
_SPEED_M_S, _RATE_RAD_S = 0.5, math.radians(45.0)

# Real buildings have furniture and people that no map has.
_FLOOR_PER_BOX_M2 = 20.0
_MOST_BOXES = 500


class Effort(Enum):
    """What a robot does to be found."""

    SCAN = "one scan"
    TURN = "one turn in place"
    METRE = "one metre of driving"


class Answer(Enum):
    """How it ends."""

    RIGHT = "right"
    WRONG = "wrong"
    OPEN = "open"


@dataclass(frozen=True, slots=True)
class Prediction:
    """The answers at one place of the map.

    Parameters
    ----------
    T_map_base : SE2
        The place.
    answers : dict of Effort to Answer
        An effort that needs less counts for those that need more: nobody turns after one scan was
        enough.
    sees_little : bool
        True if too few beams of the first scan hit anything.
    """

    T_map_base: SE2
    answers: dict[Effort, Answer]
    sees_little: bool


def predict(
    grid: OccupancyGrid, rig: Rig, samples: int, seed: int, done: Callable[[str], None]
) -> list[Prediction]:
    """Let a robot with some sensors start at random places, on all cores.

    Parameters
    ----------
    grid : OccupancyGrid
        The map. The world is like it, with a box on every 20 m² of floor besides.
    rig : Rig
        The sensors.
    samples : int
        Number of places, drawn uniformly over the floor.
    seed : int
        Of places, noise and wheels; the result does not depend on the number of cores.
    done : callable
        Takes the answer to one scan after each place, in words.

    Raises
    ------
    MapError
        If nothing can be located in the map.
    """
    check_searchable(grid)
    rng = np.random.default_rng(seed)
    poses = random_free_poses(grid, rng, samples)
    boxes = min(_MOST_BOXES, round(grid.free_area / _FLOOR_PER_BOX_M2))
    world = furnished(grid, boxes, rng, keep_free=poses)
    matcher = ScanMatcher(grid, cache_dir=cache_folder())
    matcher.fields.compute("squares", "distances", "clearance", "positions", "endpoints", "ranges")

    def at(index: int) -> Prediction:
        # A stream for each place: the order of the threads must not matter.
        own_rng = np.random.default_rng([seed, index])
        return _predict_at(poses[index], world, rig, matcher, own_rng)

    predictions = []
    # The kernels run without the GIL, so threads share one prepared map.
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        try:
            for prediction in pool.map(at, range(len(poses))):
                predictions.append(prediction)
                done(prediction.answers[Effort.SCAN].value)
        except BaseException:  # Ctrl-C must not wait for the places that are left
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    return predictions


def share(predictions: Sequence[Prediction], effort: Effort, answer: Answer) -> float:
    """Return the share of places with an answer, 0 to 1."""
    return sum(p.answers[effort] is answer for p in predictions) / max(1, len(predictions))


def _predict_at(
    place: SE2, world: OccupancyGrid, rig: Rig, matcher: ScanMatcher, rng: np.random.Generator
) -> Prediction:
    pose = _facing_room(place, world)
    scans = rig.scans(world, pose, rng)
    result = matcher.locate(scans)
    first = _answer(result.verdict, result.best, pose)
    answers = dict.fromkeys(Effort, first)
    if first is Answer.OPEN:
        belief = update(begin(matcher.fields), View(scans, SE2.identity()))
        turn = [(0.0, FULL_TURN / _TURN)] * _TURN
        drive = [(length, 0.0) for length in _DRIVE_STEPS_M]
        for effort, steps in ((Effort.TURN, turn), (Effort.METRE, drive)):
            answers[effort] = _move(belief, _views(world, pose, steps, rig, rng))
    hits = sum(np.count_nonzero(scan.hit) for scan in scans)
    return Prediction(pose, answers, sees_little=bool(hits < FEWEST_HITS))


def _move(belief: Belief, views: Iterator[tuple[SE2, View]]) -> Answer:
    """Take views until the pose is published, or there are no more."""
    for T_map_base, view in views:
        belief = update(belief, view)
        answer = _answer(belief.verdict, next(iter(belief.places), None), T_map_base)
        if answer is not Answer.OPEN:
            return answer
    return Answer.OPEN


def _views(
    world: OccupancyGrid,
    pose: SE2,
    steps: Sequence[tuple[float, float]],
    rig: Rig,
    rng: np.random.Generator,
) -> Iterator[tuple[SE2, View]]:
    """Move by lengths (m) and turns (rad); yield the true pose and the view after each."""
    kobuki = Kobuki()
    wheels, T_odom_base = Wheels(kobuki.wheels, kobuki.base_m, rng), SE2.identity()
    for length, turn in steps:
        if length > 0.0 and _room(pose, world, np.zeros(1))[0] < length + kobuki.radius_m:
            return
        pose = pose @ SE2(length, 0.0, turn)
        T_odom_base = T_odom_base @ wheels.count(length, turn)
        motion = SE2(
            _SPEED_M_S * SWEEP_S if length else 0.0, 0.0, _RATE_RAD_S * SWEEP_S * bool(turn)
        )
        yield pose, View(_moving_scans(world, pose, motion, rig, wheels, rng), T_odom_base)


def _moving_scans(
    world: OccupancyGrid,
    pose: SE2,
    motion: SE2,
    rig: Rig,
    wheels: Wheels,
    rng: np.random.Generator,
) -> tuple[LaserScan, ...]:
    """Take the scans of a robot that moves; those that are skewed are straightened by its wheels.

    The motion is that of the time of a sweep.
    """
    if rig.shutter is not Shutter.ROLLING:
        return rig.scans(world, pose, rng)
    counted = wheels.count(motion.x, motion.yaw)
    odometry = Trajectory(
        np.array([0.0, SWEEP_S]), np.stack([SE2.identity().as_array(), counted.as_array()])
    )
    skewed = rig.sweeps(Floor(world), pose, pose @ motion, rng)
    return tuple(deskew(scan, odometry) for scan in skewed)


def _answer(verdict: Verdict, best: Hypothesis | None, truth: SE2) -> Answer:
    if verdict is not Verdict.UNIQUE or best is None:
        return Answer.OPEN
    is_right = PoseError.between(best.pose, truth).is_within(FOUND)
    return Answer.RIGHT if is_right else Answer.WRONG


def _facing_room(place: SE2, world: OccupancyGrid) -> SE2:
    """Turn a robot to the first direction in which it can drive, as robots stand in corridors."""
    turns = np.linspace(0.0, FULL_TURN, _DIRECTIONS, endpoint=False)
    room = _room(place, world, turns)
    best = np.argmax(room >= _ROOM_M) if (room >= _ROOM_M).any() else np.argmax(room)
    return place @ SE2(0.0, 0.0, float(turns[best]))


def _room(pose: SE2, world: OccupancyGrid, turns: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the distance to the next wall in some directions, m."""
    return expected_ranges(world, pose, turns, 10.0 * _ROOM_M)
