#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Generates ROS packages of messages that ROS 2 installations have, but PyPI's ROS wheels lack.

    python -m stagesim.ros.make_messages

These are tf2_msgs, for /tf and /tf_static, and ackermann_msgs, for commands to cars. ROS's own generators make them
from the definitions of the messages and install them into the current virtual environment. This needs CMake, a C++ compiler
and Python's headers. Types and type hashes equal the originals', so both can communicate.
"""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Mapping


@dataclass(frozen=True)
class Package:
    """A ROS package: the package that it depends on, and the definitions of its messages by name."""

    base: str
    messages: Mapping[str, str]


PACKAGES = {
    "tf2_msgs": Package("geometry_msgs", {"TFMessage": "geometry_msgs/TransformStamped[] transforms\n"}),
    "ackermann_msgs": Package("std_msgs", {
        "AckermannDrive": "".join(f"float32 {name}\n" for name in (
            "steering_angle", "steering_angle_velocity", "speed", "acceleration", "jerk")),
        "AckermannDriveStamped": "std_msgs/Header header\nAckermannDrive drive\n"}),
}

MANIFEST = """\
<?xml version="1.0"?>
<package format="3">
  <name>{name}</name>
  <version>0.0.0</version>
  <description>Messages for Stage</description>
  <maintainer email="nobody@example.com">nobody</maintainer>
  <license>GPL-2.0-or-later</license>
  <buildtool_depend>ament_cmake</buildtool_depend>
  <buildtool_depend>rosidl_default_generators</buildtool_depend>
  <depend>{base}</depend>
  <exec_depend>rosidl_default_runtime</exec_depend>
  <member_of_group>rosidl_interface_packages</member_of_group>
  <export><build_type>ament_cmake</build_type></export>
</package>
"""

# The wheels contain the include path of the Python that built them, which is wrong here, so it is cleared.
BUILD = """\
cmake_minimum_required(VERSION 3.20)
project({name})
find_package(ament_cmake REQUIRED)
find_package({base} REQUIRED)
find_package(rosidl_default_generators REQUIRED)
foreach(package IN ITEMS builtin_interfaces std_msgs geometry_msgs)
  if(TARGET ${{package}}::${{package}}__rosidl_generator_py)
    set_target_properties(${{package}}::${{package}}__rosidl_generator_py
                          PROPERTIES INTERFACE_INCLUDE_DIRECTORIES "")
  endif()
endforeach()
rosidl_generate_interfaces({name} {files} DEPENDENCIES {base})
ament_package()
"""


def make(name: str, folder: Path) -> None:
    """Builds the package in `folder` and installs it. Raises CalledProcessError if a command fails."""
    package = PACKAGES[name]
    (folder / "msg").mkdir()
    for message, definition in package.messages.items():
        (folder / "msg" / f"{message}.msg").write_text(definition)
    files = " ".join(f"msg/{message}.msg" for message in package.messages)
    (folder / "package.xml").write_text(MANIFEST.format(name=name, base=package.base))
    (folder / "CMakeLists.txt").write_text(BUILD.format(name=name, base=package.base, files=files))
    environment = dict(os.environ, AMENT_PREFIX_PATH=sys.prefix)
    build = str(folder / "build")
    for command in (
        ["cmake", "-S", str(folder), "-B", build, f"-DCMAKE_PREFIX_PATH={sys.prefix}",
         f"-DPython3_EXECUTABLE={sys.executable}", f"-DCMAKE_INSTALL_PREFIX={sys.prefix}",
         "-DBUILD_TESTING=OFF", "-DCMAKE_BUILD_TYPE=Release"],
        ["cmake", "--build", build, "--parallel", "2"],
        ["cmake", "--install", build],
    ):
        subprocess.run(command, env=environment, check=True, text=True, stdout=subprocess.PIPE,
                       stderr=subprocess.STDOUT)


def main() -> int | str:
    """Makes the packages that are missing; returns the argument of sys.exit()."""
    missing = [name for name in PACKAGES if not importlib.util.find_spec(name)]
    if not missing:
        return 0
    if sys.prefix == sys.base_prefix:
        return f"make_messages: this is no virtual environment; a ROS 2 installation has {' and '.join(missing)}"
    if not importlib.util.find_spec("rosidl_adapter"):
        return "make_messages: there is no Python module rosidl_adapter: pip install 'stagesim[ros]'"
    for name in missing:
        with tempfile.TemporaryDirectory() as folder:
            try:
                make(name, Path(folder))
            except FileNotFoundError:
                return "make_messages: there is no cmake, expected CMake and a C++ compiler"
            except subprocess.CalledProcessError as error:
                return f"make_messages: {name}: {' '.join(error.cmd[:3])} failed:\n{error.output[-2000:]}"
    return 0


if __name__ == "__main__":
    sys.exit(main())
