"""Which maps a folder or a ``site.yaml`` has; every fault is one sentence."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from firstfix.core.errors import FirstfixError
from firstfix.core.se2 import SE2
from firstfix.io.maps.site_skeleton import write_site_skeleton
from firstfix.io.maps.site_yaml import read_site

MAP = "image: map.pgm\nresolution: 0.05\n"


def put(folder: Path, files: dict[str, str]) -> Path:
    for name, text in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)
    return folder


def test_a_folder_of_maps_needs_no_description(tmp_path: Path) -> None:
    put(
        tmp_path,
        {
            "hall.yaml": MAP,
            "hall.zones.yaml": "zones: {}",
            "a/map.yaml": MAP,
            "b/c/first.yml": MAP,
            "params.yaml": "amcl: {}",
        },
    )
    found = read_site(tmp_path)
    assert [one.id for one in found.maps] == ["a", "b/c/first", "hall"]
    assert found.transitions == ()


def test_a_description_says_where_the_maps_are_and_how_they_are_connected(tmp_path: Path) -> None:
    put(
        tmp_path,
        {
            "site.yaml": """
maps:
  ground: floors/ground.yaml
  1: {map: first.yaml, building: A, floor: 1, pose: [1, -2, 0.5], zones: {lobby: [[0, 0], [1, 0], [1, 1]]}}
transitions:
  lift: {kind: lift, ends: [{map: ground, pose: [1, 2, 0]}, {map: 1, pose: [3.5, 2, 3]}]}
"""  # noqa: E501
        },
    )
    for path in (tmp_path, tmp_path / "site.yaml"):
        found = read_site(path)
        ground, first = found.maps
        assert (ground.id, ground.path) == ("ground", tmp_path / "floors" / "ground.yaml")
        assert (first.id, first.building, first.floor) == ("1", "A", "1")
        assert first.T_site_map == SE2(1.0, -2.0, 0.5)
        assert first.zones == {"lobby": ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0))}
        (lift,) = found.transitions
        assert (lift.id, lift.kind) == ("lift", "lift")
        assert [(end.map_id, end.pose) for end in lift.ends] == [
            ("ground", SE2(1.0, 2.0, 0.0)),
            ("1", SE2(3.5, 2.0, 3.0)),
        ]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "an empty file"),
        ("site: hospital", "has no maps"),
        ("maps: []", "has no maps"),
        ("maps: {a: x.yaml, a: y.yaml}", "Two maps .* have the id 'a'"),
        ("maps: {1: x.yaml, '1': y.yaml}", "the same id"),
        ("maps: {a: 3}", "cannot be read: 3"),
        ("maps: {a: {file: x.yaml}}", "names no file"),
        ("maps: {a: {map: x.yaml, flor: 1}}", "unknown key 'flor'"),
        ("maps: {a: x.yaml}\nlifts: {}", "unknown key 'lifts'"),
        ("maps: {a: {map: x.yaml, pose: [1, 2]}}", "pose of the map 'a'"),
        ("maps: {a: {map: x.yaml, pose: [1, .nan, 0]}}", "pose of the map 'a'"),
        ("maps: {a: {map: x.yaml, zones: {b: 1}}}", "zone b"),
        ("maps: {a: x.yaml}\ntransitions: [1]", "transitions .* cannot be read"),
        ("maps: {a: x.yaml}\ntransitions: {l: {ends: []}}", "has not two ends"),
        (
            "maps: {a: x}\ntransitions: {l: {ends: [{map: a, pose: [0, 0, 0]}, {map: roof}]}}",
            "leads to the map 'roof', which is not among the maps",
        ),
        (
            "maps: {a: x.yaml}\ntransitions: {l: {ends: [{map: a}, {map: a, pose: [0, 0, 0]}]}}",
            "pose of the transition 'l'",
        ),
        ("maps: &x {a: *x}", "plain YAML"),
        ("maps: !!python/object:os.system {}", "plain YAML"),
    ],
)
def test_a_fault_is_one_sentence(tmp_path: Path, text: str, message: str) -> None:
    put(tmp_path, {"site.yaml": text})
    with pytest.raises(FirstfixError, match=message) as caught:
        read_site(tmp_path)
    assert "\n" not in str(caught.value)


def test_two_maps_of_one_name(tmp_path: Path) -> None:
    put(tmp_path, {"hall.yaml": MAP, "hall/map.yaml": MAP})
    with pytest.raises(FirstfixError, match="Two maps have the id 'hall'"):
        read_site(tmp_path)


@pytest.mark.parametrize("path", ["nowhere", "a\0b", "empty"])
def test_no_maps_at_all(tmp_path: Path, path: str) -> None:
    (tmp_path / "empty").mkdir()
    with pytest.raises(FirstfixError, match="There is no"):
        read_site(tmp_path / path)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(st.binary(max_size=200))
def test_any_bytes_are_read_or_refused(tmp_path: Path, data: bytes) -> None:
    (tmp_path / "site.yaml").write_bytes(b"maps: {a: x.yaml}\n" + data)
    try:
        read_site(tmp_path)
    except FirstfixError as error:
        assert str(error)  # noqa: PT017 - the only error there may be


def test_a_skeleton_has_all_maps_and_zones_and_leaves_the_lifts_to_a_person(tmp_path: Path) -> None:
    zones = "zones: {door: [[0, 0], [1, 0], [1, 1]]}"
    put(
        tmp_path,
        {"hall.yaml": MAP, "hall.zones.yaml": zones, "a: b/map.yaml": MAP, "no/1.yaml": MAP},
    )
    before = read_site(tmp_path)
    written = write_site_skeleton(tmp_path)
    after = read_site(tmp_path)
    assert written == tmp_path / "site.yaml"
    assert [(m.id, m.path) for m in after.maps] == [(m.id, m.path) for m in before.maps]
    assert {m.id: m.zones for m in after.maps if m.zones} == {
        "hall": {"door": ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0))}
    }
    # What a person fills in can be read.
    filled = written.read_text().replace("# transitions:", "transitions:")
    written.write_text(filled.replace("#   lift:", "  lift:"))
    (lift,) = read_site(tmp_path).transitions
    assert [end.map_id for end in lift.ends] == [before.maps[0].id, before.maps[-1].id]


@pytest.mark.parametrize("given", [".", "site.yaml"])
def test_a_skeleton_replaces_nothing(tmp_path: Path, given: str) -> None:
    put(tmp_path, {"hall.yaml": MAP, "site.yaml": "maps: {hall: hall.yaml}"})
    with pytest.raises(FirstfixError, match=r"has a site\.yaml already"):
        write_site_skeleton(tmp_path / given)
