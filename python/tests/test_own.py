"""Penny's own: simulations, tables, sweeps in pieces, what a scene means."""

import ast
import builtins
import copy
import os
import pickle
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from conftest import MODELS

import penny
from penny import _pieces

CIRCLE = MODELS / "circle.xml"
GRID = {"law": ["penalty", "mujoco"], "timestep": [0.001, 0.002], "geom.1.friction": [[0.1, 0, 0], [0.5, 0, 0]]}


def test_a_simulation():
    sim = penny.Simulation.from_path(MODELS / "stack.xml")
    assert sim.model.opt.law == "penalty"
    saved = sim.step(200).save()
    later = sim.step(100).qpos.copy()
    assert np.array_equal(sim.restore(saved).step(100).qpos, later)
    weight = sum(sim.model.body_mass) * 9.81
    floor = [sim.contact_force(g, "ground") for g in range(sim.model.ngeom) if g != sim.model.geom("ground").id]
    assert np.isclose(np.sum(floor, axis=0)[2], weight, rtol=0.05)
    assert penny.Simulation.from_path(MODELS / "point_mass.xml").model.opt.law == "tutorial"
    with pytest.raises(ValueError, match="penalty"):
        penny.Simulation.from_path(CIRCLE, law="penaltie")


def test_pushes_add_up_and_go():
    sim = penny.Simulation.from_xml(
        '<mujoco><option gravity="0 0 0"/><worldbody><body name="b"><freejoint/><geom size=".1" mass="2"/></body>'
        "</worldbody></mujoco>"
    )
    sim.push("b", [4, 0, 0]).push("b", [0, 0, 2], point=[0.1, 0, 0]).step()
    assert np.allclose(sim.data.qacc[:3], [2, 0, 1])
    assert sim.data.qacc[4] < 0
    sim.clear_forces().forward()
    assert not sim.data.qacc.any()
    assert np.isclose(sim.set_mass("b", 4).model.body_inertia[1, 0], 2 * 0.4 * 2 * 0.01)
    for no_effect in (lambda: sim.push("world", [1, 0, 0]), lambda: sim.set_mass(0, 5)):
        with pytest.raises(ValueError, match="no joint moves it"):
            no_effect()
    for force, point in (
        ([np.nan, 0, 0], None),
        ([1, 0, 0], [np.inf, 0, 0]),
        ([1], None),
        (1, None),
        ([1, 2], None),
        ([1, 0, 0], [1]),
    ):
        with pytest.raises(ValueError, match="finite"):
            sim.push("b", force, point)
        assert not sim.data.xfrc_applied.any()
    for mass in (-1, 0, np.nan):
        with pytest.raises(ValueError, match="mass"):
            sim.set_mass("b", mass)
        assert sim.step().model.body_mass[1] == 4


def test_a_push_acts_at_a_place_that_is_where_the_body_is_now():
    sim = penny.Simulation.from_path(MODELS / "stack.xml")
    sim.qpos[:3] += [5, 0, 0]
    sim.push(1, [0, 0, 1], sim.qpos[:3])
    assert np.allclose(sim.xfrc_applied[1], [0, 0, 1, 0, 0, 0])


def test_contacts_are_those_of_the_changed_model():
    for look in (
        lambda sim: sim.push("b", [0, 0, 0]).data,
        lambda sim: copy.copy(sim.data),
        lambda sim: pickle.loads(pickle.dumps(sim.data)) and sim.data,
    ):
        sim = penny.Simulation.from_xml(
            '<mujoco><worldbody><geom type="plane" size="1 1 1"/><body name="a" pos="0 0 .1"><freejoint/>'
            '<geom size=".1" friction="3"/></body><body name="b" pos="1 0 .1"><freejoint/><geom name="b" size=".1" '
            'friction="2"/></body></worldbody></mujoco>'
        ).step(10)
        sim.model.geom("b").friction[0] = 3
        data = look(sim)
        assert data.contact.friction[:, 0].tolist() == [3, 3] and data.qfrc_constraint[2] > 0


def test_a_trajectory_goes_forwards():
    sim = penny.Simulation.from_path(CIRCLE)
    for seconds, every in ((-1, 1), (1, 0)):
        with pytest.raises(ValueError, match="a trajectory takes a time from 0 s on"):
            sim.trajectory(seconds, every)
        with pytest.raises(ValueError, match="a comparison takes a time from 0 s on"):
            penny.compare(CIRCLE, time=seconds, every=every)


def test_data_that_another_thread_steps_are_its_own():
    sim = penny.Simulation.from_path(MODELS / "stack.xml")
    m, d = sim.model, sim.data
    asked = {
        "step": lambda: penny.mj_step(m, d),
        "reset": lambda: penny.mj_resetData(m, d),
        "array": lambda: d.qpos,
        "view": lambda: d.body("high").xpos,
        "write": lambda: setattr(d, "time", 0.0),
        "copy": lambda: copy.copy(d),
        "jacobian": lambda: penny.mj_jacBody(m, d, np.zeros((3, m.nv)), None, 1),
        "picture": lambda: sim.picture(8, 8),
    }
    refused = set()
    for _ in range(20):
        stepping = threading.Thread(target=penny.mj_step, args=(m, d, 20_000))
        stepping.start()
        while stepping.is_alive():
            for name, ask in asked.items():
                try:
                    ask()
                except RuntimeError as why:
                    assert "lready" in str(why), why
                    refused.add(name)
        stepping.join()
    assert refused == set(asked)


