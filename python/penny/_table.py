"""Columns of numbers and names, as results of sweeps and rollouts."""

from __future__ import annotations

import html
from collections.abc import Iterable, Mapping

import numpy as np

from ._penny import _chart


# A dictionary, for these are what pandas and pyarrow take.
class Table(dict):
    """Columns by name, all of one length: `pandas.DataFrame(table)`, `pyarrow.table(table)`,
    `pyplot.plot(table["x"])`."""

    def __init__(self, columns: Mapping):
        super().__init__({name: np.asarray(values) for name, values in columns.items()})
        if len({len(column) for column in self.values()}) > 1:
            raise ValueError("columns differ in length")

    @classmethod
    def of_rows(cls, rows: list[dict]) -> Table:
        """A column for every key; NaN where a row lacks a number, an empty string where it lacks a name."""
        names = list(dict.fromkeys(name for row in rows for name in row))

        def column(name):
            text = any(isinstance(row.get(name), str) for row in rows)
            return np.array([row.get(name, "" if text else np.nan) for row in rows])

        return cls({name: column(name) for name in names})

    @classmethod
    def joined(cls, tables: list[Table]) -> Table:
        """One below the other."""
        names = list(tables[0]) if tables else []
        return cls({name: np.concatenate([table[name] for table in tables]) for name in names})

    @property
    def rows(self) -> list[dict]:
        """A dictionary for each row."""
        return [dict(zip(self, values)) for values in zip(*(column.tolist() for column in self.values()))]

    def to_pandas(self):
        """A `pandas.DataFrame`; needs pandas."""
        import pandas

        return pandas.DataFrame(self)

    def to_arrow(self):
        """A `pyarrow.Table`; needs pyarrow."""
        import pyarrow

        return pyarrow.table(self)

    def __eq__(self, other) -> bool:
        return (
            isinstance(other, Table)
            and list(self) == list(other)
            and all(_same(self[name], other[name]) for name in self)
        )

    def __ne__(self, other) -> bool:
        return not self == other

    __hash__ = None

    def __repr__(self) -> str:
        n = len(next(iter(self.values()), ()))
        return f"<penny.Table of {n} rows: {', '.join(self)}>"

    def _repr_html_(self, most: int = 20) -> str:
        """The first rows."""
        rows = self.rows
        cell = lambda x: html.escape(f"{x:.6g}" if isinstance(x, float) else str(x))  # noqa: E731
        head = "".join(f"<th>{html.escape(name)}</th>" for name in self)
        body = "".join("<tr>" + "".join(f"<td>{cell(x)}</td>" for x in row.values()) + "</tr>" for row in rows[:most])
        more = f"<p>{len(rows) - most} more rows</p>" if len(rows) > most else ""
        return f"<table><tr>{head}</tr>{body}</table>{more}"


class Sweep(Table):
    """The table of a sweep: a notebook shows what was measured over the first setting that is a number."""

    # More curves in a panel, or panels side by side, nobody can read.
    CURVES, PANELS = 6, 3

    def __init__(self, columns: Mapping, settings: Iterable[str] = ()):
        super().__init__(columns)
        self.settings = tuple(settings)

    def svg(self) -> str | None:
        """A chart; `None` where no setting is a number of several values, or there are too many others."""
        varied = [name for name in self.settings if len(np.unique(self[name])) > 1]
        x = next((name for name in varied if self[name].dtype.kind in "if"), None)
        if x is None:
            return None
        others = [name for name in varied if name != x]
        keys = list(zip(*(self[name].tolist() for name in others))) if others else [()] * len(self[x])
        kinds = list(dict.fromkeys(keys))
        measured = [name for name, values in self.items() if name not in self.settings and values.dtype.kind in "if"]
        measured = [name for name in measured if len(np.unique(self[name])) > 1][: self.PANELS]
        if len(kinds) > self.CURVES or not measured:
            return None

        def curve(quantity, kind):
            which = np.array([key == kind for key in keys])
            points = sorted(zip(self[x][which].tolist(), self[quantity][which].tolist()))
            return ", ".join(str(part) for part in kind), [[float(a), float(b)] for a, b in points]

        low, high = self[x].min(), self[x].max()
        panels = [(quantity, [curve(quantity, kind) for kind in kinds]) for quantity in measured]
        return _chart("", x, bool(low > 0 and high >= 10 * low), panels)

    def _repr_html_(self, most: int = 20) -> str:
        return (self.svg() or "") + super()._repr_html_(most)


def _same(a: np.ndarray, b: np.ndarray) -> bool:
    """The same bits: NaN equals NaN."""
    return a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()
