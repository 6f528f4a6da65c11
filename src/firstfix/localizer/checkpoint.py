"""The complete state of a localizer, to go on from there with the same outputs to the last bit.

Most of the state is immutable values. The few objects that change are listed with the attributes
that are their state; a test compares the lists with the objects.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from typing import Any

import numpy as np

from firstfix.amcl.tracker import Track
from firstfix.belief.belief import Belief
from firstfix.belief.view import Link, View
from firstfix.core.errors import InputError
from firstfix.core.estimate import Hypothesis
from firstfix.core.odometry import Odometry, SignalKind
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.global_localization.prior import Prior
from firstfix.localizer.agreement import AgreementCounter
from firstfix.localizer.checked_odometry import CheckedOdometry
from firstfix.localizer.hint import Hint
from firstfix.localizer.localizer import Localizer
from firstfix.localizer.map_localization import MapLocalization
from firstfix.localizer.odometry_buffer import OdometryBuffer
from firstfix.localizer.place_belief import PlaceBelief
from firstfix.localizer.pose_fusion import SharpPose
from firstfix.localizer.pose_monitor import PoseMonitor
from firstfix.localizer.pose_tracker import PoseTracker, Tracked
from firstfix.localizer.scan_queue import ScanQueue
from firstfix.localizer.sensor_clocks import Clock, SensorClocks
from firstfix.localizer.state_codec import Decoder, Encoder
from firstfix.localizer.states import State

_PARTS: Mapping[type[Any], Mapping[str, Any]] = {
    Localizer: {
        "_rng": np.random.Generator,
        "_scans": ScanQueue,
        "_odometry": CheckedOdometry,
        "_view": View | None,
        "_lifted": set[SignalKind],
        "_in_map": MapLocalization,
    },
    MapLocalization: {
        "state": State,
        "_unweighed": tuple[View, Tracked] | None,
        "_update_requested": bool,
        "_hint": Hint | None,
        "_chosen_by": str | None,
        "_lost_T_map_odom": SE2 | None,
        "tracker": PoseTracker,
        "places": PlaceBelief,
    },
    ScanQueue: {
        "odometry": OdometryBuffer,
        "_instants": deque[list[LaserScan]],
        "_clocks": SensorClocks,
        "_apart": dict[str, LaserScan],
        "_used_until": float,
        "_valid_since": float,
    },
    CheckedOdometry: {"_before": View | None, "_T_checked_odom": SE2, "_unconfirmed": int},
    OdometryBuffer: {"_kept": deque[Odometry]},
    SensorClocks: {"_clocks": dict[str, Clock], "_reported": set[str]},
    PoseTracker: {
        "_track": Track | None,
        "_sharp": SharpPose | None,
        "_monitor": PoseMonitor,
        "_has_leapt": bool,
    },
    PoseMonitor: {
        "_contradicted_since": float | None,
        "_suspected_since": float | None,
        "_has_leapt": bool,
        "_T_map_odom": SE2 | None,
        "_agreement": AgreementCounter,
        "_searched_at": float | None,
        "_usual_cost": float,
        "_last_cost": float | None,
    },
    AgreementCounter: {"_T_map_odom": SE2 | None, "_count": int},
    PlaceBelief: {
        "_used_at": tuple[float, SE2] | None,
        "_places": tuple[Hypothesis, ...],
        "_credit": int,
        "_views_against": int,
        "_views_lost": int,
        "_fixes": dict[str, Prior],
        "_latest": tuple[View, ...],
        "_link": Link,
        "belief": Belief,
    },
}
# What is made anew from the map and the settings, or does not change the outputs.
_REBUILT: Mapping[type[Any], frozenset[str]] = {
    Localizer: frozenset({"config", "_cache_dir"}),
    MapLocalization: frozenset({"matcher", "changes", "_config", "_scans"}),
    ScanQueue: frozenset({"_config"}),
    PoseTracker: frozenset({"_matcher", "_config", "_rng", "_filter"}),
    PoseMonitor: frozenset({"_matcher", "_config"}),
    PlaceBelief: frozenset({"_fields", "_config", "_rest_period_s"}),
}


def known_parts(localizer: Localizer) -> dict[str, object]:
    """Return what the state of a localizer with a map refers to, by name."""
    matcher = localizer.matcher
    if matcher is None:
        raise InputError("There is no map yet. Give the localizer a map first.")
    return {"fields": matcher.fields, "belief_config": localizer.config.belief}


def write_state(part: Localizer | ScanQueue, encoder: Encoder) -> dict[str, Any]:
    """Return the state as plain values; arrays go to the encoder.

    Parameters
    ----------
    part : Localizer or ScanQueue
        A localizer with a map, or a queue of its own. It does not change.
    encoder : Encoder
        Made with `known_parts`.
    """
    return _write(part, encoder)


def read_state(part: Localizer | ScanQueue, state: object, decoder: Decoder) -> None:
    """Give a localizer, or a queue, the state of another one.

    Parameters
    ----------
    part : Localizer or ScanQueue
        With the same settings and the same map as that of `write_state`.
    state : object
        Of `write_state`.
    decoder : Decoder
        Made with `known_parts`.

    Raises
    ------
    InputError
        If the state is damaged; discard the localizer then.
    """
    _read(part, state, decoder)


def _write(part: object, encoder: Encoder) -> dict[str, Any]:
    written = {}
    for name, hint in _PARTS[type(part)].items():
        value = getattr(part, name)
        if hint in _PARTS:
            written[name] = _write(value, encoder)
        elif hint is np.random.Generator:
            written[name] = value.bit_generator.state
        else:
            written[name] = encoder.encode(value)
    return written


def _read(part: object, state: object, decoder: Decoder) -> None:
    types = _PARTS[type(part)]
    if not isinstance(state, dict) or set(state) != set(types):
        raise InputError("The state is damaged or of another version of firstfix.")
    for name, hint in types.items():
        if hint in _PARTS:
            _read(getattr(part, name), state[name], decoder)
        elif hint is np.random.Generator:
            _read_rng(getattr(part, name), state[name])
        else:
            setattr(part, name, decoder.decode(state[name], hint))


def _read_rng(rng: np.random.Generator, state: Any) -> None:
    try:
        rng.bit_generator.state = state
    except Exception as error:
        raise InputError("The state of the random numbers is damaged.") from error
