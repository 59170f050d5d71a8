#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Trains a policy for any shipped task with PPO and PyTorch, in one file.

  ppo.py --task Navigate --until 0.9 --save policy.pt           # one robot drives to goals in a room
  ppo.py --task Navigate --world arena.world --envs 64          # five robots share a policy
  ppo.py --task Navigate --envs 16384 --device cuda             # worlds and learning on the card, without copies
  ppo.py --task PushT --device cuda --worlds cpu                # worlds on the host, learning on the card
  ppo.py --task Navigate --load policy.pt --steps 0             # only evaluates a policy

Each robot of each world is a row: it has its own observation and reward, and all share one policy. Rows of robots whose
episode is over, while others of their world still drive, are left out. With --until, training stops as soon as the
deterministic policy succeeds in that share of 500 fresh episodes. At the end it is evaluated in 500 others. Two runs
with the same options give the same policy on the same machine. The methods are proximal policy optimization (Schulman
and others, https://arxiv.org/abs/1707.06347) and generalized advantage estimation (https://arxiv.org/abs/1506.02438).
"""

from __future__ import annotations

import argparse
import csv
import math
import time
from collections.abc import Sequence
from typing import Any, Union

import numpy as np
import torch
from gymnasium.spaces import Box
from stagesim.env import Cover, StageArrayEnv, Task
from torch import Tensor, nn

AnyTask = Union[Task, str, None]
EPISODES = 500  # least number of episodes of robots in an evaluation
SEED_OF_TESTS, SEED_OF_RESULT = 1_000_000_000, 2_000_000_000  # the seeds of training are smaller
WINDOW = 300  # episodes of training that must have the wanted success before the policy is evaluated
PAUSE = 8  # updates between two evaluations
LARGEST = 32768  # rows of a minibatch


def tensor(array: Any, policy: Policy) -> Tensor:
    """The array as a tensor where the policy is: without a copy if it is there already."""
    return (array if isinstance(array, Tensor) else torch.from_numpy(array)).to(policy.log_std.device)


def as_given(action: Tensor, env: StageArrayEnv) -> Any:
    """The actions as the environment takes them: limited to -1 to 1, shape (worlds, robots, numbers)."""
    action = action.clamp(-1, 1).view(env.num_envs, len(env.agents), -1)
    return action if env.batch.device else action.cpu().numpy()


class Clock:
    """Adds up the time of each phase. On a card phases overlap, unless `waits` makes each end before the next one."""

    def __init__(self, env: StageArrayEnv, waits: bool) -> None:
        self.start = self.last = time.perf_counter()
        self.waits = waits
        self.seconds = dict.fromkeys(("setup", "simulation", "environment", "policy", "update", "evaluation"), 0.0)
        step = env.batch.step

        def timed(*arguments: Any, **named: Any) -> None:
            self.book("environment")
            step(*arguments, **named)
            self.book("simulation")

        env.batch.step = timed  # type: ignore[method-assign]

    def book(self, phase: str) -> None:
        """Adds the time since the last call to a phase."""
        if self.waits:
            torch.cuda.synchronize()
        now = time.perf_counter()
        self.seconds[phase] += now - self.last
        self.last = now

    def rollouts(self) -> float:
        """Seconds of all rollouts."""
        return self.seconds["simulation"] + self.seconds["environment"] + self.seconds["policy"]

    def __str__(self) -> str:
        total = self.last - self.start
        return ", ".join(f"{phase} {100 * spent / total:.0f} %" for phase, spent in self.seconds.items())


class Policy(nn.Module):
    """A Gaussian distribution of actions, and an estimate of the return, from an observation of `size` numbers."""

    def __init__(self, size: int, numbers: int, width: int = 64) -> None:
        super().__init__()
        self.sizes = (size, numbers, width)
        self.actor, self.critic = (nn.Sequential(nn.Linear(size, width), nn.Tanh(), nn.Linear(width, width), nn.Tanh(),
                                                 nn.Linear(width, outputs)) for outputs in (numbers, 1))
        for layer, gain in zip([*self.actor[::2], *self.critic[::2]], (2**0.5, 2**0.5, 0.01, 2**0.5, 2**0.5, 1)):
            nn.init.orthogonal_(layer.weight, gain)
            nn.init.zeros_(layer.bias)
        self.log_std = nn.Parameter(torch.full((numbers,), -0.5))

    def log_chance(self, noise: Tensor) -> Tensor:
        """Logarithm of the density of actions but for a constant; `noise` is (action - mean) / deviation."""
        return (-0.5 * noise * noise - self.log_std).sum(-1)

    def save(self, path: str) -> None:
        """Writes the policy to a file."""
        torch.save({"sizes": self.sizes, "state": self.state_dict()}, path)

    @staticmethod
    def load(path: str) -> Policy:
        """Reads a policy from a file."""
        kept = torch.load(path, map_location="cpu", weights_only=True)
        policy = Policy(*kept["sizes"])
        policy.load_state_dict(kept["state"])
        return policy


class Rollout:
    """Everything that all robots saw and did for an update, as tensors of shape (length, rows, ...)."""

    def __init__(self, rows: int, policy: Policy, options: argparse.Namespace) -> None:
        self.options, (size, numbers, _) = options, policy.sizes
        shape, device = (options.length, rows), policy.log_std.device
        self.seen, self.action = (torch.zeros((*shape, count), device=device) for count in (size, numbers))
        self.log_chance, self.reward, self.value, self.goes_on, self.advantage = torch.zeros((5, *shape), device=device)
        self.took_part = torch.zeros(shape, dtype=torch.bool, device=device)

    @torch.no_grad()
    def fill(self, env: StageArrayEnv, policy: Policy, seen: Tensor, clock: Clock) -> Tensor:
        """Drives all robots by the policy, from what they see now. Returns what they see afterwards."""
        rows, deviation = len(seen), policy.log_std.exp()
        for i in range(self.options.length):
            noise = torch.randn_like(self.action[i])
            self.action[i] = policy.actor(seen) + deviation * noise
            self.seen[i], self.log_chance[i], self.value[i] = seen, policy.log_chance(noise), policy.critic(seen)[:, 0]
            given = as_given(self.action[i], env)
            clock.book("policy")
            step = env.step(given)
            clock.book("environment")
            self.reward[i], self.took_part[i], terminated, truncated = (
                tensor(x, policy).view(rows) for x in (step.rewards, step.took_part, step.terminated, step.truncated))
            self.goes_on[i] = ~(terminated | truncated)
            if step.over.any():  # an episode that was cut off would have gone on: the rest is estimated
                final = policy.critic(tensor(step.final_observations, policy).view(rows, -1))[:, 0]
                self.reward[i] += self.options.discount * final * truncated
            seen = tensor(step.observations, policy).view(rows, -1)
        self._advantages(policy.critic(seen)[:, 0])
        if seen.is_cuda:
            torch.cuda.synchronize()
        clock.book("policy")
        return seen

    def _advantages(self, following: Tensor) -> None:
        gained = torch.zeros_like(following)
        for i in reversed(range(self.options.length)):
            discount = self.options.discount * self.goes_on[i]
            gained = self.reward[i] + discount * (following + self.options.smoothing * gained) - self.value[i]
            self.advantage[i], following = gained, self.value[i]


def improve(policy: Policy, optimizer: torch.optim.Optimizer, rollout: Rollout) -> float:
    """Improves the policy with the rows of a rollout. Returns the mean loss."""
    options, rows = rollout.options, rollout.took_part.view(-1).nonzero()[:, 0]
    seen, action, log_chance, advantage, value = (x.flatten(0, 1)[rows] for x in (
        rollout.seen, rollout.action, rollout.log_chance, rollout.advantage, rollout.value))
    wanted, advantage = value + advantage, (advantage - advantage.mean()) / (advantage.std() + 1e-8)
    losses = []
    for _ in range(options.epochs):
        for some in torch.randperm(len(rows), device=rows.device).chunk(max(options.minibatches, len(rows) // LARGEST)):
            noise = (action[some] - policy.actor(seen[some])) / policy.log_std.exp()
            ratio = (policy.log_chance(noise) - log_chance[some]).exp()
            limited = ratio.clamp(1 - options.clip, 1 + options.clip)
            gain = torch.minimum(ratio * advantage[some], limited * advantage[some]).mean()
            error = (policy.critic(seen[some])[:, 0] - wanted[some]).square().mean()
            loss = error - gain - options.entropy * policy.log_std.sum()
            optimizer.zero_grad()
            loss.backward()
            nn.utils.clip_grad_norm_(policy.critic.parameters(), 0.5)
            nn.utils.clip_grad_norm_([*policy.actor.parameters(), policy.log_std], 0.5)
            optimizer.step()
            losses.append(loss.detach())
    return float(torch.stack(losses).mean())


@torch.no_grad()
def evaluate(policy: Policy, env: StageArrayEnv, seed: int) -> dict[str, float]:
    """Drives by the mean actions for an episode in each world.

    Returns the mean return of a robot, and the means of the task's info when the episodes of the robots end.
    """
    seen = tensor(env.reset(seed), policy)
    runs = torch.ones_like(seen[:, :1, 0], dtype=torch.bool)
    sums: dict[str, Any] = {}
    while runs.any():
        step = env.step(as_given(policy.actor(seen), env))
        ended = runs & (tensor(step.terminated, policy) | tensor(step.truncated, policy))
        for name, values, which in (("return", step.rewards, runs), *((x, step.info[x], ended) for x in step.info)):
            sums[name] = sums.get(name, 0) + torch.where(which, tensor(values, policy).double(), 0).sum()
        runs &= ~tensor(step.over, policy)[:, None]
        seen = tensor(step.observations, policy)
    return {name: float(found) / (env.num_envs * len(env.agents)) for name, found in sums.items()}


def score(means: dict[str, float], robots: int = 1) -> float:
    """The share of success; the mean return of a robot if the task has none; NaN before the first episode has ended."""
    return means.get("is_success", means.get("return", means.get("returns", math.nan) / robots))


def make(options: argparse.Namespace, envs: int, task: AnyTask = None) -> StageArrayEnv:
    """Makes an environment where the worlds shall be: on the host, or on the card."""
    chosen = Cover(image=False) if options.task == "Cover" else options.task
    env = StageArrayEnv(envs, options.world, task or chosen, maps=options.maps,
                        device="opencl:gpu" if (options.worlds or options.device) == "cuda" else None)
    for name, (low, high) in options.vary.items():
        random = np.random.default_rng([options.seed, *name.encode()])
        env.vary(name, random.uniform(low, high, envs))
    space, actions = env.single_observation_space, env.single_action_space
    if not (isinstance(space, Box) and len(space.shape) == 1 and isinstance(actions, Box)):
        raise SystemExit(f"found observations {space} and actions {actions}, expected a Box with one axis for each")
    return env


def train(options: argparse.Namespace, task: AnyTask = None) -> tuple[Policy, list[dict[str, float]]]:
    """Trains a policy. Returns it, and the learning curve: the figures of each update."""
    torch.manual_seed(options.seed)
    torch.set_num_threads(options.threads)
    env = make(options, options.envs, task)
    clock = Clock(env, options.profile and options.device == "cuda")
    tests = make(options, math.ceil(EPISODES / len(env.agents)), task) if options.until is not None else None
    sizes = env.single_observation_space.shape[0], env.single_action_space.shape[0], options.width
    policy = (Policy.load(options.load) if options.load else Policy(*sizes)).to(options.device)
    rows = env.num_envs * len(env.agents)
    rollout = Rollout(rows, policy, options)
    optimizer = torch.optim.Adam(policy.parameters(), options.rate, eps=1e-5, fused=True)
    clock.book("setup")
    seen = tensor(env.reset(options.seed * 1_000_000), policy).view(rows, -1)
    curve: list[dict[str, float]] = []
    steps, next_test, is_done = 0, 0, False
    while steps < options.steps and not is_done:
        seen = rollout.fill(env, policy, seen, clock)
        optimizer.param_groups[0]["lr"] = options.rate * (1 - 0.7 * steps / options.steps)
        loss = improve(policy, optimizer, rollout)
        clock.book("update")
        steps += rows * options.length
        # Until each world had time for a whole episode, only short ones have ended.
        has_begun = len(curve) * options.length < env.task.limit
        line = {"steps": steps, "loss": loss,
                "score": math.nan if has_begun else score(env.statistics.mean(WINDOW), len(env.agents))}
        if tests and line["score"] >= options.until and len(curve) >= next_test:
            line["test"], next_test = score(evaluate(policy, tests, SEED_OF_TESTS + steps)), len(curve) + PAUSE
            clock.book("evaluation")
            is_done = line["test"] >= options.until
        line["seconds"] = clock.last - clock.start
        curve.append(line)
        if is_done or len(curve) % options.report == 0:
            left = max(options.steps - steps, 0) * line["seconds"] / steps
            print(f"{steps:>9} steps", *(f"{x} {line[x]:.3f}" for x in ("score", "test") if x in line),
                  f"{steps / line['seconds']:.3g} steps/s ({steps / clock.rollouts():.3g} in rollouts)",
                  f"{line['seconds']:.1f} s, at most {left:.0f} s left", clock, sep="  ", flush=True)
    return policy, curve


def parsed(arguments: Sequence[str] | None = None) -> argparse.Namespace:
    """The options of a command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name, default, meaning in (
            ("task", "Navigate", "name of a shipped task"), ("world", None, "another world than that of the task"),
            ("device", "cpu", "where the worlds and the policy are: cpu or cuda"),
            ("worlds", None, "cpu: the worlds stay on the host, whatever the device"), ("envs", 128, "number of worlds"),
            ("seed", 1, "of all random numbers"), ("steps", 2_000_000, "max number of actions of robots"),
            ("until", None, "success at which training stops, or mean return if the task has no success"),
            ("save", None, "file to write the policy to"), ("load", None, "policy to begin with"),
            ("curve", None, "CSV file to write the learning curve to"), ("length", 32, "actions per update"),
            ("epochs", 4, "passes over them"), ("minibatches", 4, "least number of minibatches of a pass"),
            ("rate", 3e-3, "learning rate at the start"), ("discount", 0.98, "of rewards, per action"),
            ("smoothing", 0.95, "lambda of the advantages"), ("clip", 0.2, "limit of the change of probabilities"),
            ("entropy", 0.0, "weight of the entropy"), ("width", 64, "neurons of both hidden layers"),
            ("threads", 1, "of PyTorch"), ("report", 10, "updates per line")):
        kind = float if name == "until" else str if default is None else type(default)
        parser.add_argument(f"--{name}", type=kind, default=default, help=f"{meaning} (default: {default})")
    # For calls from Python: see StageVectorEnv; `vary` has the range of a property that differs between worlds, by name.
    parser.set_defaults(maps=None, vary={})
    parser.add_argument("--profile", action="store_true", help="on a card: phases wait for each other, to time them")
    return parser.parse_args(arguments)


def main(arguments: Sequence[str] | None = None) -> dict[str, Any]:
    options = parsed(arguments)
    policy, curve = train(options)
    if options.save:
        policy.save(options.save)
    if options.curve:
        with open(options.curve, "w", newline="") as file:
            writer = csv.DictWriter(file, ("seconds", "steps", "score", "test", "loss"))
            writer.writeheader()
            writer.writerows(curve)
    worlds = math.ceil(EPISODES / len(make(options, 1).agents))
    found = evaluate(policy, make(options, worlds), SEED_OF_RESULT)
    print("fresh episodes:", *(f"{name} {value:.3f}" for name, value in found.items()), sep="  ")
    return {"curve": curve, **found}


if __name__ == "__main__":
    main()
