# SPDX-License-Identifier: GPL-2.0-or-later
"""Definitions of the messages, services and actions that PyPI's ROS wheels lack.

These are names, types and constants of public interfaces, without the originals' comments: tf2_msgs from
github.com/ros2/geometry2 (BSD-3-Clause), ackermann_msgs from github.com/ros-drivers/ackermann_msgs (BSD-3-Clause),
and simulation_interfaces from
github.com/ros-simulation/simulation_interfaces (Apache-2.0) as of its releases 1.x, from 1.2 on.
"""

from __future__ import annotations

from typing import NamedTuple


class Package(NamedTuple):
    """A ROS package of interfaces.

    Attributes:
        depends: names of the packages whose interfaces it uses.
        text: its definitions. Each begins with a line that has the name of its file in brackets.
    """

    depends: tuple[str, ...]
    text: str

    def files(self) -> dict[str, str]:
        """Contents of the files with definitions by their paths, such as "msg/TFMessage.msg"."""
        found = {}
        for part in self.text.split("[[")[1:]:
            name, _, body = part.partition("]]\n")
            found[f"{name.rpartition('.')[2]}/{name}"] = body
        return found


TF2_MSGS = """\
[[TFMessage.msg]]
geometry_msgs/TransformStamped[] transforms
"""

ACKERMANN_MSGS = """\
[[AckermannDrive.msg]]
float32 steering_angle
float32 steering_angle_velocity
float32 speed
float32 acceleration
float32 jerk
[[AckermannDriveStamped.msg]]
std_msgs/Header header
AckermannDrive drive
"""

