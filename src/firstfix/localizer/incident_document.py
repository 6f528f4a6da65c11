"""An incident as a document of plain values and arrays, and back; whether it can be repeated."""

from __future__ import annotations

import platform
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from firstfix.core.errors import InputError
from firstfix.core.grid import OccupancyGrid
from firstfix.core.se2 import SE2
from firstfix.io.saved_pose import map_key
from firstfix.localizer.checkpoint import known_parts, read_state
from firstfix.localizer.config import LocalizerConfig
from firstfix.localizer.incident import Cause, Incident, KeptOutput, WrittenState, kept
from firstfix.localizer.inputs import Input, NewMap
from firstfix.localizer.localizer import Localizer
from firstfix.localizer.outputs import Output
from firstfix.localizer.state_codec import Decoder, Encoder

FORMAT = "firstfix incident 1"
# A larger map is not included: replaying asks for its file.
MOST_CELLS = 4_000_000
_MOST_TEXT = 2000

_Inputs = tuple[Input, ...]
_Outputs = tuple[tuple[KeptOutput, ...], ...]
Arrays = Mapping[str, NDArray[Any]]


def to_document(incident: Incident) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
    """Return a document for JSON and arrays of numbers, for `write_incident`."""
    encoder = Encoder()
    document = {
        "format": FORMAT,
        "software": software(),
        "cause": incident.cause.value,
        "reason": incident.reason[:_MOST_TEXT],
        "stamp": float(incident.stamp),
        "config": encoder.encode(incident.config),
        "map": None if incident.map is None else _described(incident.map, encoder),
        "inputs": encoder.encode(incident.inputs),
        "outputs": encoder.encode(incident.outputs),
        "nodes": encoder.nodes,
        "start": incident.start.value,
        "start_nodes": incident.start.nodes,
    }
    arrays: dict[str, NDArray[Any]] = {
        "arrays": np.frombuffer(bytes(encoder.arrays), np.uint8),
        "start_arrays": np.frombuffer(incident.start.arrays, np.uint8),
    }
    grid = None if incident.map is None else incident.map.grid
    if grid is not None and grid.cells.size <= MOST_CELLS:
        arrays["cells"] = grid.cells
        for name in ("unseen", "changed"):
            if (mask := getattr(grid, name)) is not None:
                arrays[name] = mask
    return document, arrays


def _described(given: NewMap, encoder: Encoder) -> dict[str, Any]:
    return {
        "key": map_key(given.grid),
        "id": given.map_id,
        "stamp": float(given.stamp),
        "resolution": given.grid.resolution,
        "T_map_grid": encoder.encode(given.grid.T_map_grid),
    }


def software() -> dict[str, str]:
    """Return what the last bits depend on, beside the inputs."""
    return {
        **{name: _version(name) for name in ("firstfix", "numpy", "numba")},
        "machine": platform.machine(),
        "system": platform.system(),
    }


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:  # run from its sources
        return "unknown"


@dataclass(frozen=True, eq=False, slots=True)
class SavedIncident:
    """An incident from a file.

    Parameters
    ----------
    incident : Incident
        With the map of the file, or the one that was given.
    software : dict
        Versions with which it was recorded.
    """

    incident: Incident
    software: dict[str, str]

    @property
    def other_software(self) -> str:
        """What differs here from where it was recorded, for a person; empty: nothing."""
        here = software()
        return ", ".join(
            f"{name} {then} then, {here.get(name, 'none')} now"
            for name, then in self.software.items()
            if here.get(name) != then
        )


def from_document(
    document: Mapping[str, Any], arrays: Arrays, grid: OccupancyGrid | None = None
) -> SavedIncident:
    """Read a document of `to_document`, which may come from a stranger.

    Parameters
    ----------
    document : mapping
        From JSON.
    arrays : mapping from str to ndarray
        Its arrays.
    grid : OccupancyGrid, optional
        The map, where the file does not include it.

    Raises
    ------
    InputError
        If the document is damaged, or the map is missing or another one.
    """
    if document.get("format") != FORMAT:
        raise InputError(
            "This is no incident of firstfix, or one of another version. Pass a file that "
            "firstfix saved."
        )
    try:
        return _read(document, arrays, grid)
    except InputError:
        raise
    except Exception as error:
        raise InputError(
            f"The incident is damaged ({type(error).__name__}). Copy the file again."
        ) from error


