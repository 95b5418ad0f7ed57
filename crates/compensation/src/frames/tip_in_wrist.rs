//! Tools whose tip lies behind the flange, within the wrist: no tool ends there, but a frame that was stated the other way round does.

use std::collections::BTreeSet;

use truegrind_arm::model::Model;
use truegrind_programs::motion::Listing;

/// A centring hole or a recess is no deeper than this (mm).
const RECESS_MM: f64 = 10.0;

/// Radius of the wrist about the axis of the flange, as a share of the length of the stretched arm. Data sheets state no shapes; `plan` takes
/// the same share for all links.
const WRIST_SHARE: f64 = 1.0 / 12.0;

/// Whether a tip (mm, flange frame) lies behind the flange, within the wrist: farther behind than beside it, since tools that reach back
/// beside the arm exist. The inverse of a tool frame has its origin there whenever the tip lies on the z axis of the tool, whatever the
/// tool's rotation.
fn is_in_wrist([x, y, z]: [f64; 3], nominal: &Model) -> bool {
    let length_mm: f64 = nominal.links[1..].iter().map(|link| link.a_mm.abs() + link.d_mm.abs()).sum();
    z < -RECESS_MM && x.hypot(y) < (WRIST_SHARE * length_mm).min(-z)
}

/// What is said of each such tool that the robot holds in one of these motions.
pub(crate) fn notes(listing: &Listing, nominal: &Model, motions: impl Iterator<Item = usize>) -> Vec<String> {
    let tools: BTreeSet<u32> = motions.filter_map(|motion| listing.motions[motion].tool).collect();
    let held = tools.into_iter().filter_map(|tool| {
        let tool = listing.tools.get(tool as usize)?;
        let value = tool.value.as_ref().ok().filter(|value| value.robhold)?;
        Some((&tool.name, value.frame.position_mm))
    });
    held.filter(|(_, tip)| is_in_wrist(*tip, nominal))
        .map(|(name, [x, y, z])| {
            format!(
                "tool {name}: its tip, at [{x}, {y}, {z}] mm, is {:.0} mm behind the flange, within the wrist. Expected: the tip as seen from \
                 the flange, whose z axis points out of it. If this is the flange as seen from the tip, state the inverse of the frame",
                -z
            )
        })
        .collect()
}
