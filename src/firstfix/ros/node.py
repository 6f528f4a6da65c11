"""A node without its transport: callbacks queue messages, one worker thread localizes."""

from __future__ import annotations

import math
import threading
import time
import traceback
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from firstfix.belief.prior import AnyOf, Region
from firstfix.core.errors import InputError, MapError
from firstfix.core.grid import OccupancyGrid
from firstfix.core.scan import LaserScan
from firstfix.fields.cache import cache_folder
from firstfix.global_localization.prior import Prior
from firstfix.io.incident_files import IncidentFolder, incident_folder
from firstfix.io.maps.map_server import load_map
from firstfix.io.maps.zones import load_zones
from firstfix.io.ros_messages.outgoing import occupancy_grid
from firstfix.localizer.inputs import Input, NewMap, Reset
from firstfix.localizer.localizer import Localizer
from firstfix.localizer.outputs import MapSwitched, Output
from firstfix.localizer.precompile import precompile
from firstfix.ros.channels import SENSORS, Channel, subscribed_topics
from firstfix.ros.exact_stamps import ExactStamps
from firstfix.ros.inbox import Inbox
from firstfix.ros.incident_keeper import IncidentKeeper
from firstfix.ros.map_files import map_at, map_from, path_of, result_of
from firstfix.ros.map_server_client import MapServerClient
from firstfix.ros.message_converter import MessageConverter
from firstfix.ros.node_config import NodeConfig
from firstfix.ros.output_publisher import OutputPublisher
from firstfix.ros.pose_memory import PoseMemory
from firstfix.ros.services import LoadResult, Request
from firstfix.ros.transport import Severity, Transport
from firstfix.site.floors import AnyLocalizer, SiteLocalizer
from firstfix.site.site import Site

Watcher = Callable[[Input, list[Output], AnyLocalizer], None]

# A warning on one subject is repeated after this time at the earliest, s.
_REPEAT_S = 10.0
# A topic that is silent for this time is reported, s.
_SILENCE_S = 5.0
# `stop` waits for the worker this long: it may be in the compiler, s.
_STOP_S = 3.0


