"""What can go wrong, as Python's exceptions."""

from __future__ import annotations

import html
from dataclasses import dataclass


@dataclass(frozen=True)
class Problem:
    """A problem of a scene file, with its place and, where it is known, its cure."""

    severity: str
    """'error' or 'warning'"""
    code: str
    """A stable name: 'unknown-attribute'."""
    message: str
    file: str
    line: int
    """From 1; 0 where there is no place."""
    column: int
    help: str | None
    text: str
    """The whole report, with the lines of the file."""

    def __str__(self) -> str:
        return self.text

    def _repr_html_(self) -> str:
        return f"<pre>{html.escape(self.text)}</pre>"


class FatalError(Exception):
    """MuJoCo's name for what stops a simulation."""


class StepError(FatalError):
    """A step could not be taken: the run diverged, or the state is none of this model. The text says where and why."""


class SceneError(ValueError):
    """A scene file with errors. `problems` lists all of them, each with its place."""

    def __init__(self, text: str, problems: list[Problem] | None = None) -> None:
        super().__init__(text)
        self.problems = problems or []

    def _repr_html_(self) -> str:
        return f"<pre>{html.escape(str(self))}</pre>"

    def __reduce__(self):
        return SceneError, (str(self), self.problems)
