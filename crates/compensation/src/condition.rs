//! The condition of the arm at each target: what it carries and from which side its joints arrive.

pub(crate) mod arm_conditions;
pub mod other_load;
pub mod overload;
pub mod payload;
pub mod stated;
pub mod warmth;
