//! Joint samples along the segments of a program.

use crate::backlash::motion_end::{MotionEnd, ReachedEnd, SampledJoints};
use crate::backlash::reversals::samples_agree;
use crate::frames::frame_pair::FramePair;
use crate::search_budget;
use crate::segment::curve::Curve;
use crate::segment::wrist_interpolation;
use truegrind_arm::inverse::Inverse;
use truegrind_arm::inverse::budget::{SearchBudget, with_budget};
use truegrind_arm::model::Joints;
use truegrind_math::se3::Pose;
use truegrind_programs::motion::{MotionKind, Switch};

/// Largest distance between samples of a path (mm, rad).
const SAMPLE_MM: f64 = 25.0;
const SAMPLE_RAD: f64 = 0.1;
/// Most samples of a path.
const MAX_SAMPLES: usize = 64;
/// A shorter path has one sample (mm, rad): its joints are almost a parabola.
const SHORT_MM: f64 = 5.0;
const SHORT_RAD: f64 = 0.02;
/// How often the sampling is made four times denser where the samples disagree on where a joint reverses.
const REFINEMENTS: u32 = 3;
/// Most samples of a refined path.
const MAX_REFINED: usize = 256;

/// A larger joint step between neighbouring samples means that the path passes a singularity (rad).
const MAX_STEP_RAD: f64 = 0.6;

