"""Recordings of the command line, read by the `rerun-sdk` of whoever has one: the package itself brings none."""

from __future__ import annotations

import subprocess

import pytest

from conftest import DATA, PROGRAMS

MODEL = ("--robot", "abb-irb-120", "-o", "arm.toml", "--allow-doubtful")


@pytest.mark.filterwarnings("ignore:RRD file has no footer")
@pytest.mark.parametrize("verb, entity, rows", [("identify", "/residual/1", 300), ("compensate", "/deviation/size/before", 5)])
def test_a_recording_is_read_by_reruns_own_library(run, binary, tmp_path, monkeypatch, verb, entity, rows):
    """One row of what was measured or run for each, and a layout of the viewer beside them. (Recordings have no list of contents at
    their end, so that their bytes are the same in every run; Rerun says that it reads them through.)"""
    experimental = pytest.importorskip("rerun.experimental")
    monkeypatch.chdir(tmp_path)
    cable = DATA / "irb120-cable.csv"
    tried = subprocess.run([binary, "identify", cable, *MODEL, "--rrd", "made.rrd"], capture_output=True)
    if b"makes no recordings" in tried.stderr:
        pytest.skip("the binary was built without pictures")
    assert tried.returncode in (0, 1), tried.stderr.decode()
    if verb == "compensate":
        run(verb, PROGRAMS / "told.mod", "--model", "arm.toml", "-o", "real.mod", "--rrd", "made.rrd")
    read = experimental.RrdReader("made.rrd")
    (kept,) = read.recordings()
    assert kept.application_id.startswith("truegrind") and len(read.blueprints()) == 1
    there: dict[str, int] = {}
    for chunk in read.stream():
        if not chunk.is_static:
            there[chunk.entity_path] = there.get(chunk.entity_path, 0) + chunk.num_rows
    assert there[entity] == rows
    assert any(path.startswith("/arm/") and count == rows for path, count in there.items())
