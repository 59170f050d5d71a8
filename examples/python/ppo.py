#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Trains eight robots in a cave with PPO and PyTorch: they drive to goals, past each other.

  ppo.py                                      # worlds on the host
  ppo.py --worlds-on opencl:gpu --learn-on cuda    # worlds and learning on the card, without copies
  ppo.py --trace steps.txt                    # writes a checksum of all poses and ranges for each step

Each robot sees 24 distances, the goal, and its speed, and one policy drives them all. A robot that reaches its goal
gets another one. Prints a line per update: steps of robots, goals per robot in ten seconds, steps of robots per second.
Two runs that learn on the same device with the same seed are equal to the bit, wherever the worlds are.
Proximal policy optimization: Schulman and others, https://arxiv.org/abs/1707.06347.
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import stagesim as st
import torch

ROBOTS, RAYS, REACH = 8, 24, 3.0
REACHED = 0.3  # metres between a robot and its goal
EPISODE = 150  # steps of 0.1 s
FASTEST = (0.8, 2.0)  # m/s, rad/s
HORIZON, EPOCHS, PARTS = 50, 2, 4  # steps per update; passes over them; minibatches of a pass
TRACED = 1000  # steps with checksums
DISCOUNT, LAMBDA, CLIP, ENTROPY = 0.98, 0.95, 0.2, 0.002
WORLD = """
resolution 0.02
contacts "cells"
model( bitmap "bitmaps/cave.png" size [32 32 0.8] )
define robot position( drive "diff" size [0.3 0.3 0.4]
  ranger( pose [0 0 -0.1 0] sensor( range [0 3] fov 345 samples 24 ) ) )
""" + "".join(f"robot( pose [{0.5 * i - 0.5} 0.3 0 0] )\n" for i in range(ROBOTS))


class Places:
    """Places in the cave with the free way in 64 directions, from which starts and goals are drawn."""

    def __init__(self, world: st.World, device: str) -> None:
        random = np.random.default_rng(0)
        tried = np.zeros((4000, 3))
        tried[:, :2] = random.uniform(-15, 15, (4000, 2))
        free = world.cast(tried, np.linspace(0, math.tau, 64, endpoint=False), 4.0)
        # In the open, all directions are free for a while; inside a rock, some ray soon meets its outline.
        chosen = (free.min(axis=1) > 0.8) & (free.max(axis=1) < 4.0)
        self.at = torch.as_tensor(tried[chosen, :2], device=device)
        self.free = torch.as_tensor(free[chosen], device=device)

    def draw(self, places: torch.Tensor, least: float, most: float, random: torch.Generator) -> torch.Tensor:
        """Returns a point in sight of each place: shape (*places.shape, 2)."""
        directions = torch.randint(64, places.shape, generator=random, device=places.device)
        share = torch.rand(places.shape, generator=random, device=places.device, dtype=torch.float64)
        way = least + (most - least) * share
        way = torch.minimum(way, 0.85 * self.free[places, directions])
        angle = directions * (math.tau / 64)
        return self.at[places] + way[..., None] * torch.stack((angle.cos(), angle.sin()), -1)


