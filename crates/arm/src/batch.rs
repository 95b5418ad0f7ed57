//! Forward kinematics of many rows at once, in columns.
//!
//! Method: the kernels of [`chain`](super::chain) and of the effects on as many rows as a register holds, compiled for the
//! widest vector instructions that the machine has. No allocation once the buffers have their size.
//! Shapes: one column per joint in, twelve columns out (position and the three axes of the flange).
//! Checked against: [`PreparedModel::forward`], row by row.

use super::chain::FrameColumns;
use super::model::PreparedModel;
use crate::joints::Joints;
use truegrind_math::lanes::{AnyWidth, Real, SinCos, WIDTH, aligned, vectorised};
use truegrind_math::se3::{Pose, rotation_from_matrix};

/// Controller angles of many rows (rad), one column per joint.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct JointColumns {
    /// The columns, all of one length.
    pub angle_rad: [Vec<f64>; 6],
}

impl FromIterator<Joints> for JointColumns {
    fn from_iter<I: IntoIterator<Item = Joints>>(rows: I) -> Self {
        let rows = rows.into_iter();
        let least = rows.size_hint().0;
        let mut out = Self { angle_rad: std::array::from_fn(|_| Vec::with_capacity(least)) };
        for row in rows {
            for (column, angle) in out.angle_rad.iter_mut().zip(row.iter()) {
                column.push(*angle);
            }
        }
        out
    }
}

impl JointColumns {
    /// Number of rows: the length of the shortest column.
    pub fn len(&self) -> usize {
        self.angle_rad.iter().map(Vec::len).min().unwrap_or(0)
    }

    /// Whether there is no row.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// Poses of the flange in the base of many rows, one column per number.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PoseColumns {
    /// x, y and z of the origin (mm).
    pub position_mm: [Vec<f64>; 3],
    /// Rotation matrix, column by column: x axis (x, y, z), y axis, z axis.
    pub axes: [Vec<f64>; 9],
}

impl PoseColumns {
    /// Number of rows.
    pub fn len(&self) -> usize {
        self.position_mm[0].len()
    }

    /// Whether there is no row.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// One row as a pose.
    pub fn pose(&self, row: usize) -> Pose {
        let position = nalgebra::Vector3::from_fn(|k, _| self.position_mm[k][row]);
        let matrix = nalgebra::Matrix3::from_fn(|i, j| self.axes[3 * j + i][row]);
        Pose::from_parts(position.into(), rotation_from_matrix(&matrix))
    }

    fn resize(&mut self, rows: usize) {
        for column in self.position_mm.iter_mut().chain(&mut self.axes) {
            column.resize(rows, 0.0);
        }
    }
}

impl PreparedModel<'_> {
    /// Poses of the flange for all rows of `joints`. `out` takes their number and keeps its buffers.
    pub fn forward_columns(&self, joints: &JointColumns, out: &mut PoseColumns) {
        let rows = joints.len();
        out.resize(rows);
        let flange = self.flange_columns();
        if self.moves_links() {
            vectorised(Forward::<true> { arm: self, flange, joints, out });
        } else {
            vectorised(Forward::<false> { arm: self, flange, joints, out });
        }
    }

    /// Poses of the flange for many joint vectors.
    ///
    /// ```
    /// use truegrind_arm::condition::Condition;
    /// use truegrind_arm::model::Joints;
    /// use truegrind_arm::robots;
    ///
    /// let arm = robots::load("abb-irb-120")?.model;
    /// let still = Condition::default();
    /// let ready = arm.at_condition(&still);
    /// let rows: Vec<Joints> = (0..20).map(|k| Joints::repeat(0.05 * f64::from(k))).collect();
    /// let poses = ready.forward_many(&rows);
    /// for (q, pose) in rows.iter().zip(&poses) {
    ///     assert!((ready.forward(q).translation.vector - pose.translation.vector).norm() < 1e-9);
    /// }
    /// # Ok::<(), robots::RobotError>(())
    /// ```
    pub fn forward_many(&self, joints: &[Joints]) -> Vec<Pose> {
        let flange = self.flange_columns();
        let mut out = Vec::with_capacity(joints.len());
        for block in joints.chunks(WIDTH) {
            let joints = std::array::from_fn(|j| std::array::from_fn(|k| block[k.min(block.len() - 1)][j]));
            let flange = &flange;
            let poses = if self.moves_links() {
                vectorised(ForwardBlock::<true> { arm: self, flange, joints })
            } else {
                vectorised(ForwardBlock::<false> { arm: self, flange, joints })
            };
            out.extend((0..block.len()).map(|k| {
                let position = nalgebra::Vector3::from_fn(|i, _| poses.origin[i][k]);
                let matrix = nalgebra::Matrix3::from_fn(|i, j| poses.axes[j][i][k]);
                Pose::from_parts(position.into(), rotation_from_matrix(&matrix))
            }));
        }
        out
    }

    /// The flange in the last frame; absent where it is that frame.
    fn flange_columns(&self) -> Option<FrameColumns<f64>> {
        let turn = self.model.flange.rotation.to_rotation_matrix();
        let flange = FrameColumns {
            axes: std::array::from_fn(|j| std::array::from_fn(|i| turn[(i, j)])),
            origin: self.model.flange.translation.vector.into(),
        };
        (self.model.flange != Pose::identity()).then_some(flange)
    }
}

