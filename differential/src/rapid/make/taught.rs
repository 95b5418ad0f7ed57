//! Tools and objects that were taught with the arm as it is, so that they are told where the data sheet puts them.

use std::fmt::Write;

use nalgebra::{DMatrix, DVector, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};
use rand::RngExt;

use super::{Made, Maker};
use crate::arm::{Circumstance, Pose};

fn joints_text(all: &[[f64; 6]]) -> String {
    let rows: Vec<String> = all.iter().map(|q| format!("{:?}", q.map(f64::to_degrees))).collect();
    format!("[{}]", rows.join(", "))
}

impl Maker<'_> {
    /// Teaches an object, a tool, or both.
    pub(super) fn teach(&mut self, made: &mut Made) {
        let which = self.rng.random_range(0..3);
        if which != 0 {
            self.teach_tool(made);
        }
        if which != 1 {
            self.teach_object(made);
        }
    }

    /// The object `wPart` is taught with the pointer `tSmall`, which is what it is told to be.
    fn teach_object(&mut self, made: &mut Made) {
        let at = Circumstance::default();
        let pointer = self.tools[2].frame;
        let tip = self.arm.actual_forward(&self.base, &at) * pointer;
        let corner = Point3::from(tip.translation.vector) - Vector3::new(30.0, 20.0, 10.0);
        let real = Pose::from_parts(Translation3::from(corner.coords), self.small_turn(15.0));
        let mut joints = Vec::new();
        for point in [[15.0, 0.0, 0.0], [95.0, 0.0, 0.0], [0.0, 70.0, 0.0]] {
            let touch =
                Pose::from_parts(Translation3::from((real * Point3::from(point)).coords), tip.rotation);
            match self.arm.actual_inverse(&(touch * pointer.inverse()), &self.base, &at) {
                Some(q) => joints.push(q),
                None => return,
            }
        }
        let told: Vec<Vector3<f64>> =
            joints.iter().map(|q| (self.arm.nominal_forward(q) * pointer).translation.vector).collect();
        let x = (told[1] - told[0]).normalize();
        let origin = told[0] + x * x.dot(&(told[2] - told[0]));
        let y = (told[2] - origin).normalize();
        let turn = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[x, y, x.cross(&y)]));
        let told = Pose::from_parts(Translation3::from(origin), UnitQuaternion::from_rotation_matrix(&turn));
        self.objects[1].user = self.rounded(&told, [6, 9]);
        self.objects[1].object = Pose::identity();
        made.real_objects.push(("wpart".into(), real, Pose::identity()));
        let _ = write!(
            made.cell,
            "[[wobj]]\nname = \"wPart\"\norigin = \"taught\"\ntaught_with = \"tSmall\"\nteaching_deg = {}\n",
            joints_text(&joints)
        );
    }

    /// The tip of `tGrind` is taught at one point.
    fn teach_tool(&mut self, made: &mut Made) {
        let at = Circumstance::default();
        let real = self.tools[1].frame;
        let point = (self.arm.actual_forward(&self.base, &at) * real).translation;
        let around = self.arm.actual_forward(&self.base, &at).rotation * real.rotation;
        let mut joints = Vec::new();
        for k in 0..6 {
            let mut lean = [0.0; 3];
            lean[k / 2] = if k % 2 == 0 { 0.3 } else { -0.3 };
            let touch = Pose::from_parts(point, around * UnitQuaternion::from_scaled_axis(lean.into()));
            match self.arm.actual_inverse(&(touch * real.inverse()), &self.base, &at) {
                Some(q) => joints.push(q),
                None => return,
            }
        }
        // R t + p is one point for all poses: t by least squares.
        let mut rows = DMatrix::zeros(3 * joints.len(), 6);
        let mut right = DVector::zeros(3 * joints.len());
        for (k, q) in joints.iter().enumerate() {
            let flange = self.arm.nominal_forward(q);
            rows.view_mut((3 * k, 0), (3, 3)).copy_from(flange.rotation.to_rotation_matrix().matrix());
            rows.view_mut((3 * k, 3), (3, 3)).copy_from(&-Matrix3::<f64>::identity());
            right.rows_mut(3 * k, 3).copy_from(&-flange.translation.vector);
        }
        // The least squares by their normal equations: singular vectors are not exact where singular values coincide.
        let Some(square) = rows.tr_mul(&rows).cholesky() else { return };
        let found = square.solve(&rows.tr_mul(&right));
        let tip = Translation3::new(found[0], found[1], found[2]);
        self.tools[1].frame = self.rounded(&Pose::from_parts(tip, real.rotation), [6, 9]);
        made.real_tools.push(("tgrind".into(), real));
        let _ = write!(
            made.cell,
            "[[tool]]\nname = \"tGrind\"\norigin = \"taught\"\nteaching_deg = {}\n",
            joints_text(&joints)
        );
    }
}
