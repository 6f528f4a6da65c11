"""Places with their past: where each would have put the robot at every view of the window."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from firstfix.belief.adjust import adjust, slack_between, strains
from firstfix.belief.planar import between, compose
from firstfix.belief.view import Observation, costs, settle_on_rays
from firstfix.core.angles import angle_error
from firstfix.fields.map_fields import MapFields

# Beams that weigh all places, and those that weigh the few best.
BEAMS = 36
CAREFUL_BEAMS = 180

# The best places are refined on rays, below the size of a cell.
RAY_PLACES = 12

# Rays sharpen a pose; where they move it farther, along a corridor say, odometry knows better.
_SHARPENED_M = 0.1
_SHARPENED_RAD = math.radians(2.0)


@dataclass(frozen=True, eq=False)
class Tracks:
    """Places and their past.

    Parameters
    ----------
    poses : ndarray, shape (n, v, 3)
        x, y (cells), heading (rad) of the base in the grid at each view, oldest first.
    costs : ndarray, shape (n, v)
        Mean cost of a beam at each view, nats.
    strains : ndarray, shape (n, v)
        How far each pose is from what odometry says of it: minus a log-likelihood, nats.
    careful : ndarray of bool, shape (n, v)
        True where all beams have been compared.
    ids : ndarray of int64, shape (n,)
        Names that last.
    """

    poses: NDArray[np.float64]
    costs: NDArray[np.float64]
    strains: NDArray[np.float64]
    careful: NDArray[np.bool_]
    ids: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.ids)

    @classmethod
    def at(
        cls,
        poses: NDArray[np.float64],
        cost: NDArray[np.float64],
        ids: NDArray[np.int64],
        strain: NDArray[np.float64] | None = None,
    ) -> Tracks:
        """Make tracks of one view: poses of shape (n, 3), all others of shape (n,)."""
        strain = np.zeros(len(ids)) if strain is None else strain
        rough = np.zeros((len(ids), 1), np.bool_)
        return cls(poses[:, None], cost[:, None], strain[:, None], rough, ids)

    @classmethod
    def none(cls, views: int = 1) -> Tracks:
        """Make no tracks, over so many views."""
        return cls.at(np.empty((0, 3)), np.empty(0), np.empty(0, np.int64)).over([0] * views)

    @property
    def now(self) -> NDArray[np.float64]:
        """Poses at the newest view, shape (n, 3)."""
        return self.poses[:, -1]

    def take(self, index: NDArray[np.int64] | NDArray[np.bool_]) -> Tracks:
        """Choose some of the tracks."""
        return Tracks(
            self.poses[index],
            self.costs[index],
            self.strains[index],
            self.careful[index],
            self.ids[index],
        )

    def split(self, n: int) -> tuple[Tracks, Tracks]:
        """Return the first n tracks, and the others."""
        index = np.arange(len(self))
        return self.take(index[:n]), self.take(index[n:])

    def named(self, ids: NDArray[np.int64]) -> Tracks:
        """Give the tracks other ids, shape (n,)."""
        return replace(self, ids=ids)

    def joined_by(self, others: Tracks) -> Tracks:
        """Put tracks over the same views together."""
        return _joined(self, others, 0, np.concatenate([self.ids, others.ids]))

    def before(self, later: Tracks) -> Tracks:
        """Put the same places over later views behind these."""
        return _joined(self, later, 1, self.ids)

    def over(self, views: slice | Sequence[int]) -> Tracks:
        """Keep some of the views, in their order."""
        chosen = views if isinstance(views, slice) else list(views)
        return Tracks(
            self.poses[:, chosen],
            self.costs[:, chosen],
            self.strains[:, chosen],
            self.careful[:, chosen],
            self.ids,
        )


def follow(tracks: Tracks, start: Observation, end: Observation, fields: MapFields) -> Tracks:
    """Carry tracks from the newest view to the next, and adjust them to it."""
    return tracks.before(_carried(tracks.now, tracks.ids, start, end, fields))


def trace_back(tracks: Tracks, early: Observation, late: Observation, fields: MapFields) -> Tracks:
    """Carry tracks, whose oldest view is the late one, back to an early one."""
    return _carried(tracks.poses[:, 0], tracks.ids, late, early, fields).before(tracks)


def at_rest(tracks: Tracks, seen: Observation, fields: MapFields) -> Tracks:
    """Weigh tracks anew by the newest view, which has changed while the robot stood still."""
    earlier, newest = tracks.over(slice(None, -1)), tracks.over(slice(-1, None))
    cost = costs(tracks.now, seen, BEAMS, fields)
    return earlier.before(Tracks.at(tracks.now, cost, tracks.ids, newest.strains[:, 0]))


def look_again(tracks: Tracks, window: Sequence[Observation], fields: MapFields) -> Tracks:
    """Compare all beams where only some have been, and refine the newest poses on rays."""
    careful = _compare_all(tracks, window, fields)
    seen, last = window[-1], len(window) - 1
    few = careful.take(np.arange(min(RAY_PLACES, len(careful))))
    sharp = settle_on_rays(few.now, seen, fields)
    gain = costs(few.now, seen, CAREFUL_BEAMS, fields) - costs(sharp, seen, CAREFUL_BEAMS, fields)
    # Rays are sharper, but in a map with smeared walls they can do harm: the better pose stays.
    held = _are_near(few.now, sharp, fields) if len(window) > 1 else True
    better = np.flatnonzero((gain > 0.0) & held)
    poses, cost = careful.poses.copy(), careful.costs.copy()
    poses[better, last] = sharp[better]
    cost[better, last] -= gain[better]
    return replace(careful, poses=poses, costs=cost)


def _are_near(
    given: NDArray[np.float64], refined: NDArray[np.float64], fields: MapFields
) -> NDArray[np.bool_]:
    away = np.hypot(*(refined - given)[:, :2].T) * fields.grid.resolution
    turned = angle_error(refined[:, 2], given[:, 2])
    near: NDArray[np.bool_] = (away <= _SHARPENED_M) & (turned <= _SHARPENED_RAD)
    return near


def _compare_all(tracks: Tracks, window: Sequence[Observation], fields: MapFields) -> Tracks:
    refined, careful = tracks.costs.copy(), tracks.careful.copy()
    for v, seen in enumerate(window):
        rough = np.flatnonzero(~careful[:, v])
        if len(rough) > 0:
            poses = tracks.poses[rough, v]
            fewer, everything = (costs(poses, seen, n, fields) for n in (BEAMS, CAREFUL_BEAMS))
            refined[rough, v] += everything - fewer
            careful[rough, v] = True
    return replace(tracks, costs=refined, careful=careful)


def _carried(
    poses: NDArray[np.float64],
    ids: NDArray[np.int64],
    start: Observation,
    end: Observation,
    fields: MapFields,
) -> Tracks:
    """Return the tracks at the end only, carried by odometry and adjusted."""
    predicted = compose(poses, between(start.odometry, end.odometry))
    slack = slack_between(start, end)
    adjusted = adjust(predicted, end, slack, fields)
    strain = strains(predicted, adjusted, slack)
    return Tracks.at(adjusted, costs(adjusted, end, BEAMS, fields), ids, strain)


def _joined(one: Tracks, other: Tracks, axis: int, ids: NDArray[np.int64]) -> Tracks:
    return Tracks(
        np.concatenate([one.poses, other.poses], axis=axis),
        np.concatenate([one.costs, other.costs], axis=axis),
        np.concatenate([one.strains, other.strains], axis=axis),
        np.concatenate([one.careful, other.careful], axis=axis),
        ids,
    )
