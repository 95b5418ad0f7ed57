//! Tests of `diagnosis`: hidden effects are found by name, and nothing is found where nothing is hidden.

#[path = "diagnosis/simulator.rs"]
#[allow(dead_code, unreachable_pub)]
pub(crate) mod simulator;
#[path = "diagnosis/scenarios.rs"]
#[allow(dead_code, unreachable_pub)]
pub(crate) mod scenarios;
mod along_turn;
mod certain;
mod path_speeds;
mod play_flanks;
mod decision;
mod doubts;
mod change_points;
mod data_quality;
mod elimination;
mod found;
mod in_doubt;
mod joint_scatter;
mod one_orientation;
mod other_gravity;
mod parts;
mod rules;
