"""The service behind Ray Serve: ``serve run firstfix.fleet.ray_serve:build site=/maps workers=8``.

Ray Serve has the HTTP port and restarts the front. There is one front, because it remembers the
robots; the maps are in the actors of `RayEngine`.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from firstfix.core.errors import InputError
from firstfix.fleet.ray_engine import RayEngine  # before Ray, for its environment

from ray import serve  # isort: skip

from firstfix.fields.cache import cache_folder
from firstfix.fleet.app import make_app
from firstfix.fleet.fleet import Fleet
from firstfix.fleet.jobs import ShardedSite, parts_for, spread
from firstfix.fleet.service import Service
from firstfix.io.maps.site_yaml import read_site
from firstfix.web.access_control import AccessPolicy

MEMORY = 4_000_000_000
"""Prepared maps that all workers hold together, bytes."""


def build(arguments: dict[str, str]) -> Any:
    """Build the application of Ray Serve.

    Parameters
    ----------
    arguments : dict of str to str
        ``site``: path of the site on all nodes; ``workers``: their number. The token is
        ``FIRSTFIX_TOKEN`` of the environment.

    Returns
    -------
    serve.Application
        For ``serve.run`` or a RayService of KubeRay.

    Raises
    ------
    InputError
        If an argument or the token is missing.
    """
    try:
        site, workers = Path(arguments["site"]), int(arguments["workers"])
    except (KeyError, ValueError) as error:
        raise InputError("Pass site=PATH and workers=N as arguments.") from error
    token = os.environ.get("FIRSTFIX_TOKEN")
    if not token:
        raise InputError("Set FIRSTFIX_TOKEN: Ray Serve can be reached by other machines.")

    def front() -> Any:
        maps = read_site(site).maps
        shards = spread(maps, parts_for(len(maps), workers))
        copies = max(1, workers // len(shards))
        size = MEMORY // len(shards)
        engine = RayEngine(ShardedSite(site, shards * copies, cache_folder() / "sites", size), None)
        service = Service(Fleet(engine, shards, copies))
        return make_app(service, AccessPolicy(token, loopback_only=False))

    class FleetFront:
        """Answers HTTP requests."""

    deployed = serve.deployment(num_replicas=1, max_ongoing_requests=1000)
    return deployed(serve.ingress(front)(FleetFront)).bind()
