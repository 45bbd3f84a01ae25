"""Programs by people who use MuJoCo, each run on MuJoCo and on Penny: what came out is compared, the table printed.

    python clients.py [--check] [NAME...]

None of their code is here. Packages come from PyPI by pip, into the folder of `PENNY_CLIENTS` (`target/clients`);
scripts from GitHub at a commit, into the same folder, where they stay. What cannot be fetched is left out, and said.
`docs/clients.md` has the table of the last run; with `--check` it is an error if a line has become another but for its
numbers.
"""

import os
import re
import subprocess
import sys
import tempfile
import urllib.request
from dataclasses import dataclass
from pathlib import Path

import numpy as np

HERE = Path(__file__).parent
CACHE = Path(os.environ.get("PENNY_CLIENTS", HERE.parent / "target" / "clients"))
MODELS = HERE.parents[1] / "models"
TABLE = HERE.parents[1] / "docs" / "clients.md"
# Relative to the greatest number of a state and to 1.
TOLERANCE = 1e-9


@dataclass
class Client:
    """A program. `pip`: its package; or `github`: repository, commit and files, the script first."""

    name: str
    licence: str
    pip: str = ""
    # What else it imports, without versions that would bring another MuJoCo.
    needs: tuple = ()
    github: tuple = ()
    # What starts it; by default the script, in its folder.
    code: str = ""
    arguments: tuple = ()
    steps: int = 1000
    remark: str = ""

    def source(self) -> str:
        return f"PyPI {self.pip}" if self.pip else f"GitHub {self.github[0]} {self.github[1][:7]}, {self.github[2]}"

    def fetch(self) -> Path:
        """The folder that it is in.

        Errors: `OSError`, `CalledProcessError` where it cannot be had.
        """
        pip = [sys.executable, "-m", "pip", "install", "--quiet"]
        folder = CACHE / (self.pip.replace("==", "-") or "-".join(self.github[:2]).replace("/", "-"))
        if folder.exists():
            return folder
        if self.needs:
            subprocess.run([*pip, *self.needs], check=True, capture_output=True)
        if self.pip:
            subprocess.run([*pip, "--no-deps", "--target", folder, self.pip], check=True, capture_output=True)
            return folder
        repository, commit, *files = self.github
        texts = {}
        for name in files:
            address = f"https://raw.githubusercontent.com/{repository}/{commit}/{name}"
            with urllib.request.urlopen(address, timeout=20) as source:
                texts[folder / name] = source.read()
        for path, text in texts.items():
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(text)
        return folder

    def run(self, which: str, folder: Path, out: Path):
        script = folder / self.github[2] if self.github else None
        code = self.code or f"import runpy; runpy.run_path({str(script)!r}, run_name='__main__')"
        arguments = [a.format(models=MODELS, out=out.parent) for a in self.arguments]
        place = script.parent if script and not self.code else out.parent
        paths = os.pathsep.join([str(folder), os.environ.get("PYTHONPATH", "")])
        environment = {**os.environ, "PYTHONPATH": paths, "MPLBACKEND": "Agg", "PYTHONHASHSEED": "0"}
        command = [sys.executable, HERE / "client.py", which, str(self.steps), out, code, *arguments]
        subprocess.run(command, check=True, cwd=place, env=environment, capture_output=True, timeout=600)
        with np.load(out) as result:
            return result["trace"], str(result["said"]), str(result["error"])


def numbers(text):
    """Numbers in a text, and the text between them; times of day and of computing are no result."""
    parts = re.split(r"(-?\d+(?:\.\d*)?(?:e[-+]?\d+)?)", re.sub(r"wall-clock.*|\d+\.?\d*\s*s\b", "", text))
    return [p.split() for p in parts[::2]], np.array([float(x) for x in parts[1::2]])


def same_for(a, b, tolerance) -> int:
    """So many steps two runs were the same."""
    n = min(len(a), len(b))
    a, b = a[:n], b[:n]
    apart = np.abs(a - b).max(axis=1, initial=0) > tolerance * np.maximum(1, np.abs(b).max(axis=1, initial=0))
    return int(np.argmax(apart)) if apart.any() else n


def verdict(ours, theirs, kicked) -> str:
    """In: results of Penny, of MuJoCo, and what gives those of MuJoCo with one ulp changed in every step."""
    (a, said, error), (b, expected, their_error) = ours, theirs
    if error and their_error:
        return f"neither runs. MuJoCo: {their_error}. Penny: {error}"
    if error or their_error:
        return f"Penny fails: {error}" if error else f"MuJoCo fails: {their_error}"
    until = same_for(a, b, TOLERANCE)
    if until < len(b):
        # Chaos: rounding grows as fast in MuJoCo itself, and a step rounds more than once.
        most = same_for(kicked()[0], b, 0.1 * TOLERANCE)
        if until >= most > 0:
            return f"same for {until} steps of {len(b)}, as long as MuJoCo agrees with itself ({most})"
        return f"differs from step {until} of {len(b)} on; MuJoCo agrees with itself for {most}"
    if len(a) != len(b):
        return f"differs: {len(a)} steps, MuJoCo {len(b)}"
    (words, x), (other_words, y) = numbers(said), numbers(expected)
    if words != other_words or x.shape != y.shape or not np.allclose(x, y, rtol=1e-6, atol=1e-8):
        return "differs in what it prints"
    return f"same, {len(a)} steps" if len(a) else f"same, {len(x)} numbers printed"


