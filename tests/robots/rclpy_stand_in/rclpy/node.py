"""A node: parameters, log, ends of topics."""

from __future__ import annotations

import inspect
import math
from dataclasses import dataclass
from typing import Any

from builtin_interfaces.msg import Time
from rcl_interfaces.msg import ParameterDescriptor, SetParametersResult

from rclpy.exceptions import (
    InvalidParameterTypeException,
    InvalidParameterValueException,
    ParameterAlreadyDeclaredException,
)
from rclpy.graph import End, RCLError, world
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.task import Future


@dataclass(frozen=True)
class Parameter:
    name: str
    value: Any


class Clock:
    def now(self) -> Clock:
        return self

    def to_msg(self) -> Any:
        return Time(sec=1, nanosec=0)


class Logger:
    """Refuses, as rclpy's does, to log with another severity from the same place."""

    def __init__(self) -> None:
        self._severities: dict[Any, str] = {}

    def info(self, message: str) -> bool:
        return self._log("info", message)

    def warning(self, message: str) -> bool:
        return self._log("warning", message)

    def error(self, message: str) -> bool:
        return self._log("error", message)

    def _log(self, severity: str, message: str) -> bool:
        assert isinstance(message, str)
        caller = inspect.currentframe().f_back.f_back
        place = (caller.f_code, caller.f_lasti)
        if self._severities.setdefault(place, severity) != severity:
            raise ValueError("Logger severity cannot be changed between calls.")
        world.log.append((severity, message))
        return True


class Client:
    """Calls a service of `world.services` at once."""

    def __init__(self, srv_type: Any, srv_name: str) -> None:
        self.srv_type, self._name, self.is_destroyed = srv_type, srv_name, False

    def wait_for_service(self, timeout_sec: float) -> bool:
        assert not self.is_destroyed
        assert timeout_sec > 0.0
        return self._name in world.services

    def call_async(self, request: Any) -> Future:
        assert isinstance(request, self.srv_type.Request)
        future = Future()
        future.set_result(world.ask(self._name, request))
        return future


class Node:
    def __init__(self, node_name: str) -> None:
        if not world.is_ok:
            raise RCLError("cannot create node")
        self.name = node_name
        self._logger = Logger()
        self._parameters: dict[str, Parameter] = {}
        self._descriptors: dict[str, Any] = {}
        self._on_set_parameters: list[Any] = []
        given = world.arguments.parameters
        self._parameter_overrides = {name: Parameter(name, given[name]) for name in given}
        self.declare_parameter("use_sim_time", value=False)

    def get_logger(self) -> Logger:
        return self._logger

    def declare_parameter(self, name: str, value: Any = None, descriptor: Any = None) -> Parameter:
        descriptor = descriptor or ParameterDescriptor()
        assert isinstance(descriptor, ParameterDescriptor)
        if name in self._parameters:
            raise ParameterAlreadyDeclaredException(name)
        override = self._parameter_overrides.get(name, Parameter(name, value))
        if not descriptor.dynamic_typing and type(override.value) is not type(value):
            raise InvalidParameterTypeException(name)
        self._keep(override, descriptor)
        self._descriptors[name] = descriptor
        return override

    def set_parameter(self, name: str, value: Any) -> Any:
        """Do what ``ros2 param set`` does; return the result."""
        parameter = Parameter(name, value)
        for callback in self._on_set_parameters:
            result = callback([parameter])
            if not result.successful:
                return result
        self._keep(parameter, self._descriptors[name])
        return SetParametersResult(successful=True)

    def add_on_set_parameters_callback(self, callback: Any) -> None:
        inspect.signature(callback).bind([])
        self._on_set_parameters.append(callback)

    def describe_parameter(self, name: str) -> Any:
        return self._descriptors[name]

    def has_parameter(self, name: str) -> bool:
        return name in self._parameters

    def get_parameter(self, name: str) -> Parameter:
        return self._parameters[name]

    def _keep(self, parameter: Parameter, descriptor: Any) -> None:
        ranges = []
        if type(parameter.value) is int:
            ranges = descriptor.integer_range
        elif type(parameter.value) is float:
            ranges = descriptor.floating_point_range
        assert len(ranges) <= 1
        for limits in ranges:
            assert math.isfinite(limits.from_value)
            assert math.isfinite(limits.to_value)
            if not limits.from_value <= parameter.value <= limits.to_value:
                raise InvalidParameterValueException(parameter.name)
        self._parameters[parameter.name] = parameter

    def get_name(self) -> str:
        return self.name

    def get_clock(self) -> Clock:
        return Clock()

    def create_timer(self, timer_period_sec: float, callback: Any) -> Any:
        assert timer_period_sec > 0.0
        inspect.signature(callback).bind()
        world.timers.append(callback)
        return callback

    def destroy_timer(self, timer: Any) -> bool:
        world.timers.remove(timer)
        return True

    def create_publisher(self, msg_type: Any, topic: str, qos_profile: int) -> End:
        assert isinstance(msg_type, type)
        reliable = QoSProfile(
            depth=qos_profile,
            reliability=ReliabilityPolicy.RELIABLE,
            durability=DurabilityPolicy.VOLATILE,
        )
        return world.join(End(msg_type, topic, reliable))

    def destroy_publisher(self, publisher: End) -> bool:
        world.leave(publisher)
        return True

    def create_subscription(
        self, msg_type: Any, topic: str, callback: Any, qos_profile: Any
    ) -> End:
        assert isinstance(msg_type, type)
        inspect.signature(callback).bind(object())
        return world.join(End(msg_type, topic, qos_profile, callback))

    def create_service(self, srv_type: Any, srv_name: str, callback: Any) -> str:
        inspect.signature(callback).bind(object(), object())
        assert srv_name not in world.services
        world.services[srv_name] = (srv_type, callback)
        return srv_name

    def create_client(self, srv_type: Any, srv_name: str) -> Client:
        return Client(srv_type, srv_name)

    def destroy_client(self, client: Client) -> bool:
        client.is_destroyed = True
        return True

    def destroy_subscription(self, subscription: End) -> bool:
        world.leave(subscription)
        return True

    def destroy_service(self, service: str) -> bool:
        del world.services[service]
        return True

    def destroy_node(self) -> None:
        self._parameters.clear()
