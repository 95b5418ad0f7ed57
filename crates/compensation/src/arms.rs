//! The nominal arm, which the controller computes with, and the estimated arm.

use crate::condition::arm_conditions::ArmConditions;
use crate::condition::payload::{is_load_dependent, payload_at};
use truegrind_arm::condition::Condition;
use truegrind_arm::estimated::Estimated;
use truegrind_arm::inverse::Inverse;
use truegrind_arm::model::Model;
use truegrind_programs::motion::Listing;
use truegrind_programs::motion::load::{Load, Loads};

/// Both arms with their inverses, shared by all targets.
pub(crate) struct Arms<'a> {
    pub(crate) nominal: Inverse<'a>,
    /// The estimated arm at mid-play of every joint, under the stated condition.
    pub(crate) estimated: Inverse<'a>,
    /// The estimated arm under each condition that occurs in the program.
    pub(crate) conditions: ArmConditions<'a>,
    pub(crate) knowledge: Option<&'a Estimated>,
}

impl<'a> Arms<'a> {
    pub(crate) fn of(estimated: &'a Estimated, condition: &Condition) -> Self {
        let arms = Self::simulated(&estimated.nominal, &estimated.model, condition);
        Self { knowledge: Some(estimated), ..arms }
    }

    pub(crate) fn simulated(nominal: &'a Model, actual: &'a Model, condition: &Condition) -> Self {
        let condition = Condition { approach: [0; 6], ..*condition };
        Self {
            nominal: Inverse::new(nominal, &Condition::default(), nominal),
            estimated: Inverse::new(actual, &condition, nominal),
            conditions: ArmConditions::new(actual, nominal, &condition),
            knowledge: None,
        }
    }

    /// The payload at each motion, where the program states it and the arm is compliant; empty otherwise.
    pub(crate) fn loads(&self, listing: &Listing, loads: Option<&Loads>) -> Vec<Option<Load>> {
        let model = self.estimated.arm().model;
        let Some(loads) = loads.filter(|_| model.effects.iter().any(is_load_dependent)) else {
            return Vec::new();
        };
        let motions = listing.motions.iter().enumerate();
        motions.map(|(index, motion)| payload_at(loads, index, motion, listing)).collect()
    }
}