ENV = """
import gymnasium, {module} as module
gymnasium.register_envs(module)
env = gymnasium.make("{name}")
env.action_space.seed(0)
print(env.reset(seed=0)[0])
while True:
    seen, reward, ended, cut, _ = env.step(env.action_space.sample())
    print(reward, ended)
    if ended or cut:
        env.reset(seed=1)
"""
# Written for `gym`, before it became `gymnasium`.
MWE = """
import sys, gymnasium
from gymnasium.utils import seeding
own = seeding.np_random
# It moves at random before one can give it a seed.
seeding.np_random = lambda seed=None: own(seed or 0)
sys.modules["gym"] = gymnasium
import mjc_mwe
for make in (mjc_mwe.HalfCheetahEnv, mjc_mwe.InvertedDoublePendulumEnv, mjc_mwe.ReacherEnv, mjc_mwe.PusherEnv):
    env = make()
    env.action_space.seed(0)
    print(env.reset(seed=0))
    for _ in range(40):
        seen, reward, ended, *_ = env.step(env.action_space.sample())
        print(reward, ended)
"""
# The file alone: the package's own beginning imports benchmarks that need other engines.
FANCY = """
import importlib.util, os, sys
folder = next(p for p in sys.path if os.path.isdir(os.path.join(p, "fancy_gym")))
path = os.path.join(folder, "fancy_gym", "envs", "mujoco", "reacher", "reacher.py")
spec = importlib.util.spec_from_file_location("reacher", path)
module = sys.modules["reacher"] = importlib.util.module_from_spec(spec)
spec.loader.exec_module(module)
for links in (5, 7):
    env = module.ReacherEnv(n_links=links)
    env.action_space.seed(0)
    print(env.reset(seed=0)[0])
    for _ in range(200):
        print(env.step(env.action_space.sample())[1])
"""
ROBOTICS = {"pip": "gymnasium-robotics==1.4.2", "licence": "MIT", "needs": ("gymnasium", "pettingzoo")}
TUTORIAL = ("peakyet/mujoco_tutorial", "0665fb7a09bdee6fa05cc690de0e81d720b34776")
BASICS = ("wtz19945/tools_basics", "5e1afda82df63ac28e5a4b9eedeabc24054e2398")
ALGOVERSE = "sidselvaraj/MuJoCo-Testing-Algoverse"

