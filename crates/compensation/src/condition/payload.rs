//! Payload at each motion: the tool's own load (`tload`) and what the program states that it grips, on the flange.

use nalgebra::Point3;

use truegrind_arm::effect::Effect;
use truegrind_math::se3::Pose;
use truegrind_programs::motion::load::{Grip, Load, Loads};
use truegrind_programs::motion::{Listing, Motion, ToolValue, WorkObjectValue};

/// Payload at motion `index`, its centre in the flange frame (mm); `None` where the program does not state it. With an
/// unknown gripped load only the tool counts.
pub fn payload_at(loads: &Loads, index: usize, motion: &Motion, listing: &Listing) -> Option<Load> {
    if let Some(total) = loads.totals.get(&index) {
        return Some(*total);
    }
    let tool: &ToolValue = listing.tool(motion)?.value.as_ref().ok()?;
    let own =
        (tool.mass_kg > 0.0).then_some(Load { mass_kg: tool.mass_kg, centre_mm: tool.centre_of_gravity_mm });
    let Grip::Holds(held) = loads.grip(index) else { return own };
    let object: &WorkObjectValue = listing.work_object(motion)?.value.as_ref().ok()?;
    let frame: Pose = if tool.robhold { tool.frame.pose() } else { object.user_frame.pose() };
    let held = Load { centre_mm: (frame * Point3::from(held.centre_mm)).coords.into(), ..held };
    Some(match own {
        Some(own) => together(&own, &held),
        None => held,
    })
}

/// Combines two loads.
fn together(a: &Load, b: &Load) -> Load {
    let mass_kg = a.mass_kg + b.mass_kg;
    let centre_mm = std::array::from_fn(|k| {
        (a.mass_kg * a.centre_mm[k] + b.mass_kg * b.centre_mm[k]) / mass_kg.max(f64::MIN_POSITIVE)
    });
    Load { mass_kg, centre_mm }
}

/// Whether an effect depends on the payload.
pub(crate) fn is_load_dependent(effect: &Effect) -> bool {
    effect.depends_on_load() && !effect.is_zero()
}
