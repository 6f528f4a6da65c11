"""Options of the commands that run a localizer: the bridge to a fleet control."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from firstfix.core.errors import InputError

if TYPE_CHECKING:
    from firstfix.vda5050.bridge import Bridge


class FleetVersion(Enum):
    """Versions of VDA 5050."""

    V2 = "2.1.0"
    V3 = "3.0.0"


FleetUrl = Annotated[
    str | None,
    typer.Option(
        "--vda5050",
        metavar="URL",
        help="Report to the VDA 5050 fleet control at mqtt://[USER@]HOST[:PORT] (mqtts://: TLS). "
        "The password is in FIRSTFIX_MQTT_PASSWORD or in the file FIRSTFIX_MQTT_PASSWORD_FILE.",
    ),
]
Manufacturer = Annotated[
    str | None, typer.Option(metavar="M", help="Of the robot, as in the topics of VDA 5050.")
]
SerialNumber = Annotated[
    str | None, typer.Option(metavar="S", help="Of the robot, as in the topics of VDA 5050.")
]
MapId = Annotated[
    str | None,
    typer.Option(metavar="ID[@VERSION]", help="How the fleet control names the map in use."),
]
FleetMaps = Annotated[
    list[str] | None,
    typer.Option(
        "--vda5050-map",
        metavar="ID[@VERSION]=MAP",
        help="Another map that the fleet control may enable; repeat it for more.",
    ),
]
FleetVersionOption = Annotated[
    FleetVersion, typer.Option("--vda5050-version", help="Version of VDA 5050.")
]

# The id of the map of a site in use before one is found.
_UNKNOWN = "unknown"


@contextmanager
def fleet_bridge(
    url: str | None,
    manufacturer: str | None,
    serial_number: str | None,
    map_id: str | None,
    maps: list[str] | None,
    version: FleetVersion,
    site: Path | None = None,
) -> Iterator[Bridge | None]:
    """Give the bridge of these options while it runs; None without --vda5050.

    The maps of a site have names of their own.

    Raises
    ------
    InputError
        If an option is missing or cannot be used.
    """
    needed = {
        "--manufacturer": manufacturer,
        "--serial-number": serial_number,
        "--map-id": map_id,
    }
    if url is None:
        unused = [name for name, value in {**needed, "--vda5050-map": maps}.items() if value]
        if unused:
            raise InputError(f"{unused[0]} is of no use without --vda5050 URL. Add it.")
        yield None
        return
    if site is not None:
        if unused := [n for n, v in {"--map-id": map_id, "--vda5050-map": maps}.items() if v]:
            raise InputError(f"{unused[0]} is of no use with --site, whose maps have ids.")
        needed["--map-id"] = _UNKNOWN
    if missing := [name for name, value in needed.items() if not value]:
        raise InputError(f"--vda5050 needs {' and '.join(missing)} as well.")
    named = f"{needed['--map-id']}"
    with _bridge(url, f"{manufacturer}", f"{serial_number}", named, maps, version) as bridge:
        yield bridge


def _bridge(
    url: str,
    manufacturer: str,
    serial_number: str,
    map_id: str,
    maps: list[str] | None,
    version: FleetVersion,
) -> Bridge:
    try:
        from firstfix.vda5050.bridge import Bridge
    except ModuleNotFoundError as error:
        raise InputError(
            expected="aiomqtt in this Python",
            received=f"no module {error.name}",
            remedy="pip install 'firstfix[vda5050]'",
        ) from error
    from firstfix.vda5050.broker import read_broker
    from firstfix.vda5050.identity import Identity, Version
    from firstfix.vda5050.maps import MapRegister, read_map, read_map_name

    identity = Identity(manufacturer, serial_number, Version(version.value))
    register = MapRegister(read_map_name(map_id), [read_map(text) for text in maps or []])

    def log(text: str) -> None:
        typer.echo(text, err=True)

    return Bridge(read_broker(url), identity, register, log)
