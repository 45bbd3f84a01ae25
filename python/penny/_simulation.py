"""One way in: a scene that is stepped, read and changed by name, as in Rust."""

from __future__ import annotations

import copy
import math
import os

import numpy as np

from ._penny import (
    MjData,
    MjModel,
    mj_contactForce,
    mj_forward,
    mj_kinematics,
    mj_resetData,
    mj_resetDataKeyframe,
    mj_setConst,
    mj_step,
)
from ._render import png, snapshot


class Simulation:
    """A scene that runs, under its own contact law or else Penny's default, `penalty`.

    sim = Simulation.from_path("scene.xml")
    sim.step(500)
    print(sim.time, sim.body("ball").xpos)

    `model` and `data` are an `MjModel` and an `MjData`; everything MuJoCo names is there too.
    """

    def __init__(self, model: MjModel, law: str | None = None):
        self.model = model
        model.opt.law = law or model.scene_law or "penalty"
        self.data = MjData(model)

    @classmethod
    def from_path(cls, path: str | os.PathLike, law: str | None = None) -> Simulation:
        """Errors: `SceneError` with every problem of the file."""
        return cls(MjModel.from_xml_path(path), law)

    @classmethod
    def from_xml(cls, text: str, law: str | None = None) -> Simulation:
        """Errors: as `from_path`."""
        return cls(MjModel.from_xml_string(text), law)

    @classmethod
    def of(cls, scene, law: str | None = None) -> Simulation:
        """From a path, the text of a scene, a model (a copy of it) or another simulation."""
        if isinstance(scene, Simulation):
            return copy.deepcopy(scene)
        if isinstance(scene, MjModel):
            return cls(copy.copy(scene), law or scene.opt.law)
        if isinstance(scene, str) and scene.lstrip().startswith("<"):
            return cls.from_xml(scene, law)
        return cls.from_path(scene, law)

    def step(self, n: int = 1) -> Simulation:
        """n timesteps. Errors: `StepError` where the run diverges."""
        mj_step(self.model, self.data, n)
        return self

    def run(self, seconds: float) -> Simulation:
        """As many timesteps as come nearest to that time.

        Errors: `ValueError` for a time below 0, or one without a step.
        """
        timestep = self.model.opt.timestep
        if not 0 <= seconds < math.inf:
            raise ValueError(f"a run takes a time from 0 s on, not {seconds}")
        steps = round(seconds / timestep)
        if seconds > 0 and steps == 0:
            raise ValueError(f"{seconds:g} s are less than half a timestep of {timestep:g} s: nothing would move")
        return self.step(steps)

    def forward(self) -> Simulation:
        """Poses, contacts, forces, accelerations and sensors of the state as it is; nothing moves."""
        mj_forward(self.model, self.data)
        return self

    def reset(self, key: str | int | None = None) -> Simulation:
        """At rest in `qpos0`, or in the state of a keyframe."""
        if key is None:
            mj_resetData(self.model, self.data)
        else:
            mj_resetDataKeyframe(self.model, self.data, self.model.key(key).id)
        return self

    def save(self) -> bytes:
        """The whole state: with it a run continues with the same bits."""
        return bytes(self.data._state())

    def restore(self, state: bytes) -> Simulation:
        """Goes back to a saved state. Errors: `ValueError` if it is none of this model."""
        self.data._restore(state)
        return self

    @property
    def time(self) -> float:
        """s"""
        return self.data.time

    @property
    def energy(self) -> tuple[float, float]:
        """Potential and kinetic energy of the state at the beginning of the last step, J."""
        potential, kinetic = self.data.energy
        return float(potential), float(kinetic)

    def push(self, body: str | int, force, point=None) -> Simulation:
        """Adds a force (N) on a body, at a point of the world (m) or at its centre of mass, until `clear_forces`.

        The point is where it is now; later the force acts on the same place relative to the centre of mass, in world
        axes.
        ValueError: no joint moves the body, or force or point are not three finite numbers.
        """
        thing = self.data.body(self._moving(body, "a force"))
        mj_kinematics(self.model, self.data)
        force = np.asarray(force, dtype=float)
        point = thing.xipos if point is None else np.asarray(point, dtype=float)
        if any(x.shape != (3,) or not np.isfinite(x).all() for x in (force, point)):
            raise ValueError("a force and the point that it acts on are three finite numbers each")
        arm = point - thing.xipos
        thing.xfrc_applied[:3] += force
        thing.xfrc_applied[3:] += np.cross(arm, force)
        return self

    def clear_forces(self) -> Simulation:
        """Takes back all that `push` has added."""
        self.data.xfrc_applied[:] = 0
        return self

    def set_mass(self, body: str | int, mass: float) -> Simulation:
        """kg; the moments of inertia change in proportion.

        ValueError: no joint moves the body, or nothing could move with this mass.
        """
        thing = self.model.body(self._moving(body, "a mass"))
        before = thing.mass[0], thing.inertia.copy()
        if thing.mass[0] > 0:
            thing.inertia *= mass / thing.mass[0]
        thing.mass = mass
        try:
            mj_setConst(self.model, self.data)
        except ValueError:
            thing.mass, thing.inertia = before
            raise
        return self

    def _moving(self, body: str | int, what: str) -> int:
        """The id of a body that some joint moves."""
        m, thing = self.model, self.model.body(body)
        if m.body_dofnum[m.body_weldid[thing.id]] == 0:
            raise ValueError(f"{what} has no effect on body {thing.name!r}: no joint moves it")
        return thing.id

    def contact_force(self, on: str | int, other: str | int) -> np.ndarray:
        """The force of all contacts between two geoms on the first, N, world axes."""
        ids = self.model.geom(on).id, self.model.geom(other).id
        total, wrench = np.zeros(3), np.zeros(6)
        for i, contact in enumerate(self.data.contact):
            pair = contact.geom1, contact.geom2
            if set(pair) == set(ids):
                mj_contactForce(self.model, self.data, i, wrench)
                force = contact.frame.reshape(3, 3).T @ wrench[:3]
                total += force if pair[1] == ids[0] else -force
        return total

    def picture(self, width: int = 640, height: int = 400, camera=None, contacts: bool = True) -> np.ndarray:
        """(height, width, 3), uint8: all that moves, or from a camera of the scene."""
        return snapshot(self.data, width, height, camera, contacts)

    def trajectory(self, seconds: float, every: int = 1) -> Trajectory:
        """Runs on and keeps qpos, qvel and energies of every so many steps, with pictures now and then."""
        return Trajectory(self, seconds, every)

    def _repr_png_(self) -> bytes:
        return png(self.picture())

    def __getattr__(self, name: str):
        # Whatever data or model have: qpos, ctrl, body(…), sensor(…) …
        if name.startswith("_"):
            raise AttributeError(name)
        try:
            return getattr(self.data, name)
        except AttributeError:
            return getattr(self.model, name)

    def __deepcopy__(self, memo) -> Simulation:
        other = object.__new__(Simulation)
        other.data = copy.deepcopy(self.data, memo)
        other.model = other.data.model
        return other

    def __repr__(self) -> str:
        return f"<penny.Simulation at {self.time:g} s, law {self.model.opt.law}>"


