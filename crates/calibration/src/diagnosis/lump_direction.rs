//! Whether deflections of a joint along two horizontal axes are those of one direction of gravity.
//!
//! An arm that is mounted at a tilt has κₗ (cos φ, sin φ) for every lump l, with one direction φ for all, and κₗ = compliance × mass ≥ 0 for
//! masses (first moments may have either sign). The free products (xₗ, yₗ) of the fit also take what other smooth errors of the joint look
//! like; then they point anywhere. How much −2 log posterior rises by the best single direction is Σ (v − A(φ)κ)ᵀ C⁻¹ (v − A(φ)κ).

use nalgebra::{DMatrix, DVector};

use truegrind_arm::effect::lumped_compliance::LumpedCompliance;

/// Directions tried on the circle.
const DIRECTIONS: usize = 180;

/// Rise of −2 log posterior that one direction may cost: this, and as much for each lump.
const CHANCE: (f64, f64) = (16.0, 3.0);

/// Whether one direction of gravity explains the values of a deflection, given their covariance; true where they are of one axis.
pub fn is_one_direction(load: &LumpedCompliance, values: &[f64], covariance: &DMatrix<f64>) -> bool {
    let mut axes: Vec<usize> = load.lump.iter().filter_map(|lump| lump.axis).collect();
    axes.sort_unstable();
    axes.dedup();
    let &[first, _] = axes.as_slice() else { return true };
    let mut lumps: Vec<(usize, Option<usize>)> = load.lump.iter().map(|l| (l.frame, l.moment)).collect();
    lumps.sort_unstable();
    lumps.dedup();
    let Some(precision) = covariance.clone().cholesky().map(|factor| factor.inverse()) else { return true };
    let values = DVector::from_column_slice(values);
    let rise = (0..DIRECTIONS)
        .map(|step| {
            let angle = step as f64 * std::f64::consts::TAU / DIRECTIONS as f64;
            let directions = DMatrix::from_fn(values.len(), lumps.len(), |k, l| {
                let lump = &load.lump[k];
                let along = if lump.axis == Some(first) { angle.cos() } else { angle.sin() };
                if lumps[l] == (lump.frame, lump.moment) { along } else { 0.0 }
            });
            rise_along(&directions, &values, &precision, &lumps)
        })
        .fold(f64::INFINITY, f64::min);
    rise < CHANCE.0 + CHANCE.1 * lumps.len() as f64
}

/// The rise for one direction; masses whose product would be negative are left out, the most negative first.
fn rise_along(
    directions: &DMatrix<f64>,
    values: &DVector<f64>,
    precision: &DMatrix<f64>,
    lumps: &[(usize, Option<usize>)],
) -> f64 {
    let mut kept: Vec<usize> = (0..lumps.len()).collect();
    loop {
        let of_kept = directions.select_columns(&kept);
        let weighted = precision * &of_kept;
        let normal = of_kept.tr_mul(&weighted);
        let Some(factor) = normal.cholesky() else { return f64::INFINITY };
        let products = factor.solve(&weighted.tr_mul(values));
        let masses = (0..kept.len()).filter(|&at| lumps[kept[at]].1.is_none() && products[at] < 0.0);
        let Some(worst) = masses.min_by(|&a, &b| products[a].total_cmp(&products[b])) else {
            let left = values - of_kept * products;
            return (precision * &left).dot(&left);
        };
        kept.remove(worst);
    }
}
