"""Runs a program on one of the two engines, unchanged, and writes down what it did: see `clients.py`.

    python client.py mujoco|penny|kicked STEPS OUT.npz CODE [ARGUMENT...]

`kicked` is MuJoCo with every velocity changed by one unit in its last place before every step, up or down at random.

Both engines get the same surroundings: no display (the viewer's window is a stand-in that stays open), no pauses, an
exact solver (`tolerance` 0), and an end after so many steps.
"""

import contextlib
import io
import sys
import time
import traceback

import numpy as np

which, most, out, code, *arguments = sys.argv[1:]
if which == "penny":
    import penny as engine
    from penny import viewer

    sys.modules["mujoco"] = engine
    sys.modules["mujoco.viewer"] = viewer
else:
    import mujoco as engine
    from mujoco import viewer

trace, seen, random = [], set(), np.random.default_rng(1)
own_step = engine.mj_step


def exact(m):
    if id(m) not in seen:
        seen.add(id(m))
        m.opt.tolerance, m.opt.iterations = 0, 200
        if which != "penny":
            m.opt.ls_iterations = 100


def step(m, d, nstep=1):
    exact(m)
    for _ in range(nstep):
        if which == "kicked":
            d.qvel[:] = np.nextafter(d.qvel, random.choice([-np.inf, np.inf], d.qvel.size))
        own_step(m, d)
        trace.append(np.concatenate([[d.time], d.qpos, d.qvel]))
        if len(trace) >= int(most):
            raise SystemExit


class Window(contextlib.AbstractContextManager):
    """A window that nobody sees."""

    def __init__(self, *_, **__):
        self.cam, self.opt, self.pert = engine.MjvCamera(), engine.MjvOption(), engine.MjvPerturb()

    def is_running(self):
        return True

    def lock(self):
        return contextlib.nullcontext()

    def sync(self, *_):
        pass

    def close(self):
        pass

    def __exit__(self, *_):
        return None


def launch(model=None, data=None, *, loader=None):
    model, data = loader() if loader else (model, data)
    while True:
        step(model, data)


engine.mj_step, viewer.launch_passive, viewer.launch, time.sleep = step, Window, launch, lambda _: None
said, error = io.StringIO(), ""
sys.argv = ["client", *arguments]
np.random.seed(0)
with contextlib.redirect_stdout(said):
    try:
        exec(compile(code, "client", "exec"), {"__name__": "__main__"})
    except SystemExit:
        pass
    except BaseException as why:
        error = "".join(traceback.format_exception_only(why)).strip().splitlines()[0]
        if "-v" in arguments:
            traceback.print_exc()
width = max((len(row) for row in trace), default=0)
rows = [np.pad(row, (0, width - len(row))) for row in trace]
np.savez(out, trace=np.array(rows).reshape(len(rows), width), said=said.getvalue(), error=error)
