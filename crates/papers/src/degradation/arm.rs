//! One simulated arm and its groups of poses, each measured with the warm-up and wear of its time.

use super::settings::Degradation;
use crate::experiment::ExperimentError;
use truegrind_arm::model::Model;
use truegrind_arm::parameter::{Parameter, link_parameters};
use truegrind_calibration::identification::calibration::{Frames, Weight};
use truegrind_calibration::identification::fit::{Observations, Start, errors_on, fit, frame_parameters};
use truegrind_calibration::identification::identify::prepare_observations;
use truegrind_calibration::identification::solver::SOLVERS;
use truegrind_calibration::identification::start::candidate_frames;
use truegrind_calibration::identification::tolerance::Tolerance;
use truegrind_calibration::measurement::import;
use truegrind_calibration::measurement::simulation::recipe::{LinkDeviation, Recipe};

/// One simulated arm and its groups of poses.
pub(super) struct Arm {
    pub(super) nominal: Model,
    pub(super) frames: Frames,
    pub(super) groups: Vec<Group>,
    pub(super) sigma: Weight,
}

/// One group: poses measured at the same time.
pub(super) struct Group {
    pub(super) identify: Observations,
    pub(super) verify: Observations,
}

/// Simulates the arm and its measurements with this seed.
pub(super) fn arm(
    settings: &Degradation,
    recipe: &Recipe,
    experiment: &str,
    seed: u64,
    resolve: &(impl Fn(&str) -> Result<Model, String> + Sync),
) -> Result<Arm, ExperimentError> {
    let fail = |message: String| ExperimentError::Recipe { experiment: experiment.to_owned(), message };
    let nominal = resolve(&recipe.robot).map_err(fail)?;
    let mut groups = Vec::with_capacity(settings.groups);
    for g in 0..settings.groups {
        let hours = settings.hours_apart * g as f64;
        let mut now = recipe.clone();
        now.seed = recipe.seed + 1_000 * seed + g as u64;
        if let Some(random) = &mut now.arm.random {
            random.seed += seed;
        }
        for joint in 0..6 {
            let link = &nominal.links[joint];
            let warm = 1.0 - (-hours / settings.heat.time_constant_h).exp();
            let growth = settings.heat.growth_per_k * settings.heat.rise_k[joint] * warm;
            now.arm.link.push(LinkDeviation {
                joint,
                a_mm: link.a_mm * growth,
                d_mm: link.d_mm * growth,
                theta_deg: settings.wear.zero_deg_per_h[joint] * hours,
                ..LinkDeviation::default()
            });
        }
        let simulation = now.simulate(resolve).map_err(|e| fail(e.to_string()))?;
        let file = format!("group {} (simulated)", g + 1);
        let dataset = import::read(&file, simulation.csv.as_bytes(), &import::Options::default())
            .map_err(|e| fail(e.to_string()))?;
        if dataset.rows.len() <= settings.identification {
            return Err(fail(format!(
                "{} poses in a group, expected more than the {} that identify",
                dataset.rows.len(),
                settings.identification
            )));
        }
        let (observed, _) = prepare_observations(&dataset, &nominal, false);
        let all: Vec<usize> = (0..dataset.rows.len()).collect();
        let (identify, verify) = all.split_at(settings.identification);
        groups.push(Group { identify: observed.subset(identify), verify: observed.subset(verify) });
    }
    let noise = recipe.noise;
    // A laser tracker at a typical distance of 2 m.
    let sigma_mm = (noise.sigma_mm + 2.0 * noise.per_metre_mm).max(1e-3);
    let sigma_rad = noise.sigma_deg.to_radians().max(1e-6);
    let first = &groups[0].identify;
    let candidates = candidate_frames(&first.dataset, &nominal)?;
    let frames = candidates.into_iter().next().unwrap_or_else(|| Frames::at_origin(1));
    let parameters: Vec<Parameter> =
        link_parameters(&nominal).into_iter().chain(frame_parameters(&first.dataset)).collect();
    let start = Start { model: &nominal, frames: &frames };
    let fitted = fit(first, start, &parameters, &Tolerance::default(), &SOLVERS[0], 0);
    Ok(Arm {
        nominal,
        frames: fitted.frames,
        groups,
        sigma: Weight { per_mm: 1.0 / sigma_mm, per_rad: 1.0 / sigma_rad },
    })
}

/// Mean position error of rows (mm).
pub(super) fn mean_error(arm: &Arm, rows: &Observations, model: &Model) -> f64 {
    let errors = errors_on(rows, model, &arm.frames);
    errors.iter().sum::<f64>() / errors.len().max(1) as f64
}

/// Mean position error of all rows of a group (mm).
pub(super) fn group_error(arm: &Arm, group: usize, model: &Model) -> f64 {
    let group = &arm.groups[group];
    let (a, b) = (group.identify.dataset.rows.len() as f64, group.verify.dataset.rows.len() as f64);
    (a * mean_error(arm, &group.identify, model) + b * mean_error(arm, &group.verify, model)) / (a + b)
}
