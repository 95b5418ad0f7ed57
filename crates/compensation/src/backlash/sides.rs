//! From which side each joint comes to rest, from the program's own motion.
//!
//! A link with play stays where it is until one of its flanks takes it along, so where it can be follows from the joints on
//! the way: a range, as wide as the play where nothing is known (the start of a program, a motion that the text does not
//! tell), a point from there on where its motor has moved by more than that. A target that is corrected says where the link
//! shall stand. The motor pushes it there from below if it is above all places where the link can be before, from above if
//! it is below all of them, and comes by the whole play farther where it turns; where it is between, no side is known, and
//! side 0 stands for the middle of the play. So a target whose link turns by less than its play is told from one whose
//! motor alone turns. What stays as it was told leaves a link that turns by less than its play between its flanks.
//!
//! Lines and arcs are sampled between their ends, and a parabola through neighbouring samples tells where between them
//! a joint turned. Where the text leaves open how the joints go (rapid motions of NC; lines and arcs of which the wrist goes
//! joint by joint; lines written as joints or cut by targets that are put in), each way is followed, and a side is known
//! where they agree.

pub(crate) use crate::backlash::motion_end::{BacklashSides, JointSides, MotionEnd, ReachedEnd};

use crate::backlash::joint_samples::{by_wrist, sampled};
use crate::backlash::motion_end::SampledJoints;
use crate::backlash::play_track::{PlayTrack, agreed, arrive, passing};
use crate::frames::frame_pair::FramePair;
use truegrind_arm::inverse::Inverse;

/// The sides along all motions. `before[m]`: the motion that ended where motion m starts. `doubted[m]`: the joints of which
/// no side is to be known at the end of motion m; all others where it is empty.
pub(crate) fn backlash_sides(
    stops: &[MotionEnd<'_>],
    before: &[Option<u32>],
    nominal: &Inverse<'_>,
    play_rad: &[f64; 6],
    mounting: &dyn Fn(usize) -> FramePair,
    doubted: &[[bool; 6]],
) -> Vec<BacklashSides> {
    let half = play_rad.map(|play| 0.5 * play.abs());
    let (paths, passes) = sampled(stops, before, nominal, &half, mounting);
    let by_wrist = by_wrist(stops, before, nominal, &half, mounting);
    let mut tracks: Vec<Option<[PlayTrack; 6]>> = Vec::with_capacity(stops.len());
    let mut out = Vec::with_capacity(stops.len());
    for (m, stop) in stops.iter().enumerate() {
        let from = before[m].map(|b| b as usize).filter(|b| *b < m);
        let mut track = from.and_then(|b| tracks[b]);
        let mut course = BacklashSides { turns: Vec::new(), end: [0; 6], via: [0; 6] };
        match stop {
            MotionEnd::Unknown => track = None,
            MotionEnd::Unmoved => course.end = track.map_or([0; 6], |track| track.map(|t| t.side)),
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
                if along.len() < 1 + by_wrist[m].iter().count() {
                    // The arm cannot go along the path: how it comes to the end is not known.
                    here = std::array::from_fn(|j| PlayTrack::unknown(reached.joints[j], half[j]));
                    along = vec![Vec::new()];
                }
                course.via = agreed(along.iter().map(|samples| passing(here, reached, samples, passes[m])));
                (course.turns, here) = arrive(here, reached, &along);
                course.end = here.map(|t| t.side);
                for joint in (0..6).filter(|&joint| doubted.get(m).is_some_and(|doubted| doubted[joint])) {
                    course.forget(joint);
                    here[joint].forget(reached.links.map(|links| links[joint]), reached.joints[joint]);
                }
                let open = course.end.map(|side| side == 0);
                (0..6).filter(|&joint| open[joint]).for_each(|joint| course.forget(joint));
                track = Some(here);
            }
        }
        tracks.push(track);
        out.push(course);
    }
    out
}
