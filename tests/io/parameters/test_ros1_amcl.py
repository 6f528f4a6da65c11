"""Names of ROS 1 are rejected with their new names."""

import pytest

from firstfix.amcl.config import MotionModel
from firstfix.io.parameters.ros1_amcl import GONE, NEW_NAMES, ros1_remedy
from firstfix.ros.parameters import defaults

NAMES = set(defaults())


def test_the_new_names_exist_and_the_old_ones_do_not():
    assert set(NEW_NAMES.values()) <= NAMES
    assert not NAMES & (set(NEW_NAMES) | GONE)


@pytest.mark.parametrize("old", sorted(NEW_NAMES))
def test_the_remedy_has_the_new_name(old):
    assert NEW_NAMES[old] in (ros1_remedy(old, "0.2") or "")


@pytest.mark.parametrize(
    ("text", "model"),
    [
        ("diff", MotionModel.DIFFERENTIAL),
        ("diff-corrected", MotionModel.DIFFERENTIAL),
        ("omni", MotionModel.OMNIDIRECTIONAL),
        ("omni-corrected", MotionModel.OMNIDIRECTIONAL),
    ],
)
def test_the_motion_model_is_translated_with_its_value(text, model):
    assert f"'robot_model_type: {model.value}'" in (ros1_remedy("odom_model_type", text) or "")


def test_removed_and_unknown_names():
    assert "delete" in (ros1_remedy("gui_publish_rate", "10") or "")
    assert ros1_remedy("alpha1", "0.2") is None
    assert ros1_remedy("anything", "") is None