SIMULATION_INTERFACES = """\
[[Bounds.msg]]
uint8 TYPE_EMPTY=0
uint8 TYPE_BOX=1
uint8 TYPE_CONVEX_HULL=2
uint8 TYPE_SPHERE=3
uint8 type
geometry_msgs/Vector3[] points
[[EntityCategory.msg]]
uint8 CATEGORY_OBJECT=0
uint8 CATEGORY_ROBOT=1
uint8 CATEGORY_HUMAN=2
uint8 CATEGORY_DYNAMIC_OBJECT=4
uint8 CATEGORY_STATIC_OBJECT=5
uint8 category
[[EntityFilters.msg]]
string filter
EntityCategory[] categories
TagsFilter tags
Bounds bounds
[[EntityInfo.msg]]
EntityCategory category
string description
string[] tags
[[EntityState.msg]]
std_msgs/Header header
geometry_msgs/Pose pose
geometry_msgs/Twist twist
geometry_msgs/Accel acceleration
[[NamedPose.msg]]
string name
string description
string[] tags
geometry_msgs/Pose pose
[[Resource.msg]]
string uri
string resource_string
[[Result.msg]]
uint8 RESULT_FEATURE_UNSUPPORTED=0
uint8 RESULT_OK=1
uint8 RESULT_NOT_FOUND=2
uint8 RESULT_INCORRECT_STATE=3
uint8 RESULT_OPERATION_FAILED=4
uint8 result
string error_message
[[SimulationState.msg]]
uint8 STATE_STOPPED=0
uint8 STATE_PLAYING=1
uint8 STATE_PAUSED=2
uint8 STATE_QUITTING=3
uint8 STATE_NO_WORLD=4
uint8 STATE_LOADING_WORLD=5
uint8 state
[[SimulatorFeatures.msg]]
uint8 SPAWNING=0
uint8 DELETING=1
uint8 NAMED_POSES=2
uint8 POSE_BOUNDS=3
uint8 ENTITY_TAGS=4
uint8 ENTITY_BOUNDS=5
uint8 ENTITY_BOUNDS_BOX=6
uint8 ENTITY_BOUNDS_CONVEX=7
uint8 ENTITY_CATEGORIES=8
uint8 SPAWNING_RESOURCE_STRING=9
uint8 ENTITY_STATE_GETTING=10
uint8 ENTITY_STATE_SETTING=11
uint8 ENTITY_INFO_GETTING=12
uint8 ENTITY_INFO_SETTING=13
uint8 SPAWNABLES=14
uint8 SIMULATION_RESET=20
uint8 SIMULATION_RESET_TIME=21
uint8 SIMULATION_RESET_STATE=22
uint8 SIMULATION_RESET_SPAWNED=23
uint8 SIMULATION_STATE_GETTING=24
uint8 SIMULATION_STATE_SETTING=25
uint8 SIMULATION_STATE_PAUSE=26
uint8 STEP_SIMULATION_SINGLE=31
uint8 STEP_SIMULATION_MULTIPLE=32
uint8 STEP_SIMULATION_ACTION=33
uint8 WORLD_LOADING=40
uint8 WORLD_RESOURCE_STRING=41
uint8 WORLD_TAGS=42
uint8 WORLD_UNLOADING=43
uint8 WORLD_INFO_GETTING=44
uint8 AVAILABLE_WORLDS=45
uint16[] features
string[] spawn_formats
string custom_info
[[Spawnable.msg]]
string uri
string description
Bounds spawn_bounds
[[TagsFilter.msg]]
string[] tags
uint8 FILTER_MODE_ANY=0
uint8 FILTER_MODE_ALL=1
uint8 filter_mode
[[WorldResource.msg]]
string name
Resource world_resource
string description
string[] tags
[[DeleteEntity.srv]]
string entity
---
Result result
[[GetAvailableWorlds.srv]]
string[] additional_sources
TagsFilter filter
bool offline_only
bool continue_on_error
---
uint8 DEFAULT_SOURCES_FAILED=101
Result result
WorldResource[] worlds
[[GetCurrentWorld.srv]]
---
uint8 NO_WORLD_LOADED=101
Result result
WorldResource world
[[GetEntities.srv]]
EntityFilters filters
---
Result result
string[] entities
[[GetEntitiesStates.srv]]
EntityFilters filters
---
Result result
string[] entities
EntityState[] states
[[GetEntityBounds.srv]]
string entity
---
Result result
Bounds bounds
[[GetEntityInfo.srv]]
string entity
---
Result result
EntityInfo info
[[GetEntityState.srv]]
string entity
---
Result result
EntityState state
[[GetNamedPoseBounds.srv]]
string name
---
Result result
Bounds bounds
[[GetNamedPoses.srv]]
TagsFilter tags
---
Result result
NamedPose[] poses
[[GetSimulationState.srv]]
---
SimulationState state
Result result
[[GetSimulatorFeatures.srv]]
---
SimulatorFeatures features
[[GetSpawnables.srv]]
string[] sources
---
Result result
Spawnable[] spawnables
[[LoadWorld.srv]]
string uri
string resource_string
bool fail_on_unsupported_element
bool ignore_missing_or_unsupported_assets
---
uint8 UNSUPPORTED_FORMAT=101
uint8 NO_RESOURCE=102
uint8 RESOURCE_PARSE_ERROR=103
uint8 MISSING_ASSETS=104
uint8 UNSUPPORTED_ASSETS=105
uint8 UNSUPPORTED_ELEMENTS=106
Result result
WorldResource world
[[ResetSimulation.srv]]
uint8 SCOPE_DEFAULT=0
uint8 SCOPE_TIME=1
uint8 SCOPE_STATE=2
uint8 SCOPE_SPAWNED=4
uint8 SCOPE_ALL=255
uint8 scope
---
Result result
[[SetEntityInfo.srv]]
string entity
EntityInfo info
---
Result result
[[SetEntityState.srv]]
string entity
EntityState state
---
uint8 INVALID_POSE=101
Result result
[[SetSimulationState.srv]]
SimulationState state
---
uint8 ALREADY_IN_TARGET_STATE=101
uint8 STATE_TRANSITION_ERROR=102
uint8 INCORRECT_TRANSITION=103
Result result
[[SpawnEntity.srv]]
string name
bool allow_renaming
string uri
string resource_string
string entity_namespace
geometry_msgs/PoseStamped initial_pose
---
uint8 NAME_NOT_UNIQUE=101
uint8 NAME_INVALID=102
uint8 UNSUPPORTED_FORMAT=103
uint8 NO_RESOURCE=104
uint8 NAMESPACE_INVALID=105
uint8 RESOURCE_PARSE_ERROR=106
uint8 MISSING_ASSETS=107
uint8 UNSUPPORTED_ASSETS=108
uint8 INVALID_POSE=109
Result result
string entity_name
[[StepSimulation.srv]]
uint64 steps 1
---
Result result
[[UnloadWorld.srv]]
---
uint8 NO_WORLD_LOADED=101
Result result
[[SimulateSteps.action]]
uint64 steps
---
Result result
---
uint64 completed_steps
uint64 remaining_steps
"""

PACKAGES = {
    "tf2_msgs": Package(("geometry_msgs",), TF2_MSGS),
    "ackermann_msgs": Package(("std_msgs",), ACKERMANN_MSGS),
    "simulation_interfaces": Package(("builtin_interfaces", "std_msgs", "geometry_msgs", "action_msgs"),
                                     SIMULATION_INTERFACES),
}
