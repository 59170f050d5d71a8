# SPDX-License-Identifier: GPL-2.0-or-later
"""ros2 launch stage_ros2_cpp stage.launch.py world:=/path/to/arena.world [parameters:=/path/to/parameters.yaml]

Starts a container with the node as a component. Other components can be loaded into it: they get the messages
without copies.
"""

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import ComposableNodeContainer
from launch_ros.descriptions import ComposableNode


def start_container(context: LaunchContext) -> list[ComposableNodeContainer]:
    """The container with the node, whose parameters are the file of the argument `parameters` and the world."""
    file = LaunchConfiguration("parameters").perform(context)
    given = [file] if file else []
    node = ComposableNode(
        package="stage_ros2_cpp", plugin="stage_ros2_cpp::StageNode", name="stage",
        parameters=[*given, {"world_file": LaunchConfiguration("world")}],
        extra_arguments=[{"use_intra_process_comms": True}])
    return [ComposableNodeContainer(
        name=LaunchConfiguration("container"), namespace="", package="rclcpp_components",
        executable="component_container", composable_node_descriptions=[node], output="screen")]


def generate_launch_description() -> LaunchDescription:
    """Called by ros2 launch."""
    return LaunchDescription([
        DeclareLaunchArgument("world", description="path of the world file"),
        DeclareLaunchArgument("parameters", default_value="", description="a YAML file with parameters of the node"),
        DeclareLaunchArgument("container", default_value="stage_container", description="name of the container"),
        OpaqueFunction(function=start_container)])
