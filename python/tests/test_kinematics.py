"""Forward and inverse map over arrays of any layout."""

import numpy as np
import pytest

import truegrind as tg

ARM = tg.Robot("abb-irb-120")


def angles(count: int) -> np.ndarray:
    low, high = ARM.min_deg, ARM.max_deg
    return np.random.default_rng(7).uniform(0.7 * low, 0.7 * high, (count, 6))


def test_the_picture_of_the_manual():
    pose = ARM.forward([0, 0, 0, 0, 0, 0])
    assert pose.position_mm.shape == (3,) and pose.rotation.shape == (3, 3)
    assert np.allclose(pose.position_mm, [374, 0, 630], atol=1e-9)
    assert np.allclose(pose.matrix[:3, 3], pose.position_mm)


@pytest.mark.parametrize("count", [0, 1, 7, 8, 513, 20_000])
def test_every_layout_gives_the_same_bits(count):
    """One row, many rows, rows by columns, every other row: block and thread borders change nothing."""
    q = angles(count)
    whole = ARM.forward(q)
    assert whole.position_mm.shape == (count, 3) and whole.rotation.shape == (count, 3, 3)
    for other in (np.asfortranarray(q), np.repeat(q, 2, axis=0)[::2], q[::-1][::-1]):
        again = ARM.forward(other)
        assert np.array_equal(again.position_mm, whole.position_mm)
        assert np.array_equal(again.rotation, whole.rotation)
    for row in list(range(0, count, 997))[:20]:
        one = ARM.forward(q[row])
        assert np.array_equal(one.position_mm, whole.position_mm[row])
        assert np.array_equal(one.rotation, whole.rotation[row])


def test_numbers_of_other_types_are_taken():
    q = np.array([[10, 20, -30, 40, 50, 60]])
    wanted = ARM.forward(q.astype(float)).position_mm
    packed = np.frombuffer(b"x" + q.astype(float).tobytes(), np.uint8)[1:].view(float).reshape(q.shape)
    frozen = q.astype(float)
    frozen.flags.writeable = False
    assert not packed.flags.aligned
    for other in (q, q.astype(np.float32), q.tolist(), q.astype(np.int16), q.astype(">f8"), q.astype(object), packed, frozen):
        assert np.array_equal(ARM.forward(other).position_mm, wanted)


def test_what_is_no_real_number_is_not_taken_for_one():
    for other in (np.zeros((2, 6), complex), np.full((2, 6), "1"), np.zeros((2, 6), "M8[s]"), [[1] * 6, [2] * 5]):
        with pytest.raises(tg.ArgumentError, match="expected an array of real numbers") as raised:
            ARM.forward(other)
        assert raised.value.column == "q_deg"
    # What a mask hides was not measured.
    hidden = np.ma.masked_array(np.zeros((2, 6)), mask=[[0] * 6, [0, 1, 0, 0, 0, 0]])
    assert np.isnan(ARM.forward(hidden).position_mm).any(axis=1).tolist() == [False, True]
    with pytest.raises(tg.DatasetError) as raised:
        tg.Dataset.from_numpy(hidden, length_mm=[500, 600])
    assert (raised.value.row, raised.value.column) == (1, "q2")


def test_the_inverse_comes_back():
    q = angles(500)
    poses = ARM.forward(q)
    near = q + np.random.default_rng(1).uniform(-3, 3, q.shape)
    found = ARM.inverse(poses.position_mm, poses.rotation, near)
    assert found.reached.all() and found.why == [None] * 500
    again = ARM.forward(found.q_deg)
    assert np.abs(again.position_mm - poses.position_mm).max() < 1e-8
    assert np.abs(again.rotation - poses.rotation).max() < 1e-11
    # Beside a singularity another solution may be as near.
    regular = np.abs(q[:, 4]) > 15
    assert regular.sum() > 300 and np.median(np.abs(found.q_deg - q)[regular].max(axis=1)) < 1e-9
    one = ARM.inverse(poses.position_mm[3], poses.rotation[3], q[3])
    assert one.q_deg.shape == (6,) and one.reached and one.why is None


def test_what_is_out_of_reach_is_said():
    far = ARM.forward(np.zeros((2, 6)))
    far.position_mm[1, 0] = 5000
    found = ARM.inverse(far.position_mm, far.rotation, np.zeros(6))
    assert found.reached.tolist() == [True, False]
    assert np.isnan(found.q_deg[1]).all() and "out of reach by" in found.why[1]
    with pytest.raises(tg.InverseError, match="out of reach by"):
        ARM.inverse(far.position_mm[1], far.rotation[1])


def test_the_estimated_arm_is_another(model):
    q = angles(100)
    off = np.linalg.norm(model.forward(q).position_mm - model.nominal.forward(q).position_mm, axis=1)
    assert 0.01 < off.mean() < 20
    assert np.array_equal(tg.forward(model, q).position_mm, model.forward(q).position_mm)
    found = model.inverse(*model.forward(q), near_deg=q)
    assert np.abs(model.forward(found.q_deg).position_mm - model.forward(q).position_mm).max() < 1e-8
    sigma = model.sigma_mm(q, [0, 0, 100])
    assert sigma.shape == (100,) and (sigma > 0).all()
    assert model.sigma_mm(q[4], [0, 0, 100]) == sigma[4]
    assert model.covariance.shape == (len(model.order),) * 2
    assert model.measured_at(q).dtype == bool


def test_a_load_moves_an_arm_that_yields():
    made = tg.simulate(
        """
robot = "abb-irb-120"
seed = 4
[[arm.effect]]
effect = "joint-compliance"
joint = 1
compliance_rad_per_nm = 1e-5
[poses]
kind = "random"
count = 30
[sensor]
kind = "position"
frame = { position_mm = [2000.0, -600.0, 500.0], wxyz = [1.0, 0.0, 0.0, 0.0] }
reflector_mm = [38.0, 12.0, 61.0]
[noise]
sigma_mm = 0.01
"""
    )
    q = [0, 30, 0, 0, 0, 0]
    light, heavy = made.actual.forward(q), made.actual.forward(q, payload_kg=3, payload_centre_mm=[0, 0, 50])
    assert 0.05 < light.position_mm[2] - heavy.position_mm[2] < 5
    assert made.dataset.sensor == "position" and len(made.dataset) == 30
    assert made.dataset.position_mm.shape == (30, 3) and made.dataset.length_mm is None
