//! The experiment's section: groups of poses, heat, wear, and what the paper states.

use serde::{Deserialize, Serialize};

/// The experiment's section.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Degradation {
    /// Groups of poses.
    pub groups: usize,
    /// Time between two groups (h).
    pub hours_apart: f64,
    /// The first so many poses of a group identify; all others verify.
    pub identification: usize,
    /// Pose counts of the study of counts.
    pub counts: Vec<usize>,
    /// Pose counts of continuous calibration.
    pub continuous: Vec<usize>,
    /// Simulated arms, each with its own deviations, poses and noise.
    pub arms: usize,
    /// Forgetting factor of one pose.
    pub forgetting: f64,
    /// Steps of the stopped LM.
    pub stopped_after: usize,
    /// Links that warm up.
    pub heat: Heat,
    /// Joints that wear.
    pub wear: Wear,
    /// What the paper's prose states.
    #[serde(default)]
    pub paper: Vec<PaperStatement>,
    /// What it states of the study of counts.
    #[serde(default)]
    pub paper_counts: Vec<PaperCount>,
}

/// Links warm up to a steady state and grow: length · growth · rise · (1 − e^(−t/T)).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Heat {
    /// Relative growth per kelvin.
    pub growth_per_k: f64,
    /// By how much each link is warmer in the steady state than when the first group was measured (K).
    pub rise_k: [f64; 6],
    /// T (h).
    pub time_constant_h: f64,
}

/// Zeros of the joints wander: rate · t.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Wear {
    /// Of each joint (° per hour).
    pub zero_deg_per_h: [f64; 6],
}

/// Figures that the paper's prose states.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PaperStatement {
    /// Poses per group.
    pub count: usize,
    /// Name of the method: `RLS` or `LM`.
    pub method: String,
    /// Mean error before, poses that identify (mm).
    pub identification_before_mm: Option<f64>,
    /// The same after.
    pub identification_after_mm: Option<f64>,
    /// Mean error before, poses that verify (mm).
    pub verification_before_mm: Option<f64>,
    /// The same after.
    pub verification_after_mm: Option<f64>,
    /// Improvement of the verification poses as stated (%).
    pub improvement_percent: Option<f64>,
    /// The figure that shows it.
    #[serde(default)]
    pub figure: Option<String>,
}

/// What the paper's prose states of the study of counts.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PaperCount {
    /// Poses.
    pub count: usize,
    /// Improvement of the poses that identify (%).
    pub identification_percent: f64,
    /// Improvement of the poses that verify (%).
    pub verification_percent: f64,
}

impl Degradation {
    /// What in the section cannot be used: key, found, expected.
    pub(crate) fn fault(&self) -> Option<(&'static str, String, &'static str)> {
        let most = self.counts.iter().chain(&self.continuous).max().copied().unwrap_or(0);
        let least = self.counts.iter().chain(&self.continuous).min().copied().unwrap_or(0);
        if self.groups == 0 || self.arms == 0 {
            let found = format!("{} groups, {} arms", self.groups, self.arms);
            return Some(("degradation.groups, .arms", found, "1 of each at least"));
        }
        if most > self.identification || least == 0 {
            let found = format!("{least} to {most} poses");
            return Some(("degradation.counts", found, "1 pose at least, and no more than identify"));
        }
        if !(self.forgetting > 0.0 && self.forgetting <= 1.0) {
            return Some(("degradation.forgetting", self.forgetting.to_string(), "above 0, up to 1"));
        }
        None
    }
}
