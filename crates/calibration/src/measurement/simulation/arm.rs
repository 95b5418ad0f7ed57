//! The actual arm of a recipe.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};

use super::error::RecipeError;
use super::recipe::{Deviations, LinkDeviation};
use truegrind_arm::link::{Link, LinkModel};
use truegrind_arm::model::{Body, Model};

pub(super) fn actual(nominal: &Model, deviations: &Deviations) -> Result<Model, RecipeError> {
    let mut arm = nominal.clone();
    if let Some(random) = &deviations.random {
        let mut rng = ChaCha8Rng::seed_from_u64(random.seed);
        let mut draw = |sigma: f64| {
            let z: f64 = StandardNormal.sample(&mut rng);
            z * sigma
        };
        for (joint, link) in arm.links.iter_mut().enumerate() {
            let a_mm = draw(random.a_mm);
            let (d_mm, beta_deg) = match link.model {
                LinkModel::Dh => (draw(random.d_mm), 0.0),
                LinkModel::Hayati => (0.0, draw(random.beta_deg)),
            };
            let (alpha_deg, theta_deg) = (draw(random.alpha_deg), draw(random.theta_deg));
            add(link, &LinkDeviation { joint, a_mm, d_mm, alpha_deg, beta_deg, theta_deg });
        }
    }
    for deviation in &deviations.link {
        add(&mut arm.links[deviation.joint], deviation);
    }
    if let Some(bodies) = &deviations.body {
        let count = bodies.len();
        arm.bodies = Some(<[Body; 6]>::try_from(bodies.clone()).map_err(|_| RecipeError::Invalid {
            key: "arm.body".into(),
            found: format!("{count} bodies"),
            expected: "six",
        })?);
    }
    arm.effects = deviations.effect.clone();
    Ok(arm)
}

fn add(link: &mut Link, by: &LinkDeviation) {
    link.a_mm += by.a_mm;
    link.d_mm += by.d_mm;
    link.alpha_rad += by.alpha_deg.to_radians();
    link.beta_rad += by.beta_deg.to_radians();
    link.theta_rad += by.theta_deg.to_radians();
}
