//! The path between the targets of a corrected program, judged as the correction itself judges it.
//!
//! Method. From one target of the original to the next the rewritten program has one motion, or several with the inserted targets. Each
//! piece is followed by the acting arm and compared with the intended line or arc by the functions that plan a correction
//! ([`line_deviation`], [`Circle`]). The intended line or arc is carried to where its two ends are really reached: how far these are off is
//! told of the targets, and a model other than the correcting one, or a placement that is kept, displaces all of the path alike.
//! A line or arc that starts at a target which is not corrected is judged where its own end hardly moves; elsewhere it is listed, as the path
//! steps there. Where the text does not tell the start, it is listed and judged from the motions that may come before all the same. The corner
//! between two of them that the robot rounds is compared with the one that the intended ones make.

use std::collections::BTreeSet;

use nalgebra::Vector3;

use super::differences::{nearest_share, way};
use super::executed_end::{ExecutedEnd, Run};
use crate::arms::Arms;
use crate::cut::{StartsOf, only_start};
use crate::deviation::BetweenTargets;
use crate::line_list::lines_of;
use crate::options::Emit;
use crate::segment::circle::Circle;
use crate::segment::corner::{CornerSegments, corner_deviation};
use crate::segment::curve::Curve;
use crate::segment::line::{Segment, SegmentEnd, line_deviation, midpoint_deviations};
use crate::segment::segment_plan::by_axes_mm;
use truegrind_math::se3::Pose;
use truegrind_math::work::checkpoint;
use truegrind_programs::motion::{Listing, Motion, MotionKind};

/// How much of the difference between the deviations of its two ends a path may deviate between them: a program may be verified with
/// another model than the one that corrected it.
const FREE_SHARE: f64 = 0.5;

/// What the decimals of a written program may add (mm).
const WRITTEN_MM: f64 = 0.005;

/// Two targets nearer to each other along the path than this are one place, at which a joint takes up its backlash (mm).
const ONE_PLACE_MM: f64 = 1e-3;

/// Two programs with the ends of their motions.
pub(super) struct Followed<'a> {
    pub(super) original: &'a Listing,
    pub(super) rewritten: &'a Listing,
    /// The rewritten motion of each original one.
    pub(super) partners: &'a [Option<usize>],
    pub(super) before: &'a [Option<&'a ExecutedEnd>],
    pub(super) after: &'a [Option<&'a ExecutedEnd>],
    /// The run of the rewritten program.
    pub(super) run: &'a Run,
    pub(super) is_same: &'a dyn Fn(&ExecutedEnd, &ExecutedEnd) -> bool,
}

/// One piece of a rewritten path.
struct Piece<'a> {
    /// The original motion.
    index: usize,
    segment: Segment<'a>,
    emit: Emit,
    /// Where a line does not describe it.
    curved: Option<Circle>,
    /// Whether the control may turn the tool otherwise on the way.
    whole: Option<[Curve; 2]>,
}

/// What is found of the path to the ends of the motions.
struct Found {
    /// Largest deviation by original motion (mm).
    largest_mm: Vec<Option<f64>>,
    unchecked: BTreeSet<u32>,
    /// Of these, lines and arcs before which the text has no motion.
    first: Vec<u32>,
}

impl<'a> Followed<'a> {
    /// The path between all targets.
    pub(super) fn judged(&self, arms: &Arms<'_>, tolerance_mm: f64) -> BetweenTargets {
        let count = self.original.motions.len();
        let mut found =
            Found { largest_mm: vec![None; count], unchecked: BTreeSet::new(), first: Vec::new() };
        let mut free_mm = vec![0.0_f64; count];
        let mut pieces = Vec::new();
        let starts = StartsOf::of(self.original);
        for index in 0..count {
            checkpoint();
            self.add_pieces(index, &starts, tolerance_mm, &mut pieces, &mut free_mm[index], &mut found);
        }
        for (piece, mm) in pieces.iter().zip(deviations(&pieces, self, arms)) {
            let largest = &mut found.largest_mm[piece.index];
            *largest = Some(largest.map_or(mm, |before| before.max(mm)));
        }
        for index in 0..count {
            checkpoint();
            if let Some((mm, free)) = self.corner_mm(index, arms) {
                let largest = &mut found.largest_mm[index];
                *largest = Some(largest.map_or(mm, |before| before.max(mm)));
                free_mm[index] = free_mm[index].max(free);
            }
        }
        let bound_mm = |index: usize| tolerance_mm + WRITTEN_MM + free_mm[index];
        let beyond: Vec<u32> = (0..count)
            .filter(|index| found.largest_mm[*index].is_some_and(|mm| !(mm <= bound_mm(*index))))
            .filter_map(|index| Some(self.partners[index]? as u32))
            .collect();
        let rewritten = |index: &u32| Some(self.partners[*index as usize]? as u32);
        let unchecked: Vec<u32> = found.unchecked.iter().filter_map(rewritten).collect();
        let first: Vec<u32> = found.first.iter().filter_map(rewritten).collect();
        BetweenTargets {
            tolerance_mm,
            largest_mm: found.largest_mm.into_iter().flatten().reduce(f64::max),
            beyond: beyond.len(),
            beyond_lines: lines_of(self.rewritten, &beyond),
            unchecked: unchecked.len(),
            unchecked_lines: lines_of(self.rewritten, &unchecked),
            first_lines: lines_of(self.rewritten, &first),
        }
    }

