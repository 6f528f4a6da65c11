from collections.abc import Callable
from typing import Any

from rcl_interfaces.msg import ParameterDescriptor
from rclpy.impl.rcutils_logger import RcutilsLogger
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile
from rclpy.service import Service
from rclpy.subscription import Subscription

class Node:
    def __init__(self, node_name: str) -> None: ...
    def get_logger(self) -> RcutilsLogger: ...
    def declare_parameter(
        self,
        name: str,
        value: bool | int | float | str,
        descriptor: ParameterDescriptor | None = None,
    ) -> Parameter: ...
    def has_parameter(self, name: str) -> bool: ...
    def get_parameter(self, name: str) -> Parameter: ...
    def create_subscription(
        self,
        msg_type: Any,
        topic: str,
        callback: Callable[[Any], None],
        qos_profile: QoSProfile | int,
    ) -> Subscription: ...
    def create_service(
        self, srv_type: Any, srv_name: str, callback: Callable[[Any, Any], Any]
    ) -> Service: ...
    def destroy_subscription(self, subscription: Subscription) -> bool: ...
    def destroy_service(self, service: Service) -> bool: ...
    def destroy_node(self) -> None: ...
