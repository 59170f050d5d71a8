#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Eight robots drive to goals of their own in a map: a world and a task written from scratch, and what chance achieves."""

import math

import numpy as np
from stagesim import scenes
from stagesim.env import Outcome, StageArrayEnv, Task, distance_to, free_space, joined, towards, with_headings

walls = scenes.rooms(12, 12, room=4, door=2, seed=3)
lidar = scenes.Ranger(range=(0, 4), fov=2 * math.pi, samples=32)
robots = [scenes.Robot(pose=pose, size=(0.3, 0.3, 0.25), sensors=[lidar]) for pose in walls.free_places(8, 0.4)]


class EightRobots(Task):
    """Each robot is rewarded for the metres that it comes nearer to its goal, and for being there."""

    world, limit = scenes.Scene(walls, robots, resolution=0.02), 300

    def size(self, scene):
        return 3 + scene.ranges.shape[-1]

    def begin(self, scene, randoms):
        places = scene.scatter(randoms, 2 * scene.robots)
        scene.notes["goal"] = places[:, ::2]
        scene.notes["distance"] = distance_to(places[:, 1::2], places[:, ::2])
        return with_headings(places[:, 1::2], randoms.headings(scene.robots))

    def observe(self, scene):
        return joined(towards(scene, scene.notes["goal"], far=10), free_space(scene, reach=4))

    def judge(self, scene):
        distance = distance_to(scene.pose, scene.notes["goal"])
        reward = scene.notes["distance"] - distance + (distance < 0.3)
        scene.notes["distance"] = distance
        return Outcome(reward, distance < 0.3, {"is_success": distance < 0.3})


if __name__ == "__main__":
    env, random = StageArrayEnv(64, task=EightRobots()), np.random.default_rng(1)
    env.reset(seed=1)
    for _ in range(300):
        env.step(random.uniform(-1, 1, (64, 8, 2)))
    print("{returns:.2f} reward, {is_success:.1%} success by chance".format(**env.statistics.mean()))
