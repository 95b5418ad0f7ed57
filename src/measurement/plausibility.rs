//! temp
use super::dataset::Dataset;
use crate::kinematics::model::Model;
/// temp
pub fn plausibility(_: &Dataset, _: &Model) -> Vec<String> {
    Vec::new()
}
/// temp
pub fn from_dh_angles(_: &mut Dataset, _: &Model) {}
