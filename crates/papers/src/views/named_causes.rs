//! The diagnosis among the methods of a paper.

use crate::named_causes::NamedCauses;

/// Its id and name.
pub(super) const LABEL: (&str, &str) = ("NC", "named causes");

/// The diagnoses of all cases; `None` if one refused its rows.
pub(super) fn complete(cases: &[Option<NamedCauses>]) -> Option<Vec<&NamedCauses>> {
    cases.iter().map(Option::as_ref).collect()
}

/// What the row of the diagnosis means, with its cost in findings; `None` if it refused a case. `methods` are the held-out errors of each
/// method in all cases (mm).
pub(super) fn note(cases: &[Option<NamedCauses>], methods: impl Iterator<Item = Vec<f64>>) -> Option<String> {
    let found = complete(cases)?;
    let n = found.len().max(1) as f64;
    let mean = |of: &dyn Fn(&NamedCauses) -> f64| found.iter().map(|c| of(c)).sum::<f64>() / n;
    Some(format!(
        "NC, named causes: `truegrind diagnose` on the same rows of the fit, with all causes that it finds: {:.1} findings in the mean of \
         the cases, {:.1} of them identified. Its own geometry alone reaches {:.3} mm RMSE. {}",
        mean(&|c| c.findings as f64),
        mean(&|c| c.identified as f64),
        mean(&|c| c.geometry.rmse),
        beside_the_best(methods, &found).unwrap_or_default()
    ))
}

/// Standard errors of the mean difference over the cases from which it is no chance.
const SURELY: f64 = 2.0;

/// The diagnosis beside the best method, case by case.
fn beside_the_best(methods: impl Iterator<Item = Vec<f64>>, found: &[&NamedCauses]) -> Option<String> {
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len().max(1) as f64;
    let best = methods.min_by(|a, b| mean(a).total_cmp(&mean(b)))?;
    if best.len() != found.len() {
        return None;
    }
    let gains: Vec<f64> = best.iter().zip(found).map(|(best, named)| best - named.held_out.rmse).collect();
    let (n, gain) = (gains.len() as f64, mean(&gains));
    let error = (gains.iter().map(|g| (g - gain).powi(2)).sum::<f64>() / (n * (n - 1.0))).sqrt();
    Some(if n > 1.0 && gain > SURELY * error {
        format!(
            "It is {gain:.3} ± {error:.3} mm below the best of the methods in the same cases (mean and its standard error): that part no \
             optimiser of geometry can reach."
        )
    } else if n > 1.0 {
        format!(
            "Beside the best of the methods in the same cases it gains {gain:.3} ± {error:.3} mm (mean and its standard error): no more than \
             chance may give."
        )
    } else {
        "One case does not show whether the difference from the best of the methods is more than chance."
            .to_owned()
    })
}