def test_a_sweep_says_what_is_wrong_with_it():
    # In a process that has not loaded those of executors.
    wrong = f"import penny; penny.sweep({str(CIRCLE)!r}, {{'law': ['penaltie']}})"
    said = subprocess.run([sys.executable, "-c", wrong], capture_output=True, text=True).stderr
    assert "ValueError: no contact law 'penaltie'" in said, said


def test_values_are_a_list_and_there_are_some():
    for values, said in (("penalty", r"takes a list of values: \['penalty'\]"), ([], "has no values")):
        with pytest.raises(ValueError, match=said):
            penny.sweep(CIRCLE, {"law": values})
    with pytest.raises(ValueError, match="takes a list of values"):
        penny.sweep(CIRCLE, {"timestep": np.array(0.001)})
    assert len(penny.sweep(CIRCLE, {"timestep": (h for h in (0.001, 0.002))}, time=0.01).rows) == 2
    with pytest.raises(ValueError, match="at least 1"):
        penny.sweep(CIRCLE, {"timestep": [0.001]}, piece=-1)


def test_a_thing_is_found_by_its_name_whatever_that_is():
    text = (
        '<mujoco><worldbody><body name="left.foot"><freejoint/><geom size=".1"/></body>'
        '<body name="1" pos="1 0 0"><freejoint/><geom size=".1"/></body></worldbody></mujoco>'
    )
    masses = lambda sim: {f"m{i}": m for i, m in enumerate(sim.model.body_mass)}  # noqa: E731
    grid = {"body.left.foot.mass": [2.0], "body.1.mass": [3.0]}
    [row] = penny.sweep(text, grid, time=0.01, measure=masses).rows
    assert (row["m1"], row["m2"]) == (2, 3)


def test_a_run_takes_a_time_that_has_a_step():
    sim = penny.Simulation.from_path(CIRCLE)
    assert sim.run(0).time == 0 and sim.run(0.6 * sim.model.opt.timestep).time > 0
    for seconds, said in ((-1, "not -1"), (float("nan"), "not nan"), (1e-9, "less than half a timestep")):
        with pytest.raises(ValueError, match=said):
            sim.run(seconds)


def test_results_go_into_arrays_of_the_right_kind():
    m = penny.MjModel.from_xml_path(CIRCLE)
    d = penny.MjData(m)
    with pytest.raises(TypeError, match="a NumPy array of float64, which an array of float32 is not"):
        penny.mj_jac(m, d, np.zeros((3, m.nv), np.float32), None, [0, 0, 0], 1)
    with pytest.raises(TypeError, match="a NumPy array of int32, which an array of int64 is not"):
        penny.mj_ray(m, d, [0, 0, 3], [0, 0, -1], None, 1, -1, np.zeros(1, np.int64))


def test_what_contacts_mean():
    m = penny.MjModel.from_xml_path(MODELS / "point_mass.xml")
    m.opt.law = "tutorial"
    [row] = penny.explain(m)
    assert (row["geom1"], row["geom2"]) == ("ground", "point")
    assert np.isclose(row["stiffness"], 2500) and np.isclose(row["damping"], 20) and np.isclose(row["mass"], 1)
    assert np.isclose(row["rest_depth"], 9.81 / 2500)
    assert 0.02 < row["largest_timestep"] < 0.05


def test_beside_mujoco():
    table = penny.compare(MODELS / "pendulum.xml", time=0.2)
    assert table["difference"].max() < 1e-9 and np.isclose(table["time"][-1], 0.2)


def test_a_table():
    table = penny.Table.of_rows([{"law": "a", "x": 1.0}, {"law": "b", "y": 2.0}])
    assert list(table) == ["law", "x", "y"] and np.isnan(table["x"][1])
    assert table.rows[0]["law"] == "a" and "<td>b</td>" in table._repr_html_()
    assert dict(table).keys() == {"law", "x", "y"}


def test_a_sweep_is_the_same_everywhere():
    here = penny.sweep(CIRCLE, GRID, time=0.2)
    assert len(here["law"]) == 8 and set(here["failed"]) == {""}
    assert here["timestep"].tolist() == [0.001, 0.001, 0.002, 0.002] * 2
    with ProcessPoolExecutor(2) as processes, ThreadPoolExecutor(2) as threads:
        assert penny.sweep(CIRCLE, GRID, time=0.2, executor=processes, piece=3) == here
        assert penny.sweep(CIRCLE, GRID, time=0.2, executor=threads, piece=1) == here
    with pytest.raises(TypeError, match="executor"):
        penny.sweep(CIRCLE, GRID, executor=3)
    with pytest.raises(AttributeError, match=r"geom\.1\.frcition"):
        penny.sweep(CIRCLE, {"geom.1.frcition": [1]})