class Node:
    """The localizer of a robot; callbacks of any thread feed it.

    Parameters
    ----------
    config : NodeConfig
        Parameters.
    transport : Transport
        Makes and sends messages; called from the worker only.
    watchers : sequence of Watcher
        Called by the worker with each input and its outputs, such as the live page.
    """

    def __init__(
        self, config: NodeConfig, transport: Transport, watchers: Sequence[Watcher] = ()
    ) -> None:
        self._config = config
        self._transport = transport
        self._watchers = watchers
        self._inbox: Inbox[tuple[Channel, Any]] = Inbox()
        stamps = ExactStamps()
        self._converter = MessageConverter(config, stamps, self.warn_throttled)
        self._publisher = OutputPublisher(config, stamps, transport)
        self._memory = PoseMemory(config, transport.log)
        self.incidents = IncidentKeeper(
            config.incident_seconds,
            IncidentFolder(incident_folder(config.incident_folder)),
            lambda text: self.warn_throttled("incidents", text),
        )
        self._site: Site | None = None
        self._map_server: MapServerClient | None = None
        self._localizer = self._new_localizer()
        self._changes: OccupancyGrid | None = None
        self._prior: Prior | None = None  # of the first search
        self._map: NewMap | None = None  # of yaml_filename, then the one in use
        self._logged_at: dict[str, float] = {}
        self._received: set[Channel] = set()
        self._scan_at = (
            math.inf
        )  # arrival of the last scan; infinite before the first and once stale
        self.expects_topics_since = math.inf  # infinite while the transport passes nothing on
        self._worker = threading.Thread(target=self._work, name="firstfix", daemon=True)

    def start(self) -> None:
        """Start the worker; it prepares kernels and map first.

        Raises
        ------
        InputError
            If the map file cannot be used.
        """
        self._load_own_map()
        self.expects_topics_since = time.monotonic()
        self._worker.start()

    def stop(self) -> None:
        """Stop the worker after the message that it is handling, unless that takes long."""
        self._inbox.close()
        if self._map_server is not None:
            self._map_server.close()
        if self._worker.is_alive():
            self._worker.join(_STOP_S)

    def receive(self, channel: Channel, message: Any = None) -> None:
        """Queue a message or a request; returns at once.

        Parameters
        ----------
        channel : Channel
            Where it came from.
        message : message
            None for a request.
        """
        if not _is_scan(channel, message):
            self._inbox.put((channel, message))
            return
        self._scan_at = time.monotonic()  # here: a search may keep the worker for seconds
        of_robot = isinstance(message, LaserScan)
        sensor = message.sensor if of_robot else message.header.frame_id
        self._inbox.put_scan((channel, message), (channel, sensor))

    def give(self, given: Input) -> None:
        """Queue an input that needs no conversion, such as a hint from the live page."""
        self.receive(Channel.INPUT, given)

    def answer(self, request: Request, message: Any) -> dict[str, Any]:
        """Handle the request of a service; returns at once unless it reads or writes a file.

        Parameters
        ----------
        request : Request
            What the service does.
        message : message
            Its request.

        Returns
        -------
        dict
            The fields of its response; those that are missing keep their defaults.
        """
        if request is Request.SEARCH:
            self.receive(Channel.RESET)
        elif request is Request.UPDATE:
            self.receive(Channel.UPDATE)
        elif request is Request.HINT:
            self.receive(Channel.INITIAL_POSE, message.pose)
        elif request is Request.SET_MAP:
            self.receive(Channel.MAP, message.map)
            self.receive(Channel.INITIAL_POSE, message.initial_pose)
            return {"success": True}
        elif request is Request.LOAD_MAP:
            return self._load_map(str(message.map_url))
        elif request is Request.SAVE_INCIDENT:
            return self._save_incident()
        return {}

    def warn_throttled(
        self, subject: str, text: str, severity: Severity = Severity.WARNING
    ) -> None:
        """Write a line to the log, unless this subject had one less than 10 s ago.

        Parameters
        ----------
        subject : str
            The key of the rate limit.
        text : str
            One sentence for people.
        severity : Severity, optional
            Of the line.
        """
        now = time.monotonic()
        if now - self._logged_at.get(subject, -_REPEAT_S) >= _REPEAT_S:
            self._logged_at[subject] = now
            self._transport.log(severity, text)

    def _save_incident(self) -> dict[str, Any]:
        try:
            path = self.incidents.folder.path / self.incidents.save("a service was called")
        except InputError as error:
            return {"success": False, "message": f"{error}"}
        return {"success": True, "message": f"{path}"}

    def _load_map(self, url: str) -> dict[str, Any]:
        try:
            loaded = map_from(path_of(url))
            if self._site is not None:
                self._name_map(self._site, path_of(url))
        except MapError as error:
            self.warn_throttled(f"map {url}", f"{error}")
            return {"result": int(_refusal(url))}
        if self._site is None:
            self.give(loaded)
        frame = self._config.global_frame_id
        grid = occupancy_grid(self._transport.make, 0.0, frame, loaded.grid)
        return {"result": int(LoadResult.SUCCESS), "map": grid}

    def _name_map(self, site: Site, path: Path) -> None:
        """Take a request for one of the maps of a site as a hint: something knows the floor."""
        map_id = map_at(path, site)
        if map_id is None:
            raise MapError(f"{path} is not a map of the site. Load one of its maps.")
        self.receive(Channel.MAP_HINT, self._transport.make("std_msgs/String", data=map_id))

    def _load_own_map(self) -> None:
        if self._config.site:
            self._site = Site.load(self._config.site, cache_folder() / "sites")
            self._localizer = self._new_localizer()
        if service := self._config.load_map_service:
            self._map_server = MapServerClient(
                partial(self._transport.load_map, service),
                lambda text: self.warn_throttled(service, text),
            )
        if self._config.changes_layer:
            self._changes = load_map(self._config.changes_layer)
        if self._config.yaml_filename:
            self._map = map_from(Path(self._config.yaml_filename))
            if self._changes is not None:
                self._map.grid.with_changes(self._changes)  # refused now, not in the worker
            self._prior = self._prior_of_zones(self._map.grid)

    def _prior_of_zones(self, grid: OccupancyGrid) -> Prior | None:
        names = self._config.zones.split()
        if not names:
            return None
        zones = load_zones(self._config.yaml_filename)
        for name in names:
            if name not in zones:
                raise InputError(f"There is no zone {name}. Choose one of {', '.join(zones)}.")
        regions = tuple(Region(zones[name]) for name in names)
        for region in regions:
            region.check(grid)
        return regions[0] if len(regions) == 1 else AnyOf(regions)

    def _work(self) -> None:
        self._try(self._prepare)
        while not self._inbox.is_closed:
            self._take_all(
                self._inbox.take(min(_SILENCE_S, self._config.scan_timeout or _SILENCE_S))
            )
            self._check_scans()
            if time.monotonic() - self.expects_topics_since >= _SILENCE_S:
                self._report_silent_topics()
        self._try(self._memory.close)
        self._try(self.incidents.close)
        # The arrays must not wait for the collector of reference cycles.
        del self._localizer, self._converter

    def _prepare(self) -> None:
        precompile(self._config.localizer.amcl)
        if self._site is not None:
            self._site.prepare()
            for fault in self._site.faults.values():
                self.warn_throttled(fault, fault)
        if self._map is not None:
            stamp, prior = self._map.stamp, self._prior
            self._handle_all(self._converter.use_map(self._map))
            if prior is not None:
                self._handle(Reset(stamp, prior))

    def _take_all(self, items: list[tuple[Channel, Any]]) -> None:
        for channel, message in items:
            if self._inbox.is_closed:
                return
            self._received.add(Channel.SCAN if _is_scan(channel, message) else channel)
            self._try(self._take, channel, message)

    def _take(self, channel: Channel, message: Any) -> None:
        if channel is Channel.INITIAL_POSE and self._publisher.is_own(message):
            return
        self._handle_all(self._converter.convert(channel, message))

    def _handle_all(self, inputs: list[Input]) -> None:
        for given in inputs:
            self._handle(given)
            hint = self._memory.hint_after(given)
            if hint is not None:
                self._handle(hint)

    def _handle(self, given: Input) -> None:
        if isinstance(given, NewMap) and self._changes is not None:
            given = self._with_changes(given, self._changes)
        try:
            outputs = self._localizer.handle(given)
        except MapError:
            self._converter.restore_map()
            raise
        except InputError:
            raise
        except Exception:
            self._replace_localizer(given)
            raise
        if isinstance(given, NewMap) and self._site is None:
            self._map = given
            self._publisher.publish_map_id(given.map_id)
        self._publish(given, outputs)

    def _with_changes(self, given: NewMap, layer: OccupancyGrid) -> NewMap:
        """Mark what is known to have changed; a map of other cells is used as it is."""
        try:
            return replace(given, grid=given.grid.with_changes(layer))
        except MapError as error:
            self.warn_throttled("changes_layer", f"changes_layer is not used. {error}")
            return given

    def _new_localizer(self) -> AnyLocalizer:
        if self._site is None:
            return Localizer(self._config.localizer, cache_folder())
        return SiteLocalizer(self._site, self._config.localizer, cache_folder())

    def _replace_localizer(self, given: Input) -> None:
        """Start over on the same map: an exception may have left the localizer half-changed."""
        self._localizer = self._new_localizer()
        text = "the localizer failed and was reset: searching the whole map again"
        self.warn_throttled("reset", text, Severity.ERROR)
        if isinstance(given, NewMap):
            self._converter.restore_map()
        if self._map is not None and self._site is None:
            known = replace(self._map, stamp=given.stamp)
            self._publish(known, self._localizer.handle(known))

    def _publish(self, given: Input, outputs: list[Output]) -> None:
        self._publisher.publish(outputs, self._localizer.particles)
        self._memory.keep(outputs)
        for output in outputs:
            if isinstance(output, MapSwitched):
                named = NewMap(output.stamp, output.grid, output.map_id)
                self._memory.hint_after(named)  # whose poses it keeps; a site needs no hint
                self._tell(named, [])
                if self._map_server is not None and self._site is not None:
                    self._map_server.ask(f"{self._site.maps[output.map_id].path.resolve()}")
        self._tell(given, outputs)

    def _tell(self, given: Input, outputs: list[Output]) -> None:
        self.incidents(given, outputs, self._localizer)
        for watch in self._watchers:
            watch(given, outputs, self._localizer)

    def _try(self, step: Callable[..., None], *given: Any) -> None:
        """Run a step; whatever a message contains, it must not end the node."""
        try:
            step(*given)
        except InputError as error:
            # The key is not the text, which may contain another number each time.
            self.warn_throttled(f"{type(error).__name__} {given[:1]}", f"{error}")
        except Exception:  # noqa: BLE001 - a worker that ends silently would be worse
            text = f"an error of firstfix itself:\n{traceback.format_exc()}"
            self.warn_throttled("error", text, Severity.ERROR)

    def _check_scans(self) -> None:
        """Publish once that the status is stale when scans stop."""
        silence_s = time.monotonic() - self._scan_at
        if 0.0 < self._config.scan_timeout < silence_s:
            self._scan_at = math.inf
            self._try(self._publisher.publish_stale, silence_s)

    def _report_silent_topics(self) -> None:
        """Name the topics without a message since the last report."""
        self.expects_topics_since = time.monotonic()
        topics = subscribed_topics(self._config)
        for channel in (Channel.MAP, Channel.SCAN):
            if channel in topics and channel not in self._received:
                topic = topics[channel]
                text = f"no message on {topic.name} ({topic.type_name}) for {_SILENCE_S:.0f} s"
                self.warn_throttled(channel.value, text)
        # A map comes once. Missing odometry is reported with each scan.
        self._received &= {Channel.MAP}


def _is_scan(channel: Channel, message: Any) -> bool:
    return channel in SENSORS or isinstance(message, LaserScan)


def _refusal(url: str) -> LoadResult:
    try:
        return result_of(path_of(url))
    except MapError:
        return LoadResult.MAP_DOES_NOT_EXIST


MakeNode = Callable[[NodeConfig, Transport], Node]
