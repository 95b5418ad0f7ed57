//! temp
use super::dataset::Dataset;
/// temp
pub fn random(dataset: &Dataset, share: f64, seed: u64) -> (Vec<usize>, Vec<usize>) {
    use rand::SeedableRng;
    use rand::seq::SliceRandom;
    let mut all: Vec<usize> = (0..dataset.rows.len()).collect();
    all.shuffle(&mut rand_chacha::ChaCha8Rng::seed_from_u64(seed));
    let test = all.split_off((all.len() as f64 * (1.0 - share)).round() as usize);
    (all, test)
}
