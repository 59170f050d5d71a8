# SPDX-License-Identifier: GPL-2.0-or-later
"""Generates the ROS packages that the node needs and PyPI's ROS wheels lack.

    python -m stagesim.ros.make_messages
    python -m stagesim.ros.make_messages simulation_interfaces

These are tf2_msgs, for /tf and /tf_static, and ackermann_msgs, for commands to cars; simulation_interfaces, for services,
takes some minutes and is only made on request. ROS 2 installations have these packages or can install them. ROS's own generators make them from the definitions of
their interfaces, and install them into the current virtual environment. This needs CMake, a C++ compiler and
Python's headers. Types and type hashes equal the originals', so both can communicate.
"""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Sequence

from .definitions import PACKAGES

#: The packages that are made by default.
MESSAGES = ("tf2_msgs", "ackermann_msgs")

MANIFEST = """\
<?xml version="1.0"?>
<package format="3">
  <name>{name}</name>
  <version>0.0.0</version>
  <description>Interfaces of {name}</description>
  <maintainer email="nobody@example.com">nobody</maintainer>
  <license>GPL-2.0-or-later</license>
  <buildtool_depend>ament_cmake</buildtool_depend>
  <buildtool_depend>rosidl_default_generators</buildtool_depend>
  {depends}
  <exec_depend>rosidl_default_runtime</exec_depend>
  <member_of_group>rosidl_interface_packages</member_of_group>
  <export><build_type>ament_cmake</build_type></export>
</package>
"""

# All generators are needed: without those of C++ and of introspection, ROS prints errors about missing type support. The
# wheels contain the include path of the Python that built them, which is wrong here, so it is cleared.
BUILD = """\
cmake_minimum_required(VERSION 3.20)
project({name})
find_package(ament_cmake REQUIRED)
foreach(package IN ITEMS {depends} rosidl_default_generators)
  find_package(${{package}} REQUIRED)
endforeach()
foreach(package IN ITEMS action_msgs builtin_interfaces geometry_msgs service_msgs std_msgs unique_identifier_msgs)
  if(TARGET ${{package}}::${{package}}__rosidl_generator_py)
    set_target_properties(${{package}}::${{package}}__rosidl_generator_py PROPERTIES INTERFACE_INCLUDE_DIRECTORIES "")
  endif()
endforeach()
rosidl_generate_interfaces({name} {files} DEPENDENCIES {depends})
ament_package()
"""


def write(name: str, folder: Path) -> None:
    """Writes the sources of a package into a folder."""
    package = PACKAGES[name]
    files = package.files()
    for path, text in files.items():
        (folder / path).parent.mkdir(exist_ok=True)
        (folder / path).write_text(text)
    (folder / "package.xml").write_text(MANIFEST.format(
        name=name, depends="".join(f"<depend>{other}</depend>" for other in package.depends)))
    (folder / "CMakeLists.txt").write_text(BUILD.format(
        name=name, depends=" ".join(package.depends), files=" ".join(sorted(files))))


def make(name: str, folder: Path, prefix: str = sys.prefix) -> None:
    """Builds a package in `folder` and installs it. Raises CalledProcessError if a command fails."""
    write(name, folder)
    environment = dict(os.environ, AMENT_PREFIX_PATH=sys.prefix)
    build = str(folder / "build")
    for command in (
        ["cmake", "-S", str(folder), "-B", build, f"-DCMAKE_PREFIX_PATH={sys.prefix}",
         f"-DPython3_EXECUTABLE={sys.executable}", f"-DCMAKE_INSTALL_PREFIX={prefix}",
         "-DBUILD_TESTING=OFF", "-DCMAKE_C_FLAGS=-O1", "-DCMAKE_CXX_FLAGS=-O1"],
        ["cmake", "--build", build, "--parallel", "2"],
        ["cmake", "--install", build],
    ):
        subprocess.run(command, env=environment, check=True, text=True, stdout=subprocess.PIPE,
                       stderr=subprocess.STDOUT)


def missing(names: Sequence[str]) -> list[str]:
    """The packages among `names` that are not installed."""
    return [name for name in names if not importlib.util.find_spec(name)]


def main(names: Sequence[str] = ()) -> int | str:
    """Makes packages that do not exist yet, by default those of messages; returns the argument of sys.exit()."""
    for name in names:
        if name not in PACKAGES:
            return f"make_messages: found the package {name!a}, expected some of {', '.join(PACKAGES)}"
    wanted = missing(names or MESSAGES)
    if not wanted:
        return 0
    if sys.prefix == sys.base_prefix:
        return f"make_messages: this is no virtual environment; a ROS 2 installation has {', '.join(wanted)}"
    if not importlib.util.find_spec("rosidl_adapter"):
        return "make_messages: there is no Python module rosidl_adapter: pip install 'stagesim[ros]'"
    for name in wanted:
        with tempfile.TemporaryDirectory() as folder:
            try:
                make(name, Path(folder))
            except FileNotFoundError:
                return "make_messages: there is no cmake, expected CMake and a C++ compiler"
            except subprocess.CalledProcessError as error:
                return f"make_messages: {' '.join(error.cmd[:3])} failed:\n{error.output[-2000:]}"
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
