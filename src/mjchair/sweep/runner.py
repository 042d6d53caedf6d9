"""Run a study: here, or on a Dask cluster; results land as they finish."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from typing import Any

import pyarrow
from tqdm import tqdm

from mjchair.engine.install import installed
from mjchair.errors import MjchairError
from mjchair.sweep.chunk import run_chunk
from mjchair.sweep.dataset import Dataset, read
from mjchair.sweep.study import Case, Study

Chunk = tuple[int, Sequence[Case]]
Done = tuple[int, list[dict[str, Any]]]

RETRIES = 5  # workers that may die over one chunk


def run(
    study: Study,
    out: str | os.PathLike[str],
    *,
    threads: int = 0,
    scheduler: str | None = None,
    progress: bool = False,
    force: bool = False,
) -> pyarrow.Table:
    """Simulate every case of a study that `out` does not hold yet.

    The results do not depend on the number of threads, on where they were computed, nor on
    whether the sweep was interrupted.

    Args:
      study: what to run. out: folder of the results; a folder of the same study is gone on with.
      threads: of one chunk, 0 for all processors. On Dask: of a worker's task; 0 is 1 there.
      scheduler: address of a Dask scheduler, as tcp://host:8786; its workers need mjchair.
      progress: show a bar where standard error is a terminal.
      force: drop another study's results in `out`.

    Returns:
      The whole table, in the order of the cases.

    Raises:
      MjchairError: bad input, a scheduler that does not answer, or a case that cannot be built.
    """
    dataset = Dataset(out, study, force)
    cases = study.cases()
    chunks: list[Chunk] = [
        (first, list(cases[first : first + study.chunk]))
        for first in range(0, len(cases), study.chunk)
    ]
    missing = [chunk for chunk in chunks if not dataset.has(chunk[0])]
    finished = _here(study, missing, threads)
    if scheduler is not None:
        finished = _on_dask(study, missing, threads or 1, scheduler)
    have = len(cases) - sum(len(chunk[1]) for chunk in missing)
    with tqdm(
        total=len(cases), initial=have, unit="chair", disable=None if progress else True
    ) as bar:
        for first, rows in finished:
            dataset.write(first, rows)
            bar.update(len(rows))
    return read(out)


def _here(study: Study, chunks: list[Chunk], threads: int) -> Iterator[Done]:
    with installed():
        for first, cases in chunks:
            yield first, run_chunk(study, cases, first, threads)


def _on_dask(study: Study, chunks: list[Chunk], threads: int, scheduler: str) -> Iterator[Done]:
    try:
        from dask.distributed import Client, as_completed
    except ImportError:
        raise MjchairError(
            "--scheduler needs dask.distributed; install mjchair[dask], or leave it out"
        ) from None
    try:
        client = Client(scheduler, timeout="10s", set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        line = " ".join(str(error).split())
        raise MjchairError(f"no Dask scheduler at {scheduler}: {line}") from None
    with client, client.as_current():
        waiting = {
            client.submit(
                run_chunk, study, cases, first, threads, pure=False, retries=RETRIES
            ): first
            for first, cases in chunks
        }
        try:
            for future in as_completed(list(waiting)):
                yield waiting[future], future.result()
                future.release()
        finally:
            client.cancel(list(waiting))
