"""Many programs, arms and simulations on Dask: a laptop's processors, or a cluster (``dask-jobqueue``, ``dask-kubernetes``).

>>> from dask.distributed import Client
>>> from truegrind.dask import compensate_folder, diagnose_many
>>> client = Client("scheduler:8786")                                                     # doctest: +SKIP
>>> done = compensate_folder("programs", "arm.toml", "corrected", html="corrected.html")  # doctest: +SKIP
>>> fleet = diagnose_many("measurements", "abb-irb-120", "models", html="fleet.html")     # doctest: +SKIP

Needs ``pip install truegrind[dask]``, and the command line on every worker (on PATH, or named by TRUEGRIND). All workers see the
folders under the same paths. Workers with one thread each are best: ``Client(threads_per_worker=1)``. Without a client jobs are started
from this process, which is the cheapest on one machine: each is a process of the command line anyway. Workers of a cluster look at
themselves a hundred times a second, which costs each some 3 % of a processor; where that matters:

>>> import dask
>>> from truegrind.dask import QUIET
>>> with dask.config.set(QUIET):                                                          # doctest: +SKIP
...     client = Client(n_workers=8, threads_per_worker=1)

What is written is byte for byte what one run of the command line writes. A worker that dies, and a client that is started again, cost
what they were doing at that moment: what is done is not done again, as long as inputs, model, cell, options and version are the same.
A program that kills whoever does it is listed in the table.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from contextlib import contextmanager
from os import PathLike
from typing import Any

import dask
from dask.system import CPU_COUNT
from distributed import Client, as_completed, get_client

from . import _jobs, _power
from ._jobs import CHUNK, Gathered

__all__ = ["CHUNK", "Gathered", "QUIET", "compensate_folder", "diagnose_many", "power_study"]

_Path = str | PathLike[str]

RETRIES = 5
"""As often Dask tries a chunk again whose worker died."""


QUIET = {
    "distributed.worker.profile.enabled": False,
    "distributed.admin.tick.interval": "500ms",
    "distributed.admin.tick.cycle": "5s",
    "distributed.admin.system-monitor.interval": "5s",
}
"""Settings of Dask for workers that only wait for processes: looking at themselves a hundred times a second takes the processor from
those. They have to stand before the cluster is started; without a client they are set."""


@contextmanager
def _client(given: Client | None, *, processes: bool):
    """The client that was given, else the current one, else one of this machine with one thread a worker. ``processes``: each worker is
    one. Jobs that start processes of their own need none around them, and are spared the start of interpreters with all of Dask."""
    if given is not None:
        yield given
        return
    try:
        yield get_client()
    except ValueError:
        local = {"n_workers": CPU_COUNT, "threads_per_worker": 1, "processes": processes, "dashboard_address": None}
        with dask.config.set(QUIET), Client(**local) as made:
            yield made


def _all(
    client: Client, work: Callable[..., Any], chunks: Iterable[Any], progress: Callable[[int, int], object] | None
) -> list[Any]:
    """Every chunk's result in its order; one that failed for good is ``None``, and its exception comes last."""
    futures = client.map(work, list(chunks), retries=RETRIES, pure=False)
    place = {future.key: at for at, future in enumerate(futures)}
    out: list[Any] = [None] * len(futures)
    errors = []
    for count, future in enumerate(as_completed(futures), start=1):
        if future.status == "finished":
            out[place[future.key]] = future.result()
        else:
            errors.append(future.exception())
        if progress is not None:
            progress(count, len(futures))
    return [*out, errors]


def _run(command: _jobs.Command, reports: Mapping[str, Any], client: Client | None, chunk: int, progress) -> Gathered:
    units = _jobs.listed(command)
    with _client(client, processes=False) as client, _jobs.Started() as started:
        *_, errors = _all(client, _Do(command, started.key), _jobs.chunks(units, chunk), progress)
    try:
        return _jobs.gathered(command, reports)
    except _jobs.TruegrindError as missing:
        # Why is in the jobs, what in the folder.
        raise missing from (errors[0] if errors else None)


class _Do:
    """A job as it travels."""

    def __init__(self, command: _jobs.Command, run: str) -> None:
        self.command, self.run = command, run

    def __call__(self, units: str) -> None:
        _jobs.do(self.command, units, self.run)


