"""The service behind Ray Serve: ``serve run firstfix.fleet.ray_serve:build site=/maps workers=8``.

Ray Serve has the HTTP port and restarts the front. There is one front, because it remembers the
robots; the maps are in the actors of `RayEngine`. A robot whose map is known is answered by a
replica of `KnownMaps` that holds this map: Ray Serve routes by map, and drops those that were not
asked for lately.
"""

from __future__ import annotations

import asyncio
import os
from pathlib import Path
from typing import Any

from firstfix.core.errors import InputError
from firstfix.fleet.ray_engine import RayEngine, answer_of  # before Ray, for its environment

from ray import serve  # isort: skip

from firstfix.fields.cache import cache_folder
from firstfix.fleet.app import make_app
from firstfix.fleet.fleet import Fleet
from firstfix.fleet.jobs import Done, Job, ShardedSite, open_map, parts_for, run_job, spread
from firstfix.fleet.service import Service
from firstfix.io.maps.site_yaml import read_site
from firstfix.site.site import Site
from firstfix.web.access_control import AccessPolicy

MOST_MAPS = 20
"""Maps that a replica of `KnownMaps` holds."""

MEMORY = 4_000_000_000
"""Prepared maps that all workers hold together, bytes."""


class KnownMaps:
    """Searches the maps of robots that know theirs.

    Parameters
    ----------
    site : Path
        The site, at the same path on all nodes.
    """

    def __init__(self, site: Path) -> None:
        self._site = site

    @serve.multiplexed(max_num_models_per_replica=MOST_MAPS)  # type: ignore[untyped-decorator]
    async def open(self, map_id: str) -> Site:
        """Open a map; Ray Serve keeps it."""
        return await asyncio.to_thread(open_map, self._site, map_id, cache_folder() / "sites")

    async def run(self, job: Job[Any]) -> Done[Any]:
        """Do a job with the map that the request names."""
        site = await self.open(serve.get_multiplexed_model_id())
        return await asyncio.to_thread(run_job, job, site)


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
        known = serve.get_deployment_handle("KnownMaps", serve.get_replica_context().app_name)

        async def on_map(map_id: str, job: Job[Any]) -> Done[Any]:
            return await answer_of(
                known.options(method_name="run", multiplexed_model_id=map_id).remote(job)
            )

        service = Service(Fleet(engine, shards, copies, maps=maps, on_map=on_map))
        return make_app(service, AccessPolicy(token, loopback_only=False))

    class FleetFront:
        """Answers HTTP requests.

        Parameters
        ----------
        known : handle
            Of `KnownMaps`, so that Ray Serve starts it.
        """

        def __init__(self, known: Any) -> None:
            self._known = known

    # They take no cores of their own: a query goes to them or to the workers.
    known_maps = serve.deployment(
        num_replicas=max(1, workers // 4), ray_actor_options={"num_cpus": 0}
    )
    deployed = serve.deployment(num_replicas=1, max_ongoing_requests=1000)
    fronts = deployed(serve.ingress(front)(FleetFront))
    return fronts.bind(known_maps(KnownMaps).bind(site))
