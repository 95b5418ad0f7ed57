"""Many programs, arms and simulations on Dask: locally or on a cluster (``dask-jobqueue``, ``dask-kubernetes``).

>>> from dask.distributed import Client
>>> from truegrind.dask import compensate_folder, diagnose_many
>>> client = Client("scheduler:8786")                                                     # doctest: +SKIP
>>> done = compensate_folder("programs", "arm.toml", "corrected", html="corrected.html")  # doctest: +SKIP
>>> fleet = diagnose_many("measurements", "abb-irb-120", "models", html="fleet.html")     # doctest: +SKIP

Requires ``pip install truegrind[dask]``, and the command line on every worker (on PATH, or named by TRUEGRIND). All workers must see the
folders under the same paths. Use workers with one thread each: ``Client(threads_per_worker=1)``. Without a client, jobs are started from
this process, which is cheapest on one machine, since each job is a process of the command line anyway. Workers of a cluster monitor
themselves a hundred times a second, which costs about 3 % of a processor each, and each imports Dask anew, half a second; to avoid both:

>>> import dask
>>> from truegrind.dask import QUIET
>>> with dask.config.set(QUIET):                                                          # doctest: +SKIP
...     client = Client(n_workers=8, threads_per_worker=1)

The outputs are byte for byte those of a single run of the command line. If a worker crashes or the client is restarted, only unfinished
units are repeated, as long as inputs, model, cell, options and version are the same. A program that crashes its process repeatedly is
listed in the table.
"""

from __future__ import annotations

import multiprocessing
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
"""Retries by Dask of a chunk whose worker crashed."""

QUIET: dict[str, Any] = {
    "distributed.worker.profile.enabled": False,
    "distributed.admin.tick.interval": "500ms",
    "distributed.admin.tick.cycle": "5s",
    "distributed.admin.system-monitor.interval": "5s",
    "distributed.worker.memory.monitor-interval": "2s",
}
"""Dask settings for workers that only wait for processes: less monitoring, and workers that are forked from one process, which alone
imports Dask (where the system can fork). Set them before the cluster starts; without a client they are set automatically."""

if "forkserver" in multiprocessing.get_all_start_methods():
    QUIET["distributed.worker.multiprocessing-method"] = "forkserver"


@contextmanager
def _client(given: Client | None, *, processes: bool):
    """The given client, or the current one, or a local one with one thread per worker. ``processes``: whether workers are processes; jobs
    that start their own processes do not need them."""
    if given is not None:
        yield given
        return
    try:
        yield get_client()
    except ValueError:
        local = {"n_workers": CPU_COUNT, "threads_per_worker": 1, "processes": processes, "dashboard_address": None}
        with dask.config.set(QUIET), Client(**local) as made:
            yield made


def _done(
    client: Client, work: Callable[..., Any], chunks: Iterable[Any], progress: Callable[[int, int], object] | None
) -> list[Any]:
    """All chunks in order, done or failed, as futures: fetching a result costs a job of its own, even if it is nothing."""
    futures = client.map(work, list(chunks), retries=RETRIES, pure=False)
    for count, _ in enumerate(as_completed(futures), start=1):
        if progress is not None:
            progress(count, len(futures))
    return futures


def _errors(futures: list[Any]) -> list[BaseException]:
    return [future.exception() for future in futures if future.status != "finished"]


def _run(command: _jobs.Command, reports: Mapping[str, Any], client: Client | None, chunk: int, progress) -> Gathered:
    units = _jobs.listed(command)
    with _client(client, processes=False) as client, _jobs.Started() as started:
        errors = _errors(_done(client, _Do(command, started.key), _jobs.chunks(units, chunk), progress))
    try:
        return _jobs.gathered(command, reports)
    except _jobs.TruegrindError as missing:
        # Why is in the jobs, what in the folder.
        raise missing from (errors[0] if errors else None)


class _Do:
    """A picklable job."""

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
    :param model: a model file.
    :param output: the output folder, which also contains the records of the jobs unless ``work`` names another folder.
    :param csv: file for the table of all programs; likewise ``json``, ``html``, ``md`` and ``parquet``. Units processed without
        ``json`` are processed again if a later run requests it.
    :param client: Dask client; by default the current one, or this machine.
    :param chunk: number of programs per job.
    :param progress: called with the numbers of finished and of all jobs.
    :param options: options of the command line: ``cell="cell.toml"``, ``max_correction=5``, ``partial=True``.
    :raises TruegrindError: an error of the command line, or a list of missing units.
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
    """Diagnoses many arms separately, and makes one table over all with causes, sizes and a ranking.

    :param data: a folder of measurements, or several files and folders; each file is an arm.
    :param robot: the robot: a name from the catalogue, or a robot file.
    :param output: the folder for models and pages.
    :param chunk: number of arms per job; a diagnosis takes seconds to minutes.

    Other parameters as in :func:`compensate_folder`.
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
    """Estimates how often a diagnosis finds the causes of a simulated arm: simulates and diagnoses every recipe with every seed.

    :param recipes: recipe files of ``truegrind simulate``, for example one per number of poses or noise level.
    :param seeds: seeds of poses, noise and other random values of a recipe; each is a run.
    :param robot: nominal robot of the diagnosis; by default that of the recipe.
    :param work: a folder for the results of runs, so that a restarted study only does the rest.
    :param options: options of :func:`truegrind.diagnose`.
    :returns: a row per recipe and found cause: runs, named, identified, share, and its 95 % interval (Wilson).
    """
    study = _power.study(recipes, robot, work, options)
    numbers = [int(seed) for seed in seeds]
    runs = [(name, seed) for name, *_ in study.recipes for seed in numbers]
    with _client(client, processes=True) as client:
        futures = _done(client, _Run(study), runs, progress)
        for error in _errors(futures):
            raise error
        return _power.table(client.gather(futures))


class _Run:
    """A picklable run of a study."""

    def __init__(self, study: _power.Study) -> None:
        self.study = study

    def __call__(self, run: tuple[str, int]) -> dict[str, Any]:
        return _power.run(self.study, *run)
