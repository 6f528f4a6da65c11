"""A simulated robot, such as in Gazebo: the time comes from the topic clock.

``ros2 launch firstfix simulation.launch.py mode:=full``
"""

from pathlib import Path

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration

NODE = Path(__file__).resolve().with_name("firstfix.launch.py")
# Name, default and meaning; the other arguments are those of firstfix.launch.py.
ARGUMENTS = (
    ("use_sim_time", "true", "whether the simulator provides the time"),
    ("mode", "bootstrap", "bootstrap: an AMCL runs beside; full: firstfix is the AMCL"),
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
