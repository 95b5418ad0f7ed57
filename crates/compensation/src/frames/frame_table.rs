//! Frame table of a program: every pair of tool and work object once, and the external axes that carry the base.

use std::cell::LazyCell;
use std::collections::{BTreeSet, HashMap, HashSet};

use rayon::prelude::*;

use crate::arms::Arms;
use crate::cell::{AXES, Carries, Cell, CellFrame, FrameOrigin};
use crate::configuration::{configured, monitored, unstated};
use crate::frames::frame_pair::{FrameNote, FramePair, ResolveContext, ResolvedFrames, resolve_frames};
use crate::frames::taught::Teaching;
use crate::line_list::numbered;
use crate::plan::reason::OutcomeReason;
use crate::search_budget;
use truegrind_arm::inverse::Inverse;
use truegrind_arm::inverse::budget::{SearchBudget, with_budget};
use truegrind_arm::model::Joints;
use truegrind_math::option_f64::OptionF64;
use truegrind_math::se3::Pose;
use truegrind_programs::motion::{Listing, Motion, Reason, RobTarget, Switch, WorkObjectValue};

/// Frame pairs by (tool, work object).
pub(crate) struct FrameTable {
    /// Index of each in the list, or why it has none.
    places: HashMap<(u32, u32), Result<usize, OutcomeReason>>,
    pub(crate) list: Vec<ResolvedFrames>,
    /// The work object of each.
    objects: Vec<u32>,
    /// External axes that carry the base.
    base: [bool; 6],
    /// External axes of which targets state a value.
    states: [bool; 6],
    /// The axis of NC blocks that carries the base, as an index into [`AXES`]: it may stand elsewhere in any block.
    base_of_blocks: Option<usize>,
    /// Axes that move or do not stand at 0, and of which the cell file does not say what they carry.
    pub(crate) unstated_axes: Vec<char>,
    /// Assumptions about external axes, and contradictions with the cell file.
    assumed: Vec<String>,
    /// Joints where the program begins, as the cell file or the program states them.
    start: Option<Joints>,
}