class Task:
    """Worlds of robots with goals."""

    def __init__(self, worlds: int, worlds_on: str | None, learn_on: str, seed: int) -> None:
        world = st.World.from_text(WORLD)
        self.device, self.n = learn_on, worlds
        self.batch = st.Batch.of(world, worlds, device=worlds_on)
        self.shared = isinstance(self.batch.pose, st.DeviceArray)
        arrays = [self.batch.cmd, self.batch.pose, self.batch.ranges, self.batch.stalled]
        if self.shared:  # the memory of the card
            self.batch.synchronous = False
            self.cmd, self.pose, self.ranges, self.stalled = (torch.from_dlpack(array) for array in arrays)
        else:
            self.cmd, self.live = self.batch.cmd, arrays[1:]
            self.fetch()
        self.places = Places(world, learn_on)
        self.random = torch.Generator(learn_on).manual_seed(seed)
        self.place = torch.zeros(worlds, dtype=torch.int64, device=learn_on)
        self.goal = torch.zeros((worlds, ROBOTS, 2), dtype=torch.float64, device=learn_on)
        self.age = torch.randint(EPISODE, (worlds,), generator=self.random, device=learn_on)
        self.speed = torch.zeros((worlds, ROBOTS, 2), device=learn_on)
        self.begin(torch.ones(worlds, dtype=torch.bool, device=learn_on))

    def fetch(self) -> None:
        """Copies arrays of the host to the device that learns."""
        if not self.shared:
            self.pose, self.ranges, self.stalled = (torch.tensor(array, device=self.device) for array in self.live)

    def begin(self, which: torch.Tensor) -> None:
        """Begins episodes: robots around another place, with goals around it."""
        worlds, device = self.n, self.device
        place = torch.randint(len(self.places.at), (worlds,), generator=self.random, device=device)
        self.place = torch.where(which, place, self.place)
        of_robots = self.place[:, None].expand(-1, ROBOTS)
        starts = self.places.at[of_robots].clone()
        angle = torch.arange(ROBOTS, device=device, dtype=torch.float64) * (math.tau / ROBOTS)
        starts += 0.6 * torch.stack((angle.cos(), angle.sin()), -1)
        heading = torch.rand((worlds, ROBOTS, 1), generator=self.random, device=device, dtype=torch.float64) * math.tau
        poses = torch.cat((starts, heading), -1).contiguous()
        robots = which[:, None].expand(-1, ROBOTS).contiguous()
        if self.shared:
            self.batch.reset(ids=which)
            self.batch.teleport(poses, robots)
        else:
            self.batch.reset(ids=which.cpu().numpy())
            self.batch.teleport(poses.cpu().numpy(), robots.cpu().numpy())
        self.fetch()
        self.new_goals(robots)
        self.age = torch.where(which, 0, self.age)
        self.speed[which] = 0

    def new_goals(self, which: torch.Tensor) -> None:
        """Draws goals of some robots."""
        goals = self.places.draw(self.place[:, None].expand(-1, ROBOTS), 0.8, 3.5, self.random)
        self.goal = torch.where(which[..., None], goals, self.goal)

    def way(self) -> torch.Tensor:
        """Distances to the goals."""
        return (self.goal - self.pose[..., :2]).norm(dim=-1)

    def observe(self) -> torch.Tensor:
        """Returns what the robots see: shape (worlds, ROBOTS, RAYS + 5). Until its first step, a world has no ranges."""
        gap = self.goal - self.pose[..., :2]
        angle = torch.atan2(gap[..., 1], gap[..., 0]) - self.pose[..., 2]
        to_goal = torch.stack((gap.norm(dim=-1) / 3, angle.cos(), angle.sin()), -1)
        return torch.cat((self.ranges.nan_to_num(REACH) / REACH, to_goal, self.speed), -1).float()

    def step(self, actions: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        """Makes a step. Returns rewards, which episodes ended, and which robots reached their goals."""
        before = self.way()
        self.speed = actions.clamp(-1, 1)
        forwards, turn = (self.speed * torch.tensor(FASTEST, device=self.device)).double().unbind(-1)
        command = torch.stack((forwards, torch.zeros_like(turn), turn), -1)
        if self.shared:
            self.cmd.copy_(command)
        else:
            self.cmd[...] = command.cpu().numpy()
        self.batch.step()
        self.fetch()
        reached = self.way() < REACHED
        rewards = (before - self.way() + reached.double() - 0.05 * self.stalled.double()).float()
        self.new_goals(reached)
        self.age += 1
        ended = self.age >= EPISODE
        self.begin(ended)
        return rewards, ended, reached

    def checksum(self) -> int:
        """Returns a number that depends on all bits of the poses and ranges."""
        bits = torch.cat((self.pose, self.ranges.nan_to_num(-1)), -1).contiguous().view(torch.int64)
        weights = torch.arange(1, bits.numel() + 1, device=self.device).view(bits.shape) * 2 + 1
        return int((bits * weights).sum())


class Policy(torch.nn.Module):
    """A Gaussian around two actions, and an estimate of the return."""

    def __init__(self) -> None:
        super().__init__()
        self.body = torch.nn.Sequential(torch.nn.Linear(RAYS + 5, 128), torch.nn.Tanh(), torch.nn.Linear(128, 128),
                                        torch.nn.Tanh())
        self.mean, self.value = torch.nn.Linear(128, 2), torch.nn.Linear(128, 1)
        self.log_deviation = torch.nn.Parameter(torch.full((2,), -0.5))
        with torch.no_grad():
            self.mean.weight *= 0.01

    def forward(self, seen: torch.Tensor) -> tuple[torch.distributions.Normal, torch.Tensor]:
        """Returns the distribution of the actions, and the value."""
        hidden = self.body(seen)
        return torch.distributions.Normal(self.mean(hidden), self.log_deviation.exp()), self.value(hidden)[..., 0]


class Rollout:
    """The experience of HORIZON steps."""

    def __init__(self, task: Task, policy: Policy, seen: torch.Tensor, checksums: list[int] | None) -> None:
        steps: list[tuple[torch.Tensor, ...]] = []
        self.goals = torch.zeros((), device=task.device)
        with torch.no_grad():
            for _ in range(HORIZON):
                distribution, value = policy(seen)
                noise = torch.randn(distribution.mean.shape, generator=task.random, device=task.device)
                action = distribution.mean + distribution.stddev * noise
                rewards, ended, reached = task.step(action)
                steps.append((seen, action, distribution.log_prob(action).sum(-1), value, rewards,
                              ended[:, None].expand_as(rewards)))
                self.goals += reached.sum()
                seen = task.observe()
                if checksums is not None:
                    checksums.append(task.checksum())
            self.last = seen
            self.seen, self.action, self.log_chance, value, rewards, ended = (torch.stack(part) for part in zip(*steps))
            self.advantage = self.advantages(rewards, ended, value, policy(seen)[1])
            self.wanted = self.advantage + value

    @staticmethod
    def advantages(rewards: torch.Tensor, ended: torch.Tensor, value: torch.Tensor,
                   last: torch.Tensor) -> torch.Tensor:
        """Generalized advantage estimation: https://arxiv.org/abs/1506.02438."""
        advantage, sum_ = torch.zeros_like(rewards), torch.zeros_like(last)
        for i in reversed(range(len(rewards))):
            goes_on = 1 - ended[i].float()
            following = value[i + 1] if i + 1 < len(rewards) else last
            sum_ = rewards[i] + DISCOUNT * following * goes_on - value[i] + DISCOUNT * LAMBDA * goes_on * sum_
            advantage[i] = sum_
        return advantage


def learn(policy: Policy, optimizer: torch.optim.Optimizer, rollout: Rollout, random: torch.Generator) -> None:
    """Improves the policy with the steps of a rollout."""
    parts = (rollout.seen, rollout.action, rollout.log_chance, rollout.advantage, rollout.wanted)
    seen, action, log_chance, advantage, wanted = (part.flatten(0, 2) for part in parts)
    advantage = (advantage - advantage.mean()) / (advantage.std() + 1e-8)
    for _ in range(EPOCHS):
        order = torch.randperm(len(seen), generator=random, device=seen.device)
        for some in order.chunk(PARTS):
            distribution, value = policy(seen[some])
            ratio = (distribution.log_prob(action[some]).sum(-1) - log_chance[some]).exp()
            gain = torch.minimum(ratio * advantage[some], ratio.clamp(1 - CLIP, 1 + CLIP) * advantage[some]).mean()
            loss = 0.5 * (value - wanted[some]).square().mean() - gain - ENTROPY * distribution.entropy().sum(-1).mean()
            optimizer.zero_grad()
            loss.backward()
            torch.nn.utils.clip_grad_norm_(policy.parameters(), 0.5)
            optimizer.step()


def train(options: argparse.Namespace) -> dict[str, Any]:
    """Trains a policy. Returns the goals per robot in ten seconds of the first and of the last update, and the
    checksums of the first steps."""
    torch.manual_seed(options.seed)
    task = Task(options.worlds, options.worlds_on, options.learn_on, options.seed)
    policy = Policy().to(options.learn_on)
    optimizer = torch.optim.Adam(policy.parameters(), options.rate)
    checksums: list[int] = []
    goals: list[float] = []
    seen = task.observe()
    of_rollout = options.worlds * ROBOTS * HORIZON
    for update in range(1, options.updates + 1):
        start = time.perf_counter()
        rollout = Rollout(task, policy, seen, checksums if len(checksums) < TRACED else None)
        learn(policy, optimizer, rollout, task.random)
        seen = rollout.last
        goals.append(float(rollout.goals) / (options.worlds * ROBOTS) * 100 / HORIZON)
        speed = of_rollout / (time.perf_counter() - start)
        print(f"{update * of_rollout:>10} steps  {goals[-1]:.3f} goals  {speed:.0f} steps/s", flush=True)
    return {"first": goals[0], "last": goals[-1], "checksums": checksums}


def main(arguments: Sequence[str] | None = None) -> dict[str, Any]:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--worlds", type=int, default=256, help="number of worlds (default: 256)")
    parser.add_argument("--updates", type=int, default=60, help="of the policy (default: 60)")
    parser.add_argument("--rate", type=float, default=1e-3, help="learning rate (default: 0.001)")
    parser.add_argument("--seed", type=int, default=1, help="of all random numbers (default: 1)")
    parser.add_argument("--worlds-on", help="the device that steps the worlds, as in Batch (default: the host)")
    parser.add_argument("--learn-on", default="cpu", help="the device of PyTorch (default: cpu)")
    parser.add_argument("--trace", help="file to write the checksums of the first 1000 steps to")
    parser.add_argument("--short", action="store_true", help="20 updates with 64 worlds, as a test")
    options = parser.parse_args(arguments)
    if options.short:
        options.worlds, options.updates = 64, 20
    found = train(options)
    if options.trace:
        Path(options.trace).write_text("".join(f"{checksum}\n" for checksum in found["checksums"]))
    return found


if __name__ == "__main__":
    main()
