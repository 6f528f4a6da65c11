"""Messages, services, parameters and qualities of service of ROS 2, by their names."""

from __future__ import annotations

import functools
import importlib
import math
from typing import Any

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from firstfix.core.errors import InputError
from firstfix.ros.channels import TF, Delivery, Topic
from firstfix.ros.parameters import Parameter

# Packages that ROS 2 names differently than `firstfix.ros.channels`.
_PACKAGES = {"kobuki": "kobuki_ros_interfaces"}
# Optional packages.
_OPTIONAL = ("bond", "kobuki", "nav2_msgs", "visualization_msgs")

# As in tf2: many nodes publish on this topic.
_TF_DEPTH = 100
_DEPTHS = {
    Delivery.SENSOR: 5,
    Delivery.RELIABLE: 10,
    Delivery.LATCHED: 1,
    Delivery.LATCHED_MANY: 100,
}
LATCHED = (Delivery.LATCHED, Delivery.LATCHED_MANY)


@functools.cache
def find(kind: str, type_name: str) -> Any | None:
    """Return the class of a message or a service.

    Parameters
    ----------
    kind : str
        ``msg`` or ``srv``.
    type_name : str
        ``package/Type``.

    Returns
    -------
    type or None
        None if an optional package is not installed, or too old to have the type.

    Raises
    ------
    InputError
        If a required package is not installed.
    """
    package, _, name = type_name.partition("/")
    module_name = f"{_PACKAGES.get(package, package)}.{kind}"
    try:
        return getattr(importlib.import_module(module_name), name, None)
    except ModuleNotFoundError as error:
        if package in _OPTIONAL:
            return None
        raise InputError(
            expected=f"the package {package} in this ROS 2",
            received=f"no module {error.name}",
            remedy=f"sudo apt install ros-$ROS_DISTRO-{package.replace('_', '-')}",
        ) from error


def make(type_name: str, /, **fields: Any) -> Any:
    """Build a message of ROS 2 from its fields."""
    if type_name == "diagnostic_msgs/DiagnosticStatus":
        fields["level"] = bytes([fields["level"]])  # a `byte` is one of bytes in rclpy
    kind: Any = find("msg", type_name)
    return kind(**fields)


def quality(topic: Topic) -> QoSProfile:
    """Return the quality of service of a topic, the same for both of its ends."""
    is_sensor, is_latched = topic.delivery is Delivery.SENSOR, topic.delivery in LATCHED
    return QoSProfile(
        depth=_TF_DEPTH if topic == TF else _DEPTHS[topic.delivery],
        reliability=ReliabilityPolicy.BEST_EFFORT if is_sensor else ReliabilityPolicy.RELIABLE,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if is_latched else DurabilityPolicy.VOLATILE,
    )


def described(parameter: Parameter) -> ParameterDescriptor:
    """Return the descriptor of a parameter, with a range where it has two ends.

    The type is dynamic, so that a whole number is accepted for a length; `configured` refuses other
    types in one sentence.
    """
    descriptor = ParameterDescriptor(
        description=parameter.description,
        additional_constraints=_constraints(parameter),
        dynamic_typing=True,
    )
    least, most = parameter.least, parameter.most
    if math.isfinite(least) and math.isfinite(most):
        if isinstance(parameter.default, float):
            between = FloatingPointRange(from_value=float(least), to_value=float(most), step=0.0)
            descriptor.floating_point_range = [between]
        else:
            whole = IntegerRange(from_value=int(least), to_value=int(most), step=0)
            descriptor.integer_range = [whole]
    return descriptor


def _constraints(parameter: Parameter) -> str:
    if parameter.choices:
        return f"one of {', '.join(parameter.choices)}"
    if math.isfinite(parameter.least) and not math.isfinite(parameter.most):
        return f"at least {parameter.least:g}"
    return ""
