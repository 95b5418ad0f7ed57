"""Results as objects: pages for a notebook, files, and the example as it stands."""

import json
import runpy
from collections import deque
from pathlib import Path
from types import MappingProxyType

import numpy as np
import pytest

import truegrind as tg

from conftest import DATA, PROGRAMS


def test_the_example_runs(capsys):
    runpy.run_path(str(Path(__file__).resolve().parents[1] / "examples" / "from_rows_to_program.py"))
    told = capsys.readouterr().out
    assert "held-out RMSE" in told and "MODULE Grind" in told


def test_the_lines_of_the_readme_run(tmp_path, monkeypatch):
    """As they stand there, in a folder with files of those names."""
    root = Path(__file__).resolve().parents[2]
    text = (root / "README.md").read_text(encoding="utf-8")
    lines = text.split("## From Python")[1].split("```python\n")[1].split("```")[0]
    assert len(lines.splitlines()) <= 10
    for name, source in {
        "poses.csv": DATA / "irb120-tracker.csv",
        "blade.mod": PROGRAMS / "told.mod",
        "arm.urdf": root / "crates" / "arm" / "tests" / "data" / "tool-turned.urdf",
    }.items():
        (tmp_path / name).write_bytes(source.read_bytes())
    (tmp_path / "later.csv").write_text(tg.simulate(DATA / "irb120-tracker.toml", seed=9).csv, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    found: dict[str, object] = {}
    exec(compile(lines, "README.md", "exec"), found)
    assert (tmp_path / "blade-real.mod").read_bytes() != (tmp_path / "blade.mod").read_bytes()
    assert found["where"].position_mm.shape == (len(found["rows"]), 3)


def test_nothing_but_numpy_is_required():
    from importlib.metadata import metadata, requires

    needed = [line for line in requires("truegrind") if "extra ==" not in line]
    assert [line.replace(" ", "") for line in needed] == ["numpy>=1.24"]
    assert metadata("truegrind")["Requires-Python"] == ">=3.10"
    assert (Path(tg.__file__).parent / "py.typed").exists()
    # One wheel for every Python from 3.10 on.
    assert ".abi3." in Path(tg._truegrind.__file__).name or Path(tg._truegrind.__file__).suffix == ".pyd"


def test_every_result_has_a_page_and_json(identified, model, cable):
    results = [
        tg.Robot("abb-irb-120"),
        identified,
        tg.diagnose(cable, "abb-irb-120"),
        tg.track(model, cable),
        tg.compensate(PROGRAMS / "told.mod", model, allow_doubtful=True),
        tg.deviation(PROGRAMS / "told.mod", model),
        tg.plan("abb-irb-120", "position", poses=8, candidates=100, touched_point=[20, 0, 50]),
    ]
    for result in results:
        assert isinstance(json.loads(result.to_json()), dict)
        page, shown = result.to_html(), result._repr_html_()
        assert "<html" in page and shown.startswith("<iframe srcdoc=") and '"' not in shown[16:].split('" style')[0]
        assert type(result).__name__ in repr(result)


def test_the_scale_of_the_sensor_may_be_stated(identified, cable):
    """Its uncertainty is part of what the model promises; a percentage that no sensor has is refused."""
    exact, coarse = (
        tg.identify(cable, "abb-irb-120", sensor_scale_sigma_percent=percent).to_json() for percent in (0.0, 1.0)
    )
    expected = [json.loads(text)["benefit"]["estimated_mm"] for text in (exact, identified.to_json(), coarse)]
    assert expected == sorted(expected) and expected[0] < expected[2]
    with pytest.raises(tg.ArgumentError, match="sensor_scale_sigma_percent"):
        tg.identify(cable, "abb-irb-120", sensor_scale_sigma_percent=50.0)


def test_a_payload_in_grams_is_refused():
    rows = dict(q_deg=np.zeros((3, 6)), position_mm=np.zeros((3, 3)), payload_kg=np.full(3, 1200.0))
    with pytest.raises(tg.DatasetError, match="grams"):
        tg.identify(tg.Dataset.from_numpy(**rows), "abb-irb-120")


def test_what_was_found_is_at_hand(identified, model):
    assert identified.held_out_rmse_mm < identified.held_out_rmse_before_mm
    assert identified.held_out_max_mm >= identified.held_out_rmse_mm
    held = identified.held_out
    assert held["row"].shape == held["before_mm"].shape == held["after_mm"].shape
    assert np.isclose(np.sqrt(np.mean(held["after_mm"] ** 2)), identified.held_out_rmse_mm)
    names = {parameter["name"] for parameter in identified.parameters}
    assert "link2.theta" in names and set(model.order) <= {p["name"] for p in model.parameters} | names
    assert identified.verdict == model.verdict == identified.model.verdict


def test_a_model_goes_to_a_file_and_back(tmp_path, model):
    path = tmp_path / "arm.toml"
    model.save(path, allow_doubtful=True)
    again = tg.Model.load(path)
    q = np.random.default_rng(0).uniform(-50, 50, (50, 6))
    for ours, theirs in zip(model.forward(q), again.forward(q)):
        assert np.abs(ours - theirs).max() < 1e-9
    assert list(tmp_path.iterdir()) == [path]
    assert again.hash == model.hash and again.robot == "abb-irb-120"


def test_programs_are_never_overwritten(tmp_path, model):
    program = tmp_path / "told.mod"
    program.write_bytes((PROGRAMS / "told.mod").read_bytes())
    done = tg.compensate(program, model, allow_doubtful=True)
    assert done.changed and sum(done.counts.values()) == len(done.motions)
    with pytest.raises(tg.ProgramError, match="is the original program"):
        done.save(program)
    with pytest.raises(tg.ProgramError, match="is the original program"):
        done.save(tmp_path)
    done.save(tmp_path / "real.mod")
    assert (tmp_path / "real.mod").read_bytes() == done.programs[str(program)]
    with pytest.raises(tg.ProgramError, match="already compensated with this model"):
        tg.compensate(tmp_path / "real.mod", model, allow_doubtful=True)


def test_what_must_not_be_corrected_is_refused(tmp_path, model):
    with pytest.raises(tg.ArgumentError, match="nothing"):
        tg.compensate({}, model, allow_doubtful=True)
    with pytest.raises(FileNotFoundError):
        tg.compensate(tmp_path / "nowhere.mod", model, allow_doubtful=True)
    with pytest.raises(tg.CellError, match="not a cell file"):
        tg.compensate(PROGRAMS / "told.mod", model, cell="no = such\nkey = 1\n", allow_doubtful=True)
    with pytest.raises(tg.ArgumentError, match="placement"):
        tg.compensate(PROGRAMS / "told.mod", model, placement="everywhere", allow_doubtful=True)
    with pytest.raises(tg.ArgumentError, match="max_risk"):
        tg.compensate(PROGRAMS / "told.mod", model, max_risk=1.5, allow_doubtful=True)
    with pytest.raises(tg.ArgumentError, match="tolerance_mm"):
        tg.compensate(PROGRAMS / "told.mod", model, tolerance_mm=-1, allow_doubtful=True)


def test_a_program_is_named_by_paths_or_texts(model):
    path = PROGRAMS / "circles.mod"
    text = path.read_text(encoding="utf-8")
    correct = lambda program: tg.compensate(program, model, allow_doubtful=True)
    (wanted,) = correct(path).programs.values()
    # Any mapping and any sequence, as the types say.
    for given in (MappingProxyType({"circles.mod": text}), {"circles.mod": text.encode()}, deque([path]), (str(path),)):
        assert list(correct(given).programs.values()) == [wanted]
    for given in (text, text.encode(), (x for x in [path])):
        with pytest.raises(tg.ArgumentError, match="a dictionary of names and texts") as raised:
            correct(given)
        assert len(raised.value.found) <= 201


def after_best_motion(found: np.ndarray, wanted: np.ndarray) -> float:
    """What is left (mm RMS) after the rigid motion that fits best: no sensor whose place is fitted sees the arm's base."""
    f, w = found - found.mean(axis=0), wanted - wanted.mean(axis=0)
    u, _, v = np.linalg.svd(f.T @ w)
    turn = u @ np.diag([1, 1, np.sign(np.linalg.det(u @ v))]) @ v
    return float(np.sqrt(np.mean(np.sum((f @ turn - w) ** 2, axis=1))))


def test_the_whole_way_is_judged_on_the_actual_arm():
    """On a simulated arm, and not on the model that was found of it."""
    made = tg.simulate(DATA / "irb120-cable.toml")
    found = tg.diagnose(made.dataset, "abb-irb-120")
    q = made.dataset.q_deg
    actual = made.actual.forward(q).position_mm
    nominal = after_best_motion(tg.Robot("abb-irb-120").forward(q).position_mm, actual)
    assert after_best_motion(found.model.forward(q).position_mm, actual) < 0.5 * nominal
    # All of its motions are corrected: where one of a path of lines cannot be, what leads to it stays as it was.
    source = PROGRAMS / "circles.mod"
    # The simulated arm's base is where the data sheet has it: place and shape are judged together.
    done = tg.compensate(source, found.model, placement="absolute", max_risk=1.0, allow_doubtful=True)
    off = tg.deviation(done.programs, found.model, intended=source, actual=made.actual).points
    pairs = [(b, a) for b, a in zip(off["before_norm_mm"], off["after_norm_mm"]) if a is not None]
    before, after = np.array(pairs).T
    assert len(pairs) > 3 and np.mean(after) < np.mean(before)


def test_a_track_goes_on_where_it_ended(cable, model):
    q, length = cable.q_deg, cable.length_mm
    split = len(q) * 2 // 3
    parts = [tg.Dataset.from_numpy(q[a:b], length_mm=length[a:b], name=f"part {a}") for a, b in ((0, split), (split, None))]
    first = tg.track(model, parts[0])
    both = tg.track(model, parts, state=first.state)
    whole = tg.track(model, parts)
    assert both.poses == whole.poses == len(q)
    assert both.model.to_toml() == whole.model.to_toml()
    assert "<html" in whole.to_html() and isinstance(whole.alarms, list)


def test_a_model_goes_to_other_processes(model):
    """Engines pickle what a job is given."""
    import pickle

    again = pickle.loads(pickle.dumps(model))
    assert (again.hash, again.to_toml(), again.robot) == (model.hash, model.to_toml(), model.robot)
    q_deg = np.linspace(-20.0, 20.0, 12).reshape(2, 6)
    here, there, further = (arm.forward(q_deg).position_mm for arm in (model, again, pickle.loads(pickle.dumps(again))))
    # A file rounds angles in degrees once.
    assert np.allclose(there, here, rtol=0.0, atol=1e-9) and np.array_equal(further, there)
    options = {"allow_doubtful": True}
    there, here = (tg.compensate(PROGRAMS / "told.mod", arm, **options) for arm in (again, model))
    assert there.programs == here.programs
