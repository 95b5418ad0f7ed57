//! How far planned rows part a finding and its rivals: whether they will decide between them.
//!
//! Method: with v the whitened readings that a cause makes, R the columns of another and X those of geometry and frames in units of their priors,
//! the rows leave λ = min |v − R b − X g|² + |g|² over b and g between the two: the non-centrality with which the rows tell the first from the
//! second, if the first is true (Kay 1998, Fundamentals of Statistical Signal Processing II, section 7.7). The finding is as large as it was found;
//! a rival imitates it as well as it can, and is seen as well: it explained the same readings. Any of them may be true, so the two that are most
//! alike decide.

use nalgebra::{Cholesky, DMatrix, DVector};

use super::options::Options;
use super::questions::{CandidateCause, Question, effects_of};
use super::rows::jacobian;
use super::setup::MeasurementSetup;
use truegrind_arm::model::Model;
use truegrind_arm::parameter::Parameter;
use truegrind_calibration::diagnosis::cause_kind::CauseKind;
use truegrind_calibration::identification::calibration::Frames;
use truegrind_calibration::measurement::dataset::Row;
use truegrind_calibration::measurement::sensor::disturbance::{Disturbance, Kind, Profile};
use truegrind_calibration::measurement::sensor::empirical::{EmpiricalFault, Overturning};

/// Non-centrality from which rows decide. In simulated runs of an IRB 120 with a compliant joint 2, told from a bending of link 2, the cause was
/// identified after the rows of the plan in 0 of 4 at λ = 3, in 1 of 4 at 8 and in 4 of 4 at 18 to 20.
pub const DECIDES: f64 = 16.0;

/// How far the rows of a plan part a finding and its rivals.
#[derive(Debug, Clone, PartialEq)]
pub struct Parting {
    /// The finding.
    pub finding: CandidateCause,
    /// The two of them that are most alike: the one that is true, and the one that it is told from.
    pub alike: [CandidateCause; 2],
    /// Non-centrality of the first with the second in the model.
    pub lambda: f64,
    /// That of the finding without any rival: how well the rows show it at all.
    pub alone: f64,
    /// That of the two that are most alike with the rated load on the flange in every second row, where the load is known.
    pub with_load: Option<Load>,
    /// Rivals that rows do not decide on, or whose readings are not computed.
    pub not_computed: Vec<CauseKind>,
}

/// What a load on the flange would change.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Load {
    /// The load (kg).
    pub kg: f64,
    /// Non-centrality with it.
    pub lambda: f64,
}

impl Parting {
    /// Whether the rows will decide.
    pub fn decides(&self) -> bool {
        self.lambda >= DECIDES
    }

    /// How many times as many rows would decide.
    pub fn times_as_many(&self) -> f64 {
        DECIDES / self.lambda
    }
}

/// The two most alike of a finding and its rivals, and their λ at `rows`; `None` where the finding has no size, or no rival is computed.
pub(super) fn parting(
    setup: &MeasurementSetup<'_>,
    parameters: &[Parameter],
    rows: &[Row],
    question: &Question,
    options: &Options,
) -> Option<Parting> {
    let [finding, rivals @ ..] = question.causes.as_slice() else { return None };
    let size = question.size.as_ref()?;
    let parts = |rows: &[Row]| -> Option<Parts> {
        let geometry = geometry(setup, parameters, rows, options);
        let shown = shown(setup, rows, finding, size, options)?;
        let alone = Fit::of(&shown, &geometry, None)?.left;
        let of = |rival: &CandidateCause| Some((rival.clone(), columns_of(setup, rows, rival, options)?));
        let computed: Vec<(CandidateCause, DMatrix<f64>)> =
            std::iter::once(finding).chain(rivals).filter_map(of).collect();
        let mut nearest: Option<([CandidateCause; 2], f64)> = None;
        for (place, (truth, own)) in computed.iter().enumerate() {
            let mut readings = shown.clone();
            if place > 0 {
                readings = Fit::of(&shown, &geometry, Some(own))?.by_rival;
                let seen = Fit::of(&readings, &geometry, None)?.left;
                // What does not imitate it at all is no rival in these rows.
                if !(seen > UNSEEN * alone) {
                    continue;
                }
                readings *= (alone / seen).sqrt();
            }
            for (other, columns) in computed.iter().filter(|(other, _)| other != truth) {
                let lambda = Fit::of(&readings, &geometry, Some(columns))?.left;
                if nearest.as_ref().is_none_or(|(_, least)| lambda < *least) {
                    nearest = Some(([truth.clone(), other.clone()], lambda));
                }
            }
        }
        Some(Parts {
            nearest: nearest?,
            alone,
            computed: computed.into_iter().map(|(cause, _)| cause).collect(),
        })
    };
    let Parts { nearest: (alike, lambda), alone, computed } = parts(rows)?;
    let not_computed =
        rivals.iter().filter(|rival| !computed.contains(rival)).map(|rival| rival.effect).collect();
    let with_load = options.rated_load_kg.and_then(|kg| {
        let mut loaded = rows.to_vec();
        for row in loaded.iter_mut().step_by(2) {
            let mut condition = *row.condition;
            condition.payload_kg = Some(kg);
            row.condition = condition.into();
        }
        Some(Load { kg, lambda: parts(&loaded)?.nearest.1 })
    });
    Some(Parting { finding: finding.clone(), alike, lambda, alone, with_load, not_computed })
}

