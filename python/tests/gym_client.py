"""Runs a Gymnasium environment unchanged on one of the two engines and writes down what it saw.

    python gym_client.py mujoco|penny Ant-v5 200 out.npz
"""

import sys
import time

import numpy as np

module, name, steps, out = sys.argv[1], sys.argv[2], int(sys.argv[3]), sys.argv[4]
if module == "penny":
    import penny

    sys.modules["mujoco"] = penny

import gymnasium  # noqa: E402

env = gymnasium.make(name, render_mode="rgb_array" if module == "penny" else None, max_episode_steps=10_000)
model = env.unwrapped.model
assert type(model).__module__.startswith(module)
model.opt.tolerance, model.opt.iterations = 0, 1000
if module == "mujoco":
    model.opt.ls_iterations = 200
env.action_space.seed(0)
seen, rewards, ends, seconds = [], [], [], 0.0
observation, _ = env.reset(seed=0)
for _ in range(steps):
    action = env.action_space.sample()
    begin = time.perf_counter()
    observation, reward, terminated, truncated, _ = env.step(action)
    seconds += time.perf_counter() - begin
    seen.append(observation)
    rewards.append(reward)
    ends.append(terminated)
    if terminated or truncated:
        env.reset()
picture = env.render() if module == "penny" else None
env.close()
np.savez(out, seen=seen, rewards=rewards, ends=ends, rate=steps / seconds, picture=np.zeros(0) if picture is None else picture)