/// Samples of all motions (`None` where the arm cannot follow) and the share at which each circle point is passed. Where
/// every other sample implies other reversals than all samples do, the sampling is refined.
pub(crate) fn sampled(
    stops: &[MotionEnd<'_>],
    before: &[Option<u32>],
    nominal: &Inverse<'_>,
    half: &[f64; 6],
    frames_of: &dyn Fn(usize) -> FramePair,
) -> (Vec<Option<SampledJoints>>, Vec<f64>) {
    let start = |m: usize| before[m].and_then(|from| stops.get(from as usize));
    let mut samples = Samples::default();
    for (m, stop) in stops.iter().enumerate() {
        samples.of(start(m), stop, 1, frames_of);
    }
    let mut paths = samples.passed(nominal);
    let unchanged_for = |m: &usize, samples: &Option<SampledJoints>| match (start(*m), &stops[*m], samples) {
        (Some(MotionEnd::At(from)), MotionEnd::At(to), Some(samples)) => {
            samples_agree(&from.joints, samples, &to.joints, half)
        }
        _ => true,
    };
    let mut rough: Vec<usize> = (0..stops.len()).filter(|m| !unchanged_for(m, &paths[*m])).collect();
    for refinement in 1..=REFINEMENTS {
        let mut finer = Samples::default();
        for &m in &rough {
            finer.of(start(m), &stops[m], 4_usize.pow(refinement), frames_of);
        }
        for (&m, samples) in rough.iter().zip(finer.passed(nominal)) {
            paths[m] = samples;
        }
        rough.retain(|m| !unchanged_for(m, &paths[*m]));
    }
    (paths, samples.passes)
}

/// Samples of motions whose wrist may be interpolated separately, `None` for all others; the inner `None` where the arm
/// cannot follow.
pub(crate) fn by_wrist(
    stops: &[MotionEnd<'_>],
    before: &[Option<u32>],
    nominal: &Inverse<'_>,
    half: &[f64; 6],
    frames_of: &dyn Fn(usize) -> FramePair,
) -> Vec<Option<Option<SampledJoints>>> {
    let of = |(stop, before): (&MotionEnd<'_>, &Option<u32>)| {
        let (Some(MotionEnd::At(from)), MotionEnd::At(to)) =
            (before.and_then(|from| stops.get(from as usize)), stop)
        else {
            return None;
        };
        let wrist = to.motion.modal.wrist_interpolation != Switch::Off;
        let (curve, within) = Some((from, to)).filter(|_| wrist).and_then(|_| path(from, to, frames_of))?;
        let ends = [&from.joints, &to.joints];
        let mut count = pieces_of(&curve);
        loop {
            let samples =
                wrist_interpolation::joint_samples(nominal.arm(), &within, &curve, ends, count, MAX_STEP_RAD);
            let unchanged_for =
                |samples: &SampledJoints| samples_agree(&from.joints, samples, &to.joints, half);
            if count >= MAX_REFINED || samples.as_ref().is_some_and(unchanged_for) {
                return Some(samples);
            }
            count = (4 * count).min(MAX_REFINED);
        }
    };
    stops.iter().zip(before).map(of).collect()
}

/// The path of a motion in its work object, with its frames; `None` for joint motions.
fn path(
    from: &ReachedEnd<'_>,
    to: &ReachedEnd<'_>,
    frames_of: &dyn Fn(usize) -> FramePair,
) -> Option<(Curve, FramePair)> {
    if !to.path_kinds().0 {
        return None;
    }
    // The path belongs to the tool and work object of the motion, even where it starts under others.
    let within = frames_of(to.frames_index);
    let mut begin = from.commanded;
    if from.frames_index != to.frames_index {
        begin = within.target_of(&frames_of(from.frames_index).flange_for(&from.commanded));
    }
    let curve = match (to.motion.kind, to.via) {
        (MotionKind::Circular, Some(via)) => Curve::round(begin, &via, to.commanded, to.motion),
        (MotionKind::Circular, None) => None,
        _ => Some(Curve::line(begin, to.commanded)),
    };
    Some((curve?, within))
}

/// Sample points between the ends of all motions.
#[derive(Default)]
struct Samples {
    /// End of each motion's range of samples.
    ends: Vec<usize>,
    shares: Vec<f64>,
    flanges: Vec<Pose>,
    /// Joints at the start and at the end of each motion.
    end_joints_rad: Vec<[Joints; 2]>,
    /// Share of each motion at which its circle point is passed.
    passes: Vec<f64>,
}

impl Samples {
    fn range(&self, motion: usize) -> std::ops::Range<usize> {
        let begin = motion.checked_sub(1).map_or(0, |m| self.ends[m]);
        begin..self.ends[motion]
    }

    /// Samples of one motion, `density` times as dense as in the first pass.
    fn of(
        &mut self,
        from: Option<&MotionEnd<'_>>,
        stop: &MotionEnd<'_>,
        density: usize,
        frames_of: &dyn Fn(usize) -> FramePair,
    ) {
        let mut passes = 0.5;
        if let (Some(MotionEnd::At(from)), MotionEnd::At(to)) = (from, stop)
            && let Some((curve, within)) = path(from, to, frames_of)
        {
            passes = to.via.map_or(passes, |via| curve.passes(&via));
            let pieces = (density * pieces_of(&curve)).min(MAX_REFINED);
            for k in 1..pieces {
                let s = k as f64 / pieces as f64;
                self.shares.push(s);
                self.flanges.push(within.flange_for(&curve.at(s)));
            }
        }
        let joints = |stop: Option<&MotionEnd<'_>>| match stop {
            Some(MotionEnd::At(reached)) => reached.joints,
            _ => Joints::zeros(),
        };
        self.end_joints_rad.push([joints(from), joints(Some(stop))]);
        self.ends.push(self.shares.len());
        self.passes.push(passes);
    }

    /// Joints at the samples of each motion, each solved from the previous sample; `None` where the arm cannot follow: a
    /// joint would jump, or the path would cross a singularity, as it must between solutions of different branches, however
    /// close.
    fn passed(&self, nominal: &Inverse<'_>) -> Vec<Option<SampledJoints>> {
        let of = |motion: usize| {
            let [start, end] = &self.end_joints_rad[motion];
            let flanges = &self.flanges[self.range(motion)];
            if flanges.is_empty() {
                return Some(Vec::new());
            }
            let mut out = Vec::with_capacity(flanges.len());
            let mut last = *start;
            if nominal.branch(start) != nominal.branch(end) {
                return None;
            }
            for (k, reached) in self.range(motion).zip(nominal.solve_path_joints(flanges, start)) {
                let joints = reached.ok()?.joints;
                let steady = (joints - last).amax() < MAX_STEP_RAD;
                last = joints;
                steady.then(|| out.push((self.shares[k], joints)))?;
            }
            ((end - last).amax() < MAX_STEP_RAD).then_some(out)
        };
        let motions = self.ends.len();
        let chunks = search_budget::shared_out(
            SearchBudget::of(search_budget::SIDES),
            motions.div_ceil(search_budget::CHUNK),
            |chunk, budget| {
                let first = chunk * search_budget::CHUNK;
                let here = first..(first + search_budget::CHUNK).min(motions);
                with_budget(budget, || here.map(of).collect::<Vec<_>>())
            },
        );
        chunks.into_iter().flatten().collect()
    }
}

fn pieces_of(curve: &Curve) -> usize {
    let turn = curve.turn_rad().max(curve.arc().map_or(0.0, |arc| arc.sweep));
    pieces(curve.length_mm(), turn)
}

/// Number of pieces of a path: at least two, so that one sample sees a joint reverse half way; otherwise even and at least
/// four, so that every other sample can be compared.
fn pieces(length_mm: f64, turn_rad: f64) -> usize {
    if length_mm < SHORT_MM && turn_rad < SHORT_RAD {
        return 2;
    }
    let wanted = (length_mm / SAMPLE_MM).max(turn_rad / SAMPLE_RAD).ceil();
    (wanted as usize).next_multiple_of(2).clamp(4, MAX_SAMPLES)
}
