"""Robots from files of others."""

from pathlib import Path

import numpy as np
import pytest

import truegrind as tg

ARMS = Path(__file__).resolve().parents[2] / "crates" / "arm" / "tests" / "data"


def test_a_urdf_is_read_and_explained(tmp_path):
    arm = tg.Robot(ARMS / "tool-turned.urdf")
    assert np.allclose(arm.forward(np.zeros(6)).position_mm, [394, 0, 640], atol=1e-9)
    assert any("zero pose" in line for line in arm.understood)
    assert tg.Robot("abb-irb-120").understood == []
    (tmp_path / "arm.toml").write_text(arm.to_toml(), encoding="utf-8")
    q = np.random.default_rng(0).uniform(-90, 90, (50, 6))
    assert np.array_equal(tg.Robot(tmp_path / "arm.toml").forward(q).position_mm, arm.forward(q).position_mm)


def test_one_of_two_arms_is_chosen_by_its_links():
    with pytest.raises(tg.RobotError, match="2 arms of six joints") as raised:
        tg.Robot(ARMS / "two-arms.urdf")
    assert raised.value.expected == "one arm" and raised.value.file.endswith("two-arms.urdf")
    assert "truegrind.Robot(file, base=LINK, tip=LINK)" in str(raised.value)
    left = tg.Robot(ARMS / "two-arms.urdf", base="left_base_link", tip="left_tool0")
    assert np.allclose(left.forward(np.zeros(6)).position_mm, [394, 0, 640], atol=1e-9)
    with pytest.raises(tg.RobotError, match="seven_joint7"):
        tg.Robot(ARMS / "seven.urdf")
    with pytest.raises(tg.ArgumentError, match="are for files"):
        tg.Robot("abb-irb-120", tip="tool0")
