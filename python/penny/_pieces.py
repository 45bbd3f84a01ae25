"""Work in small pieces: on any executor, written as it comes, taken up again where it stopped.

An executor is any `concurrent.futures.Executor`, a Dask client (`distributed.Client`), or the module `ray`. None of
them is a dependency, and there is no scheduler here: pieces are handed out, and what comes back is written.
"""

from __future__ import annotations

import concurrent.futures
import hashlib
import json
import os
import pickle
import sys
import time
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np

from ._table import Table


def run(
    work: Callable[..., Table],
    pieces: list[tuple],
    *,
    executor=None,
    out: str | os.PathLike | None = None,
    resume: bool = False,
    retries: int = 2,
    progress: bool | None = None,
) -> list[Table]:
    """The tables of `work(*piece)` for every piece, in the order of the pieces, whatever the executor.

    In: `out`, a folder: each piece is written there as soon as it is done (Parquet with pyarrow, else .npz), and with
    `resume=True` pieces that are there already are read instead. A piece whose worker is lost or that fails is tried
    again, `retries` times.

    Errors: the piece's own after the last try; `ValueError` if the folder is that of other work.
    """
    folder = _Folder(Path(out), work, pieces, resume) if out is not None else None
    done: dict[int, Table] = folder.read() if folder else {}
    missing = [i for i in range(len(pieces)) if i not in done]
    shown = _Progress(len(pieces), len(done), progress)
    tries: dict[int, int] = {}
    while missing:
        failed: list[int] = []
        for i, outcome in _results(executor, work, [(i, pieces[i]) for i in missing]):
            try:
                table = outcome()
            except Exception as why:
                tries[i] = tries.get(i, 0) + 1
                if tries[i] > retries or isinstance(why, concurrent.futures.BrokenExecutor):
                    shown.close()
                    raise
                failed.append(i)
                continue
            if folder:
                folder.write(i, table)
            done[i] = table
            shown.advance()
        missing = failed
    shown.close()
    return [done[i] for i in range(len(pieces))]


def _results(executor, work, pieces) -> Iterable[tuple[int, Callable[[], Table]]]:
    """Number of each piece as it is done, and what gives its table or raises."""
    if executor is None:
        for i, piece in pieces:
            yield i, lambda piece=piece: work(*piece)
    elif getattr(executor, "__name__", "") == "ray":
        remote = executor.remote(work)
        waiting = {remote.remote(*piece): i for i, piece in pieces}
        while waiting:
            [ready], _ = executor.wait(list(waiting), num_returns=1)
            yield waiting.pop(ready), lambda ready=ready: executor.get(ready)
    elif type(executor).__module__.split(".")[0] == "distributed":
        from distributed import as_completed

        futures = {executor.submit(work, *piece, pure=False): i for i, piece in pieces}
        for future in as_completed(list(futures)):
            yield futures[future], future.result
    elif hasattr(executor, "submit"):
        futures = {executor.submit(work, *piece): i for i, piece in pieces}
        for future in concurrent.futures.as_completed(futures):
            yield futures[future], future.result
    else:
        raise TypeError(f"executor: a concurrent.futures.Executor, a Dask client or the module ray, not {executor!r}")


class _Folder:
    """A folder of pieces, with a file that says of what work."""

    def __init__(self, path: Path, work, pieces, resume: bool):
        self.path = path
        try:
            import pyarrow  # noqa: F401

            self.ending = "parquet"
        except ImportError:
            self.ending = "npz"
        digest = hashlib.sha256()
        for piece in pieces:
            digest.update(pickle.dumps(piece))
        this = {"work": f"{work.__module__}.{work.__qualname__}", "pieces": len(pieces), "sha256": digest.hexdigest()}
        path.mkdir(parents=True, exist_ok=True)
        about = path / "pieces.json"
        there = json.loads(about.read_text()) if about.exists() else None
        if there is not None and not resume:
            raise ValueError(f"{path} has results already: resume=True goes on with them, another folder begins anew")
        if there is not None and {k: there.get(k) for k in this} != this:
            raise ValueError(f"{path} has the results of other work: another scene, other parameters or other pieces")
        if there is None:
            _write(about, lambda file: file.write(json.dumps(this, indent=1).encode()))

    def name(self, i: int, ending: str) -> Path:
        return self.path / f"piece-{i:06d}.{ending}"

    def read(self) -> dict[int, Table]:
        found = {}
        for file in sorted(self.path.glob("piece-*.*")):
            if file.suffix == ".npz":
                with np.load(file) as columns:
                    found[int(file.stem[6:])] = Table(columns)
            elif file.suffix == ".parquet":
                import pyarrow.parquet

                table = pyarrow.parquet.read_table(file)
                columns = {name: table[name].to_numpy() for name in table.column_names}
                text = {name: c.astype(str) if c.dtype == object else c for name, c in columns.items()}
                found[int(file.stem[6:])] = Table(text)
        return found

    def write(self, i: int, table: Table) -> None:
        file = self.name(i, self.ending)
        if self.ending == "npz":
            _write(file, lambda to: np.savez(to, **table))
        else:
            import pyarrow.parquet

            _write(file, lambda to: pyarrow.parquet.write_table(table.to_arrow(), to))


def _write(path: Path, fill) -> None:
    """The file is there whole or not at all."""
    draft = path.with_name(f".{path.name}.{os.getpid()}")
    with open(draft, "wb") as file:
        fill(file)
    os.replace(draft, path)


class _Progress:
    """A line on standard error, in a notebook a bar: where somebody looks on."""

    def __init__(self, total: int, done: int, wanted: bool | None):
        self.total, self.done, self.last = total, done, 0.0
        self.shown = sys.stderr.isatty() or "ipykernel" in sys.modules if wanted is None else wanted

    def advance(self) -> None:
        self.done += 1
        now = time.monotonic()
        if self.shown and (now - self.last > 0.2 or self.done == self.total):
            self.last = now
            print(f"\r{self.done} of {self.total} pieces", end="", file=sys.stderr, flush=True)

    def close(self) -> None:
        if self.shown and self.last:
            print(file=sys.stderr)