/// What rows leave between causes.
struct Parts {
    /// The two most alike, and their λ.
    nearest: ([CandidateCause; 2], f64),
    alone: f64,
    /// The causes whose readings are computed.
    computed: Vec<CandidateCause>,
}

/// The whitened readings that the effects of the finding make at their size.
fn shown(
    setup: &MeasurementSetup<'_>,
    rows: &[Row],
    finding: &CandidateCause,
    size: &[f64],
    options: &Options,
) -> Option<DVector<f64>> {
    let columns = columns_of(setup, rows, finding, options)?;
    (columns.ncols() == size.len()).then(|| columns * DVector::from_column_slice(size))
}

/// The columns of a cause; `None` where its readings are not computed.
fn columns_of(
    setup: &MeasurementSetup<'_>,
    rows: &[Row],
    cause: &CandidateCause,
    options: &Options,
) -> Option<DMatrix<f64>> {
    if cause.effect == CauseKind::BaseTilt {
        return Some(base_tilt(setup, rows, options));
    }
    let effects = effects_of(cause);
    let model = Model { effects, ..setup.nominal.clone() };
    let own: Vec<Parameter> = (0..model.effects.len())
        .flat_map(|index| {
            let count = model.effects[index].parameters().len();
            (0..count).map(move |parameter| Parameter::Effect { index, parameter })
        })
        .collect();
    (!own.is_empty()).then(|| jacobian(setup, &model, &own, rows, options).0)
}

/// The columns of a base that tilts about any horizontal axis through its origin. One that tilted about an axis above, at the height of joint 2,
/// would be a compliance of that joint; no pedestal does.
fn base_tilt(setup: &MeasurementSetup<'_>, rows: &[Row], options: &Options) -> DMatrix<f64> {
    let across = match setup.nominal.gravity.iamax() {
        0 => [1, 2],
        1 => [0, 2],
        _ => [0, 1],
    };
    let load = if setup.nominal.bodies.is_some() { Overturning::Masses } else { Overturning::Lumps };
    let fault = EmpiricalFault::BaseTilt { load, axes: Some(across), deep: false };
    let tilt = Disturbance::new(Kind::Empirical(fault), Profile::Constant);
    let index = setup.frames.disturbances.len();
    let own: Vec<Parameter> =
        (0..tilt.values.len()).map(|parameter| Parameter::Disturbance { index, parameter }).collect();
    let mut frames: Frames = setup.frames.clone();
    frames.disturbances.push(tilt);
    let tilted = MeasurementSetup { frames: &frames, ..setup.clone() };
    jacobian(&tilted, setup.nominal, &own, rows, options).0
}

/// The columns of geometry and frames in units of their priors.
fn geometry(
    setup: &MeasurementSetup<'_>,
    parameters: &[Parameter],
    rows: &[Row],
    options: &Options,
) -> DMatrix<f64> {
    let (mut columns, scale) = jacobian(setup, setup.nominal, parameters, rows, options);
    columns.column_iter_mut().zip(scale).for_each(|(mut column, scale)| column *= scale);
    columns
}

/// Readings fitted by geometry and frames with priors of unit width, and by a rival without any.
struct Fit {
    /// What remains, with the priors.
    left: f64,
    /// What the rival makes of the readings.
    by_rival: DVector<f64>,
}

impl Fit {
    fn of(shown: &DVector<f64>, geometry: &DMatrix<f64>, rival: Option<&DMatrix<f64>>) -> Option<Self> {
        let (p, q) = (geometry.ncols(), rival.map_or(0, DMatrix::ncols));
        let mut all = DMatrix::zeros(geometry.nrows(), p + q);
        all.columns_mut(0, p).copy_from(geometry);
        for (k, column) in rival.iter().flat_map(|own| own.column_iter()).enumerate() {
            let length = column.norm();
            if length > 0.0 {
                all.column_mut(p + k).copy_from(&(column * (FREE * shown.norm() / length)));
            }
        }
        let factor = Cholesky::new(DMatrix::identity(p + q, p + q) + all.tr_mul(&all))?;
        let along = all.tr_mul(shown);
        let fitted = factor.solve(&along);
        let left = shown.norm_squared() - along.dot(&fitted);
        let by_rival = all.columns(p, q) * fitted.rows(p, q);
        left.is_finite().then(|| Self { left: left.max(0.0), by_rival })
    }
}

/// Share of what is seen of the finding from which a rival imitates anything of it.
const UNSEEN: f64 = 1e-6;

/// A rival may be so many times as large as what it is to imitate.
const FREE: f64 = 100.0;
