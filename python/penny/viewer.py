"""The window: `penny play` in a process of its own."""

from __future__ import annotations

import shutil
import subprocess
import tempfile
from pathlib import Path


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


def launch_passive(*args, **kwargs):
    """A window that shows what Python simulates: Penny has none; `Renderer` and `snapshot` make pictures."""
    raise NotImplementedError("Penny has no passive viewer: use Renderer, or snapshot in a notebook")
