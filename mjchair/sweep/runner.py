"""Run a study, in this process or on a Dask cluster, and write each chunk as soon as it is ready.

In: a `Study` and a folder. Out: the table of all cases; the folder then holds it as Parquet files.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from typing import Any

import pyarrow
from tqdm import tqdm

from mjchair.engine.install import installed
from mjchair.errors import MjchairError
from mjchair.sweep.chunk import check_chairs, run_chunk
from mjchair.sweep.dataset import Dataset, read
from mjchair.sweep.study import Case, Study

Chunk = tuple[int, Sequence[Case]]  # number of the first case, and the cases
Result = tuple[int, list[dict[str, Any]]]  # number of the first case, and the rows

RETRIES = 5  # how often Dask repeats a chunk whose worker died


def run(
    study: Study,
    out: str | os.PathLike[str],
    *,
    threads: int = 0,
    scheduler: str | None = None,
    progress: bool = False,
    force: bool = False,
) -> pyarrow.Table:
    """Simulate all cases of a study whose results are not in `out` yet.

    The results depend neither on the number of threads, nor on the machine of the same kind that
    computed them, nor on whether the sweep was interrupted.

    Args:
      study: the study to run. out: folder of the results; one of the same study is continued.
      threads: threads for one chunk; 0 for all processors here, and for 1 on a Dask worker.
      scheduler: address of a Dask scheduler, such as tcp://host:8786; None: run in this process.
        The workers need mjchair.
      progress: show a progress bar where standard error is a terminal.
      force: delete the results of another study in `out`.

    Returns:
      The table of all cases, in their order.

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
    if missing:
        check_chairs(study)
    if scheduler is None:
        results = _in_this_process(study, missing, threads)
    else:
        results = _on_dask(study, missing, threads or 1, scheduler)
    finished = len(cases) - sum(len(chunk[1]) for chunk in missing)
    with tqdm(
        total=len(cases), initial=finished, unit="chair", disable=None if progress else True
    ) as bar:
        for first, rows in results:
            dataset.write(first, rows)
            bar.update(len(rows))
    return read(out)


def _in_this_process(study: Study, chunks: list[Chunk], threads: int) -> Iterator[Result]:
    """Simulate chunk after chunk; the callbacks are afterwards as they were before."""
    with installed():
        for first, cases in chunks:
            yield first, run_chunk(study, cases, first, threads)


def _on_dask(study: Study, chunks: list[Chunk], threads: int, scheduler: str) -> Iterator[Result]:
    """Send all chunks to the workers, and give the results in the order in which they finish."""
    try:
        from dask.distributed import Client, as_completed
    except ImportError:
        raise MjchairError(
            "--scheduler needs dask.distributed; install mjchair[dask], or leave --scheduler out"
        ) from None
    try:
        client = Client(scheduler, timeout="10s", set_as_default=False)  # type: ignore[no-untyped-call]
    except (OSError, ValueError, TimeoutError) as error:
        line = " ".join(str(error).split())
        raise MjchairError(f"no Dask scheduler at {scheduler}: {line}") from None
    with client, client.as_current():
        first_cases = {
            client.submit(
                run_chunk, study, cases, first, threads, pure=False, retries=RETRIES
            ): first
            for first, cases in chunks
        }
        try:
            for future in as_completed(list(first_cases)):  # type: ignore[no-untyped-call]
                yield first_cases[future], future.result()
                future.release()
        finally:
            client.cancel(list(first_cases))  # type: ignore[no-untyped-call]