impl FrameTable {
    /// `own_loads`: tools load the arm with their own mass, not with a stated payload.
    pub(crate) fn of(listing: &Listing, arms: &Arms<'_>, cell: &Cell, own_loads: bool) -> Self {
        let mut out = Self {
            places: HashMap::new(),
            list: Vec::new(),
            objects: Vec::new(),
            base: [false; 6],
            states: [false; 6],
            base_of_blocks: None,
            unstated_axes: Vec::new(),
            assumed: Vec::new(),
            start: cell.start(listing),
        };
        let teaching = Teaching::of(arms.nominal.arm(), arms.estimated.arm(), cell, listing, own_loads);
        let first_motions = first_motions(listing);
        let mut budget = SearchBudget::of(search_budget::FRAMES);
        for run in listing.motions.chunk_by(Motion::same_frames) {
            let motion = &run[0];
            let (Some(tool), Some(object)) = (motion.tool, motion.work_object) else { continue };
            if out.places.contains_key(&(tool, object)) {
                continue;
            }
            let (Some(t), Some(o)) = (listing.tool(motion), listing.work_object(motion)) else { continue };
            let (Ok(tv), Ok(ov)) = (&t.value, &o.value) else {
                let reason = listing.frame_reason(motion).unwrap_or(Reason::ToolUnknown);
                out.places.insert((tool, object), Err(OutcomeReason::Program(reason)));
                continue;
            };
            // A copy has the place of its original, perhaps displaced: the cell file states what it does not say.
            let taught =
                |stated: &[CellFrame]| stated.iter().any(|entry| entry.origin == FrameOrigin::Taught);
            if t.assigned && teaching.stated.tool(t).is_none() && taught(&cell.tool) {
                out.places.insert((tool, object), Err(OutcomeReason::Program(Reason::ToolAssigned)));
                continue;
            }
            if o.assigned && teaching.stated.object(o).is_none() && taught(&cell.wobj) {
                out.places.insert((tool, object), Err(OutcomeReason::Program(Reason::WorkObjectAssigned)));
                continue;
            }
            let here = first_motions.get(&(tool, object)).map_or(&[][..], Vec::as_slice);
            let found = with_budget(&mut budget, || {
                let typical = || typical_joints(here, tv.frame.pose(), ov, arms, out.start.as_ref());
                let typical_at = LazyCell::new(Box::new(typical) as Box<dyn Fn() -> Joints + '_>);
                let (teaching, inverse) = (&teaching, &arms.nominal);
                resolve_frames(
                    (t, tv),
                    (o, ov),
                    &ResolveContext { teaching, knowledge: arms.knowledge, inverse, typical_at },
                )
            });
            let found = match found {
                Ok(frames_index) => {
                    out.list.push(frames_index);
                    out.objects.push(object);
                    Ok(out.list.len() - 1)
                }
                Err(fault) => {
                    out.assumed.push(fault);
                    Err(OutcomeReason::CellContradiction)
                }
            };
            out.places.insert((tool, object), found);
        }
        out.external_axes(listing, arms, cell);
        out.axes_of_blocks(listing, cell);
        out
    }

    /// The same with joints where the program begins, unless they are stated.
    pub(crate) fn starting_at(self, start: Option<Joints>) -> Self {
        Self { start: self.start.or(start), ..self }
    }

    /// The joints that the controller selects for a target of a motion.
    pub(crate) fn joints(
        &self,
        motion: &Motion,
        target: &RobTarget,
        flange: &Pose,
        nominal: &Inverse<'_>,
        near: Option<&Joints>,
    ) -> Result<Joints, OutcomeReason> {
        if near.is_none() && !motion.accepts_configuration {
            return unstated(nominal, flange, self.start.as_ref());
        }
        configured(nominal, flange, target, monitored(motion), near)
    }

    /// Whether the start is stated for a motion that begins where the program's words do not tell.
    pub(crate) fn knows_start(&self, motion: &Motion) -> bool {
        self.start.is_some() && !motion.accepts_configuration
    }

    /// Which external axes carry the base: those that the cell file declares so and, where it is silent, those of targets
    /// farther away than the arm is long.
    fn external_axes(&mut self, listing: &Listing, arms: &Arms<'_>, cell: &Cell) {
        let links = &arms.nominal.arm().model.links;
        let flange = arms.nominal.arm().model.flange.translation.vector.norm();
        let longest = flange + links.iter().map(|link| link.a_mm.abs() + link.d_mm.abs()).sum::<f64>();
        let (mut first, mut moves, mut away) = ([None; 6], [false; 6], [false; 6]);
        let stated = |motion: &Motion| {
            let mut values = motion.targets.iter().filter_map(|target| target.value.as_ref().ok());
            values.any(|value| *value.external() != [OptionF64::NONE; 6])
        };
        // Hardly any program has external axes.
        let any = listing.motions.par_iter().with_min_len(search_budget::MANY_MOTIONS).any(stated);
        for motion in listing.motions.iter().filter(|_| any) {
            let values = motion.targets.iter().filter_map(|target| target.value.as_ref().ok());
            for target in values {
                if *target.external() == [OptionF64::NONE; 6] {
                    continue;
                }
                let far =
                    target.cartesian().zip(self.of_motion(motion).ok()).is_some_and(|(target, index)| {
                        let flange = self.list[index].commanded.flange_for(&target.pose());
                        !(flange.translation.vector.norm() <= longest)
                    });
                for (axis, value) in target.external().iter().enumerate() {
                    let Some(value) = value.get() else { continue };
                    self.states[axis] = true;
                    away[axis] |= value != 0.0;
                    moves[axis] |= *first[axis].get_or_insert(value) != value;
                    self.base[axis] |= far && cell.carries(axis).is_none();
                }
            }
        }
        for (axis, letter) in ('a'..='f').enumerate() {
            self.base[axis] |= cell.carries(axis) == Some(Carries::Base);
            if !(moves[axis] || away[axis]) || cell.carries(axis).is_some() {
                continue;
            }
            if !self.base[axis] {
                self.unstated_axes.push(letter);
            }
            self.assumed.push(if self.base[axis] {
                format!(
                    "external axis {letter}: targets are farther away than the arm is long, so it is assumed \
                     to carry the robot's base (cell file, [[external]])"
                )
            } else {
                let state = if moves[axis] { "moves" } else { "is not at 0" };
                format!(
                    "external axis {letter} {state}: assumed not to carry the robot's base; state what it carries (cell file, \
                     [[external]])"
                )
            });
        }
    }

    /// The same for the axes that blocks of NC programs name. Their values are not read: what they carry must be stated.
    fn axes_of_blocks(&mut self, listing: &Listing, cell: &Cell) {
        for (&letter, place) in &listing.nc.other_axes {
            let index = AXES.iter().position(|axis| axis.eq_ignore_ascii_case(&letter));
            match index.and_then(|index| cell.carries(index)) {
                Some(Carries::Base) => self.base_of_blocks = index,
                Some(Carries::Other) => {}
                None => {
                    let lines = numbered(&listing.files, [*place].into_iter()).unwrap_or_default();
                    self.unstated_axes.push(letter);
                    self.assumed.push(format!(
                        "axis {letter} ({lines}): assumed not to carry the robot's base; state what it carries (cell file, [[external]])"
                    ));
                }
            }
        }
    }

    /// The external axis that carries the base: one that the target states, or that another one of the program does, since a deactivated
    /// axis stays where it was.
    pub(crate) fn moving_base(&self, target: &RobTarget) -> Option<OutcomeReason> {
        if let Some(axis) = self.base_of_blocks {
            return Some(OutcomeReason::MovingBase { axis });
        }
        let carries = |axis: &usize| self.base[*axis];
        let stated = (0..6).filter(carries).find(|axis| target.external[*axis].is_some());
        let axis = stated.or_else(|| (0..6).filter(carries).find(|axis| self.states[*axis]))?;
        Some(OutcomeReason::MovingBase { axis })
    }

    /// Index of a motion's frame pair, or why its tool or work object has no value.
    pub(crate) fn of_motion(&self, motion: &Motion) -> Result<usize, OutcomeReason> {
        let missing = Err(OutcomeReason::Program(Reason::MissingArgument));
        let (Some(tool), Some(object)) = (motion.tool, motion.work_object) else { return missing };
        self.places.get(&(tool, object)).copied().unwrap_or(missing)
    }

    /// The work object of each frame pair of the list.
    pub(crate) fn objects(&self) -> Vec<u32> {
        self.objects.clone()
    }

    /// The work objects that were taught with this arm.
    pub(crate) fn taught(&self) -> BTreeSet<u32> {
        let taught = self.list.iter().zip(&self.objects).filter(|(frames, _)| frames.taught);
        taught.map(|(_, object)| *object).collect()
    }

    /// Whether a tool or work object has no stated origin and was taken as exact.
    pub(crate) fn assumes_origins(&self) -> bool {
        self.list.iter().flat_map(|frames| &frames.notes).any(FrameNote::is_assumed)
    }

    pub(crate) fn notes(&self) -> Vec<String> {
        let mut said = HashSet::new();
        let assumed = self.assumed.iter().filter(|note| said.insert(note.as_str())).cloned();
        let of_frames = FrameNote::sentences(self.list.iter().flat_map(|frames| &frames.notes));
        assumed.chain(of_frames).collect()
    }
}

/// The first few motions of each pair of tool and work object, for typical joints.
fn first_motions(listing: &Listing) -> HashMap<(u32, u32), Vec<&Motion>> {
    const ASKED: usize = 50;
    let mut out: HashMap<(u32, u32), Vec<&Motion>> = HashMap::new();
    for run in listing.motions.chunk_by(Motion::same_frames) {
        let (Some(tool), Some(object)) = (run[0].tool, run[0].work_object) else { continue };
        let here = out.entry((tool, object)).or_default();
        here.extend(run.iter().take(ASKED - here.len()));
    }
    out
}

/// Joints of the first reachable target of these motions, at which the effect of unknown origins is estimated.
fn typical_joints(
    motions: &[&Motion],
    tool: Pose,
    object: &WorkObjectValue,
    arms: &Arms<'_>,
    start: Option<&Joints>,
) -> Joints {
    let mounting = FramePair {
        tool,
        object: object.user_frame.pose() * object.object_frame.pose(),
        holds_part: object.robhold,
    };
    let middle = Joints::from_fn(|i, _| {
        let limits = &arms.nominal.arm().model.limits;
        0.5 * (limits.min_rad[i] + limits.max_rad[i])
    });
    motions
        .iter()
        .filter_map(|motion| Some((motion, *motion.to()?.value.ok()?.cartesian()?)))
        .find_map(|(motion, target)| {
            let flange = mounting.flange_for(&target.pose());
            if motion.accepts_configuration {
                configured(&arms.nominal, &flange, &target, Switch::Off, None).ok()
            } else {
                unstated(&arms.nominal, &flange, start).ok()
            }
        })
        .unwrap_or(middle)
}
