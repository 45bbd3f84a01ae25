"""`MjData.warning`: what MuJoCo counts of a run that went wrong."""

from __future__ import annotations

import numpy as np

from ._enums import mjtWarning


class MjWarningStat:
    """One kind of warning of a list."""

    __slots__ = ("_at", "_list")

    def __init__(self, list, at: int):
        self._list, self._at = list, at

    @property
    def number(self) -> int:
        """How often there was one."""
        return int(self._list.number[self._at])

    @number.setter
    def number(self, value: int):
        self._list.number[self._at] = value

    @property
    def lastinfo(self) -> int:
        """Of which number of `qpos`, `qvel`, `qacc` or `ctrl` the last one was."""
        return int(self._list.lastinfo[self._at])

    @lastinfo.setter
    def lastinfo(self, value: int):
        self._list.lastinfo[self._at] = value

    def __eq__(self, other):
        return isinstance(other, MjWarningStat) and (self.number, self.lastinfo) == (other.number, other.lastinfo)

    __hash__ = None

    def __repr__(self) -> str:
        return f"<MjWarningStat\n  lastinfo: {self.lastinfo}\n  number: {self.number}\n>"


class MjWarningStatList:
    """A number for each `mjtWarning`, int32: `number`, how often, and `lastinfo`, of which index the last one was.

    In Penny a warning comes with a `StepError`: `mjWARN_BADQPOS`, `mjWARN_BADQVEL` and `mjWARN_BADQACC` where a state
    or an acceleration is no number or beyond 1e10, `mjWARN_BADCTRL` where a control is. `mj_resetData` sets all to 0.
    The others stay 0: contacts and constraints always have room, and a singular inertia is an error of the scene.
    """

    __slots__ = ("_lastinfo", "_number")

    def __init__(self, number=None, lastinfo=None):
        zeros = np.zeros((2, mjtWarning.mjNWARNING), dtype=np.int32)
        self._number, self._lastinfo = (zeros[0], zeros[1]) if number is None else (number, lastinfo)

    @property
    def number(self) -> np.ndarray:
        return self._number

    @property
    def lastinfo(self) -> np.ndarray:
        return self._lastinfo

    def _note(self, kind: int, index: int):
        self._number[kind] += 1
        self._lastinfo[kind] = index

    def _set(self, other: MjWarningStatList | None):
        self._number[:] = other._number if other else 0
        self._lastinfo[:] = other._lastinfo if other else 0

    def __len__(self) -> int:
        return len(self._number)

    def __getitem__(self, key):
        if isinstance(key, slice):
            return MjWarningStatList(self._number[key], self._lastinfo[key])
        return MjWarningStat(self, range(len(self))[key])

    def __eq__(self, other):
        same = isinstance(other, MjWarningStatList) and len(self) == len(other)
        return same and all(a == b for a, b in zip(self, other))

    __hash__ = None

    def __repr__(self) -> str:
        return f"<MjWarningStatList\n  lastinfo: {self._lastinfo!r}\n  number: {self._number!r}\n>"
