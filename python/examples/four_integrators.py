"""Scenario 0 of the course: a point mass falls on the ground, by hand in NumPy beside Penny.

The same force law, four integrators, each a few lines, and the same motion from Penny to rounding.

    python examples/four_integrators.py
"""

from pathlib import Path

import numpy as np

import penny

SCENE = Path(__file__).resolve().parents[2] / "models" / "point_mass.xml"
M, G, R, K, C, MU, ALPHA = 1.0, 9.81, 0.1, 2500.0, 20.0, 0.5, 50.0


def acceleration(p, v):
    """F_n = k d + c max(0, −v_z), F_f = −μ F_n tanh(α v_x); without depth d there is no force."""
    depth = max(0.0, R - p[1])
    normal = K * depth + C * max(0.0, -v[1]) if depth > 0 else 0.0
    return np.array([-MU * normal * np.tanh(ALPHA * v[0]), normal - M * G]) / M


def explicit_euler(p, v, h):
    return p + h * v, v + h * acceleration(p, v)


def semi_implicit_euler(p, v, h):
    v = v + h * acceleration(p, v)
    return p + h * v, v


def implicit_euler(p, v, h):
    """v′ = v + h a(p + h v′, v′), by Newton's method with differences for its matrix."""

    def residual(w):
        return w - v - h * acceleration(p + h * w, w)

    new = v + h * acceleration(p, v)
    for _ in range(50):
        r = residual(new)
        jacobian = np.array([(residual(new + 1e-7 * e) - r) / 1e-7 for e in np.eye(2)]).T
        step = np.linalg.solve(jacobian, r)
        new = new - step
        if np.abs(step).max() < 1e-14:
            break
    return p + h * new, new


def rk4(p, v, h):
    k1, a1 = v, acceleration(p, v)
    k2, a2 = v + h / 2 * a1, acceleration(p + h / 2 * k1, v + h / 2 * a1)
    k3, a3 = v + h / 2 * a2, acceleration(p + h / 2 * k2, v + h / 2 * a2)
    k4, a4 = v + h * a3, acceleration(p + h * k3, v + h * a3)
    return p + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4), v + h / 6 * (a1 + 2 * a2 + 2 * a3 + a4)


def by_hand(step, seconds, h):
    p, v = np.array([0.0, 0.15]), np.array([1.0, 0.0])
    for _ in range(round(seconds / h)):
        p, v = step(p, v, h)
    return p


def by_penny(name, seconds, h):
    sim = penny.Simulation.from_path(SCENE)
    sim.model.opt.integrator, sim.model.opt.timestep = name, h
    sim.data.qvel = [1, 0]
    return sim.run(seconds).data.qpos.copy()


def main(seconds=0.5, h=1e-3):
    print(f"{'integrator':22}{'x by hand':>12}{'z by hand':>12}{'Penny differs by':>18}")
    worst = 0.0
    for step in (explicit_euler, semi_implicit_euler, implicit_euler, rk4):
        mine, pennys = by_hand(step, seconds, h), by_penny(step.__name__.replace("_", "-"), seconds, h)
        difference = np.abs(mine - pennys).max()
        worst = max(worst, difference)
        print(f"{step.__name__:22}{mine[0]:12.6f}{mine[1]:12.6f}{difference:18.1e}")
    return worst


if __name__ == "__main__":
    main()
