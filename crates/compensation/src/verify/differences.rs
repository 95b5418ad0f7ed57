//! What a rewritten program has differently from its original, beyond the targets that a correction moves and inserts.
//!
//! Each program's targets are compared in its own tool and work object: a program whose tool, work object or displacement is another one,
//! or that has motions of its own, reaches the numbers of the original elsewhere, and its figures mean nothing.

use std::collections::HashMap;

use nalgebra::{UnitQuaternion, Vector3};

use super::executed_end::{ExecutedEnd, deviation};
use super::kept_placement::KeptPlacement;
use crate::cut::only_start;
use crate::line_list::lines_of;
use crate::segment::curve::Curve;
use truegrind_arm::model::Joints;
use truegrind_math::option_f64::OptionF64;
use truegrind_math::se3::Pose;
use truegrind_programs::motion::{
    Frame, Listing, Modal, Motion, MotionKind, Reason, Switch, Tool, WorkObject,
};
use truegrind_programs::rewrite::RewriteOptions;

/// How much farther than its neighbours an inserted target may be off the intended path (mm): a program may be verified with another
/// model than the one that corrected it.
const FREE_MM: f64 = 0.2;
/// The same, per deviation of its neighbours.
const FREE_SHARE: f64 = 0.5;
/// The largest turn of a joint by a correction that may bring it into another quarter (rad).
const CORRECTED_TURN_RAD: f64 = 0.5;

/// How much the deviation may change from a cut to an air move beside it, per distance: a placement that is kept is turned by less (rad).
const FREE_LEVER: f64 = 0.003;
/// How far the tool may be turned off what the original intends, beyond the original itself (°): a program may be verified with another
/// model than the one that corrected it, but no correction turns a tool by more.
const FREE_DEG: f64 = 0.3;
/// Steps in which the orientation along a way is searched (°), and most of them.
const TURN_STEP_DEG: f64 = 0.05;
const MAX_TURN_STEPS: f64 = 4000.0;
/// Targets are the same within this (mm, rad): numbers are written with fewer decimals.
const SAME_MM: f64 = 1e-3;
const SAME_RAD: f64 = 1e-5;
/// An axis that a block states as the original does is off by no more than this (mm).
const KEPT_MM: f64 = 1e-9;
/// Motions of a program among which the cut of an air move is sought.
const NEAR_MOTIONS: usize = 50;

/// Two programs, with the ends of their motions.
pub(super) struct Compared<'a> {
    pub(super) original: &'a Listing,
    pub(super) rewritten: &'a Listing,
    /// The rewritten motion of each original one.
    pub(super) partners: &'a [Option<usize>],
    pub(super) before: &'a [Option<&'a ExecutedEnd>],
    pub(super) after: &'a [Option<&'a ExecutedEnd>],
    /// How the cuts lie off as a whole.
    pub(super) placements: &'a [KeptPlacement],
    /// The quarters cf1, cf4 and cf6 of joints of the nominal arm.
    pub(super) configuration: &'a dyn Fn(&Joints) -> [i32; 3],
}

/// What differs, each with the motions of the rewritten program where it does.
#[derive(Default)]
struct Found {
    entries: Vec<(String, Vec<u32>)>,
    /// Where a sentence stands: a size in it makes nearly each its own.
    index_of: HashMap<String, usize>,
}

impl Found {
    fn push(&mut self, motion: usize, what: String) {
        let index = *self.index_of.entry(what).or_insert_with_key(|what| {
            self.entries.push((what.clone(), Vec::new()));
            self.entries.len() - 1
        });
        self.entries[index].1.push(motion as u32);
    }
}