CLIENTS = [
    Client("PointMaze_UMaze-v3", code=ENV.format(module="gymnasium_robotics", name="PointMaze_UMaze-v3"), **ROBOTICS),
    Client("AntMaze_UMaze-v5", code=ENV.format(module="gymnasium_robotics", name="AntMaze_UMaze-v5"), **ROBOTICS),
    Client(
        "MaMuJoCo Ant 2x4",
        **ROBOTICS,
        code="""
from gymnasium_robotics import mamujoco_v1
env = mamujoco_v1.parallel_env("Ant", "2x4")
env.reset(seed=0)
for agent in env.agents:
    env.action_space(agent).seed(0)
while True:
    seen, rewards, *_ = env.step({agent: env.action_space(agent).sample() for agent in env.agents})
    print(rewards["agent_0"])
    if not env.agents:
        env.reset(seed=1)
""",
    ),
    Client(
        "MaMuJoCo HalfCheetah 6x1",
        **ROBOTICS,
        code="""
from gymnasium_robotics import mamujoco_v1
env = mamujoco_v1.parallel_env("HalfCheetah", "6x1")
env.reset(seed=0)
for agent in env.agents:
    env.action_space(agent).seed(0)
while env.agents:
    env.step({agent: env.action_space(agent).sample() for agent in env.agents})
""",
        steps=200,
    ),
    Client("FetchReach-v4", code=ENV.format(module="gymnasium_robotics", name="FetchReach-v4"), **ROBOTICS),
    Client("AdroitHandDoor-v1", code=ENV.format(module="gymnasium_robotics", name="AdroitHandDoor-v1"), **ROBOTICS),
    Client(
        "mujoco_sysid: torques by regressors",
        pip="mujoco_sysid==0.2.1",
        licence="none stated",
        arguments=("{models}/arm.xml",),
        code="""
import sys, numpy as np, mujoco
from mujoco_sysid import parameters, regressors
m = mujoco.MjModel.from_xml_path(sys.argv[1])
d = mujoco.MjData(m)
rng = np.random.default_rng(0)
for _ in range(20):
    d.qpos, d.qvel = rng.normal(size=m.nq), rng.normal(size=m.nv)
    mujoco.mj_forward(m, d)
    d.qacc[:] = rng.normal(size=m.nv)
    mujoco.mj_inverse(m, d)
    mujoco.mj_rnePostConstraint(m, d)
    print(regressors.joint_torque_regressor(m, d), parameters.get_dynamic_parameters(m, 1), d.qfrc_inverse)
""",
    ),
    Client(
        "mujoco_logger",
        pip="mujoco_logger==0.1.2",
        needs=("numpy-quaternion",),
        licence="GPL 3",
        arguments=("{models}/arm.xml",),
        code="""
import sys, mujoco
from mujoco_logger import SimLogger
m = mujoco.MjModel.from_xml_path(sys.argv[1])
d = mujoco.MjData(m)
d.qvel[:] = 1
with SimLogger(m, d, data_keys=["qfrc_bias", "actuator_force"], output_filepath="log.json") as log:
    for _ in range(300):
        mujoco.mj_step(m, d)
        log.record()
    print(sum(sum(row) for row in log._SimLogger__history["data_qacc"]))
""",
    ),
    Client(
        "mujoco_tools: recorder",
        pip="mujoco_tools==0.1.0",
        licence="MIT",
        needs=("opencv-python-headless", "tqdm"),
        code="from mujoco_tools.cli import main; main()",
        arguments=(
            "-m",
            "{models}/arm.xml",
            "--mode",
            "dynamics",
            "--record_data",
            "--datatype",
            "qpos qvel xpos",
            "--output_path",
            "{out}/logs",
        ),
    ),
    Client(
        "mujopy: graph of a robot",
        pip="mujopy==0.0.1",
        licence="MIT",
        needs=("networkx",),
        code="""
import os, sys, gymnasium
from mujopy.src.mujopy_model.mujopy_model import MuJoPyModel
assets = os.path.join(os.path.dirname(gymnasium.__file__), "envs", "mujoco", "assets")
for name in ("ant", "half_cheetah", "humanoid", "walker2d_v5"):
    robot = MuJoPyModel(os.path.join(assets, name + ".xml"))
    print([b.name for b in robot._bodies], [j.name for j in robot._joints], len(robot._geoms))
""",
    ),
    Client(
        "mujoco_toolbox: simulation",
        pip="mujoco_toolbox==0.8.0",
        licence="MIT",
        needs=("defusedxml", "imageio", "pyyaml", "screeninfo", "matplotlib", "ipython", "tqdm"),
        arguments=("{models}/arm.xml",),
        code="""
import sys, numpy as np
from mujoco_toolbox import Simulation
sim = Simulation(sys.argv[1], duration=1, data_rate=50)
sim.run()
print({k: np.asarray(v)[-1] for k, v in sim.captured_data.items() if k in ("qpos", "time")})
""",
    ),
    Client("mjc_mwe: four environments", pip="mjc_mwe==0.1.2", licence="MIT", code=MWE, steps=10_000),
    Client("Fancy Gym: reachers of 5 and 7 links", pip="fancy_gym==0.3.0", licence="MIT", code=FANCY, steps=10_000),
    Client("tippe top", "MIT", needs=("matplotlib",), github=(*TUTORIAL, "scripts/tippe_top.py"), steps=3500),
    Client(
        "double pendulum by LQR",
        "MIT",
        needs=("scipy",),
        github=(*TUTORIAL, "scripts/double_pendulum.py", "scripts/double_pendulum.xml"),
    ),
    Client(
        "names and places",
        "none stated",
        github=(*BASICS, "my_trial/trial1/test.py"),
        remark="in places, which Penny knows before the first `mj_forward`",
    ),
    Client(
        "double pendulum",
        "none stated",
        github=(
            ALGOVERSE,
            "215712a31e5aedefd8337a9e92a4fc2abff8c0db",
            "scene_9-double_pendulum.py",
            "double_pendulum.xml",
        ),
    ),
    Client(
        "Atwood's machine",
        "none stated",
        github=(
            ALGOVERSE,
            "dd94fa5d00b3753de3d0d653452ddd2ec6ac054b",
            "scene-10-atwood_machine.py",
            "atwood_machine.xml",
        ),
    ),
]


def kind(line: str) -> str:
    """A line of the table without its numbers."""
    return re.sub(r"[\d.]+", "N", line)


def main(names, check) -> int:
    known = {kind(line) for line in TABLE.read_text().splitlines()} if check else set()
    print("| program | source | licence | Penny |\n|---|---|---|---|")
    failed = 0
    for client in CLIENTS:
        if names and client.name not in names:
            continue
        try:
            folder = client.fetch()
        except (OSError, subprocess.CalledProcessError) as why:
            print(f"{client.name}: cannot be fetched: {why}", file=sys.stderr)
            continue

        def run(which, client=client, folder=folder):
            with tempfile.TemporaryDirectory() as place:
                return client.run(which, folder, Path(place) / "out.npz")

        result = verdict(run("penny"), run("mujoco"), lambda run=run: run("kicked"))
        remark = f"; {client.remark}" if client.remark else ""
        line = f"| {client.name} | {client.source()} | {client.licence} | {result}{remark} |"
        print(line, flush=True)
        if check and kind(line) not in known:
            print(f"{client.name}: {TABLE.name} has another line", file=sys.stderr)
            failed = 1
    return failed


if __name__ == "__main__":
    arguments = sys.argv[1:]
    sys.exit(main([a for a in arguments if a != "--check"], "--check" in arguments))
