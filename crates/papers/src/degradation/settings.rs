//! Section `degradation` of an experiment file: groups of poses, warm-up, wear, and the paper's figures.

use serde::{Deserialize, Serialize};

/// Section `degradation` of an experiment file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Degradation {
    /// Groups of poses.
    pub groups: usize,
    /// Time between two groups (h).
    pub hours_apart: f64,
    /// Number of identification poses at the start of each group; the others verify.
    pub identification: usize,
    /// Numbers of poses compared in the first group.
    pub counts: Vec<usize>,
    /// Numbers of poses per group in continuous calibration.
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
    /// Figures stated in the paper's prose.
    #[serde(default)]
    pub paper: Vec<PaperStatement>,
    /// Figures stated for the numbers of poses.
    #[serde(default)]
    pub paper_counts: Vec<PaperCount>,
}

/// Thermal growth of the links towards a steady state: length · growth · rise · (1 − e^(−t/T)).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Heat {
    /// Relative growth per kelvin.
    pub growth_per_k: f64,
    /// Temperature rise of each link from the first group to the steady state (K).
    pub rise_k: [f64; 6],
    /// Time constant T (h).
    pub time_constant_h: f64,
}

/// Drift of the joint zeros: rate · t.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Wear {
    /// Rate of each joint (° per hour).
    pub zero_deg_per_h: [f64; 6],
}

/// Figures stated in the paper's prose.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PaperStatement {
    /// Poses per group.
    pub count: usize,
    /// Name of the method: `RLS` or `LM`.
    pub method: String,
    /// Mean error of the identification poses before calibration (mm).
    pub identification_before_mm: Option<f64>,
    /// The same after.
    pub identification_after_mm: Option<f64>,
    /// Mean error of the verification poses before calibration (mm).
    pub verification_before_mm: Option<f64>,
    /// The same after.
    pub verification_after_mm: Option<f64>,
    /// Stated improvement of the verification poses (%).
    pub improvement_percent: Option<f64>,
    /// Figure of the paper.
    #[serde(default)]
    pub figure: Option<String>,
}

/// Figures stated in the paper's prose for one number of poses.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PaperCount {
    /// Poses.
    pub count: usize,
    /// Improvement of the identification poses (%).
    pub identification_percent: f64,
    /// Improvement of the verification poses (%).
    pub verification_percent: f64,
}

impl Degradation {
    /// First invalid value of the section: key, found, expected.
    pub(crate) fn fault(&self) -> Option<(&'static str, String, &'static str)> {
        let most = self.counts.iter().chain(&self.continuous).max().copied().unwrap_or(0);
        let least = self.counts.iter().chain(&self.continuous).min().copied().unwrap_or(0);
        if self.groups == 0 || self.arms == 0 {
            let found = format!("{} groups, {} arms", self.groups, self.arms);
            return Some(("degradation.groups, .arms", found, "at least 1 of each"));
        }
        if most > self.identification || least == 0 {
            let found = format!("{least} to {most} poses");
            return Some((
                "degradation.counts",
                found,
                "at least 1 pose and at most degradation.identification",
            ));
        }
        if !(self.forgetting > 0.0 && self.forgetting <= 1.0) {
            return Some(("degradation.forgetting", self.forgetting.to_string(), "above 0, up to 1"));
        }
        None
    }
}
