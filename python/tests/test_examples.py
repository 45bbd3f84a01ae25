"""The course's examples run, and say what they should."""

import sys
import textwrap
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import penny

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
sys.path.insert(0, str(EXAMPLES))


def test_four_integrators_by_hand_are_pennys():
    import four_integrators

    assert four_integrators.main() < 1e-9


def test_the_readme_s_own_simulation_runs(monkeypatch):
    text = (EXAMPLES.parent / "README.md").read_text()
    code = text[text.index("    sim = penny") : text.index("    penny.check(text)")]
    monkeypatch.chdir(EXAMPLES.parents[1])
    exec(textwrap.dedent(code), {"penny": penny})


def test_disk(tmp_path):
    import disk

    ends = disk.main(0.5, tmp_path / "disk.png")
    assert all(0.15 < end[2] < 1.2 for end in ends.values()) and (tmp_path / "disk.png").stat().st_size > 5_000


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_kick_is_a_gymnasium_environment():
    import kick  # noqa: F401

    env = gymnasium.make("penny/Kick-v0", render_mode="rgb_array").unwrapped
    check_env(env)
    first, _ = env.reset(seed=3)
    again, _ = env.reset(seed=3)
    assert np.array_equal(first, again)


def test_a_policy_learns_to_score():
    import train

    before, after = train.main(rounds=4, population=16, kept=4, episodes=2, say=lambda _: None)
    assert after > before + 0.2


def test_the_notebook_runs():
    nbformat, nbclient = pytest.importorskip("nbformat"), pytest.importorskip("nbclient")
    pytest.importorskip("ipykernel")
    notebook = nbformat.read(EXAMPLES / "course.ipynb", as_version=4)
    nbclient.NotebookClient(notebook, timeout=120, resources={"metadata": {"path": str(EXAMPLES)}}).execute()
    shown = [output.get("data", {}) for cell in notebook.cells for output in cell.get("outputs", [])]
    assert any("image/png" in data for data in shown)
    assert any("did you mean `friction`" in data.get("text/html", "") for data in shown)
