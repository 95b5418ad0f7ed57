//! Tool and work object of a surface file compared with those of a program.
//!
//! A frame from metrology is exact: a program whose frame is elsewhere grinds elsewhere, so one of the two is wrong. A taught
//! frame can differ, since the controller holds what was taught.

use crate::frames::taught::{FrameDistance, WRITTEN_TOLERANCE, list};
use truegrind_math::se3::Pose;
use truegrind_programs::motion::{Listing, Tool, WorkObject};
use truegrind_programs::nc::setup;
use truegrind_surfaces::SurfaceFile;
use truegrind_surfaces::file::Origin;

/// Contradictions between metrology frames of the surface file and the program, one sentence each.
pub fn surface_frame_contradictions(listing: &Listing, surface: &SurfaceFile) -> Vec<String> {
    let mut out: Vec<String> = Vec::new();
    let mut add = |fault: Option<String>| out.extend(fault);
    if surface.tool.origin == Some(Origin::Metrology) {
        let means = |tool: &&Tool| named(listing, &tool.name, tool.place.is_some(), &surface.tool.name);
        let commanded = listing.tools.iter().filter(means).filter_map(|tool| tool.value.as_ref().ok());
        let poses: Vec<Pose> = commanded.map(|value| value.frame.pose()).collect();
        add(fault("tool", &surface.tool.name, &surface.tool.flange_from_tool, &poses));
    }
    if surface.work_object.origin == Some(Origin::Metrology) {
        let stated = &surface.work_object;
        let means = |object: &&WorkObject| named(listing, &object.name, object.place.is_some(), &stated.name);
        // A program displacement is not part of the stated frame.
        let undisplaced = |object: &WorkObject| {
            let value = object.value.as_ref().ok()?;
            let whole = value.user_frame.pose() * value.object_frame.pose();
            Some(object.displacement.map_or(whole, |frame| whole * frame.pose().inverse()))
        };
        let poses: Vec<Pose> = listing.work_objects.iter().filter(means).filter_map(undisplaced).collect();
        add(fault("work_object", &stated.name, &stated.base_from_work_object, &poses));
    }
    out
}

/// Whether a frame of the program has the stated name, in the text or in its comments.
fn named(listing: &Listing, name: &str, in_text: bool, stated: &str) -> bool {
    name.eq_ignore_ascii_case(stated)
        || !in_text
            && (setup::same(name, stated)
                || listing.labels_of(name).any(|label| label.eq_ignore_ascii_case(stated)))
}

/// The sentence for a stated frame that no frame of the program matches.
fn fault(kind: &str, name: &str, stated: &Pose, commanded: &[Pose]) -> Option<String> {
    let apart = |pose: &&Pose| FrameDistance::of(stated, pose);
    if commanded.iter().any(|pose| apart(&pose).within(WRITTEN_TOLERANCE)) {
        return None;
    }
    let nearest = commanded.iter().min_by(|a, b| apart(a).mm.total_cmp(&apart(b).mm))?;
    let FrameDistance { mm, rad } = FrameDistance::of(stated, nearest);
    Some(format!(
        "surface file: {kind} \"{name}\" is at {} with origin = \"metrology\", {mm:.2} mm and {:.3}° away \
         from the programmed one, {}: correct the one that is wrong, or write origin = \"taught\" if the \
         controller's was taught",
        list(&stated.translation.vector),
        rad.to_degrees(),
        list(&nearest.translation.vector)
    ))
}
