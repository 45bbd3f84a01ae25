"""Many worlds at once, with the signature of `mujoco.rollout`."""

from __future__ import annotations

import sys
import types
import warnings
from collections.abc import Sequence

import numpy as np

from penny._enums import mjtState
from penny._penny import MjModel, _rollout
from penny._state import mj_getState, mj_stateSize


class Rollout:
    """Rollouts on so many threads: 0 or `None` for all cores.

    with Rollout(nthread=2) as r:
        state, sensordata = r.rollout(model, data, initial_state, control)
    """

    def __init__(self, *, nthread: int | None = None):
        self.nthread, self._open = nthread or 0, True

    def __enter__(self) -> Rollout:
        return self

    def __exit__(self, *_) -> None:
        self.close()

    def close(self) -> None:
        self._open = False

    def rollout(self, model, data, initial_state, control=None, *, control_spec=int(mjtState.mjSTATE_CTRL),
                skip_checks=False, nstep=None, initial_warmstart=None, state=None, sensordata=None,
                chunk_size=None):  # fmt: skip
        """See `penny.rollout.rollout`."""
        if not self._open:
            raise RuntimeError("rollout requested after thread pool shutdown")
        return _run(
            model,
            data,
            initial_state,
            control,
            control_spec,
            nstep,
            initial_warmstart,
            state,
            sensordata,
            chunk_size,
            self.nthread,
        )


def rollout(
    model: MjModel | Sequence[MjModel],
    data,
    initial_state,
    control=None,
    *,
    control_spec: int = int(mjtState.mjSTATE_CTRL),
    skip_checks: bool = False,
    nstep: int | None = None,
    initial_warmstart=None,
    state: np.ndarray | None = None,
    sensordata: np.ndarray | None = None,
    chunk_size: int | None = None,
    persistent_pool: bool = False,
) -> tuple[np.ndarray, np.ndarray]:
    """Open-loop trajectories of many worlds on all cores; the same bits on any number of threads.

    In: a model, or one for each world; `initial_state` (nbatch or 1, nstate) with nstate = mj_stateSize(FULLPHYSICS);
    `control` (nbatch or 1, nstep or 1, ncontrol), what `control_spec` says: a sum of `mjtState` bits; `data` (as many
    as MuJoCo takes threads) are not touched; without `control` theirs count. Out: states (nbatch, nstep, nstate) and
    sensor values (nbatch, nstep, nsensordata) after each step. `chunk_size` and `persistent_pool` change nothing:
    threads share the work as it comes. A world that fails stays where it is, with a warning that names it.

    Errors: `ValueError` for shapes that do not fit.
    """
    threads = len(data) if isinstance(data, (list, tuple)) and len(data) > 1 else 0
    return _run(
        model,
        data,
        initial_state,
        control,
        control_spec,
        nstep,
        initial_warmstart,
        state,
        sensordata,
        chunk_size,
        threads,
    )


def _with_dimensions(array, n: int, name: str):
    """At least n dimensions, new ones of length 1 in front."""
    if array is None:
        return None
    try:
        array = np.asarray(array, dtype=float)
    except (TypeError, ValueError) as why:
        raise ValueError(f"{name} must be numeric") from why
    if array.ndim > n:
        raise ValueError(f"{name} has {array.ndim} dimensions, not {n} at most")
    return array.reshape((1,) * (n - array.ndim) + array.shape)


def _length(axis: int, **given) -> int:
    """The common length along an axis of arrays, and of numbers that say it; 1 and `None` fit any."""
    lengths = {name: x.shape[axis] if isinstance(x, np.ndarray) else x for name, x in given.items()}
    lengths = {name: n for name, n in lengths.items() if n not in (None, 1)}
    if len(set(lengths.values())) > 1:
        raise ValueError(f"lengths along dimension {axis} differ: {lengths}")
    return next(iter(lengths.values()), 1)


def _fits(name: str, array: np.ndarray | None, width: int) -> None:
    if array is not None and array.shape[-1] != width:
        raise ValueError(f"trailing dimension of {name} must be {width}, got {array.shape[-1]}")


def _run(model, data, initial, control, spec, nstep, warm, state, sensordata, chunk, threads):
    models = [model] if isinstance(model, MjModel) else list(model)
    if not models:
        raise ValueError("The list of models is empty")
    spec = int(spec)
    if spec & ~int(mjtState.mjSTATE_USER):
        raise ValueError("control_spec can only contain bits in mjSTATE_USER")
    for name, value in (("nstep", nstep), ("chunk_size", chunk)):
        if value is not None and (isinstance(value, bool) or not isinstance(value, (int, np.integer))):
            raise ValueError(f"{name} must be an integer")
    if nstep is not None and nstep < 0:
        raise ValueError("nstep must be non-negative")
    if chunk is not None and chunk <= 0:
        raise ValueError("chunk_size must be a positive integer")
    if isinstance(data, (list, tuple)) and not data:
        raise ValueError("The list of data instances is empty")
    first = models[0]
    if control is None and data is not None:
        # As in MuJoCo what is not given stays as it is in the data.
        control = np.zeros(mj_stateSize(first, spec))
        mj_getState(first, data[0] if isinstance(data, (list, tuple)) else data, control, spec)
    initial, warm = _with_dimensions(initial, 2, "initial_state"), _with_dimensions(warm, 2, "initial_warmstart")
    control = _with_dimensions(control, 3, "control")
    for name, out in (("state", state), ("sensordata", sensordata)):
        if out is not None and (not isinstance(out, np.ndarray) or out.ndim != 3):
            raise ValueError(f"{name} should be an array of 3 dimensions")
    nbatch = _length(
        0,
        model=len(models),
        initial_state=initial,
        initial_warmstart=warm,
        control=control,
        state=state,
        sensordata=sensordata,
    )
    steps = _length(1, nstep=nstep, control=control, state=state, sensordata=sensordata)
    widths = {
        "initial_state": (initial, mj_stateSize(first, mjtState.mjSTATE_FULLPHYSICS)),
        "control": (control, mj_stateSize(first, spec)),
        "initial_warmstart": (warm, first.nv),
        "state": (state, mj_stateSize(first, mjtState.mjSTATE_FULLPHYSICS)),
        "sensordata": (sensordata, first.nsensordata),
    }
    for name, (array, width) in widths.items():
        _fits(name, array, width)

    def whole(array, *shape):
        return None if array is None else np.ascontiguousarray(np.broadcast_to(array, (*shape, array.shape[-1])))

    states, sensors, stopped = _rollout(
        models, whole(initial, nbatch), whole(control, nbatch, steps), whole(warm, nbatch), spec, steps, threads
    )
    for world, step, why in stopped:
        warnings.warn(f"world {world} stopped in step {step}: {why}", RuntimeWarning, stacklevel=3)
    if state is not None:
        state[...], states = states, state
    if sensordata is not None:
        sensordata[...], sensors = sensors, sensordata
    return states, sensors


def shutdown_persistent_pool() -> None:
    """Threads are kept for all rollouts alike: there is nothing to be shut down."""


class _Callable(types.ModuleType):
    """`penny.rollout(…)` is a table of trajectories, `penny.rollout.rollout(…)` is MuJoCo's function."""

    def __call__(self, *args, **kwargs):
        from penny._sweep import rollout_table

        return rollout_table(*args, **kwargs)


sys.modules[__name__].__class__ = _Callable
