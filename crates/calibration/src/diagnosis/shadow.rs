//! Findings that may be parts of something larger whose law is not known: a doubt on each.
//!
//! A fault of which only the shape is known (a form, a field over poses, a sensor that reads worse than its noise) leaves remains
//! wherever its true law differs from the fitted one, and smooth causes of the arm take them up. How much a cause explains beside
//! all that is free in the model, its own push, is held against what the rough description explains: what is smaller may
//! be a part of it. So may what is small against another cause of the same joint, since no law of a spring or a gear is exact.

use super::cause::{Cause, Part};
use super::confirmation::Confirmation;
use super::worth::Worth;
use truegrind_arm::model::Model;

/// What casts doubt.
pub(super) struct Shadows<'a> {
    /// The causes of the fit.
    pub(super) causes: &'a [Cause],
    /// How they came out.
    pub(super) confirmations: &'a [Confirmation],
    /// What they are worth.
    pub(super) worth: &'a Worth<'a>,
    /// The data sheet's arm.
    pub(super) nominal: &'a Model,
    /// Growth of the arm in the course of the rows that has no name (mm RMS).
    pub(super) growth_mm: f64,
    /// What depends on the pose and has no name (mm RMS).
    pub(super) field_mm: f64,
    /// What is left beyond the noise that repeated poses show (mm RMS); 0 where it is little, or where that is not known.
    pub(super) beyond_noise_mm: f64,
}

/// What is left is beyond the noise where it is this many times as large.
const BEYOND: f64 = 1.5;

/// Degrees of freedom from which repeated poses tell the noise.
const REPEATED: usize = 20;

/// Share of another cause of its joint below which a smooth cause may be what the other's law leaves.
const REMAINS: f64 = 0.15;

/// The same for an error of two joints, beside a spring of either.
const OF_TWO_JOINTS: f64 = 0.5;

/// Share of the drift of stand or zero from which growth of the arm explains both.
const GROWTH: f64 = 0.25;

/// What is left beyond the noise of repeated poses, as [`Shadows`] has it.
pub(super) fn beyond_noise_mm(left_mm: f64, noise_mm: f64, freedom: usize) -> f64 {
    let beyond = freedom >= REPEATED && left_mm > BEYOND * noise_mm;
    if beyond { (left_mm * left_mm - noise_mm * noise_mm).sqrt() } else { 0.0 }
}

