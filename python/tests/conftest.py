"""What the tests share: the project's own data, and the binary that everything is compared with."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest

import truegrind as tg

from plant import fill, of_one_run

ROOT = Path(__file__).resolve().parents[2]
DATA = ROOT / "tests" / "data"
PROGRAMS = ROOT / "programs"
TIME_LIMIT_S = 300


@pytest.fixture(scope="session")
def cable() -> tg.Dataset:
    """A simulated arm whose joints 2 and 3 yield to gravity and whose first gear runs out of centre."""
    return tg.Dataset.from_csv(DATA / "irb120-cable.csv")


@pytest.fixture(scope="session")
def identified(cable: tg.Dataset) -> tg.Identification:
    return tg.identify(cable, "abb-irb-120")


@pytest.fixture(scope="session")
def model(identified: tg.Identification) -> tg.Model:
    return identified.model


@pytest.fixture(scope="session")
def binary() -> Path:
    """The command line: TRUEGRIND names it, or it stands where `cargo build` puts it."""
    named = os.environ.get("TRUEGRIND")
    target = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
    places = [Path(named)] if named else [target / "debug" / "truegrind", target / "release" / "truegrind"]
    for place in places:
        if place.is_file():
            return place
    if named or os.environ.get("CI"):
        pytest.fail(f"no binary at {', '.join(map(str, places))}: build it with `cargo build`")
    pytest.skip("no binary to compare with: build it with `cargo build`, or name it by TRUEGRIND")


@pytest.fixture(scope="session")
def run(binary: Path):
    """Runs the command line and hands back what it printed."""

    def run(*arguments: object, codes: tuple[int, ...] = (0, 1)) -> bytes:
        done = subprocess.run([binary, *map(str, arguments)], capture_output=True, timeout=TIME_LIMIT_S)
        assert done.returncode in codes, done.stderr.decode()
        return done.stdout

    return run


@pytest.fixture
def plant(tmp_path, binary, model, monkeypatch) -> Path:
    """A folder with programs and a model; the tests work in it."""
    fill(tmp_path, PROGRAMS, model)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("TRUEGRIND", str(binary))
    return tmp_path


@pytest.fixture
def expected(plant, run) -> dict[str, bytes]:
    """What one run writes: reports and programs."""
    return of_one_run(run)
