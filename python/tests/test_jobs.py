"""Many programs and arms on more than one process: byte for byte what one run of the command line writes, whatever is killed."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

import truegrind as tg
from truegrind import _jobs, _power

from conftest import DATA, PROGRAMS
from plant import COUNT, REPORTS, same

TIME_LIMIT_S = 120


def records() -> dict[str, int]:
    return {path.name: path.stat().st_ino for path in Path("out/done").glob("*.json")}


@pytest.fixture
def client():
    """Two workers of one thread each, in processes of their own, that are started again when they die."""
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
    ) as cluster, distributed.Client(cluster) as client:
        yield client


def test_importing_truegrind_needs_no_engine(tmp_path):
    code = "import sys, truegrind; assert not {'dask', 'distributed', 'ray'} & set(sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True, cwd=tmp_path)


def test_the_command_line_has_to_be_there(monkeypatch):
    monkeypatch.delenv("TRUEGRIND", raising=False)
    monkeypatch.setenv("PATH", "")
    with pytest.raises(FileNotFoundError, match="TRUEGRIND"):
        _jobs.program()


def test_options_are_those_of_the_command_line(plant):
    given = {"max_risk": 0.2, "partial": True, "again": False, "cell": None, "model": Path("a.toml"), "outlet": ["1,2,3", "4,5,6"]}
    assert _jobs.options(given) == (
        "--max-risk=0.2", "--partial", "--model=a.toml", "--outlet=1,2,3", "--outlet=4,5,6",
    )
    with pytest.raises(tg.TruegrindError, match="max-risk"):
        _jobs.listed(_jobs.compensating("in", "arm.toml", "out", None, {"max_risk": 7}))


def test_what_cannot_be_done_says_why(plant):
    command = _jobs.compensating(["in/broken.pgf"], "arm.toml", "out", None, {})
    (units,) = _jobs.chunks(_jobs.listed(command), 7)
    _jobs.do(command, units)
    with pytest.raises(tg.TruegrindError, match=r"none of 1 programs could be processed(.|\n)*nowhere\.mod"):
        _jobs.gathered(command, {})


def test_without_a_client_jobs_are_started_from_this_process(plant, expected):
    """No interpreter is started for what starts a process of the command line itself."""
    pytest.importorskip("distributed")
    from truegrind.dask import _client, compensate_folder

    with _client(None, processes=False) as client:
        assert set(client.run(os.getpid).values()) == {os.getpid()}
        assert set(client.nthreads().values()) == {1}
    same(expected, compensate_folder("in", "arm.toml", "out", **REPORTS, chunk=7))


def test_workers_are_told_not_to_look_at_themselves():
    distributed = pytest.importorskip("distributed")
    import dask

    from truegrind.dask import QUIET

    with dask.config.set(QUIET), distributed.Client(n_workers=1, threads_per_worker=1, dashboard_address=None) as client:
        (found,) = client.run(lambda: {name: dask.config.get(name) for name in QUIET}).values()
    assert found == QUIET


def test_dask_writes_what_one_run_writes_and_does_nothing_twice(plant, expected, client):
    from truegrind.dask import compensate_folder

    steps = []
    found = compensate_folder(
        "in", "arm.toml", "out", **REPORTS, client=client, chunk=7, progress=lambda done, of: steps.append((done, of))
    )
    same(expected, found)
    assert found.flagged and len(found.rows()) == COUNT and steps[-1] == (6, 6)
    assert sum(row["status"] == "failed" for row in found.rows()) == 1
    before = records()
    found = compensate_folder("in", "arm.toml", "out", **REPORTS, client=client, chunk=11)
    same(expected, found)
    # What cannot be done is tried again.
    assert sum(records()[name] != inode for name, inode in before.items()) <= 1
    # Another option is another run: nothing is taken over.
    found = compensate_folder("in", "arm.toml", "out", client=client, tolerance=0.07)
    assert len(records()) == 2 * COUNT and len(found.rows()) == COUNT


@pytest.mark.parametrize("verb", ["compensate", "deviation"])
def test_tables_of_shares_are_one_table_to_another_reader(plant, run, verb):
    """Every share leaves its table as Parquet without being asked; read by Arrow as one, they are what gathering writes."""
    parquet = pytest.importorskip("pyarrow.parquet")
    where = ["-o", "out"] if verb == "compensate" else ["--work", "out"]
    for share in ("1/3", "2/3", "3/3"):
        run(verb, "in", "--model", "arm.toml", *where, "--shard", share, "--resume")
    run("gather", "out", "--parquet", "all.parquet", "--csv", "all.csv")
    whole = parquet.read_table("all.parquet")
    name = whole.column_names[0]
    parts = [parquet.read_table(path) for path in sorted(Path("out/tables").iterdir())]
    assert len(parts) == 3 and all(part.num_rows > 0 and part.schema == whole.schema for part in parts)
    shares = [{row[name] for row in part.to_pylist()} for part in parts]
    assert sum(map(len, shares)) == len(set.union(*shares))
    # Rows keep their order within a program, and programs that of the run: a stable sort by name restores it.
    order = list(dict.fromkeys(row[name] for row in whole.to_pylist()))
    rows = [row for part in parts for row in part.to_pylist()]
    assert sorted(rows, key=lambda row: order.index(row[name])) == whole.to_pylist()
    # And what Arrow reads is what the table says in words.
    text = Path("all.csv").read_text(encoding="utf-8").splitlines()
    assert len(text) == whole.num_rows + 1 and text[0].split(",") == whole.column_names


def test_a_worker_that_is_killed_in_the_middle_costs_nothing_but_time(plant, expected, client):
    from truegrind.dask import compensate_folder

    killed = []

    def kill() -> None:
        begin = time.monotonic()
        while time.monotonic() < begin + TIME_LIMIT_S:
            if len(list(Path("out/done").glob("*.json"))) >= 5:
                pids = client.run(os.getpid)
                killed.append(next(iter(pids.values())))
                os.kill(killed[0], signal.SIGKILL)
                return
            time.sleep(0.005)

    killer = threading.Thread(target=kill)
    killer.start()
    found = compensate_folder("in", "arm.toml", "out", **REPORTS, client=client, chunk=10)
    killer.join()
    assert killed
    same(expected, found)


def begun(script, count, stderr):
    """A process of its own session that runs job.py, once so many units are done."""
    Path("job.py").write_text(script)
    job = subprocess.Popen([sys.executable, "job.py"], start_new_session=True, stderr=stderr)
    begin = time.monotonic()
    while len(list(Path("out/done").glob("*.json"))) < count:
        assert job.poll() is None and time.monotonic() < begin + TIME_LIMIT_S
        time.sleep(0.002)
    return job


def test_a_client_that_is_killed_and_started_again_does_only_the_rest(plant, expected):
    pytest.importorskip("distributed")
    script = """
