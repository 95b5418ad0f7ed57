"""Arms that others published, against a product of transforms of the tests' own and against yourdfpy: none is in the repository.

``pip install --no-deps rtb-data example-robot-data`` brings them (files of the Robotics Toolbox, MIT, and of Gepetto, BSD); without them
the tests are skipped. What is compared is the flange for angles of the file, seen from one base that is the same for all angles."""

from __future__ import annotations

import importlib.util
import re
import sys
from pathlib import Path

import numpy as np
import pytest

import truegrind as tg

from urdf import Urdf

SAME_MM = 1e-9
SAME_TURN = 1e-12

TOOLBOX, EXAMPLES = "rtbdata/xacro", "cmeel.prefix/share/example-robot-data/robots"

# Where a gripper hangs behind the flange, or several links, the tip has to be said.
FILES = {
    f"{TOOLBOX}/abb_irb140_description/urdf/irb140.urdf": {},
    f"{TOOLBOX}/abb_irb140_description/urdf/irb140QT.urdf": {},
    f"{TOOLBOX}/kuka_description/kuka_kr16/urdf/kr16_2.urdf": {},
    f"{TOOLBOX}/kuka_description/kuka_kr120/urdf/kr120r2500pro.urdf": {},
    f"{TOOLBOX}/kuka_description/kuka_kr210/urdf/kr210l150.urdf": {},
    f"{TOOLBOX}/unimation_puma560_description/urdf/puma560_robot.urdf": {},
    f"{EXAMPLES}/ur_description/urdf/ur3_robot.urdf": {},
    f"{EXAMPLES}/ur_description/urdf/ur3_joint_limited_robot.urdf": {},
    f"{EXAMPLES}/ur_description/urdf/ur3_gripper.urdf": {},
    f"{EXAMPLES}/ur_description/urdf/ur5_robot.urdf": {},
    f"{EXAMPLES}/ur_description/urdf/ur5_joint_limited_robot.urdf": {},
    f"{EXAMPLES}/ur_description/urdf/ur5_gripper.urdf": {},
    f"{EXAMPLES}/ur_description/urdf/ur10_robot.urdf": {},
    f"{EXAMPLES}/ur_description/urdf/ur10_joint_limited_robot.urdf": {},
    f"{EXAMPLES}/kinova_description/robots/kinova.urdf": {"tip": "j2s6s200_end_effector"},
    f"{EXAMPLES}/so_arm_description/urdf/so100.urdf": {},
    f"{EXAMPLES}/so_arm_description/urdf/so101.urdf": {},
    f"{EXAMPLES}/z1_description/urdf/z1.urdf": {"tip": "link06"},
}

SEVEN = {
    f"{TOOLBOX}/kuka_description/kuka_lbr_iiwa/urdf/lbr_iiwa_14_r820.urdf": "7 joints .* joint_a7",
    f"{EXAMPLES}/panda_description/urdf/panda.urdf": "8 joints .* panda_joint7, panda_finger_joint",
    f"{EXAMPLES}/xarm_description/urdf/xarm7.urdf": "7 joints .* joint7",
}


def installed(file: str) -> Path:
    place = next((Path(folder) / file for folder in sys.path if (Path(folder) / file).is_file()), None)
    if place is None:
        pytest.skip("not here: pip install --no-deps rtb-data example-robot-data")
    return place


def agree(theirs: tuple[np.ndarray, np.ndarray], ours: tg.Poses) -> None:
    """Places and turns of both, seen from the base that the first pose tells."""
    place, rotation = theirs
    turned = rotation[0] @ ours.rotation[0].T
    at = place[0] - turned @ ours.position_mm[0]
    assert np.linalg.norm(ours.position_mm @ turned.T + at - place, axis=1).max() < SAME_MM
    assert np.abs(turned @ ours.rotation - rotation).max() < SAME_TURN


@pytest.mark.parametrize("file", FILES)
def test_a_published_arm_is_the_arm_of_other_readers(file):
    path = installed(file)
    arm = tg.Robot(path, **FILES[file])
    links = re.search(r"from link (\S+) to link (\S+?)[,:;.]?(?:\s|$)", "\n".join(arm.understood))
    assert links, arm.understood
    base, tip = links.groups()
    q_deg = np.random.default_rng(7).uniform(-180, 180, (100, 6))
    q_deg[0] = 0
    ours = arm.forward(q_deg)
    text = path.read_text(encoding="utf-8")
    chain = Urdf(text, tip, base)
    agree(chain.forward(np.radians(q_deg)), ours)
    if importlib.util.find_spec("yourdfpy") is None:
        return
    import yourdfpy

    theirs = yourdfpy.URDF.load(str(path), load_meshes=False)
    place, rotation = np.empty((len(q_deg), 3)), np.empty((len(q_deg), 3, 3))
    for row, q_rad in enumerate(np.radians(q_deg)):
        theirs.update_cfg(dict(zip(chain.names, q_rad, strict=True)))
        pose = theirs.get_transform(tip, base)
        place[row], rotation[row] = 1000 * pose[:3, 3], pose[:3, :3]
    agree((place, rotation), ours)


@pytest.mark.parametrize("file", SEVEN)
def test_more_joints_are_refused_by_name(file):
    path = installed(file)
    with pytest.raises(tg.RobotError, match=SEVEN[file]):
        tg.Robot(path)
