"""A robot with two lasers: their scans are compared with the map together.

``ros2 launch firstfix two_lasers.launch.py scan_topics:='front/scan rear/scan'``
"""

from pathlib import Path

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration

NODE = Path(__file__).resolve().with_name("firstfix.launch.py")
# Name, default and meaning; the other arguments are those of firstfix.launch.py.
ARGUMENTS = (
    ("scan_topics", "front/scan rear/scan", "topics of the lasers, with spaces between them"),
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
