"""Windows: one that shows what Python simulates, and `penny play` in a process of its own."""

from __future__ import annotations

import math
import shutil
import struct
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

from ._enums import mjtCamera
from ._penny import MjData, MjModel
from ._render import MjrRect, MjvCamera, MjvOption, MjvPerturb, MjvScene, _picture, mjv_defaultFreeCamera

# The program that shows pictures, and how large.
_WINDOW = (sys.executable, "-m", "penny._window")
_SIZE = (960, 600)
# A screen shows no more pictures, 1/s.
_RATE = 60.0
# A window that is not there by then will not come, s.
_PATIENCE = 20.0


class Handle:
    """A window that shows model and data as they are at each `sync`; nothing in it moves by itself.

    Left mouse button: turn; right: shift; wheel: nearer and farther. `cam` and `opt` are MuJoCo's.
    """

    def __init__(self, model: MjModel, data: MjData, key_callback=None):
        self._model, self._data, self._keys = model, data, key_callback
        self.cam, self.opt, self.perturb = MjvCamera(), MjvOption(), MjvPerturb()
        self.user_scn = MjvScene(model)
        mjv_defaultFreeCamera(model, self.cam)
        self._lock, self._size, self._next = threading.RLock(), _SIZE, 0.0
        # Set while the window has shown the last picture.
        self._shown = threading.Event()
        self._said = "it does not answer"
        command, pipe = [*_WINDOW, *map(str, _SIZE)], subprocess.PIPE
        self._process = subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=subprocess.STDOUT)
        self._listener = threading.Thread(target=self._listen, daemon=True)
        self._listener.start()
        end = time.monotonic() + _PATIENCE
        while not self._shown.wait(0.05):
            if not self.is_running() or time.monotonic() > end:
                self._process.kill()
                self._listener.join()
                raise RuntimeError(f"cannot open a window: {self._said}")
        self.sync()

    @property
    def m(self) -> MjModel:
        return self._model

    @property
    def d(self) -> MjData:
        return self._data

    @property
    def viewport(self) -> MjrRect:
        return MjrRect(0, 0, *self._size)

    def is_running(self) -> bool:
        """Whether the window is open."""
        return self._process.poll() is None

    def lock(self):
        """A context in which the mouse changes nothing."""
        return self._lock

    def sync(self, state_only: bool = False) -> None:
        """Shows the data of now; sooner than a screen can show them, or while the last are on their way: nothing."""
        now = time.monotonic()
        if now < self._next or not self._shown.is_set() or not self.is_running():
            return
        if self.user_scn.ngeom:
            raise NotImplementedError("Penny's pictures have no geoms added by hand (user_scn)")
        self._next = now + 1 / _RATE
        with self._lock:
            width, height = self._size
            pixels = _picture(self._model, self._data, width, height, self.cam, self.opt)
        picture = b"P6 %d %d 255\n" % (width, height) + pixels.tobytes()
        self._shown.clear()
        try:
            self._process.stdin.write(struct.pack(">I", len(picture)) + picture)
            self._process.stdin.flush()
        except OSError:
            # Closed meanwhile.
            self._process.wait()

    def close(self) -> None:
        """Closes the window."""
        try:
            self._process.stdin.close()
        except OSError:
            self._process.kill()
        self._process.wait()
        self._listener.join()

    def _listen(self) -> None:
        for line in self._process.stdout:
            what, *words = line.split() or [b""]
            if what == b"shown":
                self._shown.set()
            elif what == b"size":
                self._size = int(words[0]), int(words[1])
            elif what == b"key":
                if self._keys is not None:
                    self._keys(int(words[0]))
            elif what in (b"rotate", b"pan", b"zoom"):
                with self._lock:
                    _move(self._model, self.cam, what.decode(), *map(float, words))
            else:
                # What Python says when the window fails.
                self._said = line.decode(errors="replace").strip()

    def __enter__(self) -> Handle:
        return self

    def __exit__(self, *_) -> None:
        self.close()


def _move(m: MjModel, cam: MjvCamera, how: str, x: float, y: float = 0.0) -> None:
    """Moves a camera by a mouse that goes x to the right and y down, parts of the picture's height.

    Half a turn a height; what is looked at goes with the mouse; a notch of the wheel is a tenth of the distance.
    """
    if cam.type == mjtCamera.mjCAMERA_FIXED:
        return
    if how == "rotate":
        cam.azimuth, cam.elevation = cam.azimuth - 180 * x, min(max(cam.elevation - 180 * y, -89.0), 89.0)
    elif how == "zoom":
        cam.distance *= 0.9**x
    elif cam.type == mjtCamera.mjCAMERA_FREE:
        scale = 2 * cam.distance * math.tan(math.radians(m.vis.global_.fovy) / 2)
        (sa, ca), (se, ce) = ((math.sin(a), math.cos(a)) for a in map(math.radians, (cam.azimuth, cam.elevation)))
        right, up = (sa, -ca, 0.0), (-se * ca, -se * sa, ce)
        cam.lookat = [p - scale * (x * r - y * u) for p, r, u in zip(cam.lookat, right, up)]


def launch_passive(model: MjModel, data: MjData, *, key_callback=None, show_left_ui: bool = True,
                   show_right_ui: bool = True) -> Handle:  # fmt: skip
    """A window that shows what Python simulates, through Python's own tkinter; there are no panels in it.

    In: `key_callback` gets GLFW's codes of keys that are pressed, on another thread.

    Errors: `RuntimeError` where there is no tkinter or no display, and says which.
    """
    return Handle(model, data, key_callback)


def launch(model=None, data=None, *, loader=None) -> None:
    """Plays a scene in Penny's window, where the program `penny` is installed with it; returns when it is closed.

    The window runs the scene by itself: what Python does to `data` meanwhile is not seen there.

    Errors: `NotImplementedError` where there is no such program.
    """
    program = shutil.which("penny")
    if program is None:
        raise NotImplementedError(
            "the window is part of the program `penny`: `cargo install --path crates/cli --features play`"
        )
    if model is None:
        model = loader()[0] if loader else None
    if model is None:
        raise ValueError("launch needs a model")
    with tempfile.TemporaryDirectory() as folder:
        scene = Path(folder) / "scene.xml"
        scene.write_text(model.files[0][1], encoding="utf-8")
        subprocess.run([program, "play", str(scene)], check=True)
