"""The same bits as the command line: whatever it computes, it computes from the same library."""

import json

import numpy as np
import pytest

import truegrind as tg

from conftest import DATA, PROGRAMS


def test_the_version_is_that_of_the_binary(run):
    assert run("--version").decode().split() == ["truegrind", tg.__version__]


@pytest.mark.parametrize("file", ["irb120-cable.csv", "irb120-tracker.csv", "irb120-rounded.csv"])
def test_identify_gives_the_bytes_of_the_binary(run, tmp_path, file):
    model = tmp_path / "arm.toml"
    printed = run("identify", DATA / file, "--robot", "abb-irb-120", "--json", "-o", model, "--allow-doubtful")
    found = tg.identify(tg.Dataset.from_csv(DATA / file), "abb-irb-120")
    assert found.to_json().encode() == printed
    found.model.save(tmp_path / "ours.toml", allow_doubtful=True)
    assert (tmp_path / "ours.toml").read_bytes() == model.read_bytes()
    assert tg.Model.load(model).hash == found.model.hash


def test_diagnose_gives_the_bytes_of_the_binary(run, tmp_path):
    page = tmp_path / "why.html"
    printed = run("diagnose", DATA / "irb120-cable.csv", "--robot", "abb-irb-120", "--json", "--html", page)
    found = tg.diagnose(tg.Dataset.from_csv(DATA / "irb120-cable.csv"), "abb-irb-120", threads=1)
    assert found.to_json().encode() == printed
    assert found.to_html() == page.read_text(encoding="utf-8")


def test_what_is_known_of_scale_and_tolerances_reaches_the_diagnosis(run):
    known = ("--sensor-scale-sigma", "0.001", "--tolerance-length", "0.4", "--tolerance-angle", "0.2")
    printed = run("diagnose", DATA / "irb120-tracker.csv", "--robot", "abb-irb-120", "--json", *known)
    rows = tg.Dataset.from_csv(DATA / "irb120-tracker.csv")
    options = {"sensor_scale_sigma_percent": 0.001, "tolerance_length_mm": 0.4, "tolerance_angle_deg": 0.2}
    assert tg.diagnose(rows, "abb-irb-120", **options).to_json().encode() == printed
    assert tg.diagnose(rows, "abb-irb-120").to_json().encode() != printed
    with pytest.raises(tg.ArgumentError, match="a percentage from 0 to 10"):
        tg.diagnose(rows, "abb-irb-120", sensor_scale_sigma_percent=11)
    with pytest.raises(tg.ArgumentError, match="tolerance_length_mm"):
        tg.diagnose(rows, "abb-irb-120", tolerance_length_mm=0)


@pytest.mark.parametrize("program", ["told.mod", "circles.mod"])
def test_compensate_and_deviation_give_the_bytes_of_the_binary(run, tmp_path, model, program):
    arm, written, source = tmp_path / "arm.toml", tmp_path / program, PROGRAMS / program
    model.save(arm, allow_doubtful=True)
    loaded = tg.Model.load(arm)
    options = ("--model", arm, "--allow-doubtful")
    run("compensate", source, *options, "-o", written)
    done = tg.compensate(source, loaded, allow_doubtful=True)
    assert done.programs[str(source)] == written.read_bytes()
    printed = run("compensate", source, *options, "--dry-run", "--json")
    assert done.to_json().encode() == printed
    printed = run("deviation", source, "--model", arm, "--json")
    off = tg.deviation(source, loaded)
    assert off.to_json().encode() == printed
    assert off.to_csv().encode() == run("deviation", source, "--model", arm, "--csv")


def test_simulate_gives_the_bytes_of_the_binary(run, tmp_path):
    recipe = DATA / "irb120-cable.toml"
    run("simulate", recipe, "-o", tmp_path / "rows.csv", "--arm", tmp_path / "arm.toml")
    made = tg.simulate(recipe)
    assert made.csv.encode() == (tmp_path / "rows.csv").read_bytes()
    assert made.actual.to_toml() == (tmp_path / "arm.toml").read_text(encoding="utf-8")


@pytest.mark.parametrize("frame", [None, [2000, 500, 300]])
def test_plan_gives_the_bytes_of_the_binary(run, tmp_path, frame):
    """With a stated sensor frame the line of sight stays clear of the links."""
    program = tmp_path / "poses.mod"
    options = ["--robot", "abb-irb-120", "--sensor", "position", "--poses", 12, "--candidates", 200]
    if frame:
        options += ["--sensor-frame", ",".join(map(str, frame))]
    printed = run("plan", *options, "--touched-point", "20,0,50", "--json", "-o", program)
    planned = tg.plan(
        "abb-irb-120", "position", poses=12, candidates=200, sensor_frame=frame, touched_point=[20, 0, 50]
    )
    assert planned.to_json().encode() == printed
    assert planned.program().encode() == program.read_bytes()


def test_arrays_give_what_the_file_gives(cable):
    """The name and the hash of a table are its own; every number found in it is the same."""
    rows = np.genfromtxt(DATA / "irb120-cable.csv", delimiter=",", names=True)
    q_deg = np.stack([rows[f"q{joint}"] for joint in range(1, 7)], axis=1)
    known = {"t": "time_h", "temperature": "temperature_c", "payload": "payload_kg", "anchor": "anchor"}
    further = {ours: rows[name] for name, ours in known.items() if name in rows.dtype.names}
    if {"x", "y", "z"} <= set(rows.dtype.names):
        further["readout_mm"] = np.stack([rows["x"], rows["y"], rows["z"]], axis=1)
    given = tg.Dataset.from_numpy(q_deg, length_mm=rows["L"], **further)
    ours = json.loads(tg.identify(given, "abb-irb-120").to_json())
    file = json.loads(tg.identify(cable, "abb-irb-120").to_json())
    assert ours.pop("dataset") != file.pop("dataset")
    for error in ours["held_out"] if "held_out" in ours else []:
        error.pop("row")
    for error in file["held_out"] if "held_out" in file else []:
        error.pop("row")
    for key in ours:
        if key not in {"outliers", "held_out_rows"}:
            assert ours[key] == file[key], key
