//! Power analysis: smallest size of each effect that a measurement detects.
//!
//! Method: with X the whitened Jacobian of geometry and frames in units of the priors, and R the whitened columns of an
//! effect per unit of its parameters, S = RᵀR − RᵀX (I + XᵀX)⁻¹ XᵀR is the information about the effect that geometry
//! cannot imitate. An effect with parameters a has non-centrality λ = aᵀ S a; the smallest size that reaches λ even in its
//! worst direction (phase, axis) is |a|² = λ / smallest eigenvalue of S.
//! Source: the non-central χ² of a likelihood ratio between nested linear models (Kay 1998, Fundamentals of Statistical
//! Signal Processing II, section 7.7).
//! Checked against: the drop of the fitted cost when the effect is added to simulated readings.

use nalgebra::{Cholesky, DMatrix};

use super::options::Options;
use super::questions::{CandidateCause, coupling, effects_of, harmonic, thermal};
use super::rows::{jacobian, rig};
use super::setup::MeasurementSetup;
use truegrind_arm::condition::Condition;
use truegrind_arm::effect::Effect;
use truegrind_arm::model::Model;
use truegrind_arm::parameter::Parameter;
use truegrind_calibration::diagnosis::cause_kind::CauseKind;
use truegrind_calibration::measurement::dataset::{Row, Sensor};
use truegrind_math::spectral;

/// Smallest detectable size of an effect.
#[derive(Debug, Clone, PartialEq)]
pub struct Detectability {
    /// The kind of effect.
    pub effect: CauseKind,
    /// Instance: joint, order, cable.
    pub which: String,
    /// Joint, 0-based.
    pub joint: Option<usize>,
    /// Smallest detectable size, in `unit`; absent if no plausible size is detectable.
    pub smallest: Option<f64>,
    /// Unit of `smallest`.
    pub unit: &'static str,
    /// Largest influence of that size over the rows, in `shows_unit`.
    pub shows: Option<f64>,
    /// Unit of `shows` and `usual`: ° in a joint, mm at a sensor.
    pub shows_unit: &'static str,
    /// Typical influence in practice, for comparison with `shows`.
    pub usual: f64,
}

impl Detectability {
    /// Whether an effect of typical size is detected.
    pub fn is_decided(&self) -> bool {
        self.shows.is_some_and(|shows| shows <= self.usual)
    }
}

/// Typical sizes in practice: degrees in a joint, millimetres at a sensor, growth of links in mm over a metre.
const USUAL_DEG: f64 = 0.05;
const USUAL_MM: f64 = 0.3;

/// A larger size is physically implausible (° or mm); the effect then counts as undetectable.
const ABSURD: f64 = 20.0;

/// A softer joint is no joint of an industrial arm [rad/(N m)]: a compliance that shows only there is undetectable.
const SOFTEST: f64 = 1e-2;

/// A shift needs so many times the non-centrality of an effect that is there throughout: it has three parameters, and where it begins is
/// searched for. In simulated runs (IRB 120 and a tracker) 2 of 40 were found at λ = 25, 10 of 40 at 56, 15 of 16 at 100.
const OF_SHIFTS: f64 = 4.0;

/// One effect, as columns.
struct EffectColumns {
    effect: CauseKind,
    which: String,
    joint: Option<usize>,
    unit: &'static str,
    shows_unit: &'static str,
    usual: f64,
    /// Factor from the parameters' unit to `unit`.
    to_unit: f64,
    /// Factor from the parameters' unit to `shows_unit`.
    to_shows: f64,
    columns: DMatrix<f64>,
}

