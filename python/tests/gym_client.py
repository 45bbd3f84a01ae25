"""Runs a Gymnasium environment unchanged on one of the two engines and writes down what it saw.

    python gym_client.py mujoco|penny|kicked Ant-v5 200 out.npz

`kicked` is MuJoCo with every velocity changed by one unit in its last place before every step, up or down at random:
any other order of the same operations does that. How far it grows is how far two correct engines can agree. The rate
is measured with the environment's own options.
"""

import sys
import time

import numpy as np

which, name, steps, out = sys.argv[1], sys.argv[2], int(sys.argv[3]), sys.argv[4]
if which == "penny":
    import penny

    sys.modules["mujoco"] = penny

import gymnasium  # noqa: E402


def make(**how):
    env = gymnasium.make(name, max_episode_steps=10_000, **how)
    model = env.unwrapped.model
    assert type(model).__module__.startswith("penny" if which == "penny" else "mujoco")
    env.action_space.seed(0)
    return env, model


def run(env, steps):
    """Observations, rewards and ends of so many random actions, and seconds in `step`."""
    seen, seconds = [], 0.0
    random, data = np.random.default_rng(1), env.unwrapped.data
    for _ in range(steps):
        action = env.action_space.sample()
        if which == "kicked":
            data.qvel[:] = np.nextafter(data.qvel, random.choice([-np.inf, np.inf], data.qvel.size))
        begin = time.perf_counter()
        observation, reward, terminated, *_ = env.step(action)
        seconds += time.perf_counter() - begin
        seen.append((observation, reward, terminated))
        if terminated:
            env.reset()
    return *zip(*seen), seconds


env, model = make(render_mode="rgb_array" if which == "penny" else None)
model.opt.tolerance, model.opt.iterations = 0, 100
if which != "penny":
    model.opt.ls_iterations = 100
env.reset(seed=0)
observations, rewards, ends, _ = run(env, steps)
picture = env.render() if which == "penny" else np.zeros(0)
env.close()

env, _ = make()
env.reset(seed=0)
*_, seconds = run(env, steps)
np.savez(out, seen=observations, rewards=rewards, ends=ends, rate=steps / seconds, picture=picture)