    /// The pieces of the path to the end of an original motion, from each place where it may start.
    fn add_pieces(
        &self,
        index: usize,
        known: &StartsOf<'_>,
        tolerance_mm: f64,
        pieces: &mut Vec<Piece<'a>>,
        free_mm: &mut f64,
        found: &mut Found,
    ) {
        let was = &self.original.motions[index];
        let Some((end, partner)) = self.changed(index) else { return };
        if !matches!(was.kind, MotionKind::Linear | MotionKind::Circular) {
            return;
        }
        let is_all_known = was.previous.is_some() || self.original.predecessors.contains_key(&(index as u32));
        let mut starts = Vec::new();
        match was.previous {
            Some(previous) => starts.push(previous as usize),
            None => known.each(index as u32, |start| starts.push(start as usize)),
        }
        if starts.is_empty() {
            found.first.push(index as u32);
            return;
        }
        let is_still = self.after[partner].is_some_and(|is| {
            (is.commanded.translation.vector - end.commanded.translation.vector).norm() <= tolerance_mm
        });
        let mut is_checked = is_all_known;
        for start in starts {
            let from = if is_still { self.end(start) } else { self.changed(start) };
            let nodes = from.and_then(|(from, first)| {
                let nodes = self.nodes(first, partner, was.previous.is_some())?;
                self.intended_way(was, from, end, &nodes)
            });
            match nodes {
                Some(path) => self.add_path(index, path, pieces, free_mm, found),
                None => is_checked = false,
            }
        }
        if !is_checked {
            found.unchecked.insert(index as u32);
        }
    }

