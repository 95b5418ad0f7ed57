"""What an engineer does in a notebook beside fits and corrections: plan, accept, export, paths, cells, stated frames, warmth.

Each gives the bytes of the command line, which calls the same functions."""

from __future__ import annotations

import json

import numpy as np
import pytest

import truegrind as tg

from conftest import DATA, PROGRAMS, ROOT

FRAME = [2310.5, -640.2, 512.7, 0.12, 0.02, -0.03, 0.9921]
TOUCHED = [38.2, 12.6, 61.3]


def text(numbers: list[float]) -> str:
    return ",".join(map(str, numbers))


@pytest.fixture(scope="module")
def tracker() -> tg.Dataset:
    return tg.Dataset.from_csv(DATA / "irb120-tracker.csv")


@pytest.fixture(scope="module")
def arm(tracker, tmp_path_factory):
    """A model of the tracker's rows, and its file."""
    path = tmp_path_factory.mktemp("arm") / "arm.toml"
    tg.identify(tracker, "abb-irb-120").model.save(path, allow_doubtful=True)
    return tg.Model.load(path), path


@pytest.fixture(scope="module")
def later(tmp_path_factory):
    """Other poses of the same arm, and their file."""
    path = tmp_path_factory.mktemp("later") / "later.csv"
    path.write_text(tg.simulate(DATA / "irb120-tracker.toml", seed=9).csv, encoding="utf-8")
    return tg.Dataset.from_csv(path), path


def test_accept_gives_the_bytes_of_the_binary(run, tmp_path, arm, later):
    (model, file), (rows, table) = arm, later
    page = tmp_path / "page.html"
    known = ("--sensor-uncertainty", 0.05, "--serial", "arm=120-503211")
    printed = run("accept", table, "--model", file, "--tolerance", 3, *known, "--json", "--html", page)
    found = tg.accept(model, rows, tolerance_mm=3, sensor_uncertainty_mm=0.05, serials={"arm": "120-503211"})
    assert found.to_json().encode() == printed
    assert found.to_html() == page.read_text(encoding="utf-8")
    assert found.accepted == (json.loads(printed)["decision"] == "accepted") == (found.decision == "accepted")
    assert found.rmse_mm < found.nominal_rmse_mm and found.max_mm < 3
    errors = found.errors
    assert errors["row"].shape == errors["error_mm"].shape and np.isclose(np.abs(errors["error_mm"]).max(), found.max_mm)
    assert len(found.table["row"]) == len(errors["row"])
    assert not tg.accept(model, rows, tolerance_mm=0.01, sensor_uncertainty_mm=0.001).accepted


def test_acceptance_refuses_what_decides_nothing(arm, later, tracker):
    (model, _), (rows, _) = arm, later
    with pytest.raises(tg.FitError, match="fitted to these rows"):
        tg.accept(model, tracker, tolerance_mm=1)
    for wrong in (0, -1, float("nan"), 1000):
        with pytest.raises(tg.ArgumentError, match="tolerance"):
            tg.accept(model, rows, tolerance_mm=wrong)
    with pytest.raises(tg.ArgumentError, match="touched_point is missing"):
        tg.accept(model, rows, tolerance_mm=1, sensor_frame=FRAME)
    with pytest.raises(tg.ArgumentError, match="abb-irb-120"):
        tg.accept(model, rows, tolerance_mm=1, robot="universal-robots-ur5")


@pytest.mark.parametrize("sigma", [(), ("--frame-sigma", "0.5,0.05", "--touched-sigma", "0.2")])
def test_stated_frames_reach_the_fit(run, tracker, sigma):
    stated = ("--sensor-frame", text(FRAME), "--touched-point", text(TOUCHED))
    keywords: dict = {"sensor_frame": FRAME, "touched_point": TOUCHED}
    if sigma:
        keywords |= {"frame_sigma_mm": 0.5, "frame_sigma_deg": 0.05, "touched_sigma_mm": 0.2}
    for verb, call in (("identify", tg.identify), ("diagnose", tg.diagnose)):
        printed = run(verb, DATA / "irb120-tracker.csv", "--robot", "abb-irb-120", *stated, *sigma, "--json")
        assert call(tracker, "abb-irb-120", **keywords).to_json().encode() == printed, verb


def test_a_frame_that_the_readings_contradict_is_refused(tracker, cable):
    metres = [x / 1000 for x in FRAME[:3]] + FRAME[3:]
    with pytest.raises(tg.ArgumentError, match="sensor_frame"):
        tg.identify(tracker, "abb-irb-120", sensor_frame=metres)
    with pytest.raises(tg.ArgumentError, match="outlets_mm and cable_zeros_mm"):
        tg.identify(cable, "abb-irb-120", sensor_frame=FRAME)
    with pytest.raises(tg.ArgumentError, match="frame_sigma_mm needs sensor_frame"):
        tg.identify(tracker, "abb-irb-120", frame_sigma_mm=0.5)
    with pytest.raises(tg.ArgumentError, match="touched_sigma_mm needs touched_point"):
        tg.identify(tracker, "abb-irb-120", touched_sigma_mm=0.5)
    with pytest.raises(tg.ArgumentError, match="frame_sigma_mm"):
        tg.diagnose(tracker, "abb-irb-120", sensor_frame=FRAME, frame_sigma_mm=float("nan"))


