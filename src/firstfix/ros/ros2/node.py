"""The node for ROS 2, over rclpy: a lifecycle node, as those of Nav2 are."""

from __future__ import annotations

import traceback

import rclpy
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.exceptions import InvalidParameterValueException, NameValidationException
from rclpy.executors import ExternalShutdownException
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from rclpy.utilities import remove_ros_args

from firstfix.core.errors import InputError
from firstfix.ros.node import MakeNode, Node
from firstfix.ros.parameters import Parameter, configured, parameters
from firstfix.ros.ros2.transport import Ros2
from firstfix.ros.ros2.types import described

AUTOSTART = "autostart"


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
        for parameter in parameters():
            self._declare(parameter)
        text = "configure and activate at the start, without a lifecycle manager"
        alone = ParameterDescriptor(description=text, dynamic_typing=True)
        self.declare_parameter(name=AUTOSTART, value=False, descriptor=alone)

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Read the parameters, advertise and subscribe; start to prepare kernels and map."""
        try:
            self._warn_of_unknown()
            names = [parameter.name for parameter in parameters()]
            config = configured({name: self.get_parameter(name).value for name in names})
            self._transport = Ros2(self, config)
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
    _initialise(["firstfix", *arguments])
    node = Ros2Node(make_node)
    try:
        is_alone = node.get_parameter(AUTOSTART).value is True
        if is_alone and node.trigger_configure() == TransitionCallbackReturn.SUCCESS:
            node.trigger_activate()
        while rclpy.ok():
            _spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass  # how rclpy tells that it is time to go
    finally:
        node.end()
        node.destroy_node()
        rclpy.try_shutdown()


def _spin(node: Ros2Node) -> None:
    try:
        rclpy.spin(node)
    except RuntimeError as error:
        # Asked for a transition that its state does not have, older rclpy ends (ros2/rclpy#1209).
        if "transition" not in str(error):
            raise
        node.get_logger().error(f"ignored: {error}")


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
