//! Information of readings: the whitened Jacobian of a calibration at planned rows, in units of the priors.
//!
//! Column k of row i is ∂rᵢ/∂xₖ · sₖ / σ, with σ the noise of the reading and sₖ the prior's standard deviation: a row of
//! length 1 holds as much information about its combination of parameters as the prior, and the normal matrix with all
//! priors is I + Σ xᵢ xᵢᵀ.

use nalgebra::{Cholesky, DMatrix};

use super::options::Options;
use super::questions::{Question, columns_of};
use super::setup::MeasurementSetup;
use truegrind_arm::condition::Condition;
use truegrind_arm::model::Model;
use truegrind_arm::parameter::Parameter;
use truegrind_calibration::identification::calibration::{CalibrationProblem, Weight};
use truegrind_calibration::measurement::dataset::{Dataset, Row, Sensor};
use truegrind_calibration::measurement::sensor::Rig;
use truegrind_estimation::problem::Problem;

pub use super::options::Noise;

/// Whitened Jacobian of a list of rows.
#[derive(Debug, Clone, PartialEq)]
pub struct ReadingJacobian {
    /// p × (rows · scalars per row): one column for each scalar reading.
    pub readings: DMatrix<f64>,
    /// Scalar readings of a row.
    pub per_row: usize,
    /// The parameters, in the order of the rows of `readings`.
    pub parameters: Vec<Parameter>,
    /// Prior standard deviation of each (mm, rad), by which its column was scaled.
    pub scale: Vec<f64>,
    /// Rows of `readings` that belong to the questions of a diagnosis; the rest is geometry.
    pub interest: Vec<usize>,
}

/// The sensor as defined in the simulator.
pub fn rig(setup: &MeasurementSetup<'_>) -> Rig {
    let frames = setup.frames;
    match setup.sensor {
        Sensor::Cable => Rig::Cable {
            outlets_mm: frames.outlets_mm.clone(),
            zeros_mm: frames.zeros_mm.clone(),
            hook_mm: frames.flange_from_target.translation.vector,
        },
        Sensor::Position => Rig::Position {
            base_from_sensor: frames.base_from_sensor,
            reflector_mm: frames.flange_from_target.translation.vector,
        },
        Sensor::Pose => Rig::Pose {
            base_from_sensor: frames.base_from_sensor,
            flange_from_target: frames.flange_from_target,
        },
    }
}

/// Whitened Jacobian, one row per scalar reading, and the priors of its columns. `rows` need no readings; nominal ones are
/// inserted.
pub(super) fn jacobian(
    setup: &MeasurementSetup<'_>,
    model: &Model,
    parameters: &[Parameter],
    rows: &[Row],
    options: &Options,
) -> (DMatrix<f64>, Vec<f64>) {
    let rig = rig(setup);
    let posed = setup.nominal.at_condition(&Condition::default());
    let rows: Vec<Row> = rows
        .iter()
        .map(|row| {
            let flange = posed.forward(&row.joints);
            let reading = rig.predict(&flange, row.anchor).unwrap_or_else(|| row.reading.clone());
            Row { reading, ..row.clone() }
        })
        .collect();
    let noise = &options.noise;
    let weight = Weight { per_mm: 1.0 / noise.reading_mm, per_rad: 1.0 / noise.reading_rad };
    let weights = vec![weight; rows.len()];
    let priors = options.tolerance.priors(parameters, model);
    let dataset = Dataset::new("plan", setup.sensor, rows);
    let problem = CalibrationProblem::new(&dataset, model, setup.frames, parameters, &priors, &weights);
    let count = problem.rows();
    let mut residuals = vec![0.0; count];
    let mut columns = vec![0.0; count * parameters.len()];
    problem.jacobian(&vec![0.0; parameters.len()], 0..count, &mut residuals, &mut columns);
    let scale = priors.iter().map(|prior| prior.sigma).collect();
    (DMatrix::from_vec(count, parameters.len(), columns), scale)
}

/// Whitened Jacobian of rows for the geometry and for the parameters of `questions`.
pub(super) fn reading_jacobian(
    setup: &MeasurementSetup<'_>,
    parameters: &[Parameter],
    rows: &[Row],
    questions: &[Question],
    options: &Options,
) -> ReadingJacobian {
    let (effects, frame_part) = columns_of(questions);
    let model = Model { effects, ..setup.nominal.clone() };
    let mut all = parameters.to_vec();
    for (index, effect) in model.effects.iter().enumerate() {
        let count = effect.parameters().len();
        all.extend((0..count).map(|parameter| Parameter::Effect { index, parameter }));
    }
    let (mut jacobian, scale) = jacobian(setup, &model, &all, rows, options);
    for (mut column, scale) in jacobian.column_iter_mut().zip(&scale) {
        column *= *scale;
    }
    let interest = (0..all.len())
        .filter(|&k| k >= parameters.len() || frame_part.iter().any(|frame| frame.contains(&all[k])))
        .collect();
    let per_row = match setup.sensor {
        Sensor::Cable => 1,
        Sensor::Position => 3,
        Sensor::Pose => 6,
    };
    ReadingJacobian { readings: jacobian.transpose(), per_row, parameters: all, scale, interest }
}

impl ReadingJacobian {
    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.readings.ncols() / self.per_row
    }

    /// I + Σ x xᵀ over the readings of some rows.
    pub fn information(&self, rows: &[usize]) -> DMatrix<f64> {
        let p = self.readings.nrows();
        let mut taken = DMatrix::zeros(p, rows.len() * self.per_row);
        for (index, &row) in rows.iter().enumerate() {
            taken
                .columns_mut(index * self.per_row, self.per_row)
                .copy_from(&self.readings.columns(row * self.per_row, self.per_row));
        }
        DMatrix::identity(p, p) + &taken * taken.transpose()
    }

    /// Covariance of the parameters (mm, rad) for an information matrix; `None` if that is not positive definite.
    pub fn covariance(&self, information: &DMatrix<f64>) -> Option<DMatrix<f64>> {
        let inverse = Cholesky::new(information.clone())?.inverse();
        let p = inverse.nrows();
        let finite = inverse.iter().all(|v| v.is_finite());
        finite.then(|| DMatrix::from_fn(p, p, |i, j| inverse[(i, j)] * self.scale[i] * self.scale[j]))
    }

    /// Predicted standard deviation of each length or coordinate of some rows under the fitted parameters, root mean square, in units of
    /// the noise, which is stated for each, too: √ mean xᵀ M⁻¹ x. `None` if M is not positive definite.
    pub fn reading_sigma(&self, information: &DMatrix<f64>, rows: &[usize]) -> Option<f64> {
        let factor = Cholesky::new(information.clone())?;
        // Only the three coordinates of a pose, not its angles.
        let lengths = self.per_row.min(3);
        let sum: f64 = rows
            .iter()
            .map(|row| {
                let x = self.readings.columns(row * self.per_row, lengths).into_owned();
                x.component_mul(&factor.solve(&x)).sum()
            })
            .sum();
        Some((sum / (rows.len() * lengths).max(1) as f64).sqrt())
    }

    /// Standard deviation of every parameter after all rows are measured.
    pub fn sigmas(&self) -> Option<Vec<f64>> {
        let all: Vec<usize> = (0..self.rows()).collect();
        let covariance = self.covariance(&self.information(&all))?;
        Some(covariance.diagonal().iter().map(|v| v.max(0.0).sqrt()).collect())
    }
}
