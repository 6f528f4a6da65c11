"""Lifts: when a robot stands in one, whether it sees out, and where it may come out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from firstfix.belief.view import View
from firstfix.core.se2 import SE2
from firstfix.fields.map_fields import MapFields
from firstfix.io.maps.site_yaml import Transition

KINDS = ("lift", "elevator")
"""Kinds of transitions that carry a robot while it stands."""

# A robot this near to the pose of a lift is in its cabin, or about to be.
_INSIDE_M = 1.5

# What is farther from the pose of a lift is outside the cabin.
_OUTSIDE_M = 2.5

# A view sees out if this share of its beams ends outside, and so many of them.
_SEES_OUT_SHARE = 0.04
_SEES_OUT_BEAMS = 8

# A beam whose end is this near to a wall of the map is explained; of those that end outside this
# share must be, or the robot is not where it was.
_EXPLAINED_M = 0.3
_SAME_FLOOR_SHARE = 0.6


@dataclass(frozen=True, slots=True)
class Lift:
    """A lift, seen from a robot in it.

    Parameters
    ----------
    transition : Transition
        The lift.
    T_map_lift : SE2
        Its pose on the map in use.
    """

    transition: Transition
    T_map_lift: SE2

    def holds(self, T_map_base: SE2) -> bool:
        """Tell whether a robot stands in it."""
        return self.T_map_lift.distance_to(T_map_base) <= _INSIDE_M

    def seen_from(self, map_id: str) -> Lift:
        """Return the same lift on another of its floors."""
        end = next(end for end in self.transition.ends if end.map_id == map_id)
        return Lift(self.transition, end.pose)

    def leads_to(self, map_id: str) -> bool:
        """Tell whether a map is at one of its ends."""
        return any(end.map_id == map_id for end in self.transition.ends)

    def places(self, T_map_base: SE2) -> dict[str, SE2]:
        """Return where the robot would be on each map, given where it is on the map in use."""
        T_lift_base = self.T_map_lift.inverse() @ T_map_base
        return {end.map_id: end.pose @ T_lift_base for end in self.transition.ends}


def lift_at(transitions: Sequence[Transition], map_id: str, T_map_base: SE2) -> Lift | None:
    """Return the lift that a robot stands in; None if it does not.

    Parameters
    ----------
    transitions : sequence of Transition
        Those of the site.
    map_id : str
        The map in use.
    T_map_base : SE2
        The robot in it.
    """
    near = [
        (end.pose.distance_to(T_map_base), i, end.pose)
        for i, transition in enumerate(transitions)
        if transition.kind in KINDS
        for end in transition.ends
        if end.map_id == map_id and end.pose.distance_to(T_map_base) <= _INSIDE_M
    ]
    if not near:
        return None
    _, i, T_map_lift = min(near, key=lambda item: item[:2])
    return Lift(transitions[i], T_map_lift)


def sees_out(view: View, lift: Lift, T_map_base: SE2) -> bool:
    """Tell whether a view shows more than the cabin: the door is open, and something is outside."""
    hits = sum(int(np.count_nonzero(scan.hit)) for scan in view.scans)
    least = max(_SEES_OUT_BEAMS, _SEES_OUT_SHARE * hits)
    return len(_outside(view, lift, T_map_base)) >= least


def sees_same_floor(view: View, lift: Lift, T_map_base: SE2, fields: MapFields) -> bool:
    """Tell whether a view sees out, and what it sees there is in the map in use.

    A lift moves only while its door is closed. So a robot that has always seen the same floor since
    it came in has not left it.
    """
    if not sees_out(view, lift, T_map_base):
        return False
    grid = fields.grid
    cells = np.floor(grid.to_cells(_outside(view, lift, T_map_base))).astype(np.int64)
    on_map = ((cells >= 0) & (cells < [grid.width, grid.height])).all(axis=1)
    column, row = cells[on_map].T
    most = (_EXPLAINED_M / grid.resolution) ** 2
    explained = np.count_nonzero(fields.squares[row, column] <= most)
    return bool(explained >= _SAME_FLOOR_SHARE * len(cells))


def without_cabin(view: View, lift: Lift, T_map_base: SE2) -> View:
    """Return a view without the beams that end in the cabin: they fit on every floor."""
    scans = []
    for scan in view.scans:
        ranges = scan.ranges.copy()
        ranges[np.flatnonzero(scan.hit)[~_is_outside(scan.points(), lift, T_map_base)]] = np.nan
        scans.append(replace(scan, ranges=ranges))
    return View(tuple(scans), view.T_odom_base)


def _outside(view: View, lift: Lift, T_map_base: SE2) -> NDArray[np.float64]:
    """Return the ends of beams outside the cabin, shape (n, 2), m, in the map frame."""
    ends = np.concatenate([scan.points() for scan in view.scans])
    outside: NDArray[np.float64] = T_map_base.apply(ends[_is_outside(ends, lift, T_map_base)])
    return outside


def _is_outside(ends: NDArray[np.float64], lift: Lift, T_map_base: SE2) -> NDArray[np.bool_]:
    """Tell which ends of beams, shape (n, 2), m, in the base frame, are outside the cabin."""
    away = T_map_base.apply(ends) - [lift.T_map_lift.x, lift.T_map_lift.y]
    outside: NDArray[np.bool_] = np.hypot(*away.T) > _OUTSIDE_M
    return outside