if __name__ == "__main__":
    from distributed import Client
    from truegrind.dask import compensate_folder
    with Client(n_workers=2, threads_per_worker=1, dashboard_address=None) as client:
        compensate_folder("in", "arm.toml", "out", client=client, chunk=4, csv="all.csv", json="all.json", html="all.html", md="all.md")
"""
    first = begun(script, 9, stderr=subprocess.DEVNULL)
    # With all its workers, as a machine that goes down.
    os.killpg(first.pid, signal.SIGKILL)
    first.wait()
    before = records()
    assert len(before) < COUNT and not Path("all.csv").exists()
    subprocess.run([sys.executable, "job.py"], check=True, timeout=TIME_LIMIT_S, stderr=subprocess.DEVNULL)
    after = records()
    assert len(after) == COUNT
    assert sum(after[name] != inode for name, inode in before.items()) <= 1
    found = _jobs.Gathered(True, "", "", {kind: Path(path) for kind, path in REPORTS.items()})
    same(expected, found)


def test_ctrl_c_ends_what_was_started_and_the_next_call_does_the_rest(plant, expected):
    pytest.importorskip("distributed")
    script = """
if __name__ == "__main__":
    from truegrind.dask import compensate_folder
    compensate_folder("in", "arm.toml", "out", chunk=20, csv="all.csv", json="all.json", html="all.html", md="all.md")