/// Power of every effect of the catalogue for the planned rows.
pub(super) fn detectability(
    setup: &MeasurementSetup<'_>,
    parameters: &[Parameter],
    rows: &[Row],
    options: &Options,
) -> Vec<Detectability> {
    let (raw, scale) = jacobian(setup, setup.nominal, parameters, rows, options);
    let mut x = raw.clone();
    for (mut column, scale) in x.column_iter_mut().zip(&scale) {
        column *= *scale;
    }
    let p = x.ncols();
    let Some(factor) = Cholesky::new(DMatrix::identity(p, p) + x.tr_mul(&x)) else { return Vec::new() };
    let mut asked = of_arm(setup, rows, options);
    asked.extend(of_sensor(setup, parameters, rows, &raw, options));
    asked
        .into_iter()
        .map(|a| {
            let xr = x.tr_mul(&a.columns);
            let shown = a.columns.tr_mul(&a.columns) - xr.tr_mul(&factor.solve(&xr));
            // By its own symmetry, not by rounding.
            let shown = (&shown + shown.transpose()) * 0.5;
            let weakest = spectral::symmetric_eigen(shown).map_or(f64::NAN, |eigen| eigen.eigenvalues.min());
            let is_shift = matches!(
                a.effect,
                CauseKind::SensorFrameShift | CauseKind::SensorZeroShift | CauseKind::ToolShift
            );
            let lambda = if is_shift { OF_SHIFTS * options.decisive } else { options.decisive };
            let size = (lambda / weakest).sqrt();
            let shows = size * a.to_shows;
            let is_absurd = shows > ABSURD || a.effect == CauseKind::JointCompliance && size > SOFTEST;
            let known = weakest > 0.0 && shows.is_finite() && !is_absurd;
            Detectability {
                effect: a.effect,
                which: a.which,
                joint: a.joint,
                smallest: known.then_some(size * a.to_unit),
                unit: a.unit,
                shows: known.then_some(shows),
                shows_unit: a.shows_unit,
                usual: a.usual,
            }
        })
        .collect()
}

/// The effects of the arm.
fn of_arm(setup: &MeasurementSetup<'_>, rows: &[Row], options: &Options) -> Vec<EffectColumns> {
    let mut out = Vec::new();
    let degrees = 1.0_f64.to_degrees();
    let all: Vec<Effect> = [CauseKind::JointCompliance, CauseKind::GearRatio, CauseKind::Backlash]
        .iter()
        .flat_map(|&effect| (0..6).flat_map(move |j| effects_of(&CandidateCause { effect, joints: vec![j] })))
        .chain((0..6).flat_map(|j| [harmonic(j, 1.0), harmonic(j, 2.0)]))
        .chain([(4, 3), (5, 4), (5, 3)].map(|(joint, driver)| coupling(joint, driver)))
        .chain([thermal()])
        .collect();
    for effect in all {
        let (shown, unit, to_unit, which) = match &effect {
            Effect::JointCompliance(e) => {
                // Without gravity torque at a joint its compliance has no effect.
                (0..1, "µrad/(N m)", 1e6, format!("joint {}", e.joint + 1))
            }
            Effect::GearEccentricity(e) => {
                (0..2, "°", degrees, format!("joint {}, {} per turn", e.joint + 1, e.order))
            }
            Effect::GearRatio(e) => (0..1, "‰", 1e3, format!("joint {}", e.joint + 1)),
            Effect::JointCoupling(e) => {
                (0..1, "‰", 1e3, format!("joint {} into {}", e.driver + 1, e.joint + 1))
            }
            Effect::Backlash(e) => (0..1, "°", degrees, format!("joint {}", e.joint + 1)),
            // By the clock; a thermometer is not planned.
            Effect::ThermalDrift(_) => (0..1, "µm/m", 1e6, "all links, by the clock".to_owned()),
            _ => continue,
        };
        let model = Model { effects: vec![effect.clone()], ..setup.nominal.clone() };
        let parameters: Vec<Parameter> =
            shown.map(|parameter| Parameter::Effect { index: 0, parameter }).collect();
        let (columns, _) = jacobian(setup, &model, &parameters, rows, options);
        let (to_shows, shows_unit, usual) = match &effect {
            // Growth over a metre, about the length of a small arm.
            Effect::ThermalDrift(_) => (1e3, "mm", USUAL_MM),
            Effect::GearEccentricity(_) => (degrees, "°", USUAL_DEG),
            _ => (degrees * largest_turn(&model, rows), "°", USUAL_DEG),
        };
        let joint = effect.joint();
        out.push(EffectColumns {
            effect: CauseKind::from(&effect),
            which,
            joint,
            unit,
            shows_unit,
            usual,
            to_unit,
            to_shows,
            columns,
        });
    }
    out
}

