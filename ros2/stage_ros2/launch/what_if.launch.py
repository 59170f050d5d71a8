# SPDX-License-Identifier: GPL-2.0-or-later
"""ros2 launch stage_ros2 what_if.launch.py world:=robot.world robot:=robot goal:="[4.0, 0.0]" ...

Starts the node that drives a robot by simulated futures. For several robots, launch it once for each namespace.
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
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


def generate_launch_description() -> LaunchDescription:
    """Return the node."""
    parameters = {name: LaunchConfiguration(name) if kind is list else
                  ParameterValue(LaunchConfiguration(name), value_type=kind) for name, (_, kind, _) in ARGUMENTS.items()}
    parameters["use_sim_time"] = ParameterValue(LaunchConfiguration("use_sim_time"), value_type=bool)
    return LaunchDescription([
        DeclareLaunchArgument("world", description="world file with the robot"),
        DeclareLaunchArgument("namespace", default_value="", description="namespace of the robot's topics"),
        DeclareLaunchArgument("use_sim_time", default_value="false", description="time comes from /clock"),
        *(DeclareLaunchArgument(f"{topic}_topic", default_value=topic, description=f"name of the topic {topic}")
          for topic in TOPICS),
        *(DeclareLaunchArgument(name, default_value=default, description=text)
          for name, (default, _, text) in ARGUMENTS.items()),
        Node(package="stage_ros2", executable="what_if", name="what_if", namespace=LaunchConfiguration("namespace"),
             output="screen", arguments=[LaunchConfiguration("world")], parameters=[parameters],
             remappings=[(topic, LaunchConfiguration(f"{topic}_topic")) for topic in TOPICS]),
    ])
