"""A plant's folder of programs, and what one run makes of it: what tests of shares and engines have in common."""

from __future__ import annotations

import shutil
from pathlib import Path

from truegrind import _jobs

COUNT = 40


def fill(at: Path, programs: Path, model) -> None:
    """Programs, one of which cannot be done, and a model."""
    (at / "in" / "nc").mkdir(parents=True)
    text = (programs / "circles.mod").read_text(encoding="utf-8")
    for number in range(COUNT - 2):
        (at / "in" / f"p{number:03}.mod").write_text(f"! {number}\n{text}", encoding="utf-8")
    shutil.copy(programs / "fanuc.nc", at / "in" / "nc")
    (at / "in" / "broken.pgf").write_text("<Program><Module>nowhere.mod</Module></Program>")
    model.save(at / "arm.toml", allow_doubtful=True)


def of_one_run(run) -> dict[str, bytes]:
    """Reports and programs of one run in this folder, which are taken away again."""
    kinds = ["csv", "json", "html", "md"]
    run("compensate", "in", "--model", "arm.toml", "-o", "out", *(f"--{kind}=one.{kind}" for kind in kinds))
    written = {path.name: path.read_bytes() for path in Path("out").rglob("*") if path.is_file()}
    shutil.rmtree("out")
    return {kind: Path(f"one.{kind}").read_bytes() for kind in kinds} | written


REPORTS = {kind: f"all.{kind}" for kind in ("csv", "json", "html", "md")}


def same(expected: dict[str, bytes], found: _jobs.Gathered) -> None:
    for kind, path in found.reports.items():
        assert path.read_bytes() == expected[kind], kind
    for path in Path("out").rglob("*.mod"):
        assert path.read_bytes() == expected[path.name], path
