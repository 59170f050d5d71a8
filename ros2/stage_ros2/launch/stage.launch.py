# SPDX-License-Identifier: GPL-2.0-or-later
"""ros2 launch stage_ros2 stage.launch.py world:=simple.world [naming:=stage_ros] [speed:=2.0] ...

Starts the node and, with rviz:=true, RViz on simulated time.
"""

from pathlib import Path

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

# Maps each argument to its default, the type of the node's parameter of that name, and its description.
ARGUMENTS = {
    "naming": ("stage_ros2", str, "naming scheme of topics and frames: stage_ros2 or stage_ros"),
    "enforce_prefixes": ("false", bool, "use a prefix for a single robot, too"),
    "publish_tf": ("true", bool, "publish /tf and /tf_static"),
    "publish_map_tf": ("false", bool, "publish the true transform from the map to the odometry"),
    "publish_map": ("false", bool, "publish /map and /map_metadata, which normally a map_server or SLAM does"),
    "single_beams": ("scan", str, "the kind of message for sensors with one ray: scan, range or none"),
    "sensor_qos": ("reliable", str, "reliability of sensors' topics: reliable or best_effort"),
    "ranges": ("rep117", str, "range of a ray that hits nothing: rep117 (infinity) or stage (the maximum)"),
    "clock_rate": ("0.0", float, "messages on /clock per second of real time; 0.0: one per step"),
    "stamped_cmd_vel": ("false", bool, "messages on cmd_vel are of the type TwistStamped"),
    "speed": ("1.0", float, "simulated seconds per second of real time; 0.0: as many as possible"),
    "paused": ("false", bool, "start in the paused state"),
    "gui": ("false", bool, "open the page that shows the world"),
    "lockstep": ("", str, "names of the robots and other clients that the simulation waits for"),
}


def generate_launch_description() -> LaunchDescription:
    """Return the node and, on request, RViz."""
    view = str(Path(__file__).resolve().parent.parent / "rviz" / "stage.rviz")
    parameters = {name: ParameterValue(LaunchConfiguration(name), value_type=kind)
                  for name, (_, kind, _) in ARGUMENTS.items()}
    return LaunchDescription([
        DeclareLaunchArgument("world", default_value="simple.world",
                              description="world file, or a shipped one's name"),
        DeclareLaunchArgument("rviz", default_value="false", description="start RViz"),
        *(DeclareLaunchArgument(name, default_value=default, description=text)
          for name, (default, _, text) in ARGUMENTS.items()),
        Node(package="stage_ros2", executable="stage_ros2", name="stage", output="screen",
             arguments=[LaunchConfiguration("world")], parameters=[parameters]),
        Node(package="rviz2", executable="rviz2", arguments=["-d", view],
             parameters=[{"use_sim_time": True}], condition=IfCondition(LaunchConfiguration("rviz"))),
    ])
