"""A scene under many settings, and trajectories of many worlds, in pieces on any executor."""

from __future__ import annotations

import itertools
import os
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from . import _pieces
from ._enums import mjtState
from ._errors import StepError
from ._penny import MjModel
from ._pickle import reduce_model
from ._simulation import Simulation, samples
from ._state import mj_stateSize
from ._table import Sweep, Table

_THINGS = ("body", "joint", "geom", "site", "actuator")


def _portable(scene) -> tuple:
    """A scene as plain values, which every worker can make its own model of."""
    model = scene.model if isinstance(scene, Simulation) else scene
    return reduce_model(model if isinstance(model, MjModel) else Simulation.of(model).model)


def set_parameter(sim: Simulation, name: str, value) -> None:
    """Sets what a name says: an option ('law', 'timestep', 'gravity' …), or a number of a thing of the scene or its
    start ('geom.ball.friction', 'joint.x.qvel', 'actuator.motor.ctrl').

    Errors: `AttributeError`, `KeyError` for what there is not.
    """
    if "." not in name:
        setattr(sim.model.opt, name, value)
        return
    # The name of a thing may have points of its own.
    kind, _, rest = name.partition(".")
    thing, _, attribute = rest.rpartition(".")
    if not thing or kind not in _THINGS:
        raise AttributeError(f"parameter '{name}': an option, or thing.name.attribute with thing one of {_THINGS}")
    for side in (sim.data, sim.model):
        view = _named(getattr(side, kind), thing)
        if hasattr(view, attribute):
            setattr(view, attribute, value)
            return
    raise AttributeError(f"parameter '{name}': a {kind} has no {attribute}")


def _named(things: Callable, name: str):
    """The thing of that name, or else of that number."""
    try:
        return things(name)
    except KeyError:
        if not name.isdecimal():
            raise
        return things(int(name))


def outcome(sim: Simulation) -> dict[str, float]:
    """What `sweep` writes down of a run: where everything is at its end, its energy, and its deepest contact."""
    sim.forward()
    potential, kinetic = sim.energy
    depth = max([0.0, *(-sim.data.contact.dist)]) if sim.data.ncon else 0.0
    return {
        **{f"qpos{i}": float(q) for i, q in enumerate(sim.data.qpos)},
        "energy": potential + kinetic,
        "depth": depth,
    }


def _cell(scene: tuple, time: float, settings: list[dict], measure) -> Table:
    rows = []
    load, args = scene
    for setting in settings:
        sim = Simulation(load(*args), args[2]["law"])
        for name, value in setting.items():
            set_parameter(sim, name, value)
        shown = {name: value if np.isscalar(value) else str(value) for name, value in setting.items()}
        try:
            sim.run(time)
            rows.append({**shown, "failed": "", **measure(sim)})
        except StepError as why:
            rows.append({**shown, "failed": str(why).splitlines()[0]})
    return Table.of_rows(rows)


def sweep(
    scene,
    grid: Mapping[str, Sequence],
    *,
    time: float = 1.0,
    measure: Callable[[Simulation], dict] = outcome,
    executor=None,
    out: str | os.PathLike | None = None,
    resume: bool = False,
    piece: int = 4,
    retries: int = 2,
    progress: bool | None = None,
) -> Table:
    """The scene under every combination of the grid's values: a row for each, in the grid's order.

        penny.sweep("ball.xml", {"law": ["penalty", "mujoco"], "timestep": [1e-3, 2e-3], "geom.ball.friction": [...]})

    In: `scene` as for `Simulation.of`; `grid`, values by name, see `set_parameter`; `time`, s; `measure`, what is
    written down of each run at its end, a dictionary; `executor`, `out`, `resume`, see `penny._pieces.run`; `piece`,
    runs that go to a worker together. Out: the settings, `failed` (why a run stopped, else empty), and what was
    measured. The result is the same, bit for bit, whatever the executor. Errors: `ValueError` where a name has no
    list of values, or an empty one.
    """
    for name, values in grid.items():
        if isinstance(values, (str, bytes)) or not np.iterable(values):
            raise ValueError(f"'{name}' takes a list of values: [{values!r}], not {values!r}")
    grid = {name: list(values) for name, values in grid.items()}
    for name, values in grid.items():
        if not values:
            raise ValueError(f"'{name}' has no values: nothing would be run")
    settings = [dict(zip(grid, values)) for values in itertools.product(*grid.values())]
    portable = _portable(scene)
    groups = [settings[i : i + piece] for i in _firsts(len(settings), piece)]
    pieces = [(portable, time, group, measure) for group in groups]
    tables = _pieces.run(_cell, pieces, executor=executor, out=out, resume=resume, retries=retries, progress=progress)
    return Sweep(Table.of_rows([row for table in tables for row in table.rows]), grid)


