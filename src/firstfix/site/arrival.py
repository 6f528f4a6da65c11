"""The localizers of single maps, and how one takes over at a place that the site has found."""

from __future__ import annotations

import math
from collections import OrderedDict
from dataclasses import dataclass, replace
from pathlib import Path

from firstfix.belief.view import View
from firstfix.core.odometry import Odometry
from firstfix.core.se2 import SE2
from firstfix.localizer.config import LocalizerConfig
from firstfix.localizer.inputs import NewMap, PoseHint
from firstfix.localizer.localizer import Localizer
from firstfix.localizer.outputs import InitialPose, Output
from firstfix.localizer.states import State
from firstfix.site.site import Site

# Localizers of maps that were left lately: a robot often comes back.
_MOST = 3

# A place that the site has found is known to this, for the localizer that verifies it.
_RADIUS_M = 0.7
_ANGLE_RAD = math.radians(25.0)

# Farther than this from where the site has found the robot is another place.
_SAME_M = 1.0


@dataclass(slots=True)
class Candidate:
    """A localizer that verifies a place before anything is published.

    Parameters
    ----------
    map_id : str
        Its map.
    localizer : Localizer
        It has the map and a hint of the pose.
    T_odom_map : SE2
        Of the place, as the site has found it.
    """

    map_id: str
    localizer: Localizer
    T_odom_map: SE2


class MapLocalizers:
    """Makes a localizer for each map when it is needed.

    Parameters
    ----------
    site : Site
        The maps.
    config : LocalizerConfig
        Settings of each localizer.
    cache_dir : Path or None
        Folder of prepared maps.

    Attributes
    ----------
    held : dict of str to Localizer
        Those of the maps that were used last, by map.
    """

    def __init__(self, site: Site, config: LocalizerConfig, cache_dir: Path | None) -> None:
        self._site = site
        self._config = config
        self._cache_dir = cache_dir
        self.held: OrderedDict[str, Localizer] = OrderedDict()

    def propose(self, map_id: str, T_map_base: SE2, view: View, source: str) -> Candidate:
        """Let the localizer of a map verify a place.

        Parameters
        ----------
        map_id : str
            The map.
        T_map_base : SE2
            The place, at the view.
        view : View
            The newest view.
        source : str
            Who has found the place, in the words that people will read.
        """
        localizer = self._localizer(map_id, view.stamp)
        localizer.handle(Odometry(view.stamp, view.T_odom_base))
        localizer.handle(
            PoseHint(view.stamp, T_map_base, source, radius=_RADIUS_M, angle=_ANGLE_RAD)
        )
        return Candidate(map_id, localizer, view.T_odom_base @ T_map_base.inverse())

    def new_localizer(self, map_id: str, stamp: float) -> Localizer:
        """Make a localizer that knows nothing but its map."""
        made = Localizer(self._config, self._cache_dir)
        fields = self._site.fields(map_id)
        made.handle(NewMap(stamp, fields.grid, map_id, fields))
        return made

    def _localizer(self, map_id: str, stamp: float) -> Localizer:
        held = self.held.pop(map_id, None)
        if held is None or held.state is State.LIFTED:
            held = self.new_localizer(map_id, stamp)
        self.held[map_id] = held
        while len(self.held) > _MOST:
            self.held.popitem(last=False)
        return held


def confirm(candidate: Candidate, view: View) -> list[Output]:
    """Give a candidate a view.

    Parameters
    ----------
    candidate : Candidate
        Made by `MapLocalizers.propose`.
    view : View
        A view that it has not had.

    Returns
    -------
    list of Output
        From the first pose on, once the localizer has found the robot at the place; else nothing.
    """
    localizer = candidate.localizer
    localizer.handle(Odometry(view.stamp, view.T_odom_base))
    outputs = [
        output
        for scan in view.scans
        for output in localizer.handle(replace(scan, stamp=view.stamp))
    ]
    found = next((i for i, output in enumerate(outputs) if isinstance(output, InitialPose)), None)
    if found is None or localizer.state is not State.LOCALIZED:
        return []
    expected = candidate.T_odom_map.inverse() @ view.T_odom_base
    initial = outputs[found]
    assert isinstance(initial, InitialPose)  # noqa: S101 - chosen as such
    return outputs[found:] if initial.T_map_base.distance_to(expected) <= _SAME_M else []