impl Compared<'_> {
    /// What differs, by line of the rewritten program.
    pub(super) fn differences(&self) -> Vec<String> {
        let [original, rewritten] = [self.original, self.rewritten];
        let mut sentences = Vec::new();
        if rewritten.motions.len() < original.motions.len() {
            let [has, of] = [rewritten, original].map(|listing| listing.motions.len());
            sentences.push(format!("{has} motions, but the original has {of}: motions were removed"));
            return sentences;
        }
        if rewritten.opaque.len() != original.opaque.len() {
            let [has, of] = [rewritten, original].map(|listing| listing.opaque.len());
            sentences.push(format!("{has} unreadable regions; the original has {of}"));
        }
        let mut found = Found::default();
        for (index, partner) in self.partners.iter().enumerate() {
            if let Some(partner) = *partner {
                self.compare_pair(index, partner, &mut found);
            }
        }
        self.find_added(&mut found);
        sentences.extend(found.entries.into_iter().map(|(what, motions)| {
            let lines = lines_of(rewritten, &motions).unwrap_or_default();
            format!("{lines}: {what}")
        }));
        sentences
    }

    fn compare_pair(&self, index: usize, partner: usize, found: &mut Found) {
        let [original, rewritten] = [self.original, self.rewritten];
        let [was, is] = [&original.motions[index], &rewritten.motions[partner]];
        if !is_possible_form(was, is) {
            found.push(partner, format!("{} here, {} in the original", is.instruction, was.instruction));
        }
        if !stands_alike([original, rewritten], [was, is]) {
            let what = "the motion is in another routine, branch or loop than in the original";
            found.push(partner, what.to_owned());
        }
        let [had, has] = [original.tool(was), rewritten.tool(is)];
        if !is_same_tool(had, has) {
            found
                .push(partner, format!("tool {} here, {} in the original", tool_words(has), tool_words(had)));
        }
        let [had, has] = [original.work_object(was), rewritten.work_object(is)];
        let displacement = |object: Option<&WorkObject>| object.and_then(|object| object.displacement);
        if displacement(had) != displacement(has) || was.modal.displacement != is.modal.displacement {
            found.push(partner, "the program displacement differs from the original".to_owned());
        } else if !is_same_object(had, has) {
            let [has, had] = [has, had].map(object_words);
            found.push(partner, format!("work object {has} here, {had} in the original"));
        }
        if self.before[index].is_some() && self.after[partner].is_none() {
            let what = "the target is unknown or out of reach here, but not in the original";
            found.push(partner, what.to_owned());
        }
        if let Some(mm) = self.circle_point_off_mm(index, partner) {
            let what =
                format!("the circle point is {mm:.1} mm off the circle that the end of the motion fits");
            found.push(partner, what);
        }
        if let Some(mm) = self.joint_way_off_mm(index, partner) {
            found.push(partner, format!("joint targets that leave the line of the original by {mm:.1} mm"));
        }
        if let Some(what) = self.air_target_off(index, partner).or_else(|| self.turned_off(index, partner)) {
            found.push(partner, what);
        }
        // The text of NC programs is compared word by word, and an inserted block near its neighbours may be taken for one of them here.
        if !original.numbered {
            self.compare_settings(index, partner, found);
        }
    }

    /// What decides how a motion leads to its target: no correction changes it.
    fn compare_settings(&self, index: usize, partner: usize, found: &mut Found) {
        let [original, rewritten] = [self.original, self.rewritten];
        let [was, is] = [&original.motions[index], &rewritten.motions[partner]];
        let [had, has] = [original.zone(was), rewritten.zone(is)];
        if !is_same_value(
            had.map(|zone| (&zone.text, &zone.value)),
            has.map(|zone| (&zone.text, &zone.value)),
        ) {
            let [has, had] = [has, had].map(|zone| zone.map_or("none", |zone| &zone.text));
            found.push(partner, format!("zone {has} here, {had} in the original"));
        }
        let [had, has] = [original.speed(was), rewritten.speed(is)];
        let is_same = is_same_value(
            had.map(|speed| (&speed.text, &speed.value)),
            has.map(|speed| (&speed.text, &speed.value)),
        );
        let lasts = |listing: &Listing, motion: usize| listing.durations_s.get(&(motion as u32)).copied();
        if !is_same || lasts(original, index) != lasts(rewritten, partner) {
            let [has, had] = [has, had].map(|speed| speed.map_or("none", |speed| &speed.text));
            let what = match (has == had, rewritten.numbered) {
                (false, _) => format!("speed {has} here, {had} in the original"),
                (true, false) => format!("speed {has} with another \\V or \\T than in the original"),
                (true, true) => format!("speed {has} is not that of the original"),
            };
            found.push(partner, what);
        }
        let settings = |motion: &Motion| Modal { displacement: Switch::Off, ..motion.modal };
        if settings(was) != settings(is) {
            let what = "ConfL, ConfJ, SingArea, CirPathMode or another setting of the motion differs from the original";
            found.push(partner, what.to_owned());
        }
        if external(was).zip(external(is)).is_some_and(|(had, has)| had != has) {
            found.push(partner, "the external axes differ from the original".to_owned());
        }
        if self.is_another_configuration(index, partner) {
            found
                .push(partner, "the configuration (cf1, cf4, cf6, cfx) differs from the original".to_owned());
        }
    }

    /// Whether a target states another configuration than the original, and not because the correction turns a joint into the next quarter.
    fn is_another_configuration(&self, index: usize, partner: usize) -> bool {
        let stated = |motion: &Motion| Some(motion.to()?.value.ok()?.cartesian()?.conf);
        let [was, is] = [stated(&self.original.motions[index]), stated(&self.rewritten.motions[partner])];
        let (Some(was), Some(is)) = (was, is) else { return false };
        if was == is {
            return false;
        }
        let (Some(before), Some(after)) = (self.before[index], self.after[partner]) else { return true };
        let is_turned = (after.joints - before.joints).amax() < CORRECTED_TURN_RAD;
        was[3] != is[3] || !is_turned || (self.configuration)(&after.joints) != is[..3]
    }

    /// How far the circle point is off where the end of its motion would have it (mm), if by more than a correction leaves.
    fn circle_point_off_mm(&self, index: usize, partner: usize) -> Option<f64> {
        let [was, is] = [&self.original.motions[index], &self.rewritten.motions[partner]];
        let via = |motion: &Motion| Some(motion.via()?.value.ok()?.cartesian()?.pose().translation.vector);
        let (intended, stated) = (via(was)?, via(is)?);
        let (before, after) = (self.before[index]?, self.after[partner]?);
        let moved_mm = (stated - intended).norm();
        if moved_mm > 0.0 && correction(before, after).norm() == 0.0 {
            return Some(moved_mm);
        }
        let off = |before: &ExecutedEnd, after: &ExecutedEnd| {
            after.reached.translation.vector - before.commanded.translation.vector
        };
        // How much farther off the circle point is than the end.
        let unlike_end_mm = |end: &ExecutedEnd| {
            let reached = end.on_the_way.first()?.translation.vector;
            Some((reached - intended - off(before, end)).norm())
        };
        let start = was.previous.map(|start| start as usize);
        let at_start =
            start.and_then(|start| Some(off(self.before[start]?, self.after[self.partners[start]?]?)));
        let spread_mm = at_start.map_or(0.0, |at_start| (at_start - off(before, after)).norm());
        // An arm whose errors vary over a large circle leaves as much under another model.
        let bound_mm = FREE_MM + FREE_SHARE * spread_mm + unlike_end_mm(before).unwrap_or(0.0);
        unlike_end_mm(after).filter(|mm| *mm > bound_mm)
    }

    /// What is wrong with a changed target of a joint motion, which the figures of the cut do not show: it leads neither where the original
    /// intends nor as far from there as the cut next to it does, where that keeps its placement.
    fn air_target_off(&self, index: usize, partner: usize) -> Option<String> {
        let [was, is] = [&self.original.motions[index], &self.rewritten.motions[partner]];
        let (before, after) = (self.before[index]?, self.after[partner]?);
        let turned_rad = (after.joints - before.joints).amax();
        let is_same = correction(before, after).norm() <= SAME_MM && turned_rad <= SAME_RAD;
        if !matches!(was.kind, MotionKind::Joint | MotionKind::AbsoluteJoint) || is_same {
            return None;
        }
        if was.kind == MotionKind::AbsoluteJoint && turned_rad > CORRECTED_TURN_RAD {
            let deg = turned_rad.to_degrees();
            return Some(format!("{} turns a joint {deg:.0}° farther than in the original", is.instruction));
        }
        let off = deviation(before, after);
        let (beside, apart_mm) =
            self.deviation_beside(index).unwrap_or_else(|| (deviation(before, before), 0.0));
        let bound_mm = FREE_MM + FREE_LEVER * apart_mm;
        let place = (before.base_from_object * before.commanded).translation.vector;
        let is_possible = |off: &Vector3<f64>| {
            off.norm() <= FREE_MM
                || (off - beside).norm() <= bound_mm
                || self.placements.iter().any(|kept| (off - kept.at(&place)).norm() <= bound_mm)
        };
        // A lift of an NC program before a canned cycle is corrected only in the axes that it omits: in the others it is off as in the original.
        let in_moved_axes = || {
            let is_moved = correction(before, after).map(|by| f64::from(u8::from(by.abs() > KEPT_MM)));
            let object = before.base_from_object.rotation;
            object * (object.inverse() * off).component_mul(&is_moved)
        };
        if !(is_possible(&off) || self.original.numbered && is_possible(&in_moved_axes())) {
            let mm = off.norm();
            return Some(format!("{} ends {mm:.1} mm from where the original intends", is.instruction));
        }
        None
    }

    /// What is wrong with the orientation at the end or at the circle point of a motion, which the figures of the tool's point do not show:
    /// a tool that is turned about its tip cuts with another face.
    fn turned_off(&self, index: usize, partner: usize) -> Option<String> {
        let [was, is] = [&self.original.motions[index], &self.rewritten.motions[partner]];
        let (before, after) = (self.before[index]?, self.after[partner]?);
        let off_deg = |end: &ExecutedEnd, reached: &Pose, intended: &Pose| {
            let turns = self.reached_alike(end, reached).into_iter();
            turns.map(|turn| turn.angle_to(&intended.rotation).to_degrees()).fold(f64::INFINITY, f64::min)
        };
        let ends = [after, before].map(|end| off_deg(end, &end.reached, &before.commanded));
        if let Some(deg) = beyond(ends) {
            return Some(format!(
                "{} ends turned by {deg:.1}° from what the original intends",
                is.instruction
            ));
        }
        if is.kind != MotionKind::Circular {
            return None;
        }
        let intended = was.via()?.value.ok()?.cartesian()?.pose();
        let at_via = |end: &ExecutedEnd| Some(off_deg(end, end.on_the_way.first()?, &intended));
        let deg = beyond([at_via(after)?, at_via(before)?])?;
        Some(format!(
            "{} is turned by {deg:.1}° at its circle point from what the original intends",
            is.instruction
        ))
    }

    /// The orientation of the tool as reached, and as it would be reached if the placement of the cuts were corrected too.
    fn reached_alike(&self, end: &ExecutedEnd, reached: &Pose) -> Vec<UnitQuaternion<f64>> {
        let object = end.base_from_object.rotation;
        let placed =
            |kept: &KeptPlacement| object.inverse() * kept.rotation().inverse() * object * reached.rotation;
        std::iter::once(reached.rotation).chain(self.placements.iter().map(placed)).collect()
    }

    /// The deviation at the nearest motion of a cut, and how far from a motion that is (mm). One path has one placement, whatever its frames.
    fn deviation_beside(&self, index: usize) -> Option<(Vector3<f64>, f64)> {
        let place = |end: &ExecutedEnd| (end.base_from_object * end.commanded).translation.vector;
        let here = place(self.before[index]?);
        let beside = |other: usize| {
            let kind = self.original.motions[other].kind;
            if !matches!(kind, MotionKind::Linear | MotionKind::Circular) {
                return None;
            }
            let (before, after) = (self.before[other]?, self.after[self.partners[other]?]?);
            Some((deviation(before, after), (place(before) - here).norm()))
        };
        // In the text the cut of an approach or a retreat is near.
        let around = index.saturating_sub(NEAR_MOTIONS)..(index + NEAR_MOTIONS).min(self.before.len());
        around.filter_map(beside).min_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// How far joint motions that stand for a line lead off it (mm), if farther than a correction leaves.
    fn joint_way_off_mm(&self, index: usize, partner: usize) -> Option<f64> {
        let [was, is] = [&self.original.motions[index], &self.rewritten.motions[partner]];
        if was.kind != MotionKind::Linear || is.kind != MotionKind::AbsoluteJoint {
            return None;
        }
        let first =
            index.checked_sub(1).and_then(|before| self.partners[before]).map_or(partner, |end| end + 1);
        let (way, bound_mm) = self.way_of(index)?;
        let places =
            (first..=partner).filter_map(|motion| self.after[motion]).flat_map(|end| &end.on_the_way);
        let off_mm = places.map(|place| distance_mm(&way, place)).fold(0.0, f64::max);
        (off_mm > bound_mm).then_some(off_mm)
    }

    /// Motions that belong to none of the original and are no targets inserted on its path.
    fn find_added(&self, found: &mut Found) {
        let mut next = 0;
        let mut owner: Vec<Option<usize>> = vec![None; self.after.len()];
        for (index, partner) in self.partners.iter().enumerate() {
            let Some(partner) = *partner else { continue };
            owner[next..partner].fill(Some(index));
            next = partner + 1;
        }
        let mut is_partner = vec![false; self.after.len()];
        self.partners.iter().flatten().for_each(|partner| is_partner[*partner] = true);
        for added in (0..self.after.len()).filter(|motion| !is_partner[*motion]) {
            match owner[added].and_then(|index| self.off_path_mm(added, index)) {
                Some((mm, bound_mm)) if mm <= bound_mm => {
                    let partner = owner[added].and_then(|index| self.partners[index]);
                    if let Some(what) = partner.and_then(|partner| self.inserted_otherwise(added, partner)) {
                        found.push(added, what);
                    }
                    if let Some(deg) =
                        owner[added].and_then(|index| self.turned_off_path_deg(added, index, mm))
                    {
                        found.push(
                            added,
                            format!("an added motion that ends turned by {deg:.1}° off the original path"),
                        );
                    }
                }
                Some((mm, _)) => {
                    found.push(added, format!("an added motion that ends {mm:.1} mm off the original path"))
                }
                None => found.push(added, "an added motion that is on no path of the original".to_owned()),
            }
        }
    }

    /// What an inserted motion has otherwise than a correction writes it: on the way of a line or a circle, with the speed of the motion
    /// that follows and a small zone.
    fn inserted_otherwise(&self, added: usize, owner: usize) -> Option<String> {
        let rewritten = self.rewritten;
        let [inserted, owner] = [added, owner].map(|motion| &rewritten.motions[motion]);
        let is_on_way = inserted.kind == MotionKind::Linear
            || inserted.kind == owner.kind && owner.kind == MotionKind::AbsoluteJoint;
        if !is_on_way || inserted.rapid {
            return Some(format!("an added {} on a path that the tool follows", inserted.instruction));
        }
        if rewritten.numbered {
            return None;
        }
        let [speed, wanted] = [inserted, owner].map(|motion| rewritten.speed(motion));
        if !is_same_value(speed.map(|s| (&s.text, &s.value)), wanted.map(|s| (&s.text, &s.value))) {
            let [speed, wanted] = [speed, wanted].map(|speed| speed.map_or("none", |speed| &speed.text));
            return Some(format!("an added motion with speed {speed}, before one with speed {wanted}"));
        }
        let zone = rewritten.zone(inserted).map_or("none", |zone| &zone.text);
        let written = RewriteOptions::default().extra_zone;
        (!zone.eq_ignore_ascii_case(&written))
            .then(|| format!("an added motion with zone {zone}; a correction writes {written}"))
    }

    /// How far an inserted target leads off the way of an original motion (mm), and how far it may; `None` where it cannot have been
    /// inserted on it.
    fn off_path_mm(&self, added: usize, index: usize) -> Option<(f64, f64)> {
        let (was, inserted) = (&self.original.motions[index], &self.rewritten.motions[added]);
        let partner = self.partners[index]?;
        let owner = &self.rewritten.motions[partner];
        if !matches!(was.kind, MotionKind::Linear | MotionKind::Circular)
            || !inserted.same_frames(owner)
            || inserted.routine != owner.routine
        {
            return None;
        }
        let (way, bound_mm) = self.way_of(index)?;
        Some((distance_mm(&way, &self.after[added]?.reached), bound_mm))
    }

    /// By how much an inserted target is turned off the way of an original motion (°), if by more than a correction leaves. The tool may lead
    /// or lag along that way: of the orientations nearby the nearest counts.
    fn turned_off_path_deg(&self, added: usize, index: usize, off_mm: f64) -> Option<f64> {
        let (way, bound_mm) = self.way_of(index)?;
        let end = self.after[added]?;
        let reached = self.reached_alike(end, &end.reached);
        let deg = least_turn_deg(&way, &end.reached, &reached, off_mm.max(bound_mm));
        let off_deg = |end: Option<&ExecutedEnd>, of: usize| {
            Some(turn_deg(&self.after[self.partners[of]?]?.reached, &end?.commanded))
        };
        let start = only_start(self.original, index);
        let ends = [start, Some(index)].into_iter().flatten();
        let beside_deg = ends.filter_map(|of| off_deg(self.before[of], of)).fold(0.0, f64::max);
        (deg > FREE_DEG + (1.0 + FREE_SHARE) * beside_deg).then_some(deg)
    }

    /// The way of an original motion, and how far what a correction writes for it may be off (mm).
    fn way_of(&self, index: usize) -> Option<(Curve, f64)> {
        let was = &self.original.motions[index];
        let start_index = only_start(self.original, index).or(index.checked_sub(1))?;
        let (start, end) = (self.before[start_index]?, self.before[index]?);
        // The start may be stated in another work object.
        let from = end.base_from_object.inverse() * start.base_from_object * start.commanded;
        let way = way(was, from, end.commanded)?;
        let deviation_mm = |before: &ExecutedEnd, partner: Option<usize>| {
            let reached = self.after[partner?]?.reached.translation.vector;
            Some((reached - before.commanded.translation.vector).norm())
        };
        let partner = self.partners[index];
        let beside =
            [deviation_mm(start, self.partners[start_index]), deviation_mm(end, partner)].into_iter();
        let beside_mm = beside.flatten().fold(0.0, f64::max);
        Some((way, (1.0 + FREE_SHARE) * beside_mm + FREE_MM))
    }
}

