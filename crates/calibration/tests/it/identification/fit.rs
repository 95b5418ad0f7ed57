//! The noise and the outliers of few rows: a fit of many parameters leaves residuals that are smaller than the noise.

use truegrind_arm::robots;
use truegrind_calibration::measurement::import;
use truegrind_calibration::measurement::simulation::recipe::Recipe;

use super::promise::identified;

/// Noise of a reading (mm).
const NOISE_MM: f64 = 0.05;

/// A cable at an arm that was never calibrated, read once at each of `rows` poses; `wrong` is added to the length in the eighth row (mm).
fn cable(rows: usize, seed: u64, wrong: f64) -> (Vec<usize>, f64) {
    let fault = if wrong == 0.0 {
        String::new()
    } else {
        format!("[[fault]]\nfault = \"outliers\"\nrow_list = [7]\nsize_mm = {wrong}\n")
    };
    let recipe = format!(
        "robot = \"universal-robots-ur5\"\nseed = {seed}\n[arm.random]\nseed = {}\na_mm = 0.25\nd_mm = 0.25\n\
         alpha_deg = 0.05\nbeta_deg = 0.05\ntheta_deg = 0.1\n\
         [poses]\nkind = \"random\"\ncount = {rows}\nmin_deg = [-160.0, -150.0, -130.0, -160.0, -160.0, -160.0]\n\
         max_deg = [160.0, -10.0, 130.0, 160.0, 160.0, 160.0]\n[sensor]\nkind = \"cable\"\n\
         outlets_mm = [[530.0, 80.0, 40.0]]\nzeros_mm = [3.0]\nhook_mm = [40.0, 0.0, 60.0]\n[noise]\nsigma_mm = {NOISE_MM}\n{fault}",
        900 + seed
    );
    let load = |name: &str| robots::load(name).map(|r| r.model).map_err(|e| e.to_string());
    let simulation = Recipe::parse(&recipe, "case").unwrap().simulate(load).unwrap();
    let rows = import::read("case.csv", simulation.csv.as_bytes(), &import::Options::default()).unwrap();
    let found = identified(&rows, "universal-robots-ur5", &simulation.nominal).unwrap();
    (found.outliers.rows.iter().map(|row| row.index).collect(), found.geometry.sigma_mm)
}

/// With 24 of 40 readings spent on parameters the median residual is 0.6 of that of the noise, and a robust fit lets it shrink further: the
/// healthy rows that were farthest from it were rejected, and the noise of the others was taken for that of all.
#[test]
fn few_healthy_readings_are_no_outliers() {
    const SEEDS: u64 = 24;
    let (mut rejected, mut squares) = (0, 0.0);
    for seed in 0..SEEDS {
        let (outliers, sigma_mm) = cable(40, seed, 0.0);
        rejected += outliers.len();
        squares += (sigma_mm / NOISE_MM).powi(2) / SEEDS as f64;
    }
    assert!(rejected <= 1, "{rejected} healthy rows were rejected");
    assert!((0.8..1.2).contains(&squares.sqrt()), "{}", squares.sqrt());
}

#[test]
fn a_gross_reading_among_few_is_an_outlier() {
    for seed in 0..6 {
        let (outliers, _) = cable(40, seed, 8.0);
        assert_eq!(outliers, [7], "seed {seed}");
    }
}
