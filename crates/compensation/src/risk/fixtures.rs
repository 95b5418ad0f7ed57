//! Which work objects are placed as one: those on one fixture, and those that a path joins.
//!
//! A controller's work object is a user frame, the fixture, and an object frame in it, the part. Parts on one fixture have places to each
//! other that the program states and that no arm displaces: if the placement were decided for each, one part would move away from the other by
//! the whole error of the placement.
//!
//! A path that goes on from one work object into another would have a step as high as that error where they meet, whether or not they stand
//! on one fixture. So would a line whose start was reached in another work object, as with an approach in `wobj0`.

use std::collections::{BTreeMap, BTreeSet};

use crate::cut::{find, joins, unite};
use truegrind_programs::motion::{Frame, Listing, Motion, MotionKind, WorkObject};

/// What two work objects on one fixture have in common.
#[derive(PartialEq, Eq, PartialOrd, Ord)]
enum Fixture {
    /// The same name, held the same way: a program displacement sets targets apart, not parts.
    Name(String, bool),
    /// The same user frame, held the same way.
    UserFrame([u64; 7], bool),
}

/// For each work object of a listing the first of those that are placed as one with it. `taught`: those that were taught with this arm, each
/// by touches of its own. `joint_targets`: whether joint targets are corrected too, so that they can begin a path.
pub(crate) fn of(listing: &Listing, taught: &BTreeSet<u32>, joint_targets: bool) -> Vec<u32> {
    let mut first = on_one_fixture(listing, taught);
    for [start, index] in joins(listing) {
        let [start, motion] = [start, index].map(|index| &listing.motions[index as usize]);
        let (Some(a), Some(b)) = (start.work_object, motion.work_object) else { continue };
        let begins = start.kind != MotionKind::AbsoluteJoint || joint_targets;
        if a != b && begins && is_held(listing, a) == is_held(listing, b) {
            unite(&mut first, a, b);
        }
    }
    (0..first.len() as u32).map(|object| find(&mut first, object)).collect()
}

/// The part of a motion, by the result of [`of`].
pub(crate) fn part_of_motion(motion: &Motion, part_of: &[u32]) -> u32 {
    motion.work_object.map_or(u32::MAX, |object| part_of[object as usize])
}

/// Whether the robot holds a work object: that moves with the flange and can have no displacement in common with one that stands. `None`
/// where its value is not known, so that nothing on it is corrected.
fn is_held(listing: &Listing, object: u32) -> Option<bool> {
    listing.work_objects[object as usize].value.as_ref().ok().map(|value| value.robhold)
}

/// For each work object of a listing the first on the same fixture.
fn on_one_fixture(listing: &Listing, taught: &BTreeSet<u32>) -> Vec<u32> {
    let taught_names: BTreeSet<String> = (0..)
        .zip(&listing.work_objects)
        .filter(|(index, _)| taught.contains(index))
        .map(|(_, object)| object.name.to_ascii_lowercase())
        .collect();
    let mut first: BTreeMap<Fixture, u32> = BTreeMap::new();
    let mut out = Vec::with_capacity(listing.work_objects.len());
    for (index, object) in (0_u32..).zip(&listing.work_objects) {
        let name = object.name.to_ascii_lowercase();
        let held = object.value.as_ref().is_ok_and(|value| value.robhold);
        let shared = user_frame(object).filter(|_| !taught_names.contains(&name));
        let by_name = *first.entry(Fixture::Name(name, held)).or_insert(index);
        // The first of its name leads to the first in the same user frame.
        let of_name = if by_name == index { index } else { out[by_name as usize] };
        out.push(match shared {
            Some(frame) if by_name == index => {
                *first.entry(Fixture::UserFrame(frame, held)).or_insert(of_name)
            }
            _ => of_name,
        });
    }
    out
}

/// The numbers of a user frame that is a fixture: one that is fixed and is not the base, or flange, itself. Objects that are stated in the
/// base were each measured or adjusted there; nothing says that they belong together.
fn user_frame(object: &WorkObject) -> Option<[u64; 7]> {
    let value = object.value.as_ref().ok().filter(|value| value.fixed)?;
    let Frame { position_mm: p, quaternion: q } = value.user_frame;
    let is_base = p == [0.0; 3] && q[1..] == [0.0; 3];
    // −0 and 0 are the same number.
    (!is_base).then(|| [p[0], p[1], p[2], q[0], q[1], q[2], q[3]].map(|number| (number + 0.0).to_bits()))
}

/// The names of the other work objects whose first is `part`.
pub(crate) fn other_names(listing: &Listing, part_of: &[u32], part: u32) -> Vec<String> {
    let own = &listing.work_objects[part as usize].name;
    let mut out: Vec<String> = Vec::new();
    for (object, _) in listing.work_objects.iter().zip(part_of).filter(|(_, of)| **of == part) {
        let is_said = |said: &String| said.eq_ignore_ascii_case(&object.name);
        if !is_said(own) && !out.iter().any(is_said) {
            out.push(object.name.clone());
        }
    }
    out
}
