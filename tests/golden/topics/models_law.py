"""Runs of models/ under every integrator that MuJoCo has too, from every start, with tolerance 0 and 100 iterations."""

import pathlib

import mujoco
import numpy as np

MODELS = pathlib.Path(__file__).parents[3] / "models"
INTEGRATORS = ["Euler", "RK4", "implicitfast"]
SECONDS = 2
SAMPLES = 20
# MuJoCo is started again with every velocity off by this. Where it is then further than LOST from itself, the run
# ends: boxes that begin exactly aligned are a coin's toss. The same start is then run once more with every velocity
# off by a size of its own, up to NUDGE, which aligns nothing. Where MuJoCo is further than LOOSE from itself, the
# tolerance is wide.
KICK = 1e-13
LOST = 1e-9
LOOSE = 1e-11
NUDGE = 0.05


def run(m, start, qvel):
    d = mujoco.MjData(m)
    if start is not None:
        mujoco.mj_resetDataKeyframe(m, d, start)
    d.qvel[:] += qvel
    first = d.qvel.tolist()
    steps = round(SECONDS / m.opt.timestep)
    every = steps // SAMPLES
    rows = []
    for _ in range(SAMPLES):
        mujoco.mj_step(m, d, every)
        rows.append(d.qpos.tolist())
    return every, first, rows


def runs_of(m, start):
    """A run from a start; if MuJoCo loses itself in it, another one with the start nudged."""
    for nudge in (0, NUDGE):
        qvel = nudge * np.sin(np.arange(1, m.nv + 1))
        every, first, rows = run(m, start, qvel)
        _, _, kicked = run(m, start, qvel + KICK)
        apart = [max(abs(a - b) for a, b in zip(p, q)) for p, q in zip(rows, kicked)]
        kept = next((i for i, x in enumerate(apart) if x > LOST), SAMPLES)
        tolerance = 1e-7 if max(apart[:kept], default=0) > LOOSE else 1e-10
        yield {"start": start, "qvel": first, "every": every, "tolerance": tolerance, "qpos": rows[:kept]}
        if kept == SAMPLES:
            break


def generate():
    runs = []
    for path in sorted(MODELS.glob("*.xml")):
        for integrator in INTEGRATORS:
            m = mujoco.MjModel.from_xml_path(str(path))
            m.opt.tolerance, m.opt.iterations = 0, 100
            m.opt.integrator = getattr(mujoco.mjtIntegrator, "mjINT_" + integrator.upper())
            for start in [None, *range(m.nkey)]:
                runs += [{"name": path.name, "integrator": integrator, **run} for run in runs_of(m, start)]
    return {"runs": runs}
