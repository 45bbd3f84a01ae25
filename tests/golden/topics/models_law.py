"""Runs of models/ under every integrator that MuJoCo has too, from every start, with tolerance 0 and 100 iterations."""

import pathlib

import mujoco

MODELS = pathlib.Path(__file__).parents[3] / "models"
INTEGRATORS = ["Euler", "RK4", "implicitfast"]
SECONDS = 2
SAMPLES = 20
# MuJoCo is started again with every velocity off by this. Where it is then further than LOST from itself, the run
# ends: boxes that begin exactly touching are a coin's toss. Where it is further than LOOSE, the tolerance is wide.
KICK = 1e-13
LOST = 1e-9
LOOSE = 1e-11


def run(m, start, kick=0.0):
    d = mujoco.MjData(m)
    if start is not None:
        mujoco.mj_resetDataKeyframe(m, d, start)
    d.qvel[:] += kick
    steps = round(SECONDS / m.opt.timestep)
    every = steps // SAMPLES
    rows = []
    for _ in range(SAMPLES):
        mujoco.mj_step(m, d, every)
        rows.append(d.qpos.tolist())
    return every, rows


def generate():
    runs = []
    for path in sorted(MODELS.glob("*.xml")):
        for integrator in INTEGRATORS:
            m = mujoco.MjModel.from_xml_path(str(path))
            m.opt.tolerance, m.opt.iterations = 0, 100
            m.opt.integrator = getattr(mujoco.mjtIntegrator, "mjINT_" + integrator.upper())
            for start in [None, *range(m.nkey)]:
                every, rows = run(m, start)
                _, kicked = run(m, start, KICK)
                apart = [max(abs(a - b) for a, b in zip(p, q)) for p, q in zip(rows, kicked)]
                kept = next((i for i, x in enumerate(apart) if x > LOST), SAMPLES)
                tolerance = 1e-7 if max(apart[:kept], default=0) > LOOSE else 1e-10
                runs.append({"name": path.name, "integrator": integrator, "start": start, "every": every,
                             "tolerance": tolerance, "qpos": rows[:kept]})
    return {"runs": runs}
