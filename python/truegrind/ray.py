"""Many programs and arms on Ray Core, like :mod:`truegrind.dask`; requires ``ray`` and the command line on every node."""

from __future__ import annotations

from typing import Any

import ray

from . import _jobs
from ._jobs import CHUNK, Gathered


RETRIES = 5
"""Retries by Ray of a chunk whose worker crashed."""


def _run(command: _jobs.Command, reports: dict[str, Any], chunk: int) -> Gathered:
    do = ray.remote(num_cpus=1, max_retries=RETRIES)(_jobs.do)
    errors = []
    for job in [do.remote(command, units) for units in _jobs.chunks(_jobs.listed(command), chunk)]:
        try:
            ray.get(job)
        except ray.exceptions.RayError as error:
            errors.append(error)
    try:
        return _jobs.gathered(command, reports)
    except _jobs.TruegrindError as missing:
        # Why is in the jobs, what in the folder.
        raise missing from (errors[0] if errors else None)


def compensate_folder(programs, model, output, *, reports=None, chunk=CHUNK, work=None, **options) -> Gathered:
    """See :func:`truegrind.dask.compensate_folder`; ``reports={"html": "page.html"}``."""
    command = _jobs.compensating(programs, model, output, work, options, with_json="json" in (reports or {}))
    return _run(command, reports or {}, chunk)


def diagnose_many(data, robot, output, *, reports=None, chunk=1, work=None, **options) -> Gathered:
    """See :func:`truegrind.dask.diagnose_many`."""
    return _run(_jobs.diagnosing(data, robot, output, work, options), reports or {}, chunk)
