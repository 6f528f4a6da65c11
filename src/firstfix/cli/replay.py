"""``firstfix replay``: an incident that a robot saved, once more."""

from __future__ import annotations

import json
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from firstfix.cli.progress import progress
from firstfix.cli.serve import INTERRUPTED, PORT, Address, announce
from firstfix.cli.site import load_site

if TYPE_CHECKING:
    from firstfix.localizer.incident import Incident
    from firstfix.localizer.incident_document import Repeated, SavedIncident
    from firstfix.site.site import Site

OTHER_OUTPUTS = 1
_MOST_LINES = 40


def replay(
    file: Annotated[
        Path, typer.Argument(metavar="FILE", help="An incident: .npz, saved by a robot.")
    ],
    map_path: Annotated[
        Path | None,
        typer.Option(
            "--map", metavar="MAP", help="YAML of the map, where the file does not include it."
        ),
    ] = None,
    site_path: Annotated[
        Path | None,
        typer.Option("--site", metavar="SITE", help="The maps, if the robot was in a site."),
    ] = None,
    check: Annotated[
        bool,
        typer.Option("--check", help="Exit status 1 unless all outputs are those of the robot."),
    ] = False,
    as_object: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
    serve: Annotated[
        bool,
        typer.Option(
            "--serve", "--open", help="Play it on the live page, at the speed of the robot."
        ),
    ] = False,
    port: Annotated[
        int, typer.Option(min=0, max=65535, help="Of the page; 0: any free port.")
    ] = PORT,
) -> None:
    """Repeat what a robot received in the seconds before an incident, and what it answered.

    The localizer starts in the state in which the robot was, so that the outputs are the same to
    the last bit with the same versions on the same kind of processor.
    """
    from firstfix.fields.cache import cache_folder
    from firstfix.io.incident_files import load_incident
    from firstfix.io.maps.map_server import load_map
    from firstfix.localizer.incident_document import from_document, repeat
    from firstfix.site.checkpoint import any_localizer_at_start

    document, arrays = load_incident(file)
    saved = from_document(document, arrays, load_map(map_path) if map_path else None)
    incident = saved.incident
    site = None if site_path is None else load_site(site_path)
    if serve:
        _serve(incident, file.stem, port, site)
        return
    localizer = any_localizer_at_start(incident, site, cache_folder())
    repeated = []
    with progress(len(incident.inputs), "repeating") as done:
        for step in repeat(incident, localizer):
            repeated.append(step)
            done("")
    summary = _summary(saved, repeated)
    if as_object:
        typer.echo(json.dumps(summary))
    else:
        _print(summary, saved.other_software)
    if check and not summary["identical"]:
        raise typer.Exit(OTHER_OUTPUTS)


def _serve(incident: Incident, name: str, port: int, site: Site | None) -> None:
    """Serve the page of an incident until it is interrupted."""
    from firstfix.lab.live.replayed_incident import ReplayedIncident
    from firstfix.web.server import listen, make_server

    access = Address("127.0.0.1", port, may_steer=False).access()
    with listen("127.0.0.1", port) as listening:
        replayed = ReplayedIncident(incident, name, access, site)
        announce(listening, access)
        with suppress(KeyboardInterrupt):  # the usual end
            make_server(replayed.page).run(sockets=[listening])
        replayed.stop()
    raise typer.Exit(INTERRUPTED)


def _summary(saved: SavedIncident, repeated: list[Repeated]) -> dict[str, Any]:
    """Return what happened, for people and programs."""
    from firstfix.localizer.outputs import InitialPose, MapSwitched, Status, TrackedPose

    incident, changes = saved.incident, []
    state, tracked = None, None
    for step in repeated:
        for output in step.outputs:
            if isinstance(output, TrackedPose):
                tracked = output
            elif isinstance(output, MapSwitched):
                changes.append({"stamp": output.stamp, "map_id": output.map_id})
            elif isinstance(output, InitialPose):
                pose = [round(float(number), 3) for number in output.T_map_base]
                changes.append({"stamp": output.stamp, "found_at": pose})
            elif isinstance(output, Status) and output.state is not state:
                state = output.state
                reason = output.reason
                changes.append({"stamp": output.stamp, "state": state.value, "reason": reason})
    different = [step.given.stamp for step in repeated if not step.is_identical]
    stamps = [given.stamp for given in incident.inputs]
    return {
        "cause": incident.cause.value,
        "reason": incident.reason,
        "seconds": max(stamps) - min(stamps) if stamps else 0.0,
        "inputs": len(incident.inputs),
        "outputs": sum(map(len, incident.outputs)),
        "software": saved.software,
        "changes": changes,
        "last_pose": None if tracked is None else list(tracked.T_map_base),
        "identical": not different,
        "first_different": different[0] if different else None,
    }


def _print(summary: dict[str, Any], other_software: str) -> None:
    typer.echo(f"{summary['cause']}: {summary['reason']}")
    typer.echo(
        f"{summary['seconds']:.1f} s, {summary['inputs']} inputs, {summary['outputs']} outputs, "
        f"recorded with firstfix {summary['software'].get('firstfix', 'unknown')}"
    )
    hidden = len(summary["changes"]) - _MOST_LINES
    if hidden > 0:
        typer.echo(f"({hidden} earlier changes: --json shows them)")
    for change in summary["changes"][-_MOST_LINES:]:
        if "map_id" in change:
            typer.echo(f"{change['stamp']:14.3f}  map            {change['map_id']}")
        elif "state" in change:
            typer.echo(f"{change['stamp']:14.3f}  {change['state']:14}  {change['reason']}")
        else:
            x, y, yaw = change["found_at"]
            typer.echo(f"{change['stamp']:14.3f}  found at       x {x} m, y {y} m, yaw {yaw} rad")
    if summary["last_pose"] is not None:
        x, y, yaw = summary["last_pose"]
        typer.echo(f"last pose: x {x:.3f} m, y {y:.3f} m, yaw {yaw:.3f} rad")
    if summary["identical"]:
        typer.echo("repeated: all outputs are identical to the last bit")
        return
    other = f"; other software: {other_software}" if other_software else ""
    typer.echo(f"repeated: outputs differ from stamp {summary['first_different']:.3f} on{other}")
