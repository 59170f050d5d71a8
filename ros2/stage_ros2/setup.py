# SPDX-License-Identifier: GPL-2.0-or-later
"""The colcon package: executables and launch files for the nodes in stagesim.ros."""

from glob import glob

from setuptools import setup

NAME = "stage_ros2"

setup(
    name=NAME,
    version="5.0.0",
    packages=[NAME],
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
        (f"share/{NAME}/launch", sorted(glob("launch/*.launch.py"))),
        (f"share/{NAME}/rviz", sorted(glob("rviz/*.rviz"))),
    ],
    install_requires=["setuptools"],
    zip_safe=True,
    maintainer="The Stage 5 contributors",
    maintainer_email="maintainers@example.com",
    description="The robots of a Stage world as ROS 2 robots",
    license="GPL-2.0-or-later",
    entry_points={"console_scripts": [f"{NAME} = {NAME}:main", f"what_if = {NAME}:what_if"]},
)
