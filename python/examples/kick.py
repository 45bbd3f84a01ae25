"""The course's task as a Gymnasium environment: a teammate passes the ball, kick it into the goal.

    import kick                                     # registers it
    env = gymnasium.make("penny/Kick-v0")

The ball rolls in; a force moves it as long as all of it is at least 1 m away from the goal line. A round ends when the
whole ball is over the line: a goal if it is then between the posts and under the bar.
"""

from pathlib import Path

import gymnasium
import numpy as np
from gymnasium import spaces

import penny

SCENE = Path(__file__).resolve().parents[2] / "models" / "goal.xml"
RADIUS, HALF_WIDTH, HEIGHT, FAIR = 0.11, 1.5, 2.0, 1.0
FORCE = 6.0
"""N, the largest in each direction."""
SUBSTEPS, STEPS = 20, 250


class Kick(gymnasium.Env):
    """Observation: place (x, y, z) and velocity of the ball (m, m/s), and whether it may still be pushed.

    Action: force along x and y as a share of the largest, −1 to 1. Reward: 1 for a goal, and what the ball comes nearer
    to the goal's middle, 0.02 for each metre.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 50}  # noqa: RUF012

    def __init__(self, render_mode=None, law="penalty"):
        self.render_mode = render_mode
        self.sim = penny.Simulation.from_path(SCENE, law=law)
        self.observation_space = spaces.Box(-np.inf, np.inf, (7,), np.float64)
        self.action_space = spaces.Box(-1.0, 1.0, (2,), np.float32)

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.sim.reset()
        random, data = self.np_random, self.sim.data
        start = np.array([-random.uniform(3.5, 6), random.choice([-1, 1]) * random.uniform(3.5, 4.5), RADIUS])
        goal = np.array([-random.uniform(2.5, 4.5), 0, RADIUS])
        velocity = (goal - start) / np.linalg.norm(goal - start) * random.uniform(2.6, 4.2)
        data.qpos[:3] = start
        # Rolling without slip: ω = ẑ × v / r.
        data.qvel = [*velocity, -velocity[1] / RADIUS, velocity[0] / RADIUS, 0]
        self.steps = 0
        return self._observation(), {}

    def _may_push(self):
        return self.sim.data.qpos[0] + RADIUS <= -FAIR

    def _observation(self):
        data = self.sim.data
        return np.array([*data.qpos[:3], *data.qvel[:3], float(self._may_push())])

    def step(self, action):
        data = self.sim.data
        before = data.qpos[:3].copy()
        force = FORCE * np.clip(np.asarray(action, dtype=float), -1, 1) * self._may_push()
        data.xfrc_applied[1, :2] = force
        self.sim.step(SUBSTEPS)
        now, self.steps = data.qpos[:3], self.steps + 1
        away = [np.hypot(p[0], p[1]) for p in (before, now)]
        reward, over = 0.02 * (away[0] - away[1]), now[0] - RADIUS >= 0
        goal = False
        if over:
            # Where it was when all of it was over the line.
            share = np.clip((RADIUS - before[0]) / max(now[0] - before[0], 1e-9), 0, 1)
            crossing = before + share * (now - before)
            goal = bool(abs(crossing[1]) < HALF_WIDTH and crossing[2] < HEIGHT)
            reward += float(goal)
        return self._observation(), float(reward), bool(over), self.steps >= STEPS, {"goal": goal}

    def render(self):
        free = [-3.0, 0.0, 0.3, 9.0, 18.0, -24.0, 40.0]
        return penny._penny._paint(self.sim.data, 480, 320, free, [True] * 6, False)


gymnasium.register(id="penny/Kick-v0", entry_point=Kick)
