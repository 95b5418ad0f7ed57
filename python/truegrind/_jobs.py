"""Jobs over many programs and arms, common to ``truegrind.dask`` and ``truegrind.ray``.

Each job runs the command line on a chunk of the units (``--units``, ``--resume``) in a separate process, so that a crash does not end the
worker, and the outputs are those of the command line for every engine. This module imports no engine.
"""

from __future__ import annotations

import csv
import json
import os
import shutil
import subprocess
import threading
import uuid
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar

from .errors import ArgumentError, TruegrindError

CHUNK = 200
"""Units per job: a few seconds of work, so that the overhead of the engine is negligible."""

DEATHS_WITHOUT_PROGRESS = 3
"""Crashes of the process of a chunk without any progress before the engine gets an error."""

NAMED = 3
"""Largest number of units listed in a message."""


@dataclass(frozen=True)
class Command:
    """A verb of the command line with its options, the same for every chunk."""

    verb: str
    inputs: tuple[str, ...]
    options: tuple[str, ...]
    work: str

    def arguments(self, *more: str) -> list[str]:
        return [program(), self.verb, *self.inputs, *self.options, "--work", self.work, *more]


@dataclass
class Gathered:
    """The combined result of all jobs, byte for byte that of a single run of the command line.

    ``flagged``: something was refused, flagged or failed. ``summary``: output of the command line. ``reports``: files by format.
    """

    flagged: bool
    summary: str
    notes: str
    reports: dict[str, Path] = field(default_factory=dict)

    def rows(self) -> list[dict[str, str]]:
        """The rows of the table as dictionaries; for a data frame use ``pandas.read_csv(found.reports["csv"])``."""
        with self.reports["csv"].open(encoding="utf-8", newline="") as file:
            return list(csv.DictReader(file))


def program() -> str:
    """The command line on this machine: named by TRUEGRIND, or found on PATH.

    :raises FileNotFoundError: it was not found.
    """
    found = os.environ.get("TRUEGRIND") or shutil.which("truegrind")
    if found is None:
        raise FileNotFoundError(
            "truegrind: the command line is not on this machine's PATH; jobs run it: install it (cargo install), or name it by the "
            "environment variable TRUEGRIND on every worker"
        )
    return found


def options(given: Mapping[str, Any]) -> tuple[str, ...]:
    """Converts keywords to options: ``max_risk=0.2`` to ``--max-risk=0.2``, ``partial=True`` to ``--partial``; ``None`` and ``False`` are
    omitted."""
    out: list[str] = []
    for name, value in given.items():
        option = "--" + name.replace("_", "-")
        if value is None or value is False:
            continue
        if value is True:
            out.append(option)
            continue
        several = isinstance(value, Sequence) and not isinstance(value, str)
        out.extend(f"{option}={_text(one)}" for one in (value if several else [value]))
    return tuple(out)


def _text(value: object) -> str:
    return os.fspath(value) if isinstance(value, os.PathLike) else str(value)


def inputs(given: Any) -> tuple[str, ...]:
    """One or more paths."""
    if isinstance(given, (str, os.PathLike)):
        return (os.fspath(given),)
    return tuple(os.fspath(path) for path in given)


def listed(command: Command) -> list[dict[str, Any]]:
    """All units in order; also written to the folder of the run for ``gather``.

    :raises TruegrindError: an error of the command line.
    """
    _checked(subprocess.run(command.arguments("--list-units"), capture_output=True))
    return json.loads((Path(command.work) / "run.json").read_text(encoding="utf-8"))["units"]


def chunks(units: Sequence[dict[str, Any]], size: int) -> Iterator[str]:
    """The units in chunks, as text for the command line. Text, because engines search lists and dictionaries for results of other jobs,
    which takes longer than some programs."""
    if size < 1:
        raise ArgumentError(f"chunk: {size}, expected at least 1", found=str(size), expected="at least 1")
    for start in range(0, len(units), size):
        yield json.dumps(list(units[start : start + size]))


