"""One node that finds the robot, and configures and activates itself.

``ros2 launch firstfix firstfix.launch.py map:=map.yaml mode:=full``
"""

from pathlib import Path

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

PARAMETERS = Path(__file__).resolve().parents[1] / "config" / "firstfix.yaml"

# Name, default and meaning; what is empty is left to the file of parameters.
ARGUMENTS = (
    ("params_file", str(PARAMETERS), "file of parameters"),
    ("namespace", "", "namespace of the robot"),
    ("mode", "", "bootstrap: an AMCL runs beside; full: firstfix is the AMCL"),
    ("map", "", "YAML of the map; empty: from the topic map"),
    ("scan_topics", "", "topics of several lasers, with spaces between them; empty: one, scan"),
    ("use_sim_time", "false", "whether a simulator or a bag provides the time"),
    ("autostart", "true", "whether the node is its own lifecycle manager"),
)


def generate_launch_description():
    """Return the arguments and the node."""
    declared = [
        DeclareLaunchArgument(name, default_value=default, description=meaning)
        for name, default, meaning in ARGUMENTS
    ]
    return LaunchDescription([*declared, OpaqueFunction(function=start)])


def start(context):
    """Return the node, with the parameters of the arguments."""
    given = {name: LaunchConfiguration(name).perform(context) for name, _, _ in ARGUMENTS}
    chosen = {name: given[name].lower() == "true" for name in ("use_sim_time", "autostart")}
    chosen |= {name: given[name] for name in ("mode", "scan_topics") if given[name]}
    if given["map"]:
        chosen["yaml_filename"] = str(Path(given["map"]).absolute())
    node = Node(
        package="firstfix",
        executable="firstfix_node",
        name="firstfix",
        namespace=given["namespace"],
        output="screen",
        parameters=[given["params_file"], chosen],
        # Relative, so that several robots have transforms of their own, as in Nav2.
        remappings=[("/tf", "tf"), ("/tf_static", "tf_static")],
    )
    return [node]
