# SPDX-License-Identifier: GPL-2.0-or-later
"""ros2 launch stage_ros2 stage.launch.py world:=simple.world [naming:=stage_ros] [speed:=2.0] ...
ros2 launch stage_ros2 stage.launch.py map:=map.yaml robots:="turtlebot3_burger:0,0,0 turtlebot4:1,2,90"

Starts the node and, with rviz:=true, RViz on simulated time. Each parameter of the node is an argument. A params_file
has rates of topics and qos_overrides, too, and takes precedence over arguments. With lifecycle:=true, a lifecycle_manager
with node_names: [stage] and bond_timeout: 0.0 can load and run the world.
"""

from pathlib import Path

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

# Maps each argument to its default, the type of the node's parameter of that name, and its description.
ARGUMENTS = {
    "naming": ("stage_ros2", str, "naming scheme of topics and frames: stage_ros2 or stage_ros"),
    "odom_frame_id": ("odom", str, "frame of the odometry"),
    "base_link_frame_id": ("base_link", str, "frame of a robot's body"),
    "base_footprint_frame_id": ("base_footprint", str, "frame of a robot on the floor"),
    "map_frame_id": ("map", str, "frame of the world"),
    "enforce_prefixes": ("false", bool, "use a prefix for a single robot, too"),
    "publish_tf": ("true", bool, "publish /tf and /tf_static"),
    "publish_map_tf": ("false", bool, "publish the true transform from the map to the odometry"),
    "publish_map": ("false", bool, "publish /map and /map_metadata, which normally a map_server or SLAM does"),
    "map_resolution": ("0.05", float, "side of a cell of /map, metres"),
    "map_height": ("-1.0", float, "/map has what a lidar at this height sees, metres; below 0: all that stands still"),
    "namespaced_tf": ("never", str, "frames of each robot on /PREFIX/tf, without the prefix: never, also or only"),
    "wheel_radius": ("0.0", float, "radius of wheels, metres; 0.0: a fifth of their separation"),
    "wheel_separation": ("0.0", float, "distance of the left from the right wheels, metres; 0.0: the width of the body"),
    "ticks_per_turn": ("1000", int, "ticks that encoders count in a turn of a wheel"),
    "imu_gyro_noise": ("0.0", float, "standard deviation of the noise of gyroscopes, rad/s"),
    "imu_gyro_walk": ("0.0", float, "standard deviation of the change of their bias in a second, rad/s"),
    "imu_accelerometer_noise": ("0.0", float, "standard deviation of the noise of accelerometers, m/s2"),
    "imu_accelerometer_walk": ("0.0", float, "standard deviation of the change of their bias in a second, m/s2"),
    "single_beams": ("scan", str, "the kind of message for sensors with one ray: scan, range or none"),
    "sensor_qos": ("reliable", str, "reliability of sensors' topics: reliable or best_effort"),
    "ranges": ("rep117", str, "range of a ray that hits nothing: rep117 (infinity) or stage (the maximum)"),
    "clock_rate": ("0.0", float, "messages on /clock per second of real time; 0.0: one per step"),
    "stamped_cmd_vel": ("false", bool, "messages on cmd_vel are of the type TwistStamped"),
    "cars_turn": ("false", bool, "angular.z on cmd_vel of cars is a turn rate"),
    "always_on": ("false", bool, "run all sensors from the beginning"),
    "base_watchdog_timeout": ("0.2", float, "simulated seconds without a command after which a robot stops; 0.0: never"),
    "steps": ("1", int, "number of steps per call of the service step"),
    "seed": ("-1", int, "seed for the service reset; -1: keep the current seed"),
    "snapshot_file": ("", str, "file of the services snapshot and restore; empty: in memory"),
    "speed": ("1.0", float, "simulated seconds per second of real time; 0.0: as many as possible"),
    "paused": ("false", bool, "start in the paused state"),
    "log_file": ("", str, "an MCAP file in which the run is recorded; empty: none"),
    "gui": ("false", bool, "open the page that shows the world"),
    "lockstep": ("", str, "names of the robots and other clients that the simulation waits for"),
    "lockstep_interval": ("0.0", float, "simulated seconds between two answers of a client; 0.0: one per step"),
}


def words_of(world: str, map_file: str, robots: str, lifecycle: str = "false") -> list[str]:
    """The arguments of the node's program: a world, or a map with robots that blanks separate."""
    if lifecycle.lower() in ("true", "1"):
        return ["--lifecycle", *words_of(world, map_file, robots)]
    if not map_file:
        return [world]
    return ["--map", map_file, *(word for robot in robots.split() for word in ("--robot", robot))]


def start_node(context: LaunchContext) -> list[Node]:
    """Return the node, when the values of arguments are known."""
    given = [LaunchConfiguration(name).perform(context) for name in ("world", "map", "robots", "lifecycle")]
    file = LaunchConfiguration("params_file").perform(context)
    parameters = {name: ParameterValue(LaunchConfiguration(name), value_type=kind)
                  for name, (_, kind, _) in ARGUMENTS.items()}
    return [Node(package="stage_ros2", executable="stage_ros2", name="stage", output="screen",
                 arguments=words_of(*given), parameters=[parameters, *([file] if file else [])])]


def generate_launch_description() -> LaunchDescription:
    """Return the node and, on request, RViz."""
    view = str(Path(__file__).resolve().parent.parent / "rviz" / "stage.rviz")
    return LaunchDescription([
        DeclareLaunchArgument("world", default_value="simple.world",
                              description="world file, or a shipped one's name"),
        DeclareLaunchArgument("map", default_value="",
                              description="instead of a world: a map.yaml, or another file of stage import"),
        DeclareLaunchArgument("robots", default_value="",
                              description="with a map: robots, such as turtlebot3_burger:1,2,90, separated by blanks"),
        DeclareLaunchArgument("lifecycle", default_value="false",
                              description="start a lifecycle node, which transitions configure and activate"),
        DeclareLaunchArgument("params_file", default_value="", description="YAML file with more parameters"),
        DeclareLaunchArgument("rviz", default_value="false", description="start RViz"),
        *(DeclareLaunchArgument(name, default_value=default, description=text)
          for name, (default, _, text) in ARGUMENTS.items()),
        OpaqueFunction(function=start_node),
        Node(package="rviz2", executable="rviz2", arguments=["-d", view],
             parameters=[{"use_sim_time": True}], condition=IfCondition(LaunchConfiguration("rviz"))),
    ])
