"""A map server that is away, slow or refuses is asked again; the newest map counts."""

from __future__ import annotations

import threading

import pytest
from recorder import wait_for

from firstfix.ros.map_server_client import MapServerClient


def test_a_map_server_that_is_away_is_asked_again_and_named_once_it_is_there() -> None:
    answers = iter([OSError("there is no service"), 2, 0])
    asked: list[str] = []
    warned: list[str] = []

    def load(path: str) -> int:
        asked.append(path)
        answer = next(answers)
        if isinstance(answer, OSError):
            raise answer
        return answer

    client = MapServerClient(load, warned.append, again_s=0.01)
    client.ask("first.yaml")
    wait_for(lambda: len(asked) == 3)
    client.close()
    client._thread.join(5.0)
    assert asked == ["first.yaml"] * 3
    assert warned == [
        f"the map server has not loaded first.yaml: {why}; trying again"
        for why in ("there is no service", "invalid map data")
    ]


@pytest.mark.parametrize("last", ["second.yaml", "third.yaml"])
def test_of_maps_that_wait_the_newest_is_loaded(last: str) -> None:
    goes_on, asked = threading.Event(), []

    def load(path: str) -> int:
        asked.append(path)
        goes_on.wait(5.0)
        return 0

    client = MapServerClient(load, lambda _: None)
    client.ask("first.yaml")
    wait_for(lambda: asked)
    client.ask("second.yaml")
    client.ask(last)
    goes_on.set()
    wait_for(lambda: asked[-1] == last)
    client.close()
    client._thread.join(5.0)
    assert asked == ["first.yaml", last]
