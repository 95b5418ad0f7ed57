//! Whether the sensor or its target was set up anew between sessions: one fit has one frame of the sensor and one target, so that readings
//! of sessions that had others deviate in their means.

use std::collections::BTreeMap;

use nalgebra::Vector3;

use super::fit::Fitted;
use super::repeats::residuals_mm;
use crate::measurement::dataset::{Dataset, Sensor};

/// Fewest rows of a session that is judged.
const MIN_ROWS: usize = 8;
/// Standard errors by which means must differ.
const SIGNIFICANT: f64 = 8.0;
/// How many times the scatter within sessions they must differ by.
const OF_SCATTER: f64 = 0.5;

/// The residuals of a session.
#[derive(Default)]
struct Sum {
    count: f64,
    sum: Vector3<f64>,
    square: f64,
}

impl Sum {
    fn mean(&self) -> Vector3<f64> {
        self.sum / self.count
    }

    /// Sum of squares about the mean.
    fn scatter(&self) -> f64 {
        (self.square - self.sum.norm_squared() / self.count).max(0.0)
    }
}

/// What speaks against one frame for all sessions of the rows that were fitted; `None` if nothing does.
pub(super) fn set_up_anew(dataset: &Dataset, fitted: &Fitted) -> Option<String> {
    let mut sessions: BTreeMap<(&str, usize), Sum> = BTreeMap::new();
    if dataset.rows.iter().all(|row| row.session().is_none()) {
        return None;
    }
    for (row, mm) in dataset.rows.iter().zip(residuals_mm(dataset, fitted)) {
        let session = sessions.entry((row.session().unwrap_or_default(), row.anchor)).or_default();
        session.count += 1.0;
        session.sum += mm;
        session.square += mm.norm_squared();
    }
    sessions.retain(|_, session| session.count >= MIN_ROWS as f64);
    let count: f64 = sessions.values().map(|session| session.count).sum();
    let scatter: f64 = sessions.values().map(Sum::scatter).sum();
    let scatter_mm = (scatter / (count - sessions.len() as f64).max(1.0)).sqrt();
    let pairs = sessions
        .iter()
        .enumerate()
        .flat_map(|(k, a)| sessions.iter().skip(k + 1).filter(move |b| a.0.1 == b.0.1).map(move |b| (a, b)));
    let ((a, _), (b, _), mm) = pairs
        .map(|(a, b)| (a, b, (a.1.mean() - b.1.mean()).norm()))
        .filter(|(a, b, mm)| {
            let error_mm = scatter_mm * (1.0 / a.1.count + 1.0 / b.1.count).sqrt();
            *mm > SIGNIFICANT * error_mm && *mm > OF_SCATTER * scatter_mm
        })
        .max_by(|a, b| a.2.total_cmp(&b.2))?;
    let name =
        |session: &str| if session.is_empty() { "without a name".to_owned() } else { session.to_owned() };
    let (set_up, column) = match dataset.sensor {
        Sensor::Cable => ("its outlet was moved or its zero set anew", "anchor (a number for each)"),
        _ => ("the sensor was set up elsewhere", "station"),
    };
    Some(format!(
        "the readings of sessions {} and {} differ by {mm:.3} mm in the mean with one sensor frame and one target for both: sensor or \
         target was moved. If {set_up}, say so in a column {column}; otherwise let `diagnose` find what moved",
        name(a.0),
        name(b.0)
    ))
}
