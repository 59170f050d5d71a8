#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Trains a policy with policy gradients, using only NumPy, on a Batch of worlds.

The policy gives speeds to all robots in all worlds of arena.world: a Gaussian around a linear function of
what they see. The reward of an action is the distance driven forwards, minus penalties for stalls and
turns. A good policy goes straight where it is free and turns in time. It must beat the policy that only
goes straight.
"""

from __future__ import annotations

import argparse

import numpy as np
import stagesim as st

SECTORS = 8  # sectors of a scan
FEATURES = SECTORS + 1
FASTEST = np.array([0.5, 1.5])  # maximum speeds: m/s forwards, rad/s
NOISE = 0.4  # standard deviation of the policy, as a fraction of FASTEST
STEPS = 5  # world steps per action
DISCOUNT = 0.9


def features(ranges: np.ndarray) -> np.ndarray:
    """Return how near things are per sector, 0 to 1, and a constant 1: shape (n, robots, FEATURES)."""
    shape = (*ranges.shape[:2], SECTORS, -1)
    near = 1 - np.nan_to_num(ranges, nan=4.0).reshape(shape).min(axis=3) / 4
    return np.concatenate([near, np.ones((*near.shape[:2], 1))], axis=2)


def act(batch: st.Batch, actions: np.ndarray) -> np.ndarray:
    """Execute actions in all worlds and return the rewards, mainly metres."""
    before = batch.pose.copy()
    speeds = np.clip(actions, -1, 1) * FASTEST
    batch.cmd[..., 0] = speeds[..., 0]
    batch.cmd[..., 2] = speeds[..., 1]
    batch.step(n=STEPS)
    moved = batch.pose - before
    heading = before[..., 2] + ((moved[..., 2] + np.pi) % (2 * np.pi) - np.pi) / 2
    ahead = moved[..., 0] * np.cos(heading) + moved[..., 1] * np.sin(heading)
    reward: np.ndarray = ahead - 0.1 * batch.stalled - 0.05 * np.clip(actions[..., 1], -1, 1) ** 2
    return reward


def scatter(batch: st.Batch, random: np.random.Generator) -> None:
    """Start a new episode with random headings, so that worlds differ."""
    batch.reset()
    poses = batch.pose.copy()
    poses[..., 2] = random.uniform(-np.pi, np.pi, poses.shape[:2])
    batch.teleport(poses)
    batch.step()


def episode(batch: st.Batch, weights: np.ndarray, noise: float, actions: int,
            random: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return features, deviations from the policy's means, and rewards; one row per action."""
    scatter(batch, random)
    seen, strayed, rewards = [], [], []
    for _ in range(actions):
        x = features(batch.ranges)
        stray = noise * random.normal(size=(*x.shape[:2], 2))
        seen.append(x)
        strayed.append(stray)
        rewards.append(act(batch, np.tanh(x @ weights) + stray))
    return np.array(seen), np.array(strayed), np.array(rewards)


def gradient(seen: np.ndarray, strayed: np.ndarray, rewards: np.ndarray,
             weights: np.ndarray) -> np.ndarray:
    """Return the gradient of the expected reward: actions with an above-average return become likelier."""
    gains = np.zeros_like(rewards)
    gain = np.zeros_like(rewards[0])
    for moment in reversed(range(len(rewards))):
        gain = rewards[moment] + DISCOUNT * gain
        gains[moment] = gain
    gains -= gains.mean(axis=(1, 2), keepdims=True)
    gains /= gains.std() + 1e-9
    slope = 1 - np.tanh(seen @ weights) ** 2
    push = strayed / NOISE**2 * slope * gains[..., None]
    return np.einsum("mnrf,mnra->fa", seen, push) / gains.size


def train(worlds: int, episodes: int, actions: int, seed: int) -> dict[str, float]:
    """Return the reward per episode without noise: before training, after it, and for going straight."""
    random = np.random.default_rng(seed)
    batch = st.Batch("arena.world", worlds)
    weights = np.zeros((FEATURES, 2))
    mean, square = np.zeros_like(weights), np.zeros_like(weights)

    def reward_of(policy: np.ndarray) -> float:
        _, _, rewards = episode(batch, policy, 0.0, actions, np.random.default_rng(seed + 1))
        return float(rewards.sum(axis=0).mean())

    straight = np.zeros_like(weights)
    straight[-1, 0] = 2.0
    figures = {"before": reward_of(weights), "straight": reward_of(straight)}
    for number in range(1, episodes + 1):
        seen, strayed, rewards = episode(batch, weights, NOISE, actions, random)
        slope = gradient(seen, strayed, rewards, weights)
        # Adam optimizer.
        mean += 0.1 * (slope - mean)
        square += 0.01 * (slope**2 - square)
        weights += 0.1 * (mean / (1 - 0.9**number)) / (np.sqrt(square / (1 - 0.99**number)) + 1e-9)
        if number % 5 == 0:
            print(f"episode {number}: {rewards.sum(axis=0).mean():.2f}, with the policy's noise")
    return {**figures, "after": reward_of(weights), "steps": episodes * actions * STEPS * worlds}


def main(arguments: list[str] | None = None) -> dict[str, float]:
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--worlds", type=int, default=64)
    parser.add_argument("--episodes", type=int, default=60)
    parser.add_argument("--actions", type=int, default=40, help="of half a second, in an episode (40)")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--short", action="store_true", help="16 worlds, 20 episodes, 20 actions")
    options = parser.parse_args(arguments)
    if options.short:
        options.worlds, options.episodes, options.actions = 16, 20, 20
    figures = train(options.worlds, options.episodes, options.actions, options.seed)
    print("{steps} steps of worlds: the reward rose from {before:.2f} to {after:.2f}; going straight gets "
          "{straight:.2f}".format(**figures))
    return figures


if __name__ == "__main__":
    main()