    /// Deviation from the intended corner where the path to the end of an original motion begins (mm), and what its ends allow beside the
    /// tolerance; `None` where the robot rounds no corner there, or where the correction does not move what lies beside it.
    fn corner_mm(&self, index: usize, arms: &Arms<'_>) -> Option<(f64, f64)> {
        let at = only_start(self.original, index)?;
        let (_, corner) = self.changed(at)?;
        let zone = self.rewritten.zone(&self.rewritten.motions[corner])?.value.as_ref().ok()?;
        if zone.fine {
            return None;
        }
        let begin = only_start(self.original, at)?;
        let [into, out] = [[begin, at], [at, index]].map(|[from, to]| self.known_path(from, to));
        let (into, out) = (into?, out?);
        // Between joint targets the corner is one of joints; the manuals do not specify one between two tools or work objects.
        let is_of_poses = |node: &ExecutedEnd| {
            !matches!(self.rewritten.motions[node.motion].kind, MotionKind::AbsoluteJoint)
        };
        let nodes = into.nodes.iter().chain(&out.nodes).skip(1);
        if into.to.index != out.start.index
            || into.to.index != out.to.index
            || !nodes.clone().all(|node| is_of_poses(node))
        {
            return None;
        }
        let commanded = |path: &IntendedPath<'_>, [from, to]: [usize; 2]| {
            let from = if from == 0 { path.start.commanded } else { path.nodes[from].commanded };
            way(&self.rewritten.motions[path.nodes[to].motion], from, path.nodes[to].commanded)
        };
        let last = into.nodes.len() - 1;
        let [first, second] = [commanded(&into, [last - 1, last])?, commanded(&out, [0, 1])?];
        let segments =
            CornerSegments { intended: [&into.carried, &out.carried], commanded: [&first, &second] };
        let conditions = [into.to.condition_index, self.run.schedule(out.nodes[1]).at(0.0)];
        let mm = corner_deviation(&out.start, &segments, zone.tcp_mm, conditions, arms)?;
        Some((mm, into.free_mm.max(out.free_mm)))
    }

    /// The path from one original motion to the next, where the correction moves both.
    fn known_path(&self, from: usize, to: usize) -> Option<IntendedPath<'a>> {
        let was = &self.original.motions[to];
        if !matches!(was.kind, MotionKind::Linear | MotionKind::Circular) {
            return None;
        }
        let ((from, first), (end, partner)) = (self.changed(from)?, self.changed(to)?);
        let nodes = self.nodes(first, partner, was.previous.is_some())?;
        self.intended_way(was, from, end, &nodes)
    }

    /// The end of an original motion and its rewritten motion.
    fn end(&self, index: usize) -> Option<(&'a ExecutedEnd, usize)> {
        Some((self.before[index]?, self.partners[index]?))
    }

    /// The end of an original motion and its rewritten motion, where the correction moves it.
    fn changed(&self, index: usize) -> Option<(&'a ExecutedEnd, usize)> {
        let (end, partner) = self.end(index)?;
        let is_moved = !(self.is_same)(end, self.after[partner]?);
        is_moved.then_some((end, partner))
    }

    /// The motions from one target to another, the first and the last included. `in_text`: those between were inserted; otherwise they stand
    /// before the last one in its routine.
    fn nodes(&self, first: usize, last: usize, in_text: bool) -> Option<Vec<&'a ExecutedEnd>> {
        let motions: Vec<usize> = if in_text {
            (first < last).then(|| (first..=last).collect())?
        } else {
            let inserted = |motion: &usize| {
                let before = self.rewritten.motions[*motion].previous? as usize;
                (!self.partners.contains(&Some(before))).then_some(before)
            };
            let mut back: Vec<usize> = std::iter::successors(Some(last), inserted).chain([first]).collect();
            back.reverse();
            back
        };
        let follows = |pair: &[usize]| {
            !in_text || self.rewritten.motions[pair[1]].previous.is_some_and(|p| p as usize == pair[0])
        };
        if !motions.windows(2).all(follows) {
            return None;
        }
        motions.into_iter().map(|motion| self.after[motion]).collect()
    }

    fn segment_end(&self, end: &ExecutedEnd, intended: Pose) -> SegmentEnd<'a> {
        SegmentEnd {
            frames: &self.run.frame_table.list[end.frames_index],
            index: end.frames_index,
            intended,
            commanded: end.commanded,
            joints: end.joints,
            condition_index: end.condition_index,
            before: end.joints,
            conf: None,
            external: None,
            between_ends: false,
        }
    }

    /// The ends of the path, and the intended way between where they are reached. `from` and `end`: as the original has them.
    fn intended_way(
        &self,
        was: &Motion,
        from: &ExecutedEnd,
        end: &ExecutedEnd,
        nodes: &[&'a ExecutedEnd],
    ) -> Option<IntendedPath<'a>> {
        let (first, last) = (*nodes.first()?, *nodes.last()?);
        let to = self.segment_end(last, Pose::from_parts(last.reached.translation, end.commanded.rotation));
        // The start may be stated with another tool or in another work object.
        let in_frames = |intended: Pose| {
            let start = self.segment_end(first, intended);
            if start.index == to.index { start } else { start.with_frames_of(&to) }
        };
        let stated = in_frames(from.commanded);
        let start = in_frames(Pose::from_parts(first.reached.translation, from.commanded.rotation));
        let stated_way = way(was, stated.intended, end.commanded)?;
        let off = [
            start.intended.translation.vector - stated.intended.translation.vector,
            to.intended.translation.vector - end.commanded.translation.vector,
        ];
        let carried = match was.via() {
            None => Curve::line(start.intended, to.intended),
            Some(via) => {
                let via = via.value.ok()?.cartesian()?.pose();
                // The ends of a full circle are one point, also where they are reached.
                let is_full = stated_way.arc()?.sweep >= std::f64::consts::TAU - 1e-9;
                let off = if is_full { [off[0]; 2] } else { off };
                let at = off[0].lerp(&off[1], stated_way.passes(&via));
                let moved = |pose: &Pose, by: Vector3<f64>| {
                    Pose::from_parts((pose.translation.vector + by).into(), pose.rotation)
                };
                let end = moved(&end.commanded, off[1]);
                Curve::round(start.intended, &moved(&via, at), end, was)?
            }
        };
        Some(IntendedPath {
            start,
            to,
            carried,
            nodes: nodes.to_vec(),
            free_mm: FREE_SHARE * (off[1] - off[0]).norm(),
        })
    }

    /// Adds the pieces of one path.
    fn add_path(
        &self,
        index: usize,
        path: IntendedPath<'a>,
        pieces: &mut Vec<Piece<'a>>,
        free_mm: &mut f64,
        found: &mut Found,
    ) {
        *free_mm = free_mm.max(path.free_mm);
        let length_mm = path.carried.length_mm();
        let last = path.nodes.len() - 1;
        let mut before = (0.0, path.start);
        for (k, node) in path.nodes.iter().enumerate().skip(1) {
            let (share, to) = if k == last {
                (1.0, path.to)
            } else {
                let share = nearest_share(&path.carried, &node.reached);
                let off_mm = path.carried.distance(&node.reached, share);
                let largest = &mut found.largest_mm[index];
                *largest = Some(largest.map_or(off_mm, |mm| mm.max(off_mm)));
                (share, self.segment_end(node, path.carried.at(share)))
            };
            let (from_share, from) = std::mem::replace(&mut before, (share, to));
            if last > 1 && (share - from_share) * length_mm < ONE_PLACE_MM {
                continue;
            }
            let from = if from.index == to.index { from } else { from.with_frames_of(&to) };
            let executed = &self.rewritten.motions[node.motion];
            let schedule = self.run.schedule(node);
            let segment = Segment { from, to, schedule };
            let piece = Piece {
                index,
                emit: if executed.kind == MotionKind::AbsoluteJoint { Emit::Joints } else { Emit::Targets },
                curved: path.curved(executed, &segment, [from_share, share]),
                whole: (last == 1 && executed.kind != MotionKind::AbsoluteJoint)
                    .then(|| path.both(executed, &segment))
                    .flatten(),
                segment,
            };
            pieces.push(piece);
        }
    }
}

