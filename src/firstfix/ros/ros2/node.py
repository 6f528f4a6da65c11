"""The node for ROS 2, over rclpy: a lifecycle node, as those of Nav2 are."""

from __future__ import annotations

import gc
import math
import signal
import traceback
from typing import Any

import rclpy
from rcl_interfaces.msg import ParameterDescriptor, SetParametersResult
from rclpy.exceptions import InvalidParameterValueException, NameValidationException
from rclpy.executors import ExternalShutdownException
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from rclpy.utilities import remove_ros_args

from firstfix.core.errors import InputError
from firstfix.ros.node import MakeNode, Node
from firstfix.ros.parameters import Parameter, configured, parameters
from firstfix.ros.ros2.localized import LocalizedService
from firstfix.ros.ros2.transport import Ros2
from firstfix.ros.ros2.types import described

AUTOSTART, BOND_TIMEOUT = "autostart", "bond_timeout"
# Default and meaning of the parameters that only this transport has.
RCLPY_PARAMETERS: dict[str, tuple[bool | float, str]] = {
    AUTOSTART: (False, "configure and activate at the start, without a lifecycle manager"),
    BOND_TIMEOUT: (
        4.0,
        "silence after which the lifecycle manager treats the node as dead, s; 0: no bond",
    ),
}


class Ros2Node(LifecycleNode):
    """A lifecycle node: configure reads the parameters; topics are in use while it is active.

    Parameters
    ----------
    make_node : MakeNode
        Makes the localizing node.
    """

    def __init__(self, make_node: MakeNode = Node) -> None:
        super().__init__("firstfix")
        self._make_node = make_node
        self._transport: Ros2 | None = None
        self._localized = LocalizedService(self)
        for parameter in parameters():
            self._declare(parameter)
        for name, (default, text) in RCLPY_PARAMETERS.items():
            alone = ParameterDescriptor(description=text, dynamic_typing=True)
            self.declare_parameter(name=name, value=default, descriptor=alone)
        self.add_on_set_parameters_callback(self._check_parameters)

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Read the parameters, advertise and subscribe; start to prepare kernels and map."""
        try:
            self._warn_of_unknown()
            config = configured(self._values())
            self._transport = Ros2(self, config, self._bond_timeout(), self._localized)
            self._transport.start(self._make_node(config, self._transport))
        except (InputError, NameValidationException) as error:
            self.end()
            self.get_logger().error(" ".join(str(error).split()))
            return TransitionCallbackReturn.FAILURE
        except Exception:  # noqa: BLE001 - rclpy would drop it silently
            self.get_logger().error(f"an error of firstfix itself:\n{traceback.format_exc()}")
            return TransitionCallbackReturn.ERROR
        return super().on_configure(state)

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Publish and receive."""
        result = super().on_activate(state)
        if self._transport is not None:
            self._transport.activate()
        return result

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Neither publish nor receive; keep the pose and the map."""
        if self._transport is not None:
            self._transport.deactivate()
        return super().on_deactivate(state)

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Discard everything."""
        self.end()
        return super().on_cleanup(state)

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Discard everything."""
        self.end()
        return super().on_shutdown(state)

    def on_error(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Discard everything, so that it can be configured again."""
        self.end()
        return super().on_error(state)

    def end(self) -> None:
        """Stop the worker, and destroy topics and services."""
        if self._transport is not None:
            self._transport.close()
        self._transport = None
        # Reference cycles keep arrays of 10 MB, which do not trigger the collector.
        gc.collect()

    def _values(self) -> dict[str, Any]:
        return {each.name: self.get_parameter(each.name).value for each in parameters()}

    def _bond_timeout(self) -> float:
        value = self.get_parameter(BOND_TIMEOUT).value
        if isinstance(value, (int, float)) and 0.0 <= value < math.inf:
            return float(value)
        raise InputError(
            expected=f"{BOND_TIMEOUT} in seconds, 0 or more",
            received=f"{value!r:.60}",
            remedy="the default is 4.0; 0.0 means no bond",
        )

    def _check_parameters(self, changed: list[Any]) -> SetParametersResult:
        """Refuse values that the next configure would refuse, with the reason."""
        values = self._values()
        new = {each.name: each.value for each in changed if each.name in values}
        if (reason := _refusal(new)) is None and _refusal(values) is None:
            reason = _refusal(values | new)  # such as min_particles above max_particles
        if reason is not None:
            return SetParametersResult(successful=False, reason=reason)
        return SetParametersResult(successful=True)

    def _declare(self, parameter: Parameter) -> None:
        try:
            self.declare_parameter(parameter.name, parameter.default, described(parameter))
        except InvalidParameterValueException:
            # Out of range: kept for on_configure, which reports it in one sentence.
            anything = ParameterDescriptor(dynamic_typing=True)
            self.declare_parameter(parameter.name, parameter.default, anything)

    def _warn_of_unknown(self) -> None:
        # rclpy ignores undeclared parameters silently, and misspelt ones are undeclared.
        for name, parameter in getattr(self, "_parameter_overrides", {}).items():
            if not self.has_parameter(name):
                try:
                    configured({name: parameter.value})
                except InputError as error:
                    self.get_logger().warning(str(error))


def run(arguments: list[str], make_node: MakeNode = Node) -> None:
    """Run the node until ROS ends it.

    Parameters
    ----------
    arguments : list of str
        Of ROS: ``--ros-args -r topic:=other -p parameter:=value``.
    make_node : MakeNode
        Makes the localizing node.

    Raises
    ------
    InputError
        If an argument is not one of ROS.
    """
    # rclpy shuts down on SIGINT by itself. Python's KeyboardInterrupt could strike anywhere: inside
    # rclpy's conversion of a message, or in the cleanup at the second Ctrl-C.
    before = signal.signal(signal.SIGINT, lambda *_: None)
    try:
        _initialise(["firstfix", *arguments])
        _run(Ros2Node(make_node))
    finally:
        rclpy.try_shutdown()
        signal.signal(signal.SIGINT, before)


def _run(node: Ros2Node) -> None:
    try:
        is_alone = node.get_parameter(AUTOSTART).value is True
        if is_alone and node.trigger_configure() == TransitionCallbackReturn.SUCCESS:
            node.trigger_activate()
        while rclpy.ok():
            _spin(node)
    except ExternalShutdownException:
        pass  # rclpy was shut down
    finally:
        node.end()
        node.destroy_node()


def _spin(node: Ros2Node) -> None:
    try:
        rclpy.spin(node)
    except RuntimeError as error:
        if not rclpy.ok():
            return  # the shutdown interrupted a call
        # Older rclpy ends after a request for a transition that the state does not have
        # (ros2/rclpy#1209).
        if "transition" not in str(error):
            raise
        node.get_logger().error(f"ignored: {error}")


def _refusal(values: dict[str, Any]) -> str | None:
    """Return why parameters cannot be used, in one line; None if they can."""
    try:
        configured(values)
    except InputError as error:
        return " ".join(str(error).split())
    return None


def _initialise(command: list[str]) -> None:
    try:
        not_for_ros = remove_ros_args(args=command)[1:]
        if not not_for_ros:
            rclpy.init(args=command)
            return
        received = " ".join(not_for_ros)
    except RuntimeError as error:
        received = str(error)
    raise InputError(
        expected="arguments of ROS 2",
        received=received,
        remedy="write them as `--ros-args -p mode:=full -r scan:=base_scan`",
    )