/// External axes of the end of a motion.
fn external(motion: &Motion) -> Option<[OptionF64; 6]> {
    motion.to()?.value.as_ref().ok().map(|value| *value.external())
}

/// Whether an argument has the same value, or where that is unknown the same words.
fn is_same_value<T: PartialEq>(
    a: Option<(&String, &Result<T, Reason>)>,
    b: Option<(&String, &Result<T, Reason>)>,
) -> bool {
    match (a, b) {
        (Some((_, Ok(a))), Some((_, Ok(b)))) => a == b,
        (Some((a, _)), Some((b, _))) => a.eq_ignore_ascii_case(b),
        (None, None) => true,
        _ => false,
    }
}

/// The angle between two orientations (°).
fn turn_deg(a: &Pose, b: &Pose) -> f64 {
    a.rotation.angle_to(&b.rotation).to_degrees()
}

/// A turn after the correction that the turn before it does not explain (°).
fn beyond([after_deg, before_deg]: [f64; 2]) -> Option<f64> {
    (after_deg > before_deg + FREE_DEG).then_some(after_deg)
}

/// The least angle between one of these orientations at a pose and those of a way within a distance along it (°).
fn least_turn_deg(way: &Curve, pose: &Pose, reached: &[UnitQuaternion<f64>], within_mm: f64) -> f64 {
    let share = nearest_share(way, pose);
    let reach = if way.length_mm() > within_mm { within_mm / way.length_mm() } else { 1.0 };
    let [from, to] = [share - reach, share + reach].map(|s| s.clamp(0.0, 1.0));
    let turned_deg = way.turn_rad().to_degrees() * (to - from);
    let steps = (turned_deg / TURN_STEP_DEG).ceil().clamp(1.0, MAX_TURN_STEPS) as usize;
    let at = |k: usize| way.at(from + (to - from) * k as f64 / steps as f64).rotation;
    let least = |k: usize| reached.iter().map(|turn| turn.angle_to(&at(k))).fold(f64::INFINITY, f64::min);
    (0..=steps).map(least).fold(f64::INFINITY, f64::min).to_degrees()
}