/// A path between two targets of the original, as it is reached.
struct IntendedPath<'a> {
    start: SegmentEnd<'a>,
    to: SegmentEnd<'a>,
    /// The intended line or arc between the ends as reached.
    carried: Curve,
    nodes: Vec<&'a ExecutedEnd>,
    /// What the ends allow beside the tolerance (mm).
    free_mm: f64,
}

impl IntendedPath<'_> {
    /// The curve that a motion commands.
    fn commanded(executed: &Motion, segment: &Segment<'_>) -> Option<Curve> {
        way(executed, segment.from.commanded, segment.to.commanded)
    }

    /// The part of an arc that a piece stands for; `None` for a line.
    fn curved(&self, executed: &Motion, segment: &Segment<'_>, shares: [f64; 2]) -> Option<Circle> {
        self.carried.arc()?;
        let commanded = Self::commanded(executed, segment)
            .unwrap_or_else(|| Curve::line(segment.from.commanded, segment.to.commanded));
        Some(Circle { intended: self.carried.clone(), commanded, shares })
    }

    /// Intended and commanded way of a path without inserted targets.
    fn both(&self, executed: &Motion, segment: &Segment<'_>) -> Option<[Curve; 2]> {
        Some([self.carried.clone(), Self::commanded(executed, segment)?])
    }
}

/// The deviation of each piece (mm).
fn deviations(pieces: &[Piece<'_>], followed: &Followed<'_>, arms: &Arms<'_>) -> Vec<f64> {
    let straight = |emit: Emit| {
        let chosen = move |piece: &&Piece<'_>| piece.curved.is_none() && piece.emit == emit;
        let lines: Vec<&Segment<'_>> = pieces.iter().filter(chosen).map(|piece| &piece.segment).collect();
        midpoint_deviations(&lines, arms, emit).into_iter()
    };
    let (mut targets, mut joints) = (straight(Emit::Targets), straight(Emit::Joints));
    let with_middle: Vec<(&Piece<'_>, f64)> = pieces
        .iter()
        .map(|piece| {
            let middles = if piece.emit == Emit::Joints { &mut joints } else { &mut targets };
            let middle = if piece.curved.is_none() { middles.next() } else { None };
            (piece, middle.unwrap_or(f64::INFINITY))
        })
        .collect();
    with_middle
        .into_iter()
        .map(|(piece, middle)| {
            checkpoint();
            let along = match &piece.curved {
                Some(circle) => circle.deviation(&piece.segment, arms),
                None => line_deviation(&piece.segment, arms, piece.emit, middle),
            };
            let was = &followed.original.motions[piece.index];
            let by_axes = piece.whole.as_ref().map(|curves| by_axes_mm(was, &piece.segment, curves, arms));
            along.max(by_axes.unwrap_or(0.0))
        })
        .collect()
}
