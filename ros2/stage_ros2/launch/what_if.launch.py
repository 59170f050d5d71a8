# SPDX-License-Identifier: GPL-2.0-or-later
"""ros2 launch stage_ros2 what_if.launch.py world:=robot.world robot:=robot goal:="[4.0, 0.0]" ...

Starts the node that drives a robot by simulated futures. For several robots, launch it once for each namespace.
A params_file has any other parameters of the node, and takes precedence over arguments.
"""

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

# Maps each argument to its default, the type of the node's parameter of that name, and its description.
ARGUMENTS = {
    "robot": ("robot", str, "name of the robot in the world file"),
    "rate": ("10.0", float, "decisions per second"),
    "samples": ("10", int, "futures of each plan"),
    "max_risk": ("0.1", float, "plans with a greater chance of a collision are chosen only if all have one"),
    "delay": ("0.1", float, "seconds from the stamp of a measurement to the obedience to a command that answers it"),
    "robot_radius": ("0.25", float, "of the robot, metres"),
    "localization": ("both", str, "how the robot knows its place: both, odom or pose"),
    "map_topic": ("/map", str, "topic of the map; empty: there is none"),
    "others": ("", str, "topics of others that must be heard, separated by commas"),
    "tracks": ("", str, "topics of trackers, separated by commas"),
    "goal": ("[]", list, "first goal: [x, y]"),
    "stamped_cmd_vel": ("false", bool, "messages on cmd_vel are of the type TwistStamped"),
}
TOPICS = ("odom", "pose", "goal_pose", "cmd_vel")


def start_node(context: LaunchContext) -> list[Node]:
    """Return the node, when the values of arguments are known."""
    kinds = {name: kind for name, (_, kind, _) in ARGUMENTS.items()} | {"use_sim_time": bool}
    if LaunchConfiguration("goal").perform(context).strip() == "[]":
        del kinds["goal"]  # launch_ros accepts no empty lists
    parameters = {name: LaunchConfiguration(name) if kind is list else
                  ParameterValue(LaunchConfiguration(name), value_type=kind) for name, kind in kinds.items()}
    file = LaunchConfiguration("params_file").perform(context)
    return [Node(package="stage_ros2", executable="what_if", name="what_if", namespace=LaunchConfiguration("namespace"),
                 output="screen", arguments=[LaunchConfiguration("world")],
                 parameters=[parameters, *([file] if file else [])],
                 remappings=[(topic, LaunchConfiguration(f"{topic}_topic")) for topic in TOPICS])]


def generate_launch_description() -> LaunchDescription:
    """Return the node."""
    return LaunchDescription([
        DeclareLaunchArgument("world", description="world file with the robot"),
        DeclareLaunchArgument("namespace", default_value="", description="namespace of the robot's topics"),
        DeclareLaunchArgument("use_sim_time", default_value="false", description="time comes from /clock"),
        DeclareLaunchArgument("params_file", default_value="", description="YAML file with more parameters"),
        *(DeclareLaunchArgument(f"{topic}_topic", default_value=topic, description=f"name of the topic {topic}")
          for topic in TOPICS),
        *(DeclareLaunchArgument(name, default_value=default, description=text)
          for name, (default, _, text) in ARGUMENTS.items()),
        OpaqueFunction(function=start_node),
    ])