/// [`PreparedModel::forward_columns`], its buffers of the right size; no flange where it is the last frame.
struct Forward<'a, const MOVES: bool> {
    arm: &'a PreparedModel<'a>,
    flange: Option<FrameColumns<f64>>,
    joints: &'a JointColumns,
    out: &'a mut PoseColumns,
}

impl<const MOVES: bool> AnyWidth for Forward<'_, MOVES> {
    type Output = ();

    #[cfg_attr(not(debug_assertions), inline(always))]
    fn run<R: SinCos>(self, like: R) {
        let Self { arm, flange, joints, out } = self;
        let rows = joints.len();
        // The first rows once more with those that follow, so that the rest is written to whole lines of the cache.
        let second = match aligned(&out.position_mm[0]) % R::ROWS {
            0 => R::ROWS,
            head => head,
        };
        let (mut from, mut following) = (0, second);
        let mut next = angles(like, joints, 0);
        while from < rows {
            // The next rows are on their way from memory while these are worked on.
            let angle = next;
            if following < rows {
                next = angles(like, joints, following);
            }
            let end = flange_frame::<R, MOVES>(arm, &flange, &angle);
            for k in 0..3 {
                end.origin[k].store(&mut out.position_mm[k], from);
                for j in 0..3 {
                    end.axes[j][k].store(&mut out.axes[3 * j + k], from);
                }
            }
            (from, following) = (following, following + R::ROWS);
        }
    }
}

/// Eight rows' numbers side by side.
type Eight = [f64; WIDTH];

/// [`PreparedModel::forward_many`] of eight rows.
struct ForwardBlock<'a, const MOVES: bool> {
    arm: &'a PreparedModel<'a>,
    flange: &'a Option<FrameColumns<f64>>,
    joints: [Eight; 6],
}

impl<const MOVES: bool> AnyWidth for ForwardBlock<'_, MOVES> {
    type Output = FrameColumns<Eight>;

    #[cfg_attr(not(debug_assertions), inline(always))]
    fn run<R: SinCos>(self, like: R) -> FrameColumns<Eight> {
        let mut out = FrameColumns { axes: [[[0.0; WIDTH]; 3]; 3], origin: [[0.0; WIDTH]; 3] };
        for from in (0..WIDTH).step_by(R::ROWS) {
            let mut angle = [like; 6];
            for j in 0..6 {
                angle[j] = like.load(&self.joints[j], from);
            }
            let end = flange_frame::<R, MOVES>(self.arm, self.flange, &angle);
            for k in 0..3 {
                end.origin[k].store(&mut out.origin[k], from);
                for j in 0..3 {
                    end.axes[j][k].store(&mut out.axes[j][k], from);
                }
            }
        }
        out
    }
}

/// The flange in the base.
#[cfg_attr(not(debug_assertions), inline(always))]
fn flange_frame<R: SinCos, const MOVES: bool>(
    arm: &PreparedModel<'_>,
    flange: &Option<FrameColumns<f64>>,
    angle: &[R; 6],
) -> FrameColumns<R> {
    let end = arm.last_frame_of::<R, MOVES>(angle);
    match flange {
        Some(flange) => end.compose(flange),
        None => end,
    }
}

#[inline(always)]
fn angles<R: Real>(like: R, joints: &JointColumns, from: usize) -> [R; 6] {
    let mut out = [like; 6];
    for j in 0..6 {
        out[j] = like.load(&joints.angle_rad[j], from);
    }
    out
}
