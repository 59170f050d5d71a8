# SPDX-License-Identifier: GPL-2.0-or-later
"""The task in Navground: a world per environment, whose agents drive straight on and bump into each other."""

from __future__ import annotations

import math

from navground import core, sim

from ..task import RADIUS, STEP, TOP_SPEED, Floats, Task
from .separate import SeparateSimulation
from .simulation import Simulation


class Agent:
    """An agent with a lidar, and the state that the lidar writes its readings to."""

    def __init__(self, task: Task) -> None:
        self.behavior = core.Behavior.make_type("Dummy")
        kinematics = core.kinematics.OmnidirectionalKinematics(max_speed=TOP_SPEED)
        self.body = sim.Agent(radius=RADIUS, behavior=self.behavior, kinematics=kinematics)
        self.lidar = sim.state_estimations.LidarStateEstimation(
            range=task.reach, resolution=task.rays, start_angle=0.0,
            field_of_view=math.tau * (task.rays - 1) / task.rays)
        self.state = core.SensingState()


class NavgroundSimulation(SeparateSimulation):
    """Worlds in a loop. World.update() does not call lidars of such agents, so this class does."""

    note = "one thread, NumPy's arrays instead of tensors, lidars called from Python"

    def __init__(self, task: Task) -> None:
        super().__init__(task)
        self._worlds = [sim.World() for _ in range(task.envs)]
        self._agents = [[Agent(task) for _ in range(task.agents)] for _ in range(task.envs)]
        for world, agents in zip(self._worlds, self._agents):
            for agent in agents:
                world.add_agent(agent.body)
                agent.lidar.prepare(agent.body, world)
                agent.lidar.prepare_state(agent.state)

    def _place(self, env: int, positions: Floats) -> None:
        self._worlds[env].clear_collisions()
        for agent, position in zip(self._agents[env], positions):
            agent.body.pose = core.Pose2(position=position, orientation=0)
            agent.body.twist = core.Twist2((0.0, 0.0), 0.0)

    def _move(self, env: int, actions: Floats) -> None:
        for agent, action in zip(self._agents[env], actions.tolist()):
            agent.behavior.target = core.Target.Direction(action)
        self._worlds[env].update(STEP)

    def _read(self, env: int) -> None:
        world = self._worlds[env]
        for i, agent in enumerate(self._agents[env]):
            agent.lidar.update(agent.body, world, agent.state)
            self._ranges[env, i] = agent.lidar.read_ranges(agent.state)
            self._positions[env, i] = agent.body.position
            self._velocities[env, i] = agent.body.velocity
        touching = {agent._uid for agent in world.get_agents_in_collision(STEP)}
        self._collided[env] = [agent.body._uid in touching for agent in self._agents[env]]


def open_simulation(task: Task, device: str, threads: int, name: str) -> Simulation:
    """Starts the simulation."""
    assert name == "navground" and device == "cpu" and threads >= 1
    return NavgroundSimulation(task)
