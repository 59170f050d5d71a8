#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Generates the ROS package tf2_msgs with the message TFMessage, which /tf and /tf_static need.

    python -m stagesim.ros.make_tf2_msgs

ROS 2 installations have this package, but PyPI's ROS wheels lack it. ROS's own generators make it from the
definition of the message and install it into the current virtual environment. This needs CMake, a C++ compiler
and Python's headers. Type and type hash equal the original's, so both can communicate.
"""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
import tempfile
from pathlib import Path

MESSAGE = "geometry_msgs/TransformStamped[] transforms\n"

PACKAGE = """\
<?xml version="1.0"?>
<package format="3">
  <name>tf2_msgs</name>
  <version>0.0.0</version>
  <description>The message of /tf</description>
  <maintainer email="nobody@example.com">nobody</maintainer>
  <license>GPL-2.0-or-later</license>
  <buildtool_depend>ament_cmake</buildtool_depend>
  <buildtool_depend>rosidl_default_generators</buildtool_depend>
  <depend>geometry_msgs</depend>
  <exec_depend>rosidl_default_runtime</exec_depend>
  <member_of_group>rosidl_interface_packages</member_of_group>
  <export><build_type>ament_cmake</build_type></export>
</package>
"""

# The wheels contain the include path of the Python that built them, which is wrong here, so it is cleared.
BUILD = """\
cmake_minimum_required(VERSION 3.20)
project(tf2_msgs)
find_package(ament_cmake REQUIRED)
find_package(geometry_msgs REQUIRED)
find_package(rosidl_default_generators REQUIRED)
foreach(package IN ITEMS builtin_interfaces std_msgs geometry_msgs)
  set_target_properties(${package}::${package}__rosidl_generator_py
                        PROPERTIES INTERFACE_INCLUDE_DIRECTORIES "")
endforeach()
rosidl_generate_interfaces(tf2_msgs msg/TFMessage.msg DEPENDENCIES geometry_msgs)
ament_package()
"""


def make(folder: Path) -> None:
    """Builds the package in `folder` and installs it. Raises CalledProcessError if a command fails."""
    (folder / "msg").mkdir()
    (folder / "msg" / "TFMessage.msg").write_text(MESSAGE)
    (folder / "package.xml").write_text(PACKAGE)
    (folder / "CMakeLists.txt").write_text(BUILD)
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
    """Makes the package unless it exists; returns the argument of sys.exit()."""
    if importlib.util.find_spec("tf2_msgs"):
        return 0
    if sys.prefix == sys.base_prefix:
        return "make_tf2_msgs: this is no virtual environment; a ROS 2 installation has tf2_msgs"
    if not importlib.util.find_spec("rosidl_adapter"):
        return "make_tf2_msgs: there is no Python module rosidl_adapter: pip install 'stagesim[ros]'"
    with tempfile.TemporaryDirectory() as folder:
        try:
            make(Path(folder))
        except FileNotFoundError:
            return "make_tf2_msgs: there is no cmake, expected CMake and a C++ compiler"
        except subprocess.CalledProcessError as error:
            return f"make_tf2_msgs: {' '.join(error.cmd[:3])} failed:\n{error.output[-2000:]}"
    return 0


if __name__ == "__main__":
    sys.exit(main())
