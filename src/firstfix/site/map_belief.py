"""A belief over maps: which floor a robot is on whose pose on each of them would be known."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from firstfix.belief.belief import NEWS_M, NEWS_RAD, REST_M, REST_RAD
from firstfix.belief.config import BeliefConfig
from firstfix.belief.evidence import log_likelihoods, shares
from firstfix.belief.joint import joint_log_likelihoods, power_of
from firstfix.belief.judge import EXPLAINED_COST, SECOND_LOOK_M, SECOND_LOOK_RAD
from firstfix.belief.planar import compose, in_cells, to_map
from firstfix.belief.prior import FLOOR
from firstfix.belief.tracks import BEAMS, CAREFUL_BEAMS, Tracks, at_rest, follow, look_again
from firstfix.belief.view import Observation, View, costs, settle
from firstfix.core.se2 import SE2
from firstfix.fields.map_fields import MapFields
from firstfix.global_localization.beams import FEWEST_HITS
from firstfix.global_localization.verify import verify

SURE_SHARE = 0.99
"""Share of the probability at which a map is the only one that explains a view."""

# A pose on another floor is known to about this: poses of lifts in maps are drawn by hand.
_OFFSETS_M = (0.0, -0.3, 0.3)
_TURNS_RAD = (0.0, math.radians(-8.0), math.radians(8.0))

# Places on each floor that are followed.
_PLACES = 4

# Floors of one building are alike but for a few things, and things are moved. So a floor must be
# ahead by this factor even without the part of each view that speaks for it most: of so many parts
# of a view with equal numbers of beams, so many are left out.
_CLEAR_FACTOR = 10.0
_PARTS, _LEFT_OUT = 12, 3

# A floor whose map cannot be used may be the one: it is taken to fit as right maps do, nats.
_RIGHT_MAP_COST = 0.8

# Views in a row that no map explains, after which the robot is on none of them.
_MOST_MISSES = 3


@dataclass(frozen=True, eq=False)
class Floor:
    """One map of the belief.

    Parameters
    ----------
    fields : MapFields
        The map.
    window : tuple of Observation
        The views that are judged together, oldest first, in cells of this map.
    tracks : Tracks
        Where the robot would be on this map.
    """

    fields: MapFields
    window: tuple[Observation, ...]
    tracks: Tracks

    @property
    def T_map_base(self) -> SE2:
        """The best pose on this map at the newest view."""
        poses = to_map(self.tracks.now[[self._best]], self.fields.grid)
        return SE2.from_array(poses[0])

    @property
    def cost(self) -> float:
        """Mean cost of a beam of the newest view at the best pose, nats."""
        return float(self.tracks.costs[self._best, -1])

    def costs_of_parts(self) -> NDArray[np.float64]:
        """Return the mean cost of a beam in each part of each view, shape (views, parts), nats."""
        poses = self.tracks.poses[self._best]
        return np.array(
            [
                _costs_of_parts(poses[v], seen, self.fields)
                for v, seen in enumerate(self.window)
                if seen.hits >= _PARTS
            ]
        ).reshape(-1, _PARTS)

    @property
    def log_likelihood(self) -> float:
        """Of all views together, up to a constant that all maps share."""
        return float(self._logs.max())

    @property
    def _logs(self) -> NDArray[np.float64]:
        return joint_log_likelihoods(self.tracks, self.window, BeliefConfig())

    @property
    def _best(self) -> int:
        return int(self._logs.argmax())


@dataclass(frozen=True, eq=False)
class MapBelief:
    """Probabilities of maps, given views from about the same place of each. Made by `begin_maps`.

    Parameters
    ----------
    floors : mapping of str to Floor
        The maps.
    unseen : int
        Number of floors that cannot be compared, because their maps cannot be used.
    hinted : str or None
        The map that something other than the scans has named: a prior of a thousand to one.
    sure_since : tuple of str and View, or None
        The map that is sure since a view.
    misses : int
        Views in a row that no map explains.
    """

    floors: Mapping[str, Floor]
    unseen: int = 0
    hinted: str | None = None
    sure_since: tuple[str, View] | None = None
    misses: int = 0

    @property
    def probabilities(self) -> dict[str, float]:
        """Of each map; the rest to 1 is that of none of them."""
        return self._shares(self.hinted)

    @property
    def most_likely(self) -> str:
        """The map with the highest probability."""
        return max(self.probabilities.items(), key=lambda item: item[1])[0]

    @property
    def decided(self) -> str | None:
        """The map that is sure: in two views from different poses, or in one if it was named."""
        if self.sure_since is None:
            return None
        map_id, since = self.sure_since
        newest = self.floors[map_id].window[-1].views[-1]
        step = since.T_odom_base.inverse() @ newest.T_odom_base
        has_moved = math.hypot(step.x, step.y) >= SECOND_LOOK_M or abs(step.yaw) >= SECOND_LOOK_RAD
        return map_id if has_moved or self.hinted == map_id else None

    def is_clear(self, map_id: str) -> bool:
        """Tell whether a map is ahead of all others not only by one or two things.

        Parameters
        ----------
        map_id : str
            One of the maps.
        """
        chosen = self.floors[map_id].costs_of_parts()
        power = power_of(self.floors[map_id].window)
        for name, floor in self.floors.items():
            if name == map_id:
                continue
            ahead = floor.costs_of_parts() - chosen
            kept = np.argsort(ahead, axis=1)[:, : _PARTS - _LEFT_OUT]
            mean = [np.take_along_axis(c, kept, axis=1).mean() for c in (chosen, chosen + ahead)]
            own, other = log_likelihoods(np.array(mean), power)
            if own - other < math.log(_CLEAR_FACTOR):
                return False
        return True

    @property
    def is_refuted(self) -> bool:
        """True if several views in a row fit none of the maps."""
        return self.misses >= _MOST_MISSES

    def _shares(self, hinted: str | None) -> dict[str, float]:
        names = list(self.floors)
        power = power_of(next(iter(self.floors.values())).window)
        before = [0.0 if hinted in (None, name) else FLOOR for name in names]
        logs = np.array([floor.log_likelihood for floor in self.floors.values()]) + before
        unseen = log_likelihoods(np.full(self.unseen, _RIGHT_MAP_COST), power)
        unseen += 0.0 if hinted is None else FLOOR
        found, _ = shares(np.concatenate([logs, unseen]), power)
        return dict(zip(names, found.tolist(), strict=False))


def begin_maps(
    places: Mapping[str, tuple[MapFields, SE2]],
    view: View,
    *,
    unseen: int = 0,
    hinted: str | None = None,
) -> MapBelief | None:
    """Compare a first view with each map near a pose.

    Parameters
    ----------
    places : mapping of str to tuple of MapFields and SE2
        Maps, and about where the robot would be on each: ``T_map_base`` at the view.
    view : View
        The view.
    unseen : int
        Number of further floors, whose maps cannot be used.
    hinted : str, optional
        The map that something other than the scans has named.

    Returns
    -------
    MapBelief or None
        None if there is no map, or too few beams hit a surface.
    """
    floors = {name: _begin(fields, pose, view) for name, (fields, pose) in places.items()}
    seen = {name: floor for name, floor in floors.items() if floor.window[-1].hits >= FEWEST_HITS}
    if not seen:
        return None
    return _judged(MapBelief(seen, unseen, hinted), view)


def look(belief: MapBelief, view: View) -> MapBelief:
    """Weigh all maps by another view.

    Parameters
    ----------
    belief : MapBelief
        Before.
    view : View
        A later view.

    Returns
    -------
    MapBelief
        After. The same if the robot has neither moved enough for news nor rested.
    """
    last = next(iter(belief.floors.values())).window[-1].views[-1]
    step = last.T_odom_base.inverse() @ view.T_odom_base
    metres, radians = math.hypot(step.x, step.y), abs(step.yaw)
    rests = metres < REST_M and radians < REST_RAD
    if not rests and metres < NEWS_M and radians < NEWS_RAD:
        return belief
    floors = {name: _look(floor, view, rests=rests) for name, floor in belief.floors.items()}
    return _judged(replace(belief, floors=floors), view)


def predicted(belief: MapBelief, map_id: str, view: View) -> SE2:
    """Return where a robot on one of the maps is at a later view, by odometry."""
    floor = belief.floors[map_id]
    last = floor.window[-1].views[-1].T_odom_base
    return floor.T_map_base @ (last.inverse() @ view.T_odom_base)


def brings_news(belief: MapBelief, view: View) -> bool:
    """Return whether a view is taken far enough from the last one to be weighed."""
    last = next(iter(belief.floors.values())).window[-1].views[-1]
    step = last.T_odom_base.inverse() @ view.T_odom_base
    return math.hypot(step.x, step.y) >= NEWS_M or abs(step.yaw) >= NEWS_RAD


def _judged(belief: MapBelief, view: View) -> MapBelief:
    probabilities, best = belief.probabilities, belief.most_likely
    explains = belief.floors[best].cost <= EXPLAINED_COST
    is_sure = explains and probabilities[best] >= SURE_SHARE and _is_verified(belief, best)
    is_sure = is_sure and (best == belief.hinted or belief.is_clear(best))
    since = belief.sure_since
    if not is_sure:
        since = None
    elif since is None or since[0] != best:
        since = best, view
    return replace(belief, sure_since=since, misses=0 if explains else belief.misses + 1)


def _is_verified(belief: MapBelief, best: str) -> bool:
    """Tell whether the scans alone do not speak against a map that was named."""
    alone = belief._shares(None)  # noqa: SLF001 - of this module
    return alone[best] >= 0.2 * max(alone.values())


def _begin(fields: MapFields, T_map_base: SE2, view: View) -> Floor:
    seen = Observation((view,), fields.grid.resolution)
    size = fields.grid.resolution
    T_grid_base = in_cells(fields.grid.T_map_grid.inverse() @ T_map_base, size)
    offsets = [
        (x / size, y / size, yaw) for x in _OFFSETS_M for y in _OFFSETS_M for yaw in _TURNS_RAD
    ]
    settled = settle(T_grid_base + np.array(offsets), seen, fields)
    cost = costs(settled, seen, BEAMS, fields)
    best = np.argsort(cost, kind="stable")[:_PLACES]
    tracks = Tracks.at(settled[best], cost[best], np.arange(len(best)))
    return Floor(fields, (seen,), look_again(tracks, (seen,), fields))


def _look(floor: Floor, view: View, *, rests: bool) -> Floor:
    before, fields = floor.window[-1], floor.fields
    if rests and before.same_sensors(view):
        window = (*floor.window[:-1], before.joined_by(view))
        tracks = at_rest(floor.tracks, window[-1], fields)
    else:
        seen = Observation((view,), fields.grid.resolution)
        window = (*floor.window, seen)
        tracks = follow(floor.tracks, before, seen, fields)
    most = BeliefConfig().window
    window, tracks = window[-most:], tracks.over(slice(-most, None))
    return Floor(fields, window, look_again(tracks, window, fields))


def _costs_of_parts(
    pose: NDArray[np.float64], seen: Observation, fields: MapFields
) -> NDArray[np.float64]:
    sensor = seen.sensor
    at = compose(pose[None], sensor.T_base_laser)
    beams = sensor.beams.thinned(CAREFUL_BEAMS)
    parts = np.array_split(np.arange(len(beams)), _PARTS)
    return np.array([verify(at, beams.take(part), fields).scores[0] for part in parts])