def _firsts(n: int, piece: int) -> range:
    """Where each piece of so many begins."""
    if piece < 1:
        raise ValueError(f"piece: at least 1 goes to a worker, not {piece}")
    return range(0, n, piece)


def _worlds(scene: tuple, first: int, initial, control, nstep: int) -> Table:
    from .rollout import rollout

    load, args = scene
    model = load(*args)
    states, sensors = rollout(model, None, initial, control, nstep=nstep)
    worlds, steps, _ = states.shape
    columns = {
        "world": np.repeat(np.arange(first, first + worlds), steps),
        "step": np.tile(np.arange(1, steps + 1), worlds),
    }
    names = ["time", *(f"qpos{i}" for i in range(model.nq)), *(f"qvel{i}" for i in range(model.nv)),
             *(f"act{i}" for i in range(model.na))]  # fmt: skip
    columns |= dict(zip(names, states.reshape(-1, len(names)).T))
    columns |= {f"sensor{i}": sensors[:, :, i].ravel() for i in range(sensors.shape[-1])}
    return Table({name: np.ascontiguousarray(c) for name, c in columns.items()})


def rollout_table(
    scene,
    initial_state,
    control=None,
    *,
    nstep: int | None = None,
    executor=None,
    out: str | os.PathLike | None = None,
    resume: bool = False,
    piece: int = 64,
    retries: int = 2,
    progress: bool | None = None,
) -> Table:
    """Trajectories of many worlds as a table, in pieces of so many worlds on any executor.

    In: `scene` as for `Simulation.of`, `initial_state` (worlds, nstate) and `control` (worlds, nstep, nu) as for
    `penny.rollout.rollout`; the rest as for `sweep`. Out: `world`, `step`, `time`, qpos, qvel, act and sensor values
    after each step. Errors: `ValueError` for shapes that do not fit.
    """
    from .rollout import _fits, _length, _with_dimensions

    portable = _portable(scene)
    model = portable[0](*portable[1])
    initial, control = _with_dimensions(initial_state, 2, "initial_state"), _with_dimensions(control, 3, "control")
    _fits("initial_state", initial, mj_stateSize(model, mjtState.mjSTATE_FULLPHYSICS))
    _fits("control", control, model.nu)
    worlds, steps = _length(0, initial_state=initial, control=control), _length(1, nstep=nstep, control=control)
    initial = np.broadcast_to(initial, (worlds, *initial.shape[1:]))
    if control is not None:
        control = np.broadcast_to(control, (worlds, *control.shape[1:]))
    pieces = []
    for i in _firsts(worlds, piece):
        part = None if control is None else np.ascontiguousarray(control[i : i + piece])
        pieces.append((portable, i, np.ascontiguousarray(initial[i : i + piece]), part, steps))
    tables = _pieces.run(_worlds, pieces, executor=executor, out=out, resume=resume, retries=retries, progress=progress)
    return Table.joined(tables)


def compare(scene, *, time: float = 1.0, law: str = "mujoco", exact: bool = True, every: int = 1) -> Table:
    """The scene beside the real MuJoCo, which has to be installed: a row for each output, with both qpos.

    In: a path or text; `exact`, solver tolerance 0 in both. Out: `time`, `difference` (the largest of any qpos),
    `penny0` … and `mujoco0` ….
    """
    import mujoco

    sim = Simulation.of(scene, law)
    text = isinstance(scene, str) and scene.lstrip().startswith("<")
    m = mujoco.MjModel.from_xml_string(scene) if text else mujoco.MjModel.from_xml_path(os.fspath(scene))
    if exact:
        for opt in (sim.model.opt, m.opt):
            opt.tolerance, opt.iterations = 0, max(opt.iterations, 1000)
    d, rows = mujoco.MjData(m), []
    for _ in range(samples("a comparison", time, every, m.opt.timestep)):
        sim.step(every)
        mujoco.mj_step(m, d, every)
        difference = float(np.abs(sim.data.qpos - d.qpos).max())
        rows.append((sim.time, difference, *sim.data.qpos, *d.qpos))
    names = ["time", "difference", *(f"penny{i}" for i in range(m.nq)), *(f"mujoco{i}" for i in range(m.nq))]
    return Table(dict(zip(names, np.array(rows).reshape(-1, len(names)).T)))
