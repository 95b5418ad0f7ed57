"""The files below ``deploy/``, run as they stand: GNU parallel by itself, and of Kubernetes and HTCondor what the API's schemas and
HTCondor's own reader make of the files, carried out share by share, since no cluster of theirs is at hand. Slurm has a script of its
own, ``deploy/try-slurm.sh``."""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from conftest import PROGRAMS, ROOT
from plant import COUNT

DEPLOY = ROOT / "deploy"
TIME_LIMIT_S = 300

# What is killed when it begins for the first time: the shares whose number ends with 3.
WRAPPED = """#!/bin/sh
case "$*" in *--shard\\ *3/*) mkdir "died-$(echo "$*" | tr -dc 0-9)" 2>/dev/null && kill -9 $$ ;; esac
exec '{binary}' "$@"
"""


@pytest.fixture
def plant(tmp_path, binary, model, monkeypatch) -> dict[str, str]:
    """The folder that the examples expect, the tests working in it; the environment of a job, in which some need a second
    try."""
    (tmp_path / "programs").mkdir()
    text = (PROGRAMS / "circles.mod").read_text(encoding="utf-8")
    for number in range(COUNT):
        (tmp_path / "programs" / f"p{number:03}.mod").write_text(f"! {number}\n{text}", encoding="utf-8")
    model.save(tmp_path / "arm.toml", allow_doubtful=True)
    (tmp_path / "bin").mkdir()
    (tmp_path / "bin" / "truegrind").write_text(WRAPPED.format(binary=binary))
    (tmp_path / "bin" / "truegrind").chmod(0o755)
    monkeypatch.chdir(tmp_path)
    return {**os.environ, "PATH": f"{tmp_path / 'bin'}{os.pathsep}{os.environ['PATH']}"}


def finished(run) -> None:
    """What was gathered, and every program, is what one run writes; shares were killed on the way."""
    assert list(Path().glob("died-*"))
    gathered = {path.name: path.read_bytes() for path in [Path("corrected.csv"), Path("corrected.html")]}
    written = {path.name: path.read_bytes() for path in Path("corrected").glob("*.mod")}
    assert len(written) == COUNT
    shutil.rmtree("corrected")
    run("compensate", "programs", "--model", "arm.toml", "-o", "corrected", "--csv", "one.csv", "--html", "one.html")
    assert gathered == {f"corrected.{kind}": Path(f"one.{kind}").read_bytes() for kind in ("csv", "html")}
    assert written == {path.name: path.read_bytes() for path in Path("corrected").glob("*.mod")}


def tried(job) -> None:
    """As a scheduler does: again, as long as it fails."""
    for _ in range(3):
        if job() == 0:
            return
    pytest.fail("a share fails however often it is tried")


def each(jobs) -> None:
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        list(pool.map(tried, jobs))


def test_gnu_parallel(plant, run):
    if shutil.which("parallel") is None:
        pytest.skip("deploy/parallel.sh is not tested: GNU parallel is not installed")
    done = subprocess.run(["sh", DEPLOY / "parallel.sh"], env=plant, capture_output=True, timeout=TIME_LIMIT_S)
    # 1: some motions are flagged, as in one run.
    assert done.returncode in (0, 1), done.stderr.decode()
    finished(run)


def test_kubernetes(plant, run):
    """The manifests are valid by the schemas of the API; their containers' commands run as the kubelet would start them."""
    validator = pytest.importorskip("kubernetes_validate", reason="deploy/kubernetes*.yaml are not checked against the API's schemas")
    yaml = pytest.importorskip("yaml")
    names = ("kubernetes.yaml", "kubernetes-gather.yaml")
    # One of each: what is applied together starts together.
    shares, gather = (yaml.safe_load((DEPLOY / name).read_text(encoding="utf-8")) for name in names)
    for manifest in (shares, gather):
        validator.validate(manifest, validator.latest_version(), strict=True)
    with pytest.raises(validator.ValidationError):
        validator.validate({**shares, "spec": {**shares["spec"], "completion": 50}}, validator.latest_version(), strict=True)

    def container(manifest, **more) -> int:
        (one,) = manifest["spec"]["template"]["spec"]["containers"]
        command = [*one["command"], *one["args"]]
        return subprocess.run(command, env={**plant, **more}, capture_output=True, timeout=TIME_LIMIT_S).returncode

    each(
        lambda index=index: container(shares, JOB_COMPLETION_INDEX=str(index)) for index in range(shares["spec"]["completions"])
    )
    assert container(gather) == 0
    finished(run)


def test_htcondor(plant, run):
    """HTCondor's own reader expands the submit file; what each process would start is run."""
    htcondor = pytest.importorskip("htcondor2", reason="deploy/htcondor.sub is not read by HTCondor: its package is not installed")
    submit = htcondor.Submit((DEPLOY / "htcondor.sub").read_text(encoding="utf-8"))
    count = int(submit.getQArgs())
    assert count == 100 and submit.expand("retry_until") == "(ExitBySignal == False) && (ExitCode <= 1)"

    def arguments(process: int) -> list[str]:
        submit["Process"] = str(process)
        return shlex.split(submit.expand("arguments").strip('"'))

    started = [arguments(process) for process in range(count)]
    assert [one[-1] for one in started] == [f"{share}/100" for share in range(1, 101)]

    def job(words: list[str]) -> int:
        done = subprocess.run(["truegrind", *words], env=plant, capture_output=True, timeout=TIME_LIMIT_S)
        # What `retry_until` asks for.
        return 0 if 0 <= done.returncode <= 1 else done.returncode

    each(lambda words=words: job(words) for words in started)
    run("gather", "corrected", "--csv", "corrected.csv", "--html", "corrected.html")
    finished(run)