def test_a_run_that_fails_is_a_row():
    table = penny.sweep(CIRCLE, {"joint.0.qvel": [0.0, 1e12]}, time=0.1)
    assert table["failed"][0] == "" and table["failed"][1] != ""


def test_a_sweep_shows_itself_as_a_chart():
    table = penny.sweep(CIRCLE, {"law": ["penalty", "mujoco"], "timestep": [0.0005, 0.001, 0.01]}, time=0.1)
    shown = table._repr_html_()
    assert shown.startswith("<svg") or "<svg" in shown[:200]
    assert "<table>" in shown and all(word in shown for word in ("penalty", "mujoco", "timestep", "qpos0"))
    # Nothing to draw over.
    assert penny.sweep(CIRCLE, {"law": ["penalty", "mujoco"]}, time=0.1).svg() is None


def test_an_interrupted_sweep_goes_on(tmp_path, monkeypatch):
    whole = penny.sweep(CIRCLE, GRID, time=0.1, piece=1)
    ran = []
    real = _pieces._Folder.write

    def write(self, i, table):
        real(self, i, table)
        ran.append(i)
        if len(ran) == 3:
            raise KeyboardInterrupt

    monkeypatch.setattr(_pieces._Folder, "write", write)
    with pytest.raises(KeyboardInterrupt):
        penny.sweep(CIRCLE, GRID, time=0.1, piece=1, out=tmp_path)
    monkeypatch.setattr(_pieces._Folder, "write", lambda self, i, table: (ran.append(i), real(self, i, table)))
    with pytest.raises(ValueError, match="resume"):
        penny.sweep(CIRCLE, GRID, time=0.1, piece=1, out=tmp_path)
    assert penny.sweep(CIRCLE, GRID, time=0.1, piece=1, out=tmp_path, resume=True) == whole
    assert sorted(ran) == list(range(8))
    with pytest.raises(ValueError, match="other work"):
        penny.sweep(CIRCLE, GRID, time=0.2, piece=1, out=tmp_path, resume=True)


def flaky(path):
    """Fails the first time."""
    if not os.path.exists(path):
        open(path, "w").close()
        raise OSError("lost")
    return penny.Table({"x": [1.0]})


def test_a_piece_that_fails_is_tried_again(tmp_path):
    assert _pieces.run(flaky, [(str(tmp_path / "a"),)])[0]["x"] == [1]
    with pytest.raises(OSError, match="lost"):
        _pieces.run(flaky, [(str(tmp_path / "b"),)], retries=0)


def test_ctrl_c_stops_a_long_call():
    m = penny.MjModel.from_xml_path(MODELS / "stack.xml")
    d = penny.MjData(m)
    begin = time.monotonic()
    threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT)).start()
    with pytest.raises(KeyboardInterrupt):
        penny.mj_step(m, d, 10_000_000)
    assert time.monotonic() - begin < 20
    assert 0 < d.time < 10_000
    threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT)).start()
    full = np.zeros(penny.mj_stateSize(m, penny.mjtState.mjSTATE_FULLPHYSICS))
    penny.mj_getState(m, d, full, penny.mjtState.mjSTATE_FULLPHYSICS)
    with pytest.raises(KeyboardInterrupt):
        penny.rollout.rollout(m, d, full, nstep=1_000_000)


def test_others_work_during_a_step():
    m = penny.MjModel.from_xml_path(MODELS / "stack.xml")
    d = penny.MjData(m)
    work = threading.Thread(target=penny.mj_step, args=(m, d, 20_000))
    work.start()
    turns = 0
    while work.is_alive():
        turns += 1
        time.sleep(0.001)
    assert turns > 20


def test_stubs_have_what_type_checkers_look_for():
    tree = ast.parse(Path(penny.__file__).with_name("_penny.pyi").read_text())
    classes = [node for node in tree.body if isinstance(node, ast.ClassDef)]
    imported = {alias.name for node in tree.body if isinstance(node, ast.ImportFrom) for alias in node.names}
    known = {"np", *dir(builtins), *imported, *(c.name for c in classes)}
    used = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load)}
    assert used <= known
    for c in classes:
        there = {node.name for node in c.body if isinstance(node, ast.FunctionDef)}
        assert {"__len__", "__getitem__"} & set(vars(getattr(penny, c.name))) <= there, c.name


def test_a_table_is_what_pandas_takes():
    pandas = pytest.importorskip("pandas")
    table = penny.sweep(CIRCLE, GRID, time=0.01)
    frame = pandas.DataFrame(table)
    assert list(frame.columns) == list(table) and len(frame) == 8
    assert frame["energy"].tolist() == table["energy"].tolist()
    for other in (copy.copy(table), copy.deepcopy(table), pickle.loads(pickle.dumps(table))):
        assert other == table and (other != table) is False and other.settings == table.settings
