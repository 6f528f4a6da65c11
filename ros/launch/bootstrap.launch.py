"""Beside a stock Nav2 with its AMCL: finds the robot, and publishes the pose on initialpose.

``ros2 launch firstfix bootstrap.launch.py``
"""

from pathlib import Path

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration

NODE = Path(__file__).resolve().with_name("firstfix.launch.py")
# Name, default and meaning; the other arguments are those of firstfix.launch.py.
ARGUMENTS = (
    ("mode", "bootstrap", "bootstrap: an AMCL runs beside"),
    ("autostart", "true", "whether the node is its own lifecycle manager"),
)


def generate_launch_description():
    """Return the arguments, and the node with them."""
    declared = [
        DeclareLaunchArgument(name, default_value=default, description=meaning)
        for name, default, meaning in ARGUMENTS
    ]
    given = {name: LaunchConfiguration(name) for name, _, _ in ARGUMENTS}
    source = PythonLaunchDescriptionSource(str(NODE))
    node = IncludeLaunchDescription(source, launch_arguments=given.items())
    return LaunchDescription([*declared, node])