/// Largest rotation that the first parameter of the model's only effect gives a joint, per unit.
fn largest_turn(model: &Model, rows: &[Row]) -> f64 {
    let mut largest = 0.0_f64;
    for row in rows {
        let turn = model.at_condition(&row.condition).effect_regressors(0, &row.joints);
        largest = turn.first().map_or(largest, |t| largest.max(t.amax()));
    }
    largest
}

/// The effects of the measurement: shifts in the middle of the run, and a scale error.
fn of_sensor(
    setup: &MeasurementSetup<'_>,
    parameters: &[Parameter],
    rows: &[Row],
    raw: &DMatrix<f64>,
    options: &Options,
) -> Vec<EffectColumns> {
    let per = raw.nrows() / rows.len().max(1);
    let mut out = Vec::new();
    let mut step = |effect, which: &str, of: &dyn Fn(&Parameter) -> bool| {
        let indices: Vec<usize> = (0..parameters.len()).filter(|&k| of(&parameters[k])).collect();
        if indices.is_empty() {
            return;
        }
        let mut columns = raw.select_columns(&indices);
        let half = raw.nrows() / (2 * per) * per;
        columns.rows_mut(0, half).fill(0.0);
        out.push(EffectColumns {
            effect,
            which: which.to_owned(),
            joint: None,
            unit: "mm",
            shows_unit: "mm",
            usual: USUAL_MM,
            to_unit: 1.0,
            to_shows: 1.0,
            columns,
        });
    };
    if setup.sensor == Sensor::Cable {
        step(CauseKind::SensorZeroShift, "in the middle of the run", &|p| {
            matches!(p, Parameter::Zero { anchor: 0 })
        });
        step(CauseKind::SensorFrameShift, "outlet, in the middle of the run", &|p| {
            matches!(p, Parameter::Outlet { anchor: 0, .. })
        });
    } else {
        step(
            CauseKind::SensorFrameShift,
            "in the middle of the run",
            &|p| matches!(p, Parameter::SensorFrame(k) if *k < 3),
        );
    }
    step(CauseKind::ToolShift, "in the middle of the run", &|p| matches!(p, Parameter::Target(k) if *k < 3));
    let (columns, longest) = scale_column(setup, rows, per, options);
    out.push(EffectColumns {
        effect: CauseKind::SensorScale,
        which: "all readings".to_owned(),
        joint: None,
        unit: "‰",
        shows_unit: "mm",
        usual: USUAL_MM,
        to_unit: 1e3,
        to_shows: longest,
        columns,
    });
    out
}

/// Change of each whitened reading per relative error of the sensor's lengths, and the longest reading (mm).
fn scale_column(
    setup: &MeasurementSetup<'_>,
    rows: &[Row],
    per: usize,
    options: &Options,
) -> (DMatrix<f64>, f64) {
    let rig = rig(setup);
    let posed = setup.nominal.at_condition(&Condition::default());
    let mut column = DMatrix::zeros(per * rows.len(), 1);
    let mut longest = 0.0_f64;
    let weight = 1.0 / options.noise.reading_mm;
    for (i, row) in rows.iter().enumerate() {
        let flange = posed.forward(&row.joints);
        let Some(distance) = rig.distance_mm(&flange, row.anchor) else { continue };
        longest = longest.max(distance);
        if setup.sensor == Sensor::Cable {
            // Residuals are model minus reading; the sign does not matter.
            column[(i, 0)] = distance * weight;
            continue;
        }
        let point = flange * nalgebra::Point3::from(rig.target_on_flange_mm());
        let from_sensor = point.coords - setup.frames.base_from_sensor.translation.vector;
        for k in 0..3 {
            column[(i * per + k, 0)] = from_sensor[k] * weight;
        }
    }
    (column, longest)
}