impl Shadows<'_> {
    /// Why causes that are told together may be a part of something else; nothing where they may not.
    pub(super) fn on(&self, causes: &[usize]) -> Vec<String> {
        let all = |test: &dyn Fn(&Cause) -> bool| causes.iter().all(|&k| test(&self.causes[k]));
        if causes.is_empty() {
            return Vec::new();
        }
        let own = self.worth.own_of(causes);
        if all(&Cause::follows_warmth) {
            return self.of_other_warmth(causes, own).into_iter().collect();
        }
        if all(&|cause| cause.rows().is_some()) {
            return self.of_rough_form(own).into_iter().collect();
        }
        if !all(&Cause::is_of_the_arm) {
            return if all(&Cause::is_roughly_described) {
                self.of_other_sensor_fault(causes, own).into_iter().collect()
            } else {
                Vec::new()
            };
        }
        let smooth = all(&Cause::is_smooth);
        let mut out = Vec::new();
        let rough = self.rough_mm(causes, smooth);
        let (whole, sensor) = (self.worth.of(causes), self.faults_of_the_sensor_mm());
        if own < rough {
            out.push(format!(
                "beside the geometry it explains {own:.4} mm, less than the {rough:.4} mm of what is only roughly described, and may be a \
                 part of that"
            ));
        } else if smooth && whole < sensor {
            out.push(format!(
                "it is worth {whole:.4} mm, less than the {sensor:.4} mm of a fault of the sensor that is only roughly described, and may \
                 be a part of that"
            ));
        }
        if own < self.beyond_noise_mm {
            out.push(format!(
                "sensor not excluded: beside the geometry it explains {own:.4} mm, and {:.4} mm beyond the noise of repeated poses are left",
                self.beyond_noise_mm
            ));
        }
        if all(&|cause| cause.goes_with_weight(self.nominal)) {
            out.push(
                "it goes with the angle in which weight turns: a spring, or play, whose law is not known looks the same"
                    .to_owned(),
            );
        }
        if smooth && let Some(joint) = self.remains_of(causes, own) {
            out.push(format!(
                "it is small beside another cause of joint {}, and may be what the law of that leaves",
                joint + 1
            ));
        }
        out
    }

    /// A shift in some of the rows beside a larger fault of which only the shape is known: rows in which the law of that is farthest
    /// off look shifted.
    fn of_rough_form(&self, own: f64) -> Option<String> {
        let rough = |k: &usize| self.causes[*k].is_roughly_described() && self.confirmations[*k].is_there();
        let larger = (0..self.causes.len()).filter(rough).find(|&k| own < self.worth.own_of(&[k]))?;
        Some(format!(
            "beside all else it explains {own:.4} mm, less than {}, of which only the shape is known, and may be a part of that",
            self.causes[larger].name()
        ))
    }

    /// What no law describes is worth, at most (mm): faults of which only the shape is known.
    pub(super) fn roughly_described_mm(&self) -> f64 {
        let rough = |k: &usize| self.causes[*k].is_roughly_described() && self.confirmations[*k].is_there();
        (0..self.causes.len()).filter(rough).map(|k| self.worth.of(&[k])).fold(0.0, f64::max)
    }

    /// What the largest fault of the sensor that is only roughly described is worth, the arm's geometry left as it is (mm).
    fn faults_of_the_sensor_mm(&self) -> f64 {
        let of_sensor = |k: &usize| {
            let cause = &self.causes[*k];
            cause.is_roughly_described() && !cause.is_of_the_arm() && self.confirmations[*k].is_there()
        };
        (0..self.causes.len()).filter(of_sensor).map(|k| self.worth.of(&[k])).fold(0.0, f64::max)
    }

    fn others<'a>(&'a self, causes: &'a [usize]) -> impl Iterator<Item = usize> + 'a {
        (0..self.causes.len()).filter(|k| !causes.contains(k) && self.confirmations[*k].is_confirmed())
    }

    /// The most that anything roughly described explains of which these causes may be a part (mm).
    fn rough_mm(&self, causes: &[usize], smooth: bool) -> f64 {
        let parts: Vec<Option<(Part, usize)>> = causes.iter().map(|&k| self.causes[k].part()).collect();
        // What is only roughly described need not be sure itself to have remains.
        let there = |k: &usize| !causes.contains(k) && self.confirmations[*k].is_there();
        let rough = (0..self.causes.len()).filter(there).filter(|&k| self.causes[k].is_roughly_described());
        let rough = rough.filter(|&k| {
            let part = self.causes[k].part().filter(|_| self.causes[k].is_of_the_arm());
            // A spring and its bend are one story, and so are the errors of one gear.
            let same = part.is_some() && parts.contains(&part);
            let joint = |p: &Option<(Part, usize)>| p.map(|p| p.1);
            let at_joint = part.is_some() && parts.iter().all(|p| joint(p) == joint(&part));
            !same && (smooth || at_joint)
        });
        let single = rough.map(|k| self.worth.own_of(&[k])).fold(0.0, f64::max);
        if !smooth {
            return single;
        }
        let cable: Vec<usize> = self.others(causes).filter(|&k| self.causes[k].is_of_the_cable()).collect();
        // Two descriptions of one cable: neither is its law.
        let cable = if cable.len() > 1 { self.worth.own_of(&cable) } else { 0.0 };
        single.max(cable).max(self.field_mm)
    }

    /// The joint of a much larger cause of which these may be the remains.
    fn remains_of(&self, causes: &[usize], own: f64) -> Option<usize> {
        let cause = &self.causes[*causes.first()?];
        let (_, at) = cause.part()?;
        let joints = cause.joints();
        self.others(causes).filter(|&k| self.causes[k].is_of_the_arm()).find_map(|k| {
            let (part, joint) = self.causes[k].part()?;
            // The weight that a joint carries follows the angles of those before it: what is left of a spring with other masses
            // looks like two joints that disturb each other.
            let together = part == Part::Spring && joints.len() > 1 && joints.contains(&joint);
            let share = if together { OF_TWO_JOINTS } else { REMAINS };
            let near = together || joint == at;
            (near && own < share * self.worth.own_of(&[k])).then_some(joint)
        })
    }

    /// One warmth moves the arm, the stand and the zero. Links that warm unequally look like a stand that moves, since the first of
    /// them is a stand; so growth of the arm comes first, unless it is small beside the drift.
    fn of_other_warmth(&self, causes: &[usize], own: f64) -> Option<String> {
        let first = &self.causes[causes[0]];
        let warm = self.others(causes).filter(|&k| self.causes[k].follows_warmth());
        let other: Vec<usize> = warm.filter(|&k| !first.moves_the_same(&self.causes[k])).collect();
        let theirs = self.worth.own_of(&other);
        let growth = other.iter().any(|&k| self.causes[k].is_of_the_arm());
        // Growth that is there but could not be named speaks like growth that could.
        let (theirs, growth) = if !first.is_of_the_arm() && !growth && self.growth_mm > 0.0 {
            (theirs.hypot(self.growth_mm), true)
        } else {
            (theirs, growth)
        };
        let share = match (first.is_of_the_arm(), growth) {
            (true, _) => GROWTH,
            (false, true) => 1.0 / GROWTH,
            // Nothing else of it is in the arm.
            (false, false) => 0.0,
        };
        (own < share * theirs).then(|| {
            format!("something else that follows the same warmth explains {theirs:.4} mm, this {own:.4} mm: it may be a part of that")
        })
    }

    /// A fault of the sensor beside a larger one of another part of it, of which only the shape is known too.
    fn of_other_sensor_fault(&self, causes: &[usize], own: f64) -> Option<String> {
        let of_cable = |k: usize| self.causes[k].is_of_the_cable();
        let name = self.causes[causes[0]].name();
        let larger = self
            .others(causes)
            .filter(|&k| self.causes[k].is_roughly_described() && !self.causes[k].is_of_the_arm())
            .filter(|&k| self.causes[k].name() != name && !(of_cable(k) && of_cable(causes[0])))
            .find(|&k| own < self.worth.own_of(&[k]))?;
        Some(format!("it is worth less than {}, and may be a part of that", self.causes[larger].name()))
    }
}
