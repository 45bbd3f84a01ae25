"""MuJoCo at the other end of a pipe: one JSON request a line in, one JSON answer a line out."""

import json
import sys
import time


def answer(**fields):
    sys.stdout.write(json.dumps(fields) + "\n")
    sys.stdout.flush()


try:
    import mujoco
except Exception as problem:
    answer(error=f"{type(problem).__name__}: {problem}")
    sys.exit()

answer(version=mujoco.__version__)
model = data = saved = workers = None

# The state that decides the next step: position, velocity, warm start and so on.
ALL = mujoco.mjtState.mjSTATE_INTEGRATION


def load(request):
    """Loads a scene by path or text and puts it into the state to start from."""
    global model, data
    if "path" in request:
        model = mujoco.MjModel.from_xml_path(request["path"])
    else:
        model = mujoco.MjModel.from_xml_string(request["xml"])
    model.opt.timestep = request["timestep"]
    if request.get("integrator"):
        name = "mjINT_" + request["integrator"].upper()
        model.opt.integrator = getattr(mujoco.mjtIntegrator, name)
    if request.get("exact"):
        model.opt.tolerance = 0
        model.opt.iterations = max(model.opt.iterations, 100)
    data = mujoco.MjData(model)
    data.time = request["time"]
    data.qpos[:], data.qvel[:], data.ctrl[:] = request["qpos"], request["qvel"], request["ctrl"]
    return {}


def unstable():
    """MuJoCo resets an unstable state in silence; its warnings tell."""
    bad = (mujoco.mjtWarning.mjWARN_BADQPOS, mujoco.mjtWarning.mjWARN_BADQVEL, mujoco.mjtWarning.mjWARN_BADQACC)
    return any(data.warning[w].number for w in bad)


def rollout(request):
    """Steps and records qpos, the start first, then after every `every` steps."""
    rows = [data.qpos.tolist()]
    for _ in range(request["steps"] // request["every"]):
        mujoco.mj_step(model, data, request["every"])
        if unstable():
            return {"rows": rows, "unstable": True}
        rows.append(data.qpos.tolist())
    return {"rows": rows}


def warm(request):
    """Steps to a typical state and remembers it."""
    global saved
    import numpy

    mujoco.mj_step(model, data, request["steps"])
    saved = numpy.empty(mujoco.mj_stateSize(model, ALL))
    mujoco.mj_getState(model, data, saved, ALL)
    return {}


def batch(request):
    """Time of `steps` steps from the remembered state, in nanoseconds; of all `worlds` at once on `threads`."""
    if request["worlds"]:
        return rollouts(**request)
    mujoco.mj_setState(model, data, saved, ALL)
    before = time.perf_counter_ns()
    mujoco.mj_step(model, data, request["steps"])
    return {"ns": time.perf_counter_ns() - before}


def rollouts(worlds, threads, steps, **_):
    """Time of MuJoCo's own loop over many worlds."""
    global workers
    import numpy
    from mujoco import rollout as worlds_loop

    mujoco.mj_setState(model, data, saved, ALL)
    start = numpy.empty(mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS))
    mujoco.mj_getState(model, data, start, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    starts, warm = numpy.tile(start, (worlds, 1)), numpy.tile(data.qacc_warmstart, (worlds, 1))
    controls = numpy.tile(data.ctrl, (worlds, steps, 1)) if model.nu else None
    if workers is None or workers[0] is not model or len(workers[2]) != threads:
        datas = [mujoco.MjData(model) for _ in range(threads)]
        workers = model, worlds_loop.Rollout(nthread=threads if threads > 1 else 0), datas
    out = numpy.empty((worlds, steps, start.size)), numpy.empty((worlds, steps, model.nsensordata))
    before = time.perf_counter_ns()
    workers[1].rollout(
        model, workers[2], starts, controls, nstep=steps, initial_warmstart=warm, state=out[0], sensordata=out[1]
    )
    return {"ns": time.perf_counter_ns() - before}


DO = {"load": load, "rollout": rollout, "warm": warm, "batch": batch}
for line in sys.stdin:
    request = json.loads(line)
    try:
        answer(**DO[request["do"]](request))
    except Exception as problem:
        answer(error=str(problem))
