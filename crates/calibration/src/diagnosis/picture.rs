//! Residual plot that shows a cause: residuals against the revealing variable, without and with the cause in the model.

use nalgebra::{DVector, Vector3};

use super::catalogue::Candidate;
use super::cause::Cause;
use super::cause_kind::CauseKind;
use super::design::Design;
use super::extension::Subject;
use crate::measurement::dataset::{Dataset, Reading, Sensor};
use crate::measurement::sensor::disturbance::{Disturbance, Kind, Profile};
use crate::measurement::sensor::empirical::EmpiricalFault;
use truegrind_arm::effect::Effect;

/// Label and unit of an axis.
pub type Label = (String, &'static str);

/// Residuals against the variable that reveals a cause.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    /// Horizontal variable and its unit.
    pub x: Label,
    /// Vertical variable and its unit.
    pub y: Label,
    /// Without the cause in the model.
    pub before: Vec<[f64; 2]>,
    /// With it.
    pub after: Vec<[f64; 2]>,
    /// Rows of a shift.
    pub rows: Option<[usize; 2]>,
}

/// Smallest lever arm of a plotted row, as a share of the longest.
const LEVER: f64 = 0.25;

/// The picture of a cause: `before` is the model without it, `after` the extended one.
pub fn picture(subject: &Subject<'_>, cause: &Cause, before: &Design, after: &Design) -> Picture {
    let dataset = &subject.observed.dataset;
    if matches!(cause.kind(), CauseKind::AxisWobble | CauseKind::BaseTilt | CauseKind::LinkTwist) {
        return moving_links(subject, cause, before, after);
    }
    let joint = match cause {
        Cause::Arm(Effect::ThermalDrift(_)) | Cause::Measurement(_) => None,
        Cause::Arm(Effect::LinkBending(bending)) => Some(bending.joint),
        Cause::Arm(effect) => effect.joint(),
    };
    let number = |i: usize| dataset.rows[i].number as f64;
    if let Some(joint) = joint {
        let driver = match cause {
            Cause::Arm(Effect::JointCoupling(c)) => c.driver,
            _ => joint,
        };
        let side = matches!(cause, Cause::Arm(Effect::Backlash(_)));
        let x = |i: usize| {
            let row = &dataset.rows[i];
            if side {
                // Spread by row, so that points of one side do not hide each other.
                f64::from(row.condition.approach[joint]) + 0.3 * (number(i) / dataset.rows.len() as f64 - 0.5)
            } else {
                row.joints[driver].to_degrees()
            }
        };
        let label = if side {
            (format!("approach side of joint {} (−1 below, +1 above)", joint + 1), "")
        } else {
            (format!("angle of joint {}", driver + 1), "°")
        };
        return Picture {
            x: label,
            y: (format!("residual about joint {}", joint + 1), "°"),
            before: turned(before, joint, &x),
            after: turned(after, joint, &x),
            rows: None,
        };
    }
    let (x_label, x) = across(cause, dataset);
    let along = direction(cause);
    let y_label = match (dataset.sensor, along) {
        (Sensor::Cable, _) => "residual of the cable's length".to_owned(),
        (_, Some(_)) => "residual along the shift".to_owned(),
        (_, None) => "size of the residual".to_owned(),
    };
    let shown = |design: &Design| -> Vec<[f64; 2]> {
        let per = design.per;
        let mm = |s: usize| design.residual[s] * design.slopes.mm[s];
        (0..dataset.rows.len())
            .map(|i| {
                let vector = || Vector3::from_fn(|k, _| mm(i * per + k));
                let y = match (per, along) {
                    (1, _) => mm(i),
                    (_, Some(along)) => vector().dot(&along),
                    (_, None) => vector().norm(),
                };
                [x(i), y]
            })
            .collect()
    };
    Picture { x: x_label, y: (y_label, "mm"), before: shown(before), after: shown(after), rows: cause.rows() }
}

