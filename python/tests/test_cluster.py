"""Sweeps on Dask and on Ray with two workers, one of which is killed: complete, and the same bits as here.

Needs the packages `distributed` and `ray`; skipped without.
"""

import os
import signal
import time

import pytest
from conftest import MODELS

import penny

SCENE = MODELS / "circle.xml"
GRID = {"law": ["penalty", "mujoco", "tutorial"], "timestep": [0.0005, 0.001, 0.002, 0.004]}


def deadly(sim):
    """What is measured; the first worker that comes here is killed."""
    marker = os.environ["PENNY_TEST_MARKER"]
    try:
        os.close(os.open(marker, os.O_CREAT | os.O_EXCL))
    except FileExistsError:
        time.sleep(0.05)
        return {"x": float(sim.data.qpos[0])}
    os.kill(os.getpid(), signal.SIGKILL)
    return {}


@pytest.fixture
def expected(tmp_path, monkeypatch):
    monkeypatch.setenv("PENNY_TEST_MARKER", str(tmp_path / "marker"))
    monkeypatch.setenv("PYTHONPATH", os.path.dirname(__file__))
    (tmp_path / "marker").touch()
    table = penny.sweep(SCENE, GRID, time=0.2, piece=1, measure=deadly)
    (tmp_path / "marker").unlink()
    return table


def test_dask(expected, tmp_path):
    distributed = pytest.importorskip("distributed")
    how = {"n_workers": 2, "threads_per_worker": 1, "dashboard_address": None}
    with distributed.Client(**how) as client:
        table = penny.sweep(SCENE, GRID, time=0.2, piece=1, measure=deadly, executor=client, out=tmp_path / "out")
    assert (tmp_path / "marker").exists() and table == expected


def test_ray(expected, tmp_path):
    ray = pytest.importorskip("ray")
    environment = {name: os.environ[name] for name in ("PENNY_TEST_MARKER", "PYTHONPATH")}
    ray.init(num_cpus=2, include_dashboard=False, runtime_env={"env_vars": environment})
    try:
        table = penny.sweep(SCENE, GRID, time=0.2, piece=1, measure=deadly, executor=ray, out=tmp_path / "out")
    finally:
        ray.shutdown()
    assert (tmp_path / "marker").exists() and table == expected
