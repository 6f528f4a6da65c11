"""Nav2's localization_launch.py with firstfix in place of AMCL; include it instead.

It takes the same arguments and the same ``nav2_params.yaml``: the node keeps the name ``amcl``, so
that its section there and the lifecycle manager's list of nodes stay as they are.

``ros2 launch firstfix localization.launch.py map:=map.yaml params_file:=nav2_params.yaml``
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from nav2_common.launch import RewrittenYaml

# Name, default (None: required) and meaning.
ARGUMENTS = (
    ("params_file", None, "parameters of Nav2"),
    ("map", "", "YAML of the map; empty: yaml_filename of map_server in params_file"),
    ("namespace", "", "namespace of the robot"),
    ("use_sim_time", "false", "whether a simulator or a bag provides the time"),
    ("autostart", "true", "whether the lifecycle manager starts the nodes"),
    ("use_respawn", "false", "whether a node that crashed is started again"),
)
# Relative, so that several robots have transforms of their own, as in Nav2.
REMAPPINGS = [("/tf", "tf"), ("/tf_static", "tf_static")]


def generate_launch_description():
    """Return the arguments and the nodes."""
    declared = [
        DeclareLaunchArgument(name, default_value=default, description=meaning)
        for name, default, meaning in ARGUMENTS
    ]
    return LaunchDescription([*declared, OpaqueFunction(function=start)])


def start(context):
    """Return map server, localization and their lifecycle manager."""
    given = {name: LaunchConfiguration(name).perform(context) for name, _, _ in ARGUMENTS}
    time = {"use_sim_time": given["use_sim_time"].lower() == "true"}
    file = RewrittenYaml(
        source_file=given["params_file"],
        root_key=given["namespace"],
        param_rewrites={},
        convert_types=True,
    )
    map_file = {"yaml_filename": given["map"]} if given["map"] else {}
    common = {
        "namespace": given["namespace"],
        "output": "screen",
        "remappings": REMAPPINGS,
        "respawn": given["use_respawn"].lower() == "true",
        "respawn_delay": 2.0,
    }
    manager = {
        "autostart": given["autostart"].lower() == "true",
        "node_names": ["map_server", "amcl"],
    }
    return [
        Node(
            package="nav2_map_server",
            executable="map_server",
            name="map_server",
            parameters=[file, time | map_file],
            **common,
        ),
        Node(
            package="firstfix",
            executable="firstfix_node",
            name="amcl",
            parameters=[file, time | {"mode": "full"}],
            **common,
        ),
        Node(
            package="nav2_lifecycle_manager",
            executable="lifecycle_manager",
            name="lifecycle_manager_localization",
            namespace=given["namespace"],
            output="screen",
            parameters=[time | manager],
        ),
    ]