/// How a correction moves the end of a motion, in the work object (mm).
fn correction(before: &ExecutedEnd, after: &ExecutedEnd) -> Vector3<f64> {
    after.commanded.translation.vector - before.commanded.translation.vector
}

/// The way of a motion.
pub(super) fn way(motion: &Motion, from: Pose, to: Pose) -> Option<Curve> {
    if motion.kind == MotionKind::Linear {
        return Some(Curve::line(from, to));
    }
    Curve::round(from, &motion.via()?.value.ok()?.cartesian()?.pose(), to, motion)
}

/// The share of a way that is nearest to a pose, between its ends.
pub(super) fn nearest_share(way: &Curve, pose: &Pose) -> f64 {
    if way.arc().is_some() {
        return way.passes(pose);
    }
    let along = way.to.translation.vector - way.from.translation.vector;
    let square = along.norm_squared();
    if square > 0.0 {
        ((pose.translation.vector - way.from.translation.vector).dot(&along) / square).clamp(0.0, 1.0)
    } else {
        0.0
    }
}

/// Distance of a pose from a way between its ends (mm).
fn distance_mm(way: &Curve, pose: &Pose) -> f64 {
    (way.at(nearest_share(way, pose)).translation.vector - pose.translation.vector).norm()
}

/// Whether a correction can turn one form into the other: it writes joints for poses, and straight segments for circles.
fn is_possible_form(was: &Motion, is: &Motion) -> bool {
    let kind = match was.kind {
        MotionKind::Linear | MotionKind::Joint => [was.kind, was.kind, MotionKind::AbsoluteJoint],
        MotionKind::Circular => [MotionKind::Circular, MotionKind::Linear, MotionKind::AbsoluteJoint],
        other => [other; 3],
    };
    kind.contains(&is.kind) && was.rapid == is.rapid
}