/// The picture of a cause that moves links: the residual along the motion that it alone makes in each row, over the angle of its joint; where it has
/// none, over the size of the motion. No turn about one joint shows it.
fn moving_links(subject: &Subject<'_>, cause: &Cause, before: &Design, after: &Design) -> Picture {
    let values = DVector::from_vec(cause.values());
    let columns = Candidate::of(cause, subject).columns(before);
    // What links and frames can make of it, they have made.
    let motion = before.pure(&columns, &before.project(&columns)) * values;
    let coordinates = before.per.min(3);
    let of_row = |whitened: &DVector<f64>, i: usize| {
        Vector3::from_fn(|k, _| {
            let s = i * before.per + k;
            if k < coordinates { whitened[s] * before.slopes.mm[s] } else { 0.0 }
        })
    };
    let motions: Vec<Vector3<f64>> = (0..before.observations).map(|i| of_row(&motion, i)).collect();
    let longest = motions.iter().map(Vector3::norm).fold(0.0, f64::max);
    let dataset = &subject.observed.dataset;
    let joint = cause.joints().first().copied();
    let shown = |design: &Design| -> Vec<[f64; 2]> {
        let rows = motions.iter().enumerate().filter(|(_, motion)| motion.norm() > LEVER * longest);
        rows.map(|(i, motion)| {
            let x = joint.map_or(motion.norm(), |joint| dataset.rows[i].joints[joint].to_degrees());
            // The columns are derivatives of the residual, which the cause makes smaller.
            [x, -of_row(&design.residual, i).dot(&motion.normalize())]
        })
        .collect()
    };
    let x = joint.map_or(("size of this cause's own motion".to_owned(), "mm"), |joint| {
        (format!("angle of joint {}", joint + 1), "°")
    });
    let y = ("residual along this cause's own motion".to_owned(), "mm");
    Picture { x, y, before: shown(before), after: shown(after), rows: None }
}

/// Horizontal axis for a cause of the measurement or a thermal cause.
fn across<'d>(cause: &Cause, dataset: &'d Dataset) -> (Label, Box<dyn Fn(usize) -> f64 + 'd>) {
    match cause {
        // What changes from some row on is shown over the rows.
        Cause::Measurement(d) if matches!(d.kind, Kind::Scale | Kind::Sag) && cause.rows().is_none() => (
            ("distance from the sensor".to_owned(), "mm"),
            Box::new(|i| distance_mm(&dataset.rows[i].reading)),
        ),
        Cause::Measurement(Disturbance { kind: Kind::Empirical(EmpiricalFault::CableReversal), .. }) => (
            ("change of the reading from the row before".to_owned(), "mm"),
            Box::new(|i| {
                let before =
                    i.checked_sub(1).map_or(f64::NAN, |before| distance_mm(&dataset.rows[before].reading));
                distance_mm(&dataset.rows[i].reading) - before
            }),
        ),
        Cause::Measurement(Disturbance { kind: Kind::Empirical(EmpiricalFault::Lens), .. }) => (
            ("angle from the axis of the camera".to_owned(), "°"),
            Box::new(|i| {
                let at = dataset.rows[i].reading.place_mm();
                at.x.hypot(at.y).atan2(at.z.abs()).to_degrees()
            }),
        ),
        Cause::Measurement(d) if matches!(d.profile, Profile::Temperature { .. }) => (
            ("temperature".to_owned(), "°C"),
            Box::new(|i| dataset.rows[i].condition.temperature_c.unwrap_or(f64::NAN)),
        ),
        Cause::Arm(Effect::ThermalDrift(t)) if t.growth == 0.0 => (
            ("temperature".to_owned(), "°C"),
            Box::new(|i| dataset.rows[i].condition.temperature_c.unwrap_or(f64::NAN)),
        ),
        Cause::Arm(Effect::ThermalDrift(_)) => {
            (("time".to_owned(), "h"), Box::new(|i| dataset.rows[i].condition.time_h.unwrap_or(f64::NAN)))
        }
        Cause::Measurement(d) if matches!(d.profile, Profile::Exponential { .. }) => {
            (("time".to_owned(), "h"), Box::new(|i| dataset.rows[i].condition.time_h.unwrap_or(f64::NAN)))
        }
        _ => (("data row".to_owned(), ""), Box::new(|i| dataset.rows[i].number as f64)),
    }
}

fn distance_mm(reading: &Reading) -> f64 {
    reading.place_mm().norm()
}

/// Unit vector along which the residual of a sensor shift is plotted, in the base.
fn direction(cause: &Cause) -> Option<Vector3<f64>> {
    match cause {
        Cause::Measurement(d) if matches!(d.kind, Kind::Frame { .. }) => {
            Vector3::new(d.values[0], d.values[1], d.values[2]).try_normalize(1e-9)
        }
        _ => None,
    }
}

/// For each row, the joint rotation that best explains its residual (°).
fn turned(design: &Design, joint: usize, x: &dyn Fn(usize) -> f64) -> Vec<[f64; 2]> {
    let theta = &design.slopes.by_joint[joint];
    let rows: Vec<(f64, f64)> = (0..design.observations)
        .map(|i| {
            (i * design.per..(i + 1) * design.per)
                .fold((0.0, 0.0), |(a, b), s| (a - theta[s] * design.residual[s], b + theta[s] * theta[s]))
        })
        .collect();
    let longest = rows.iter().map(|r| r.1).fold(0.0, f64::max);
    rows.iter()
        .enumerate()
        .filter(|(_, r)| r.1 > LEVER * LEVER * longest)
        .map(|(i, r)| [x(i), (r.0 / r.1).to_degrees()])
        .collect()
}
