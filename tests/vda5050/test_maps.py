"""Names of maps, and the register of those that are known."""

from __future__ import annotations

from pathlib import Path

import pytest

from firstfix.core.errors import InputError
from firstfix.core.grid import OccupancyGrid
from firstfix.io.maps.map_server import save_map
from firstfix.vda5050.maps import KnownMap, MapName, MapRegister, read_map, read_map_name


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("hall", MapName("hall")),
        ("hall@3", MapName("hall", "3")),
        ("a@b@2.0", MapName("a@b", "2.0")),
        ("Halle 7/Süd", MapName("Halle 7/Süd")),
    ],
)
def test_names(text: str, name: MapName):
    assert read_map_name(text) == name


@pytest.mark.parametrize("text", ["", "@", "@3", "hall@", "x" * 300, "a\nb"])
def test_names_that_are_none(text: str):
    with pytest.raises(InputError, match="map id"):
        read_map_name(text)


def test_a_map_of_an_option(hall_plan: OccupancyGrid, tmp_path: Path):
    save_map(hall_plan, tmp_path / "hall=1.yaml")
    known = read_map(f"hall@2={tmp_path}/hall=1.yaml")
    assert known.name == MapName("hall", "2")
    assert known.grid.resolution == hall_plan.resolution
    assert read_map(f"hall={tmp_path}/hall=1.yaml").name.version == known.key[:12]


@pytest.mark.parametrize("text", ["hall", "hall=", "=hall.yaml", "hall=none.yaml", "@1=none.yaml"])
def test_maps_of_options_that_are_none(text: str):
    with pytest.raises(InputError):
        read_map(text)


def test_two_maps_of_one_name(hall_plan: OccupancyGrid):
    twice = KnownMap(MapName("hall", "1"), "key", hall_plan)
    with pytest.raises(InputError, match="hall version 1 twice"):
        MapRegister(MapName("hall", "1"), [twice])
    with pytest.raises(InputError, match="twice"):
        MapRegister(MapName("cellar"), [twice, twice])


def test_the_first_map_gets_the_hash_as_version(hall_plan: OccupancyGrid):
    register = MapRegister(MapName("hall"))
    assert register.id_in_use == "hall"
    assert register.entries == ()
    register.receive(hall_plan)
    (entry,) = register.entries
    assert (entry.id, len(entry.version), entry.is_enabled) == ("hall", 12, True)


def test_a_first_map_that_is_another_known_one(hall_plan: OccupancyGrid):
    from firstfix.io.saved_pose import map_key

    known = KnownMap(MapName("cellar", "1"), map_key(hall_plan), hall_plan)
    register = MapRegister(MapName("hall"), [known])
    register.receive(hall_plan)
    assert register.id_in_use == "cellar"
