//! Tests of `kinematics::batch`.

use nalgebra::Vector3;
use truegrind_arm::batch::{JointColumns, PoseColumns};
use truegrind_arm::condition::Condition;
use truegrind_arm::model::Joints;
use truegrind_math::lanes::{Instructions, with_instructions};
use truegrind_math::se3::{Pose, difference};

use super::arms::{SHEETS, generator, joints_within, perturbed, with_effects};

#[test]
fn columns_agree_with_rows_on_every_arm_and_length() {
    let condition = Condition { payload_kg: Some(3.0), time_h: Some(0.5), ..Condition::default() };
    let mut random = generator(61);
    let mut out = PoseColumns::default();
    for (k, sheet) in SHEETS.iter().enumerate() {
        let mut model = with_effects(&perturbed(&sheet.model(), &mut random, 1.0, 0.5), &mut random);
        if k % 2 == 0 {
            model.flange = Pose::new(Vector3::new(1.0, -2.0, 50.0), Vector3::new(0.2, 0.3, -1.0));
        }
        let posed = model.at_condition(&condition);
        // Lengths with and without a remainder, buffers growing and shrinking.
        for rows in [0, 1, 7, 8, 41] {
            let joints: Vec<Joints> = (0..rows).map(|_| joints_within(&model, &mut random)).collect();
            let columns: JointColumns = joints.iter().copied().collect();
            assert_eq!((columns.len(), columns.is_empty()), (rows, rows == 0));
            posed.forward_columns(&columns, &mut out);
            assert_eq!((out.len(), out.is_empty()), (rows, rows == 0));
            for (row, q) in joints.iter().enumerate() {
                let error = difference(&posed.forward(q), &out.pose(row));
                assert!(error.fixed_rows::<3>(0).amax() < 1e-11, "{}: {error}", sheet.name);
                assert!(error.fixed_rows::<3>(3).amax() < 1e-14, "{}: {error}", sheet.name);
            }
        }
    }
}

#[test]
fn a_lost_row_is_lost_alone() {
    let model = SHEETS[0].model();
    let posed = model.at_condition(&Condition::default());
    let mut joints = vec![Joints::repeat(0.3); 8];
    joints[3][2] = f64::NAN;
    let mut out = PoseColumns::default();
    posed.forward_columns(&joints.iter().copied().collect(), &mut out);
    let x = &out.position_mm[0];
    assert!(x[3].is_nan() && (0..8).all(|k| k == 3 || x[k] == x[0]));
}

/// Whatever travels together, and with whatever instructions: columns of every length hold the bits of each row alone.
#[test]
fn columns_have_the_same_bits_on_every_set_of_instructions() {
    let condition = Condition { payload_kg: Some(3.0), time_h: Some(0.5), ..Condition::default() };
    let mut random = generator(62);
    for sheet in SHEETS {
        let model = with_effects(&perturbed(&sheet.model(), &mut random, 1.0, 0.5), &mut random);
        let posed = model.at_condition(&condition);
        let rows: Vec<Joints> = (0..21).map(|_| joints_within(&model, &mut random)).collect();
        let found = |set, rows: &[Joints]| {
            let mut out = PoseColumns::default();
            let columns: JointColumns = rows.iter().copied().collect();
            with_instructions(set, || posed.forward_columns(&columns, &mut out));
            out
        };
        let together = found(Instructions::Scalar, &rows);
        for set in Instructions::available() {
            assert_eq!(found(set, &rows), together, "{}: {set:?}", sheet.name);
            let last = found(set, &rows[20..]);
            for (alone, column) in last.position_mm.iter().zip(&together.position_mm) {
                assert_eq!(alone[0].to_bits(), column[20].to_bits(), "{}: {set:?}", sheet.name);
            }
        }
    }
}