@pytest.mark.parametrize("format", ["urdf", "dh-csv", "mdh-csv"])
def test_export_gives_the_bytes_of_the_binary(run, tmp_path, arm, later, format):
    (model, file), (rows, table) = arm, later
    printed = run("export", file, "--to", format, "-o", "-")
    made = model.export(format)
    assert made.text.encode() == printed
    assert made.is_whole and any("held-out error" in note for note in made.notes)
    made.save(tmp_path / "arm.out")
    assert (tmp_path / "arm.out").read_bytes() == printed
    printed = run("export", file, "--to", format, "--data", table, "-o", "-")
    assert model.export(format, dataset=rows).text.encode() == printed
    assert f"on {rows.file} ({len(rows)} rows, to which the model was not fitted)" in model.export(format, dataset=rows).text


def test_only_arms_of_their_maker_are_exported_for_ur_drivers(arm):
    with pytest.raises(tg.ArgumentError, match="made by ABB") as raised:
        arm[0].export("ur-yaml")
    assert raised.value.column == "format"
    with pytest.raises(tg.ArgumentError, match="urdf"):
        arm[0].export("step")


@pytest.mark.parametrize(("control", "ending"), [("rapid", "mod"), ("fanuc", "nc"), ("siemens", "mpf")])
def test_paths_give_the_bytes_of_the_binary(run, tmp_path, control, ending):
    surface, written = ROOT / "surfaces" / "blade.toml", tmp_path / f"blade.{ending}"
    run("path", surface, "--robot", "abb-irb-120", "-o", written)
    made = tg.path(surface, "abb-irb-120")
    assert made.program(control).encode() == written.read_bytes()
    made.save(tmp_path / f"ours.{ending}")
    assert (tmp_path / f"ours.{ending}").read_bytes() == written.read_bytes()
    assert made.position_mm.shape == (len(made), 3) and made.q_deg.shape == (len(made), 6)
    assert made.singularity > 0
    with pytest.raises(tg.ProgramError, match="RAPID"):
        made.save(tmp_path / "blade.krl")
    with pytest.raises(tg.ArgumentError, match="siemens"):
        made.program("heidenhain")


@pytest.mark.parametrize("program", ["frames.mod", "fanuc.nc"])
def test_a_cell_file_is_that_of_the_binary(run, program):
    printed = run("cell", PROGRAMS / program, "--robot", "abb-irb-120", "-o", "-").decode()
    assert tg.cell_file(PROGRAMS / program, robot="abb-irb-120") == printed
    with pytest.raises(tg.ProgramError, match="contains no motion"):
        tg.cell_file({"empty.mod": "MODULE empty\nENDMODULE\n"})


def test_every_option_of_a_plan_reaches_it(run, tmp_path, cable):
    found = tg.diagnose(cable, "abb-irb-120")
    why, program = tmp_path / "why.json", tmp_path / "poses.mod"
    why.write_text(found.to_json(), encoding="utf-8")
    options = [
        *("--outlet", "750,200,40", "--range", "150,1100", "--poses", 12, "--candidates", 300, "--for", why),
        *("--cable-zero", 12, "--box", "0,-600,50,700,600,900", "--keep-out", "-700,-700,0,-300,700,900"),
        *("--repeats", 2, "--both-sides", 3, "--warm-up", 4, "--approach", 2, "--settle", 1, "--speed", 150),
        *("--seconds-per-row", 20, "--link-radius", 40, "--clearance", 30, "--singularity", 0.06, "--sigma", 0.1),
    ]
    printed = run("plan", "--robot", "abb-irb-120", "--sensor", "cable", *options, "--json", "-o", program)
    keywords = dict(
        outlets_mm=[[750, 200, 40]], range_mm=[150, 1100], poses=12, candidates=300, cable_zeros_mm=[12],
        box_mm=[[0, -600, 50], [700, 600, 900]], keep_out_mm=[[[-700, -700, 0], [-300, 700, 900]]], repeats=2,
        both_sides=3, warm_up=4, approach_deg=2, settle_s=1, speed_mm_s=150, seconds_per_row=20, link_radius_mm=40,
        clearance_mm=30, singularity=0.06, sigma_mm=0.1,
    )
    for diagnosis in (found, why):
        planned = tg.plan("abb-irb-120", "cable", diagnosis=diagnosis, **keywords)
        assert planned.to_json().encode() == printed
        assert planned.program().encode() == program.read_bytes()
    with pytest.raises(tg.PlanError, match="the diagnosis is of robot abb-irb-120"):
        tg.plan("abb-irb-1600-6-1.2", "cable", outlets_mm=[[750, 200, 40]], diagnosis=found)
    with pytest.raises(tg.PlanError, match="99"):
        tg.plan("abb-irb-120", "cable", outlets_mm=[[750, 200, 40]], diagnosis=found, finding=99)
    with pytest.raises(tg.ArgumentError, match="diagnosis"):
        tg.plan("abb-irb-120", "cable", outlets_mm=[[750, 200, 40]], finding=1)
    with pytest.raises(tg.ArgumentError, match="the arm itself reaches"):
        tg.plan("abb-irb-120", "position", touched_point=[40, 0, 60_000])