def samples(what: str, seconds: float, every: int, timestep: float) -> int:
    """How often so many steps fit into a time."""
    if not 0 <= seconds < math.inf or every < 1:
        raise ValueError(f"{what} takes a time from 0 s on and `every` from 1 on, not {seconds} and {every}")
    return round(seconds / timestep) // every


class Trajectory:
    """States over time, ready to be plotted: `time` (n), `qpos` (n, nq), `qvel` (n, nv), `energy` (n, 2)."""

    SHOTS = 5

    def __init__(self, sim: Simulation, seconds: float, every: int = 1):
        steps = samples("a trajectory", seconds, every, sim.model.opt.timestep)
        rows: list[tuple] = []
        self.pictures: list[np.ndarray] = []
        shots = {round(k * steps / (self.SHOTS - 1)) for k in range(self.SHOTS)}
        for k in range(steps + 1):
            if k:
                sim.step(every)
            sim.forward()
            rows.append((sim.time, sim.data.qpos.copy(), sim.data.qvel.copy(), sim.data.energy.copy()))
            if k in shots:
                self.pictures.append(sim.picture(240, 180))
        self.time, self.qpos, self.qvel, self.energy = (np.array(column) for column in zip(*rows))

    def table(self):
        """All of it as a `Table`."""
        from ._table import Table

        columns = {"time": self.time}
        columns |= {f"qpos{i}": q for i, q in enumerate(self.qpos.T)}
        columns |= {f"qvel{i}": v for i, v in enumerate(self.qvel.T)}
        return Table({**columns, "potential": self.energy[:, 0], "kinetic": self.energy[:, 1]})

    def _repr_png_(self) -> bytes:
        return png(np.concatenate(self.pictures, axis=1))

    def __repr__(self) -> str:
        return f"<penny.Trajectory of {len(self.time)} states from {self.time[0]:g} to {self.time[-1]:g} s>"