/// Whether both are in the same routine, and agree on being conditional or in a loop.
fn stands_alike([original, rewritten]: [&Listing; 2], [was, is]: [&Motion; 2]) -> bool {
    let routine = |listing: &Listing, motion: &Motion| {
        motion.routine.map(|routine| listing.routines[routine as usize].name.to_lowercase())
    };
    routine(original, was) == routine(rewritten, is)
        && (was.conditional, was.in_loop) == (is.conditional, is.in_loop)
}

fn is_same_tool(a: Option<&Tool>, b: Option<&Tool>) -> bool {
    match (a, b) {
        (Some(a), Some(b)) => a.name.eq_ignore_ascii_case(&b.name) && a.value == b.value,
        (None, None) => true,
        _ => false,
    }
}

fn is_same_object(a: Option<&WorkObject>, b: Option<&WorkObject>) -> bool {
    match (a, b) {
        (Some(a), Some(b)) => a.name.eq_ignore_ascii_case(&b.name) && a.value == b.value,
        (None, None) => true,
        _ => false,
    }
}

fn tool_words(tool: Option<&Tool>) -> String {
    let Some(tool) = tool else { return "none".to_owned() };
    match &tool.value {
        Ok(value) => {
            let at = if value.robhold { "" } else { ", stationary" };
            format!("{} at {}, {} kg{at}", tool.name, frame_words(&value.frame), value.mass_kg)
        }
        Err(_) => format!("{}, whose value is unknown", tool.name),
    }
}

fn object_words(object: Option<&WorkObject>) -> String {
    let Some(object) = object else { return "none".to_owned() };
    match &object.value {
        Ok(value) => format!(
            "{} with user frame {} and object frame {}",
            object.name,
            frame_words(&value.user_frame),
            frame_words(&value.object_frame)
        ),
        Err(_) => format!("{}, whose value is unknown", object.name),
    }
}

fn frame_words(frame: &Frame) -> String {
    format!("{:?} mm {:?}", frame.position_mm, frame.quaternion)
}
