//! Backlash sides: from which side each joint arrives at every target, derived from the program's own motion.
//!
//! A link with backlash rests until a flank engages. Its position follows from the joints along the path: an interval as wide
//! as the backlash where nothing is known (start of a program, a motion that the text does not determine), a point once its
//! motor has moved by more than that. A corrected target prescribes the link position. The motor pushes the link there from
//! below if it is above the whole interval, from above if it is below, and travels the backlash in addition where it
//! reverses; in between no side is known, and side 0 means mid-play. A target whose link reverses by less than the backlash
//! is thus distinguished from one whose motor alone reverses: an unmodified target leaves such a link between its flanks.
//!
//! Lines and arcs are sampled between their ends; a parabola through neighbouring samples locates reversals. Where the text
//! leaves the joint path open (rapid motions of NC; lines and arcs with separate wrist interpolation; lines written as joints
//! or split by inserted targets), each possible path is followed, and a side is known where all agree. Where the arm cannot follow a
//! path to joints that no configuration states, it may end a whole turn of a joint away: from which side joints arrive from there
//! is unknown until joints are stated again.

pub(crate) use crate::backlash::motion_end::{BacklashSides, JointSides, MotionEnd, ReachedEnd};

use crate::backlash::joint_samples::{by_wrist, sampled};
use crate::backlash::motion_end::SampledJoints;
use crate::backlash::play_track::{PlayTrack, agreed, arrive, passing};
use crate::configuration;
use crate::frames::frame_pair::FramePair;
use truegrind_arm::inverse::Inverse;
use truegrind_programs::motion::Switch;

/// The sides along all motions. `before[m]`: the motion that ended where motion m starts. `unknown_sides[m]`: the joints whose side
/// counts as unknown at the end of motion m; none where it is empty.
pub(crate) fn backlash_sides(
    stops: &[MotionEnd<'_>],
    before: &[Option<u32>],
    nominal: &Inverse<'_>,
    play_rad: &[f64; 6],
    frames_of: &dyn Fn(usize) -> FramePair,
    unknown_sides: &[[bool; 6]],
) -> Vec<BacklashSides> {
    let half = play_rad.map(|play| 0.5 * play.abs());
    let (paths, passes) = sampled(stops, before, nominal, &half, frames_of);
    let by_wrist = by_wrist(stops, before, nominal, &half, frames_of);
    let mut tracks: Vec<Option<[PlayTrack; 6]>> = Vec::with_capacity(stops.len());
    // Whether the joints at the end of each motion may be others than those solved.
    let mut unsettled = vec![false; stops.len()];
    let mut out = Vec::with_capacity(stops.len());
    for (m, stop) in stops.iter().enumerate() {
        let from = before[m].map(|b| b as usize).filter(|b| *b < m);
        let from_unsettled = from.is_some_and(|b| unsettled[b]);
        let from = from.filter(|_| !from_unsettled);
        let mut track = from.and_then(|b| tracks[b]);
        let mut sides = BacklashSides { turns: Vec::new(), end: [0; 6], via: [0; 6] };
        match stop {
            MotionEnd::Unknown => track = None,
            MotionEnd::Unmoved if from_unsettled => unsettled[m] = true,
            MotionEnd::Unmoved => sides.end = track.map_or([0; 6], |track| track.map(|t| t.side)),
            MotionEnd::At(reached) => {
                let start = from.and_then(|b| match &stops[b] {
                    MotionEnd::At(start) => Some(start.joints),
                    _ => None,
                });
                let mut here = track.unwrap_or_else(|| {
                    let at = start.unwrap_or(reached.joints);
                    std::array::from_fn(|j| PlayTrack::unknown(at[j], half[j]))
                });
                here.iter_mut().for_each(|t| t.since = 0.0);
                let mut along: Vec<SampledJoints> = Vec::new();
                for samples in std::iter::once(&paths[m]).chain(&by_wrist[m]) {
                    let begin = start.map(|joints| (0.0, joints));
                    along.extend(
                        samples.as_ref().map(|inner| begin.into_iter().chain(inner.clone()).collect()),
                    );
                }
                let follows = along.len() == 1 + by_wrist[m].iter().count();
                unsettled[m] =
                    (from_unsettled || !follows) && configuration::monitored(reached.motion) != Switch::On;
                if from_unsettled || !follows {
                    // The arm cannot follow the path, so how it arrives is unknown.
                    here = std::array::from_fn(|j| PlayTrack::unknown(reached.joints[j], half[j]));
                    along = vec![Vec::new()];
                }
                sides.via = agreed(along.iter().map(|samples| passing(here, reached, samples, passes[m])));
                (sides.turns, here) = arrive(here, reached, &along);
                sides.end = here.map(|t| t.side);
                for joint in (0..6)
                    .filter(|&joint| unknown_sides.get(m).is_some_and(|unknown_sides| unknown_sides[joint]))
                {
                    sides.forget(joint);
                    here[joint].forget(reached.links.map(|links| links[joint]), reached.joints[joint]);
                }
                let open = sides.end.map(|side| side == 0);
                (0..6).filter(|&joint| open[joint]).for_each(|joint| sides.forget(joint));
                track = Some(here);
            }
        }
        tracks.push(track);
        out.push(sides);
    }
    out
}