def _read(document: Mapping[str, Any], arrays: Arrays, grid: OccupancyGrid | None) -> SavedIncident:
    decoder = Decoder(document["nodes"], arrays["arrays"].tobytes())
    inputs = decoder.decode(document["inputs"], _Inputs)
    outputs = decoder.decode(document["outputs"], _Outputs)
    described = document["map"]
    texts = [document["reason"]]
    texts += [] if described is None else [described["id"], described["key"]]
    if len(inputs) != len(outputs) or not all(isinstance(text, str) for text in texts):
        raise InputError("The incident is damaged. Copy the file again.")
    versions = {str(name)[:100]: str(text)[:100] for name, text in document["software"].items()}
    incident = Incident(
        cause=Cause(document["cause"]),
        reason=document["reason"][:_MOST_TEXT],
        stamp=float(document["stamp"]),
        config=decoder.decode(document["config"], LocalizerConfig),
        map=None if described is None else _read_map(described, arrays, grid, decoder),
        start=WrittenState(
            document["start"], document["start_nodes"], arrays["start_arrays"].tobytes()
        ),
        inputs=inputs,
        outputs=outputs,
    )
    return SavedIncident(incident, versions)


def _read_map(
    described: Mapping[str, Any], arrays: Arrays, given: OccupancyGrid | None, decoder: Decoder
) -> NewMap:
    grid = given
    if given is None and "cells" in arrays:
        grid = OccupancyGrid(
            arrays["cells"],
            float(described["resolution"]),
            decoder.decode(described["T_map_grid"], SE2),
            arrays.get("unseen"),
            arrays.get("changed"),
        )
    if grid is None:
        raise InputError("The map is too large to be in the file. Pass its YAML with --map.")
    if map_key(grid) != described["key"]:
        raise InputError(
            "This is not the map of the incident, or it was redrawn since. Pass the map as it was "
            "then with --map."
        )
    return NewMap(float(described["stamp"]), grid, described["id"])


@dataclass(frozen=True, eq=False, slots=True)
class Repeated:
    """One input that was handled again.

    Parameters
    ----------
    given : Input
        The input.
    outputs : list of Output
        Its outputs now.
    is_identical : bool
        True if they are those of then, to the last bit.
    """

    given: Input
    outputs: list[Output]
    is_identical: bool


def localizer_at_start(
    incident: Incident, in_map: NewMap, cache_dir: Path | None = None
) -> Localizer:
    """Return a localizer in the state in which an incident in one map begins.

    Parameters
    ----------
    incident : Incident
        The incident.
    in_map : NewMap
        Its map.
    cache_dir : Path, optional
        Folder of prepared maps.

    Raises
    ------
    InputError
        If the state is damaged.
    MapError
        If the map cannot be searched.
    """
    localizer = Localizer(incident.config, cache_dir)
    localizer.handle(in_map)
    start, known = incident.start, known_parts(localizer)
    try:
        read_state(localizer, start.value, Decoder(start.nodes, start.arrays, known))
    except InputError:
        raise
    except Exception as error:
        raise InputError(
            f"The state in the incident is damaged ({type(error).__name__}). Copy the file again."
        ) from error
    return localizer


class Handles(Protocol):
    """A localizer of one map or of many."""

    def handle(self, given: Input) -> list[Output]:
        """Process one input."""


def repeat(incident: Incident, localizer: Handles) -> Iterator[Repeated]:
    """Handle the inputs of an incident again.

    Parameters
    ----------
    incident : Incident
        The incident.
    localizer : Localizer or SiteLocalizer
        In the state in which the incident begins.

    Yields
    ------
    Repeated
        Each input.

    Raises
    ------
    InputError
        If the state of a damaged file leads to an error.
    """
    for given, recorded in zip(incident.inputs, incident.outputs, strict=True):
        try:
            outputs = localizer.handle(given)
        except Exception as error:
            raise InputError(
                f"The inputs cannot be repeated ({type(error).__name__}): the incident is damaged. "
                "Copy the file again."
            ) from error
        yield Repeated(given, outputs, are_identical(recorded, outputs))


def are_identical(recorded: tuple[KeptOutput, ...], outputs: list[Output]) -> bool:
    """Return whether outputs are equal to the last bit."""
    return _bits(recorded) == _bits(kept(outputs))


def _bits(outputs: tuple[KeptOutput, ...]) -> tuple[str, bytes]:
    encoder = Encoder()
    value = encoder.encode(outputs)
    return repr((value, encoder.nodes)), bytes(encoder.arrays)
