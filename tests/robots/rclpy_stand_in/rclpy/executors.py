"""How `spin` ends."""


class ExternalShutdownException(Exception):
    """ROS has ended."""
