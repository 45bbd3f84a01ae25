"""What a call of `mj_step` costs beside the engine's own step: least of many repeats, the two by turns.

taskset -c 0 python bench.py        # on a quiet machine
"""

import gc
import timeit
from pathlib import Path

import penny

MODELS = Path(__file__).parents[1] / "models"
SLIDE = "<mujoco><worldbody><body><joint type='slide'/><geom size='.1'/></body></worldbody></mujoco>"
# As many numbers to exchange as the stack has, and nothing that touches.
AIR = "<mujoco><worldbody>" + "".join(
    f"<body pos='0 0 {9 + i}'><freejoint/><geom type='box' size='.1 .1 .1'/></body>" for i in range(3)
) + "</worldbody></mujoco>"  # fmt: skip
# Steps in a batch, and batches.
STEPS, REPEATS = 200, 1500


def least(text: str) -> tuple[float, float]:
    """Seconds a step, call by call and in one call."""
    m = penny.MjModel.from_xml_string(text)
    d = penny.MjData(m)
    known = {"step": penny.mj_step, "m": m, "d": d, "n": STEPS}
    timers = [timeit.Timer("step(m, d)", globals=known), timeit.Timer("step(m, d, n)", globals=known)]
    best = [float("inf")] * 2
    for _ in range(REPEATS):
        for i, (timer, calls) in enumerate(zip(timers, (STEPS, 1))):
            penny.mj_resetData(m, d)
            best[i] = min(best[i], timer.timeit(calls) / STEPS)
    return best[0], best[1]


gc.disable()
print("| scene | a call, ns | a step of many, ns | overhead, ns |\n|---|---|---|---|")
for name, text in {"one slide": SLIDE, **{n: (MODELS / f"{n}.xml").read_text() for n in
                   ("pendulum", "disk", "top", "arm", "stack")}, "three boxes in the air": AIR}.items():  # fmt: skip
    call, step = (1e9 * t for t in least(text))
    print(f"| {name} | {call:.0f} | {step:.0f} | {call - step:.0f} |")
