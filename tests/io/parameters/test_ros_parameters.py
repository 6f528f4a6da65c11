"""The section of one node is found in every form of a parameter file."""

import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from firstfix.core.errors import InputError
from firstfix.io.parameters.ros_parameters import MAX_PARAMETER_BYTES, read_parameters

KNOWN = frozenset({"gain", "rate", "pose.x", "pose.y"})


@pytest.fixture
def read(tmp_path):
    def read(text: str | bytes) -> dict[str, object]:
        path = tmp_path / "params.yaml"
        path.write_bytes(text.encode() if isinstance(text, str) else text)
        found = read_parameters(path, "node", KNOWN)
        return dict(found)

    return read


@pytest.mark.parametrize(
    "text",
    [
        "node: {ros__parameters: {gain: 1}}",
        "/node: {ros__parameters: {gain: 1}}",
        "/robot1/node: {ros__parameters: {gain: 1}}",
        "robot1: {node: {ros__parameters: {gain: 1}}}",
        "/fleet: {/robot1: {node: {ros__parameters: {gain: 1}}}}",
        "/**: {ros__parameters: {gain: 1}}",
        "/*: {ros__parameters: {gain: 1}}",
        "/**: {node: {ros__parameters: {gain: 1}}}",
        "/**/node: {ros__parameters: {gain: 1}}",
        "gain: 1",
        "other: {ros__parameters: {gain: 2, gain: 3}}\nnode: {ros__parameters: {gain: 1}}",
        "/**: {ros__parameters: {use_sim_time: true}}\nnode: {ros__parameters: {gain: 1}}",
        "/**: {ros__parameters: {of_another: 1}, node: {ros__parameters: {gain: 1}}}",
    ],
)
def test_every_form_of_a_section_is_read(read, text):
    assert read(text) == {"gain": 1}


def test_names_are_dotted(read):
    text = "node: {ros__parameters: {pose: {x: 1, y: 2}, a.b: {c: 3}, empty: {}, list: [1]}}"
    assert list(read(text)) == ["pose.x", "pose.y", "a.b.c", "list"]


@pytest.mark.parametrize("text", ["pose: {x: 1}", "pose.x: 1", "unheard_of: 1\npose: {x: 1}"])
def test_parameters_without_a_section(read, text):
    assert read(text)["pose.x"] == 1


def test_the_later_of_a_wildcard_and_the_own_section_counts(read):
    wildcard = "/**: {ros__parameters: {gain: 1, rate: 1, of_another: 1}}\n"
    own = "node: {ros__parameters: {gain: 2, unheard_of: 2}}\n"
    assert read(wildcard + own) == {"gain": 2, "rate": 1, "unheard_of": 2}
    assert read(own + wildcard) == {"gain": 1, "rate": 1, "unheard_of": 2}


def test_a_section_may_be_empty(read):
    assert read("node: {ros__parameters: {}}") == {}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a: {ros__parameters: {}}\nb: {c: {ros__parameters: {}}}", "only '/a, /b/c'"),
        ("/**: {ros__parameters: {use_sim_time: true}}", r"only '/\*\*'"),
        ("node_2: {ros__parameters: {gain: 1}}", "only '/node_2'"),
        ("node: {gain: 1}", "put a line 'ros__parameters:' between 'node:' and"),
        ("{}", "received none"),
        ("/a/node: {ros__parameters: {}}\n/b/node: {ros__parameters: {}}", "'/a/node and /b/node'"),
        ("/a/**: {ros__parameters: {gain: 1}}\n/b/**: {ros__parameters: {gain: 1}}", "one section"),
        ("node: {ros__parameters: {}}\nnode: {ros__parameters: {}}", "'node' twice"),
        ("node: {ros__parameters: {gain: 1, gain: 2}}", "'gain' twice"),
        ("node: {ros__parameters: {pose: {x: 1}, pose.x: 2}}", "'pose.x' nested and with a dot"),
        ("node: {ros__parameters: }", "parameters below ros__parameters of '/node'"),
        ("node: {ros__parameters: [1]}", "a list"),
        ("gain: &a 1\nrate: *a", "anchors or aliases"),
        ("- node", "a list"),
        (b"\x89PNG\r\n\x1a\n\0\0", "plain YAML"),
        (b"\xff\xfe\x00", "plain YAML"),
        (b"a: 1 \n" * (MAX_PARAMETER_BYTES // 6 + 1), "at most 131072 bytes"),
    ],
)
def test_invalid_files_are_rejected_with_the_reason(read, text, message):
    with pytest.raises(InputError, match=message) as caught:
        read(text)
    assert "params.yaml" in str(caught.value)


KEYS = st.sampled_from(["node", "/**", "ros__parameters", "gain", "pose", "x", "a", "/b/node", ""])
TREES = st.recursive(
    st.none() | st.booleans() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(KEYS, inner, max_size=4),
    max_leaves=12,
)


def error_of(read, text: str | bytes) -> str:
    try:
        read(text)
    except InputError as error:
        return str(error)
    return ""


@settings(
    max_examples=2 * settings.default.max_examples,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
@given(st.dictionaries(KEYS, TREES, max_size=4))
def test_any_tree_is_read_or_rejected_in_one_line(read, tree):
    assert "\n" not in error_of(read, yaml.safe_dump(tree))


@settings(
    max_examples=2 * settings.default.max_examples,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
@given(st.binary(max_size=60))
def test_any_bytes_are_read_or_rejected_in_one_line(read, data):
    assert "\n" not in error_of(read, data)
