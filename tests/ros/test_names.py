import contextlib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firstfix.core.errors import InputError
from firstfix.ros.names import Names


@pytest.mark.parametrize(
    ("name", "namespace", "full"),
    [
        ("scan", "/", "/scan"),
        ("scan", "/robot1", "/robot1/scan"),
        ("events/cliff", "/fleet/robot1", "/fleet/robot1/events/cliff"),
        ("/tf", "/robot1", "/tf"),
        ("~/scan", "/robot1", "/robot1/finder/scan"),
        ("~", "/", "/finder"),
    ],
)
def test_names_are_relative_full_or_private(name, namespace, full):
    assert Names("finder", namespace).resolve(name) == full


def test_the_first_rule_that_fits_counts():
    names = Names("finder", "/", (("scan", "a"), ("scan", "b")))
    assert names.resolve("scan") == "/a"
    assert names.resolve("map") == "/map"


def test_rules_compare_full_names():
    names = Names("finder", "/robot1", (("/tf", "tf"), ("/robot1/scan", "/lidar")))
    assert names.resolve("/tf") == "/robot1/tf"
    assert names.resolve("scan") == "/lidar"
    assert names.resolve("~/scan") == "/robot1/finder/scan"


@pytest.mark.parametrize("name", ["", "1scan", "a b", "a//b", "a/", "/", "~scan", "é", "a\n"])
def test_an_invalid_name_is_refused(name):
    with pytest.raises(InputError, match="letters, digits and underscores"):
        Names().resolve(name)
    with pytest.raises(InputError):
        Names("finder", "/", ((name, "scan"),))


@pytest.mark.parametrize("namespace", ["", "robot1", "/robot1/", "//", "/1"])
def test_namespaces_begin_with_a_slash_and_end_without(namespace):
    with pytest.raises(InputError, match="namespace"):
        Names("finder", namespace)


@given(st.text())
def test_any_text_is_a_name_or_an_error(text):
    with contextlib.suppress(InputError):
        assert Names().resolve(text).startswith("/")
