"""The same on Ray Core: two workers on this machine, the bytes of one run, workers that are killed, programs that kill."""

from __future__ import annotations

import json
import os
import shutil
import signal
import threading
import time
from pathlib import Path

import pytest

import truegrind as tg

from conftest import PROGRAMS
from plant import COUNT, REPORTS, fill, of_one_run, same

ray = pytest.importorskip("ray", reason="truegrind.ray is not tested: Ray is not installed")

TIME_LIMIT_S = 120

# Where the folder holds `limited`, whoever writes much is killed, as the system kills for a limit on the size of files; where it
# holds `full`, jobs fail.
WRAPPED = """#!/bin/sh
case "$*" in
*--units*)
  [ ! -e limited ] || ulimit -f 600
  [ ! -e full ] || {{ echo "error: the disk is full" >&2; exit 2; }} ;;
esac
exec '{binary}' "$@"
"""


@pytest.fixture(scope="module")
def expected(tmp_path_factory, binary, model, run):
    """What one run writes in the folder where Ray's workers stand; Ray takes seconds to start, so that all tests share it."""
    at = tmp_path_factory.mktemp("plant")
    fill(at, PROGRAMS, model)
    wrapped = at / "truegrind"
    wrapped.write_text(WRAPPED.format(binary=binary))
    wrapped.chmod(0o755)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(at)
        patch.setenv("TRUEGRIND", str(wrapped))
        ray.init(num_cpus=2, include_dashboard=False, log_to_driver=False, logging_level="error")
        try:
            yield of_one_run(run)
        finally:
            ray.shutdown()


@pytest.fixture(autouse=True)
def nothing_done_yet(expected):
    shutil.rmtree("out", ignore_errors=True)


def test_ray_writes_what_one_run_writes(expected):
    from truegrind.ray import compensate_folder

    assert ray.cluster_resources()["CPU"] == 2
    found = compensate_folder("in", "arm.toml", "out", reports=REPORTS, chunk=10)
    same(expected, found)
    assert json.loads(found.reports["json"].read_text())["totals"]["programs"] == COUNT


def worker_of_a_job(binary: Path) -> int | None:
    """A process of Ray that waits for the command line."""
    for entry in Path("/proc").iterdir():
        try:
            if not entry.name.isdigit() or (entry / "cmdline").read_bytes().split(b"\0")[0] != os.fsencode(binary):
                continue
            parent = int((entry / "stat").read_text().rpartition(")")[2].split()[1])
            if Path(f"/proc/{parent}/cmdline").read_bytes().startswith(b"ray::"):
                return parent
        except (FileNotFoundError, ProcessLookupError):
            continue
    return None


def test_a_worker_that_is_killed_in_the_middle_costs_nothing_but_time(expected, binary):
    from truegrind.ray import compensate_folder

    killed = []

    def kill() -> None:
        begin = time.monotonic()
        while time.monotonic() < begin + TIME_LIMIT_S:
            if len(list(Path("out/done").glob("*.json"))) >= 5 and (pid := worker_of_a_job(binary)) is not None:
                os.kill(pid, signal.SIGKILL)
                killed.append(pid)
                return
            time.sleep(0.002)

    killer = threading.Thread(target=kill)
    killer.start()
    found = compensate_folder("in", "arm.toml", "out", reports=REPORTS, chunk=10)
    killer.join()
    assert killed
    same(expected, found)


def test_a_program_that_kills_whoever_does_it_is_listed(expected):
    from truegrind.ray import compensate_folder

    text = Path("in/p007.mod").read_text(encoding="utf-8")
    Path("in/p007.mod").write_text("! filled\n" * 60_000 + text, encoding="utf-8")
    Path("limited").touch()
    try:
        found = compensate_folder("in", "arm.toml", "out", chunk=10)
    finally:
        Path("limited").unlink()
        Path("in/p007.mod").write_text(text, encoding="utf-8")
    failed = {row["file"]: row["note"] for row in found.rows() if row["status"] == "failed"}
    assert set(failed) == {"in/broken.pgf", "in/p007.mod"}
    assert "processing it crashed" in failed["in/p007.mod"]


def test_what_is_missing_is_said_with_the_reason(expected):
    from truegrind.ray import compensate_folder

    Path("full").touch()
    try:
        with pytest.raises(tg.TruegrindError, match="p007.mod") as refused:
            compensate_folder("in", "arm.toml", "out", chunk=COUNT)
    finally:
        Path("full").unlink()
    assert "the disk is full" in str(refused.value.__cause__)