def test_warmth_and_load_reach_the_correction(run, tmp_path, model):
    file, source = tmp_path / "warm.toml", PROGRAMS / "told.mod"
    body = model.to_toml()
    thermal = '[[estimated.effect]]\neffect = "thermal-drift"\ngrowth = 0.0\ntime_constant_h = 1.0\ngrowth_per_k = 1.2e-5\nreference_c = 20.0\n\n'
    at = body.index("[[estimated.link]]")
    file.write_text(body[:at] + thermal + body[at:], encoding="utf-8")
    warm = tg.Model.load(file)
    here = {"allow_doubtful": True}
    for celsius in (15.0, 45.0):
        options = ("--model", file, "--allow-doubtful", "--temperature", celsius)
        done = tg.compensate(source, warm, temperature_c=celsius, **here)
        assert done.to_json().encode() == run("compensate", source, *options, "--dry-run", "--json")
        printed = run("deviation", source, "--model", file, "--temperature", celsius, "--json")
        assert tg.deviation(source, warm, temperature_c=celsius).to_json().encode() == printed
    cold, hot = (tg.deviation(source, warm, temperature_c=c).points["before_norm_mm"] for c in (15.0, 45.0))
    assert cold != hot
    for call in (tg.compensate, tg.deviation):
        with pytest.raises(tg.ArgumentError, match="temperature_c 20: the model does not say"):
            call(source, model, temperature_c=20, **(here if call is tg.compensate else {}))
        with pytest.raises(tg.ArgumentError, match="in °C") as raised:
            call(source, warm, temperature_c=293.15, **(here if call is tg.compensate else {}))
        assert raised.value.column == "temperature_c"


def test_lengths_that_cannot_be_meant_in_millimetres_are_refused(model):
    for name, wrong in (("tolerance_mm", 50.0), ("tolerance_mm", float("inf")), ("max_correction_mm", 10_000.0)):
        with pytest.raises(tg.ArgumentError, match=name):
            tg.compensate(PROGRAMS / "told.mod", model, allow_doubtful=True, **{name: wrong})
    with pytest.raises(tg.ArgumentError, match="tolerance_mm"):
        tg.deviation(PROGRAMS / "told.mod", model, tolerance_mm=50.0)


def test_the_centre_of_a_payload_comes_from_arrays_too(tracker):
    q, place = tracker.q_deg, tracker.position_mm
    centre = np.tile([10.0, -5.0, 90.0], (len(q), 1))
    given = tg.Dataset.from_numpy(q, position_mm=place, payload_kg=np.full(len(q), 2.0), payload_centre_mm=centre)
    names = [f"q{j}" for j in range(1, 7)] + [f"measured_{a}" for a in "xyz"]
    columns = dict(zip(names, [*q.T, *place.T])) | {"payload": np.full(len(q), 2.0)}
    columns |= {f"payload_{axis}": values for axis, values in zip("xyz", centre.T)}
    named = tg.Dataset.from_dataframe(columns, name="numpy")
    ours, theirs = (json.loads(tg.identify(rows, "abb-irb-120").to_json()) for rows in (given, named))
    assert ours["parameters"] == theirs["parameters"]
    at_flange = tg.Dataset.from_numpy(q, position_mm=place, payload_kg=np.full(len(q), 2.0))
    with pytest.raises(tg.ArgumentError, match="payload_centre_mm"):
        tg.Dataset.from_numpy(q, position_mm=place, payload_centre_mm=np.zeros(3))
    # Without it the same note as on the command line.
    assert not any("at the flange" in note for note in tg.diagnose(given, "abb-irb-120").notes)
    assert any("at the flange" in note for note in tg.diagnose(at_flange, "abb-irb-120").notes)


def test_a_robot_is_the_json_of_the_binary(run):
    for name in tg.robots():
        assert tg.Robot(name).to_json().encode() == run("robots", name, "--json")
    listed = json.loads(run("robots", "--json"))
    assert [robot["name"] for robot in listed["robots"]] == tg.robots()


def test_stations_of_a_recipe_are_measured_and_fitted(tmp_path):
    recipe = (DATA / "irb120-tracker.toml").read_text(encoding="utf-8")
    recipe += "\n[[station]]\nposition_mm = [-1500.0, 1800.0, 400.0]\nwxyz = [0.9, 0.0, 0.0, 0.43]\n"
    found = tg.identify(tg.simulate(recipe).dataset, "abb-irb-120")
    one = tg.identify(tg.Dataset.from_csv(DATA / "irb120-tracker.csv"), "abb-irb-120")
    assert found.held_out_rmse_mm < 1.3 * one.held_out_rmse_mm