"""
    job = begun(script, 4, stderr=subprocess.PIPE)
    # As a terminal does: everybody hears of it, and jobs before whoever called them.
    os.killpg(job.pid, signal.SIGINT)
    assert b"KeyboardInterrupt" in job.communicate(timeout=TIME_LIMIT_S)[1]
    before = records()
    assert len(before) < COUNT and not Path("all.csv").exists()
    subprocess.run([sys.executable, "job.py"], check=True, timeout=TIME_LIMIT_S)
    assert sum(records()[name] != inode for name, inode in before.items()) <= 1
    same(expected, _jobs.Gathered(True, "", "", {kind: Path(path) for kind, path in REPORTS.items()}))


def test_a_program_that_kills_whoever_does_it_is_listed(plant, client, binary, monkeypatch):
    """By a limit on the size of files, which the system kills for."""
    from truegrind.dask import compensate_folder

    text = (PROGRAMS / "circles.mod").read_text(encoding="utf-8")
    Path("in/p007.mod").write_text("! filled\n" * 60_000 + text, encoding="utf-8")
    limited = plant / "limited"
    limited.write_text(f"#!/bin/sh\n[ \"$1\" = gather ] || ulimit -f 600\nexec '{binary}' \"$@\"\n")
    limited.chmod(0o755)
    monkeypatch.setenv("TRUEGRIND", str(limited))
    client.run(exec, f"import os; os.environ['TRUEGRIND'] = {str(limited)!r}")
    found = compensate_folder("in", "arm.toml", "out", client=client, chunk=10)
    failed = {row["file"]: row["note"] for row in found.rows() if row["status"] == "failed"}
    assert set(failed) == {"in/broken.pgf", "in/p007.mod"}
    assert "processing it crashed" in failed["in/p007.mod"]


def test_a_fleet_is_one_table(plant, run, client):
    from truegrind.dask import diagnose_many

    Path("fleet").mkdir()
    for number, name in enumerate(["irb120-cable.csv", "irb120-rounded.csv"]):
        shutil.copy(DATA / name, f"fleet/arm{number}.csv")
    run("diagnose", "fleet", "--robot", "abb-irb-120", "-o", "models", "--csv", "one.csv", "--html", "one.html")
    models = {path: path.read_bytes() for path in Path("models").iterdir()}
    shutil.rmtree("models")
    found = diagnose_many("fleet", "abb-irb-120", "models", csv="all.csv", html="all.html", client=client)
    assert Path("all.csv").read_bytes() == Path("one.csv").read_bytes()
    assert Path("all.html").read_bytes() == Path("one.html").read_bytes()
    assert all(path.read_bytes() == written for path, written in models.items())
    assert {row["rank"] for row in found.rows()} == {"1", "2"}


def test_a_power_study_counts_what_was_named(plant, client):
    from truegrind.dask import power_study

    recipe = (DATA / "irb120-cable.toml").read_text(encoding="utf-8").replace("count = 300", "count = 80")
    Path("few.toml").write_text(recipe, encoding="utf-8")
    rows = power_study("few.toml", range(2), client=client, work="study")
    assert rows and all((row["runs"], row["failed"]) == (2, 0) for row in rows)
    assert len(list(Path("study").glob("*.json"))) == 2
    kept = {path: path.stat().st_ino for path in Path("study").glob("*.json")}
    assert power_study({"few.toml": "few.toml"}, range(2), client=client, work="study") == rows
    assert kept == {path: path.stat().st_ino for path in Path("study").glob("*.json")}
    # One with causes and one without, as the table has them.
    finding = {"effect": "backlash", "joints": [4], "confidence": "identified", "worth_mm": 0.1}
    runs = [{"recipe": "r", "seed": s, "failed": None, "findings": [finding] if s else []} for s in range(4)]
    assert _power.table([{"recipe": "r", "seed": 9, "failed": "why", "findings": []}])[0]["failed"] == 1
    named, nothing = _power.table([*runs, {"recipe": "r", "seed": 9, "failed": "why", "findings": []}])
    assert (named["named"], named["identified"], named["runs"], named["failed"]) == (3, 3, 4, 1)
    assert nothing["effect"] is None and nothing["named"] == 1
    assert named["share_low"] == pytest.approx(0.3006, abs=1e-4) and named["share_high"] == pytest.approx(0.9544, abs=1e-4)
