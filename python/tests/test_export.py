"""What is exported, read by somebody else: a reader and a product of transforms of the tests' own, and yourdfpy where it is there.

The class: an arm that reads back well by the code that wrote it, and is another one to everybody else."""

from __future__ import annotations

import csv
import io
import re
from pathlib import Path

import numpy as np
import pytest

import truegrind as tg

from conftest import DATA
from urdf import Urdf, turn

SAME_MM = 1e-9

TRACKED = """
robot = "{robot}"
seed = {seed}
[arm.random]
seed = 3
a_mm = 0.4
d_mm = 0.4
alpha_deg = 0.05
beta_deg = 0.05
theta_deg = 0.2
[poses]
kind = "random"
count = 120
min_deg = [-90, -50, -60, -120, -100, -150]
max_deg = [90, 60, 50, 120, 100, 150]
[sensor]
kind = "position"
frame = {{ position_mm = [2310.5, -640.2, 512.7], wxyz = [0.12, 0.02, -0.03, 0.99] }}
reflector_mm = [38.2, 12.6, 61.3]
[noise]
sigma_mm = 0.015
"""


def links(model: str, q_rad: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The same of the links in a model file, without its effects: Rz Tz Tx Rx Ry, as the file's own manual has them."""
    estimated = pytest.importorskip("tomllib").loads(model)["estimated"]
    assert estimated["flange_mm"] == [0, 0, 0] and estimated["flange_wxyz"] == [1, 0, 0, 0]
    place, rotation = np.zeros((len(q_rad), 3)), np.broadcast_to(np.eye(3), (len(q_rad), 3, 3))
    turns = q_rad @ np.array(estimated["joint_map"]).T
    for link, angle in zip(estimated["link"], turns.T, strict=True):
        rotation = rotation @ turn(np.eye(3)[2], angle + np.radians(link["theta_deg"]))
        place = place + rotation @ np.array([link["a_mm"], 0.0, link["d_mm"]])
        for axis, key in ((0, "alpha_deg"), (1, "beta_deg")):
            rotation = rotation @ turn(np.eye(3)[axis], np.radians(link.get(key, 0.0)))
    return place, rotation


def simulated(tmp_path: Path, robot: str, seed: int = 1) -> tg.Dataset:
    recipe = tmp_path / f"{robot}-{seed}.toml"
    recipe.write_text(TRACKED.format(robot=robot, seed=seed), encoding="utf-8")
    return tg.simulate(recipe, name=f"{robot}.csv").dataset


def exported(run, tmp_path: Path, model: tg.Model, form: str, *options: object) -> str:
    path = tmp_path / "model.toml"
    model.save(path, allow_doubtful=True)
    return run("export", path, "--to", form, "-o", "-", *options).decode()


def poses(rows: int = 200) -> np.ndarray:
    return np.random.default_rng(5).uniform(-170, 170, (rows, 6))


@pytest.mark.parametrize("robot", ["abb-irb-120", "universal-robots-ur10", "kuka-kr6-r900-sixx"])
def test_a_urdf_is_the_arm_to_another_reader(run, tmp_path, robot):
    """Right angles, parallel axes that calibration has tilted, joints that turn the other way round."""
    model = tg.identify(simulated(tmp_path, robot), robot).model
    q_deg = poses()
    place, rotation = Urdf(exported(run, tmp_path, model, "urdf")).forward(np.radians(q_deg))
    ours = model.forward(q_deg)
    assert np.linalg.norm(place - ours.position_mm, axis=1).max() < SAME_MM
    assert np.abs(rotation - ours.rotation).max() < 1e-12


def test_joints_that_are_sums_are_as_the_file_says(run, tmp_path):
    """A FANUC measures its forearm relative to the ground, a URDF cannot: the note says what its third angle is."""
    robot = "fanuc-m-20ia"
    model = tg.identify(simulated(tmp_path, robot), robot).model
    text = exported(run, tmp_path, model, "urdf")
    assert "must compute them: joint 3 = J2 + J3;" in text
    q_deg = poses()
    place, rotation = Urdf(text).forward(np.radians(q_deg + q_deg[:, 1:2] * np.eye(6)[2]))
    ours = model.forward(q_deg)
    assert np.linalg.norm(place - ours.position_mm, axis=1).max() < SAME_MM
    assert np.abs(rotation - ours.rotation).max() < 1e-12


def test_of_an_arm_with_causes_the_links_are_exported(run, tmp_path):
    found = tg.diagnose(tg.Dataset.from_csv(DATA / "irb120-tracker.csv"), "abb-irb-120", threads=1)
    text = exported(run, tmp_path, found.model, "urdf")
    assert "effects beyond rigid links are left out: " in text
    q_deg = poses()
    place, rotation = Urdf(text).forward(np.radians(q_deg))
    ours = links(found.model.to_toml(), np.radians(q_deg))
    assert np.linalg.norm(place - ours[0], axis=1).max() < SAME_MM
    assert np.abs(rotation - ours[1]).max() < 1e-12
    # Its causes are more than what the readers differ by.
    assert np.linalg.norm(place - found.model.forward(q_deg).position_mm, axis=1).max() > 0.01


@pytest.mark.parametrize("form", ["dh-csv", "mdh-csv"])
def test_a_table_is_the_arm_to_another_reader(run, tmp_path, form):
    model = tg.identify(simulated(tmp_path, "universal-robots-ur10"), "universal-robots-ur10").model
    text = exported(run, tmp_path, model, form)
    rows = list(csv.DictReader(io.StringIO(re.sub(r"(?m)^#.*\n", "", text))))
    q_deg = poses()
    place, rotation = np.zeros((len(q_deg), 3)), np.broadcast_to(np.eye(3), (len(q_deg), 3, 3))
    for row, angle in zip(rows, np.radians(q_deg).T, strict=True):
        theta, alpha = (np.radians(float(row[key])) for key in ("theta_deg", "alpha_deg"))
        sideways, x, z = np.array([float(row["a_mm"]), 0, 0]), np.eye(3)[0], np.eye(3)[2]
        if form == "mdh-csv":
            place, rotation = place + rotation @ sideways, rotation @ turn(x, alpha)
        rotation = rotation @ turn(z, angle + theta)
        place = place + rotation @ np.array([0, 0, float(row["d_mm"])])
        if form == "dh-csv":
            place, rotation = place + rotation @ sideways, rotation @ turn(x, alpha)
    if form == "mdh-csv":
        # Craig's last frame stands before length and twist of the last link; the note says where the flange lies in it.
        numbers = re.search(r"flange lies in it at \((.*?)\) mm, turned by the quaternion\s+\((.*?)\)", text)
        assert numbers, text
        offset, (w, *v) = (np.array(group.split(","), dtype=float) for group in numbers.groups())
        half = np.linalg.norm(v)
        place = place + rotation @ offset
        rotation = rotation @ (turn(np.array(v), 2 * np.arctan2(half, w)) if half else np.eye(3))
    ours = model.forward(q_deg)
    # Common normals of nearly parallel axes lie hundreds of metres away, and take some digits with them.
    assert np.linalg.norm(place - ours.position_mm, axis=1).max() < 1e-6
    assert np.abs(rotation - ours.rotation).max() < 1e-9


def test_the_error_that_is_stated_is_that_of_the_file(run, tmp_path):
    """By rows that no fit saw: the file's own flange, the sensor's frame and target fitted to it by NumPy."""
    later = tmp_path / "later.toml"
    recipe = (DATA / "irb120-tracker.toml").read_text(encoding="utf-8")
    later.write_text(re.sub(r"(?m)^seed = 121", "seed = 4711", recipe, count=1), encoding="utf-8")
    rows = tg.simulate(later, name="later.csv")
    data = tmp_path / "later.csv"
    data.write_text(rows.csv, encoding="utf-8")
    found = tg.diagnose(tg.Dataset.from_csv(DATA / "irb120-tracker.csv"), "abb-irb-120", threads=1)
    text = exported(run, tmp_path, found.model, "urdf", "--data", data)
    stated = re.search(r"to which the model was not fitted\), only the sensor frame fitted: ([0-9.]+) mm RMS", text)
    assert stated, text
    place, rotation = Urdf(text).forward(np.radians(rows.dataset.q_deg))
    measured = rows.dataset.position_mm
    target = np.zeros(3)
    for _ in range(60):
        # The frame for a target, then a step of both.
        points = place + rotation @ target
        middles = points.mean(axis=0), measured.mean(axis=0)
        u, _, vt = np.linalg.svd((points - middles[0]).T @ (measured - middles[1]))
        frame = (u @ np.diag([1, 1, np.linalg.det(u @ vt)]) @ vt).T
        off = measured - (points - middles[0]) @ frame.T - middles[1]
        turned = frame @ rotation
        jacobian = np.concatenate(
            [turned - turned.mean(axis=0), -np.cross(np.eye(3)[None], ((points - middles[0]) @ frame.T)[:, None], axis=2)],
            axis=2,
        )
        step, *_ = np.linalg.lstsq(jacobian.reshape(-1, 6), off.reshape(-1), rcond=None)
        target = target + step[:3]
    rmse = np.sqrt((off**2).sum() / len(off))
    assert float(stated[1]) == pytest.approx(rmse, rel=2e-3), (stated[0], rmse)
    # What the whole model is off by is another number: causes make most of it.
    assert rmse > 1.5 * found.held_out_rmse_mm


def test_yourdfpy_agrees(run, tmp_path):
    yourdfpy = pytest.importorskip("yourdfpy")
    model = tg.identify(simulated(tmp_path, "universal-robots-ur10"), "universal-robots-ur10").model
    path = tmp_path / "arm.urdf"
    path.write_text(exported(run, tmp_path, model, "urdf"), encoding="utf-8")
    arm = yourdfpy.URDF.load(str(path), load_meshes=False)
    q_deg = poses(20)
    ours = model.forward(q_deg)
    for q, place, rotation in zip(np.radians(q_deg), ours.position_mm, ours.rotation, strict=True):
        arm.update_cfg(q)
        theirs = arm.get_transform("tool0")
        assert np.abs(1000 * theirs[:3, 3] - place).max() < SAME_MM
        assert np.abs(theirs[:3, :3] - rotation).max() < 1e-12
