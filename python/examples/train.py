"""A policy for `penny/Kick-v0`, trained by the cross-entropy method in NumPy.

    python examples/train.py [video.gif]

The policy is linear, force = tanh(W o + b); the method draws policies from a normal distribution, keeps the best, and
fits the distribution to them (Rubinstein 1999; Szita and Lőrincz 2006).
"""

import sys

import gymnasium
import kick  # noqa: F401
import numpy as np

import penny

OBSERVED = np.array([3.0, 3.0, 1.0, 3.0, 3.0, 1.0, 1.0])
"""What numbers of an observation are divided by."""
SIZE = 2 * 8


def act(policy, observation):
    weights = policy.reshape(2, 8)
    return np.tanh(weights[:, :7] @ (observation / OBSERVED) + weights[:, 7])


def play(env, policy, seed, frames=None):
    """One round. Out: its reward, and whether it was a goal."""
    observation, _ = env.reset(seed=seed)
    total = 0.0
    while True:
        observation, reward, terminated, truncated, info = env.step(act(policy, observation))
        total += reward
        if frames is not None and len(frames) < 400:
            frames.append(env.render())
        if terminated or truncated:
            return total, info["goal"]


def train(env, rounds=10, population=32, kept=6, episodes=4, seed=0, say=print):
    random = np.random.default_rng(seed)
    mean, spread = np.zeros(SIZE), np.full(SIZE, 1.0)
    for generation in range(rounds):
        policies = mean + spread * random.normal(size=(population, SIZE))
        seeds = 1000 * generation + np.arange(episodes)
        scores = np.array([np.mean([play(env, p, int(s))[0] for s in seeds]) for p in policies])
        best = policies[np.argsort(scores)[-kept:]]
        mean, spread = best.mean(axis=0), best.std(axis=0) + 0.3 / (1 + generation)
        say(f"generation {generation}: mean score {scores.mean():.2f}, best {scores.max():.2f}")
    return mean


def goals(env, policy, rounds=50):
    """The share of rounds, none of them seen in training, that end with a goal."""
    return np.mean([play(env, policy, 1_000_000 + i)[1] for i in range(rounds)])


def main(video=None, **how):
    env = gymnasium.make("penny/Kick-v0", disable_env_checker=True).unwrapped
    before = goals(env, np.zeros(SIZE))
    policy = train(env, **how)
    after = goals(env, policy)
    print(f"goals without pushing {before:.0%}, with the trained policy {after:.0%}")
    if video:
        frames = []
        for seed in range(3):
            play(env, policy, seed, frames)
        penny.save_video(video, frames, fps=50)
        print(f"{video}: {len(frames)} pictures")
    return before, after


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else None)