def compensate_folder(
    programs: _Path | Iterable[_Path],
    model: _Path,
    output: _Path,
    *,
    csv: _Path | None = None,
    json: _Path | None = None,
    html: _Path | None = None,
    md: _Path | None = None,
    parquet: _Path | None = None,
    client: Client | None = None,
    chunk: int = CHUNK,
    work: _Path | None = None,
    progress: Callable[[int, int], object] | None = None,
    **options: Any,
) -> Gathered:
    """Corrects all programs below a folder, as ``truegrind compensate FOLDER --model MODEL -o OUTPUT`` does.

    :param programs: a folder, or several programs and folders.
    :param model: an estimated arm.
    :param output: the folder for what is written; what jobs keep for each other lies there too, unless ``work`` names another.
    :param csv: where the table of all programs goes; likewise ``json``, ``html``, ``md`` and ``parquet``. What a run made without
        ``json`` is done again where a later one asks for it.
    :param client: of Dask; else the current one, else this machine.
    :param chunk: programs of one job.
    :param progress: called with the number of jobs that are done and of all.
    :param options: those of the command line: ``cell="cell.toml"``, ``max_correction=5``, ``partial=True``.
    :raises TruegrindError: what the command line refuses, or what could not be done, listed.
    """
    command = _jobs.compensating(programs, model, output, work, options, with_json=json is not None)
    reports = {"csv": csv, "json": json, "html": html, "md": md, "parquet": parquet}
    return _run(command, reports, client, chunk, progress)


def diagnose_many(
    data: _Path | Iterable[_Path],
    robot: _Path,
    output: _Path,
    *,
    csv: _Path | None = None,
    json: _Path | None = None,
    html: _Path | None = None,
    md: _Path | None = None,
    parquet: _Path | None = None,
    client: Client | None = None,
    chunk: int = 1,
    work: _Path | None = None,
    progress: Callable[[int, int], object] | None = None,
    **options: Any,
) -> Gathered:
    """Diagnoses a fleet: the measurements of each arm by themselves, and one table over all, which causes, how large, which arm
    first.

    :param data: a folder of measurements, or several files and folders; each file is an arm.
    :param robot: what they are: a name of the catalogue, or a file.
    :param output: the folder for models and pages.
    :param chunk: arms of one job: a diagnosis takes seconds to minutes.

    The rest is as in :func:`compensate_folder`.
    """
    command = _jobs.diagnosing(data, robot, output, work, options)
    reports = {"csv": csv, "json": json, "html": html, "md": md, "parquet": parquet}
    return _run(command, reports, client, chunk, progress)


def power_study(
    recipes: _Path | Iterable[_Path] | Mapping[str, _Path],
    seeds: Iterable[int],
    *,
    robot: _Path | None = None,
    client: Client | None = None,
    work: _Path | None = None,
    progress: Callable[[int, int], object] | None = None,
    **options: Any,
) -> list[dict[str, Any]]:
    """How often a diagnosis would name what an arm hides: every recipe of a simulation with every seed, diagnosed.

    :param recipes: files of ``truegrind simulate``, such as one for each number of poses, or each noise.
    :param seeds: of poses, noise and whatever a recipe leaves to chance; each is a run.
    :param robot: what the diagnosis starts from; else the recipe's own.
    :param work: a folder in which runs are kept: a study that is started again does only the rest.
    :param options: those of :func:`truegrind.diagnose`.
    :returns: a row for each recipe and each cause that was named: runs, named, identified, share, and its 95 % interval (Wilson).
    """
    study = _power.study(recipes, robot, work, options)
    numbers = [int(seed) for seed in seeds]
    runs = [(name, seed) for name, *_ in study.recipes for seed in numbers]
    with _client(client, processes=True) as client:
        *done, errors = _all(client, _Run(study), runs, progress)
    if errors:
        raise errors[0]
    return _power.table(done)


class _Run:
    """A run of a study as it travels."""

    def __init__(self, study: _power.Study) -> None:
        self.study = study

    def __call__(self, run: tuple[str, int]) -> dict[str, Any]:
        return _power.run(self.study, *run)