class Started:
    """Running processes of the jobs of a run, if they run in the calling process. When the call ends, by Ctrl-C or an error, they are
    ended too, and none is restarted."""

    of_run: ClassVar[dict[str, Started]] = {}
    """By key; kept after the end of the run, for jobs that start too late."""

    def __init__(self) -> None:
        self.key = uuid.uuid4().hex
        self.lock = threading.Lock()
        self.going: set[subprocess.Popen[bytes]] = set()
        self.called_off = False

    def __enter__(self) -> Started:
        self.of_run[self.key] = self
        return self

    def __exit__(self, *_: object) -> None:
        with self.lock:
            self.called_off = True
            for process in self.going:
                process.terminate()

    def go_on(self) -> None:
        if self.called_off:
            raise TruegrindError("the run was cancelled")

    def run(self, arguments: list[str], given: bytes) -> subprocess.CompletedProcess[bytes]:
        """:raises TruegrindError: the run was cancelled."""
        with self.lock:
            self.go_on()
            pipe = subprocess.PIPE
            process = subprocess.Popen(arguments, stdin=pipe, stdout=pipe, stderr=pipe)
            self.going.add(process)
        out, err = process.communicate(given)
        with self.lock:
            self.going.discard(process)
            self.go_on()
        return subprocess.CompletedProcess(arguments, process.returncode, out, err)


def do(command: Command, units: str, run: str | None = None) -> None:
    """One job: processes the unfinished units of a chunk. A crashed process is restarted; the command line itself lists a unit that
    kills it every time.

    :param units: a list of units as JSON; see :func:`chunks`.
    :param run: the key of what this process has :class:`Started`, where the job is done by the process that called the run.
    :raises TruegrindError: an error of the command line.
    """
    started = Started.of_run.get(run or "") or Started()
    idle = 0
    while True:
        before = _state(command)
        done = started.run(command.arguments("--units", "-", "--resume", "--threads", "1"), units.encode())
        if done.returncode >= 0:
            _checked(done)
            return
        idle = idle + 1 if _state(command) == before else 0
        if idle >= DEATHS_WITHOUT_PROGRESS:
            listed = json.loads(units)
            names = ", ".join(", ".join(unit["paths"]) for unit in listed[:NAMED])
            raise TruegrindError(
                f"the process was killed {idle} times (signal {-done.returncode}) before it began anything, of {len(listed)} units "
                f"({names} …): too little memory on this worker?"
            )


def _state(command: Command) -> list[tuple[str, int]]:
    """The unfinished units with their number of attempts; changes with every unit that crashes its process."""
    out = []
    for entry in os.scandir(Path(command.work) / "begun"):
        try:
            out.append((entry.name, entry.stat().st_mtime_ns))
        except FileNotFoundError:
            continue
    return sorted(out)


def gathered(command: Command, reports: Mapping[str, Any]) -> Gathered:
    """Combines the results of all jobs.

    :raises TruegrindError: units are missing; the message lists them.
    """
    files = {kind: Path(os.fspath(path)) for kind, path in reports.items() if path is not None}
    files.setdefault("csv", Path(command.work) / "table.csv")
    given = [f"--{kind}={path}" for kind, path in files.items()]
    done = _checked(subprocess.run([program(), "gather", command.work, *given], capture_output=True))
    return Gathered(done.returncode == 1, done.stdout.decode(), done.stderr.decode(errors="replace"), files)


def _checked(done: subprocess.CompletedProcess[bytes]) -> subprocess.CompletedProcess[bytes]:
    if done.returncode not in (0, 1):
        text = done.stderr.decode(errors="replace").strip()
        text = text.removeprefix("error: ") or f"the command line ended with {done.returncode}"
        # If no unit succeeded, the table lists the errors.
        raise TruegrindError("\n".join([text, *filter(None, [done.stdout.decode(errors="replace").strip()])]))
    return done


def compensating(
    programs: Any, model: Any, output: Any, work: Any, given: Mapping[str, Any], with_json: bool = True
) -> Command:
    """The command that corrects programs. ``with_json``: records contain the entries of all motions for the JSON report."""
    chosen = options({"model": model, "output": output, "brief_records": not with_json, **given})
    return Command("compensate", inputs(programs), chosen, os.fspath(work if work is not None else output))


def diagnosing(data: Any, robot: Any, output: Any, work: Any, given: Mapping[str, Any]) -> Command:
    """The command that diagnoses arms."""
    chosen = options({"robot": robot, "output": output, **given})
    return Command("diagnose", inputs(data), chosen, os.fspath(work if work is not None else output))
