"""The complete state of a robot in a site, to go on from there to the last bit.

Maps are not written: the state names them with the hashes of their contents.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from firstfix.belief.tracks import Tracks
from firstfix.belief.view import Observation, View
from firstfix.core.errors import InputError
from firstfix.core.odometry import SignalKind
from firstfix.core.se2 import SE2
from firstfix.global_localization.prior import Prior
from firstfix.localizer.checkpoint import known_parts, read_state, write_state
from firstfix.localizer.incident import Incident, WrittenState, written
from firstfix.localizer.incident_document import localizer_at_start
from firstfix.localizer.localizer import Localizer
from firstfix.localizer.state_codec import Decoder, Encoder
from firstfix.localizer.states import State
from firstfix.site.arrival import Candidate
from firstfix.site.floors import AnyLocalizer, Phase, SiteLocalizer
from firstfix.site.lifts import Lift
from firstfix.site.map_belief import Floor, MapBelief
from firstfix.site.ride import Ride
from firstfix.site.site import Site

# The attributes of `SiteLocalizer` that are plain values; the others have a line below, or are made
# anew from the site and the settings.
_VALUES: Mapping[str, Any] = {
    "_lifted": set[SignalKind],
    "_map_id": str | None,
    "_T_map_odom": SE2,
    "_view_at": float | None,
    "_hinted": str | None,
    "_state": State,
}
_OBJECTS = ("_scans", "_phase", "_search", "_localizers", "_localizer", "_ride", "_candidate")
_REBUILT = ("site", "config")

_RideParts = tuple[str, SE2, str | None, int | None]
_Floors = dict[str, tuple[tuple[Observation, ...], Tracks]]
_Belief = tuple[_Floors, int, str | None, tuple[str, View] | None, int]


def written_state(localizer: AnyLocalizer) -> WrittenState:
    """Return the state of a localizer of one map, or of many."""
    return written(localizer) if isinstance(localizer, Localizer) else _written(localizer)


def any_localizer_at_start(
    incident: Incident, site: Site | None, cache_dir: Path | None = None
) -> AnyLocalizer:
    """Return a localizer in the state in which an incident begins.

    Parameters
    ----------
    incident : Incident
        The incident.
    site : Site or None
        Its maps, where it has many.
    cache_dir : Path, optional
        Folder of prepared maps.

    Raises
    ------
    InputError
        If the state is damaged, or a map of the site is missing or another one.
    """
    if incident.map is not None:
        if site is not None:
            raise InputError("This incident has one map. Leave --site out.")
        return localizer_at_start(incident, incident.map, cache_dir)
    if site is None:
        raise InputError("The robot was in a site of several maps. Pass it with --site.")
    localizer = SiteLocalizer(site, incident.config, cache_dir)
    try:
        _restore(localizer, incident.start)
    except InputError:
        raise
    except Exception as error:
        raise InputError(
            f"The state in the incident is damaged ({type(error).__name__}). Copy the file again."
        ) from error
    return localizer


# ---- writing


def _written(localizer: SiteLocalizer) -> WrittenState:
    state, encoder = vars(localizer), Encoder()
    held: dict[str, Localizer] = state["_localizers"].held
    value = {name: encoder.encode(state[name]) for name in _VALUES}
    candidate: Candidate | None = state["_candidate"]
    search = state["_search"]
    value |= {
        "contents": localizer.site.contents,
        "scans": write_state(state["_scans"], encoder),
        "phase": state["_phase"].name,
        "search": encoder.encode((search.prior, list(search.views))),
        "used": next((name for name, one in held.items() if one is state["_localizer"]), None),
        "ride": _written_ride(state["_ride"], encoder),
        "candidate": encoder.encode(candidate and (candidate.map_id, candidate.T_odom_map)),
    }
    arrays, localizers = bytes(encoder.arrays), []
    for name, one in held.items():
        of_map = written(one)
        localizers.append([name, of_map.value, of_map.nodes, len(arrays), len(of_map.arrays)])
        arrays += of_map.arrays
    return WrittenState({**value, "localizers": localizers}, encoder.nodes, arrays)


def _written_ride(ride: Ride | None, encoder: Encoder) -> Any:
    if ride is None:
        return None
    lift = (ride.lift.transition.id, ride.lift.T_map_lift, ride.hinted, ride.probation)
    belief = None if ride.belief is None else _parts(ride.belief)
    return [encoder.encode(lift), encoder.encode(belief)]


def _parts(belief: MapBelief) -> tuple[Any, ...]:
    floors = {name: (floor.window, floor.tracks) for name, floor in belief.floors.items()}
    return floors, belief.unseen, belief.hinted, belief.sure_since, belief.misses


# ---- reading


def _restore(localizer: SiteLocalizer, start: WrittenState) -> None:
    value, site, state = start.value, localizer.site, vars(localizer)
    _check_maps(site, value["contents"])
    decoder = Decoder(start.nodes, start.arrays)
    restored = {name: decoder.decode(value[name], hint) for name, hint in _VALUES.items()}
    localizers, search = state["_localizers"], state["_search"]
    for name, of_map, nodes, first, size in value["localizers"]:
        made = localizers.new_localizer(name, 0.0)
        arrays = start.arrays[first : first + size]
        read_state(made, of_map, Decoder(nodes, arrays, known_parts(made)))
        localizers.held[name] = made
    asked = tuple[dict[str, Prior | None] | None, list[View]]
    search.prior, search.views = decoder.decode(value["search"], asked)
    read_state(state["_scans"], value["scans"], decoder)
    candidate = decoder.decode(value["candidate"], tuple[str, SE2] | None)
    if candidate is not None:
        candidate = Candidate(candidate[0], localizers.held[candidate[0]], candidate[1])
    state.update(
        restored,
        _phase=Phase[value["phase"]],
        _localizer=None if value["used"] is None else localizers.held[value["used"]],
        _ride=None if value["ride"] is None else _ride(site, decoder, *value["ride"]),
        _candidate=candidate,
    )


def _check_maps(site: Site, contents: Mapping[str, str]) -> None:
    here = site.contents
    for name, content in contents.items():
        if here.get(name) != content:
            raise InputError(
                f"The map {name!r:.60} of the incident is missing in this site, or was redrawn "
                "since. Pass the site as it was then with --site."
            )


def _ride(site: Site, decoder: Decoder, lift: Any, belief: Any) -> Ride:
    name, T_map_lift, hinted, probation = decoder.decode(lift, _RideParts)
    transition = next((one for one in site.transitions if one.id == name), None)
    if transition is None:
        raise InputError(f"There is no transition {name!r:.60} in this site.")
    ride = Ride(site, Lift(transition, T_map_lift), hinted)
    ride.probation = probation
    if (parts := decoder.decode(belief, _Belief | None)) is not None:
        floors, *rest = parts
        ride.belief = MapBelief(
            {each: Floor(site.fields(each), *of_map) for each, of_map in floors.items()}, *rest
        )
    return ride
