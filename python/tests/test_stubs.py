"""The stub, which is generated from the module (`.ci/python` compares it), as type checkers see it."""

import inspect
import subprocess
import sys
from pathlib import Path

import pytest
import truegrind
from truegrind import _truegrind

EXAMPLE = Path(__file__).parents[1] / "examples" / "from_rows_to_program.py"

WRONG = """
import truegrind as tg
rows = tg.Dataset.from_csv("poses.csv")
tg.compensate("blade.mod", "arm.toml", emit="joint")
tg.Robot("abb-irb-120").forward(rows.q_deg).position
tg.identify("poses.csv", "abb-irb-120")
tg.diagnose(rows, 120, seed="one")
found: int = tg.identify(rows, tg.Robot("abb-irb-120")).held_out_rmse_mm
worst: list[int] = tg.deviation({"a.mod": b""}, "arm.toml").points
"""
"""Each line after the second is wrong, and by one type alone."""


def mypy(at: Path, *arguments: object) -> subprocess.CompletedProcess[str]:
    pytest.importorskip("mypy")
    command = [sys.executable, "-m", *map(str, arguments)]
    return subprocess.run(command, cwd=at, capture_output=True, text=True)


def test_the_stub_is_the_module(tmp_path):
    done = mypy(tmp_path, "mypy.stubtest", "truegrind._truegrind")
    assert done.returncode == 0, done.stdout + done.stderr


def test_type_checkers_accept_the_example_and_name_what_is_wrong(tmp_path):
    done = mypy(tmp_path, "mypy", "--strict", EXAMPLE)
    assert done.returncode == 0, done.stdout
    (tmp_path / "wrong.py").write_text(WRONG, encoding="utf-8")
    done = mypy(tmp_path, "mypy", "--strict", "wrong.py")
    lines = {int(line.split(":")[1]) for line in done.stdout.splitlines() if ": error:" in line}
    assert lines == set(range(4, WRONG.count("\n") + 1)), done.stdout


def test_everything_is_exported_and_explained():
    for name in truegrind.__all__:
        value = getattr(truegrind, name)
        assert isinstance(value, str) or (value.__doc__ or "").strip(), f"{name} has no documentation"
    public = {name for name in dir(_truegrind) if not name.startswith("_")}
    assert public <= set(truegrind.__all__)
    for name in public:
        value = getattr(_truegrind, name)
        if inspect.isclass(value):
            assert value.__module__ == "truegrind", name
            for member in vars(value):
                if not member.startswith("_"):
                    assert (getattr(value, member).__doc__ or "").strip(), f"{name}.{member}"
