//! Taught frames: re-evaluates the teaching joints under the estimated arm.
//!
//! The controller computed a taught frame F from joints with the nominal arm N. Under N the teaching joints therefore
//! reproduce the programmed frame up to rounding; if they do not, another tool touched the points, another frame was taught,
//! or the joints belong to another arm, and the frame must not be moved ([`contradictions`]). If they do, the frame moves to
//! what the estimated arm E makes of the same joints, under the load of the tool that touched: F* = F_E F_N⁻¹ F. The rounding difference between F_N and F is
//! preserved, so angles with two decimals serve as well as those with ten.

pub(crate) use crate::frames::teaching_geometry::{FrameDistance, WRITTEN_TOLERANCE, list};
pub use crate::frames::teaching_geometry::{taught_frame, taught_tcp};

use std::cell::OnceCell;
use std::collections::HashSet;

use nalgebra::{Point3, Vector3};

use crate::cell::{Cell, CellFrame, CellLookup, FrameKind, FrameOrigin, Teaches};
use crate::condition::payload::is_load_dependent;
use crate::frames::known_tools::{KnownTool, KnownTools, MAX_NAMES};
use crate::frames::teaching_geometry::{
    FixedPoint, explained, fixed_point, frame_of, half_step_rad, radians, rounded, touched,
};
use truegrind_arm::condition::Condition;
use truegrind_arm::model::{Joints, Model, PreparedModel};
use truegrind_math::se3::Pose;
use truegrind_programs::motion::load::Load;
use truegrind_programs::motion::{Listing, Motion, Tool, ToolValue, WorkObject, WorkObjectValue};

/// A tool that touched teaching points.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct TouchingTool {
    pub(crate) name: String,
    /// Whether the robot holds it; otherwise it is stationary.
    pub(crate) held: bool,
    /// Its tip as commanded (mm), on the flange or in the base.
    commanded: Vector3<f64>,
    /// Its real tip.
    pub(crate) real: Vector3<f64>,
    load: Option<Load>,
}

/// A tool as it really is.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct RealTool {
    pub(crate) pose: Pose,
    /// Displacement of its TCP (mm), where it was re-evaluated.
    pub(crate) moved_mm: Option<f64>,
}

/// A work object as it really is.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct RealObject {
    /// Real pose of the frame of its targets.
    pub(crate) pose: Pose,
    /// The taught points under the estimated arm, and their frame; absent where it was not re-evaluated.
    pub(crate) taught: Option<TaughtFrame>,
}

/// The re-evaluated frame of a work object.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct TaughtFrame {
    pub(crate) pointer: TouchingTool,
    pub(crate) joints: [Joints; 3],
    pub(crate) points: [Point3<f64>; 3],
    pub(crate) frame: Pose,
}

/// Inputs for re-evaluating teaching points: both arms, the cell, and the tools of known value.
#[derive(Debug)]
pub(crate) struct Teaching<'a> {
    pub(crate) nominal: &'a PreparedModel<'a>,
    pub(crate) estimated: &'a PreparedModel<'a>,
    pub(crate) stated: CellLookup<'a>,
    pub(crate) listing: &'a Listing,
    /// Whether a tool loads the arm with its own mass, not with a stated payload.
    own_loads: bool,
    /// Cache of [`Teaching::tools`].
    known: OnceCell<KnownTools<'a>>,
}

/// Contradictions between cell file and program, unfilled entries of the cell file, and misstatements in the program's own
/// comments, one sentence each; all must be resolved before anything is corrected. `nominal`: the arm that the controller
/// computes with.
pub fn contradictions(listing: &Listing, cell: &Cell, nominal: &Model) -> Vec<String> {
    let commanded = listing.invalid_statements.iter().map(ToString::to_string);
    let unusable: Vec<String> =
        cell.open.iter().map(|entry| format!("cell file: {entry}")).chain(commanded).collect();
    if !unusable.is_empty() {
        return unusable;
    }
    let beyond = |start| {
        nominal.limits.violated(&start).map(|what| (what, nominal.limits.angle_and_range(what, &start)))
    };
    if let Some((what, [angle_rad, min_rad, max_rad])) = cell.start(listing).and_then(beyond) {
        let said = if cell.start_deg.is_some() {
            "cell file: start_deg"
        } else {
            "`truegrind start` of the program"
        };
        return vec![format!(
            "{said}: {what} is {:.1}°, outside its range of {:.1}° to {:.1}°: state the joints as the controller shows them, \
             in degrees",
            angle_rad.to_degrees(),
            min_rad.to_degrees(),
            max_rad.to_degrees()
        )];
    }
    let condition = Condition::default();
    let arm = nominal.at_condition(&condition);
    let teaching = Teaching::of(&arm, &arm, cell, listing, false);
    let (mut seen, mut said) = (HashSet::new(), HashSet::new());
    let mut out: Vec<String> = Vec::new();
    for run in listing.motions.chunk_by(Motion::same_frames) {
        let motion = &run[0];
        let (Some(tool), Some(object)) = (listing.tool(motion), listing.work_object(motion)) else {
            continue;
        };
        if !seen.insert((motion.tool, motion.work_object)) || listing.frame_reason(motion).is_some() {
            continue;
        }
        let (Ok(value), Ok(frame_value)) = (&tool.value, &object.value) else { continue };
        let found = [
            duplicate_entries(FrameKind::Tool, &teaching.stated.tools(tool), &tool.name),
            duplicate_entries(FrameKind::Wobj, &teaching.stated.objects(object), &object.name),
            teaching.tool(tool, value).err(),
            teaching.object(object, frame_value).err(),
        ];
        for fault in found.into_iter().flatten() {
            if said.insert(fault.clone()) {
                out.push(fault);
            }
        }
    }
    out
}

/// Two entries of the cell file for one frame of the program.
fn duplicate_entries(kind: FrameKind, found: &[&CellFrame], name: &str) -> Option<String> {
    let mut found = found.iter().copied();
    let first = found.next()?;
    // A repeated statement is no contradiction.
    let second = found.find(|other| **other != CellFrame::of(&other.name, first.origin))?;
    Some(format!(
        "cell file: {kind} \"{}\" and {kind} \"{}\" are both {name} of the program: keep one of the two",
        first.name, second.name
    ))
}

fn at(position: &Vector3<f64>) -> Pose {
    Pose::from_parts((*position).into(), nalgebra::UnitQuaternion::identity())
}

/// A tip by the nominal arm, by the estimated one, and how far the nominal one may lie from the programmed one.
type TaughtTip = (Vector3<f64>, Vector3<f64>, FrameDistance);

impl<'a> Teaching<'a> {
    pub(crate) fn of(
        nominal: &'a PreparedModel<'a>,
        estimated: &'a PreparedModel<'a>,
        cell: &'a Cell,
        listing: &'a Listing,
        own_loads: bool,
    ) -> Self {
        let stated = CellLookup::of(cell, listing);
        Self { nominal, estimated, stated, listing, own_loads, known: OnceCell::new() }
    }

    /// The estimated arm under the load of the tool that touched; `None` where that is the load of all.
    fn loaded_with(&self, load: Option<Load>) -> Option<PreparedModel<'a>> {
        let load = load.filter(|_| self.own_loads)?;
        let model = self.estimated.model;
        let condition = Condition {
            payload_kg: Some(load.mass_kg),
            payload_centre_mm: load.centre_mm,
            ..self.estimated.condition
        };
        model.effects.iter().any(is_load_dependent).then(|| model.at_condition(&condition))
    }

    /// Resolves a tool.
    ///
    /// # Errors
    /// A sentence where the cell file contradicts the program or itself.
    pub(crate) fn tool(&self, tool: &Tool, value: &ToolValue) -> Result<RealTool, String> {
        let commanded = value.frame.pose();
        let stands = RealTool { pose: commanded, moved_mm: None };
        let Some(stated) = self.stated.tool(tool) else { return Ok(stands) };
        if tool.place.is_some() {
            agrees(FrameKind::Tool, stated, &commanded)?;
        }
        self.commanded_tool(stated, &commanded, (value.robhold, own_load(value)))
    }

    /// Resolves a tool of the cell file that the controller holds as `commanded`.
    fn commanded_tool(
        &self,
        stated: &CellFrame,
        commanded: &Pose,
        (held, load): (bool, Option<Load>),
    ) -> Result<RealTool, String> {
        if stated.origin == FrameOrigin::Metrology || stated.teaching_deg.is_empty() {
            return Ok(RealTool { pose: *commanded, moved_mm: None });
        }
        let name = &stated.name;
        let told_tip = commanded.translation.vector;
        let (nominal, estimated, bound) = match (&stated.taught_with, held) {
            (Some(pointer), true) => {
                return Err(format!(
                    "cell file: tool \"{name}\": taught_with = \"{pointer}\", but the robot holds {name}: \
                     its own poses about one point determine its TCP; remove taught_with (it is for work \
                     objects and stationary tools)"
                ));
            }
            (Some(_), false) => self.touched_tip(stated)?,
            (None, _) => self.fixed_tip(stated, held, load)?,
        };
        let apart = (nominal - told_tip).norm();
        if !(apart <= bound.mm) {
            return Err(format!(
                "cell file: tool \"{name}\": with the nominal arm its teaching points put the TCP at {}, \
                 {apart:.2} mm and 0° away from the programmed one, {} (up to {:.2} mm is explained by \
                 rounding and by the scatter of the points): these are the joint angles of another tool or \
                 another arm, or the TCP was changed since; teach it again, or write origin = \"metrology\" \
                 without teaching_deg if its numbers are exact",
                list(&nominal),
                list(&told_tip),
                bound.mm
            ));
        }
        let shift = estimated - nominal;
        let mut pose = *commanded;
        pose.translation.vector += shift;
        Ok(RealTool { pose, moved_mm: Some(shift.norm()) })
    }

    /// Where the tip of a stationary tool lies in the base, touched with a pointer: by the nominal arm, by the estimated
    /// one, and how far the nominal one may be off.
    fn touched_tip(&self, stated: &CellFrame) -> Result<TaughtTip, String> {
        let joints = radians(&stated.teaching_deg);
        let pointer = self.pointer(FrameKind::Tool, stated, true)?;
        let tip = |arm: &PreparedModel<'_>, joints: &[Joints], tcp: &Vector3<f64>| {
            let touched = joints.iter().map(|q| (arm.forward(q) * Point3::from(*tcp)).coords);
            touched.sum::<Vector3<f64>>() / joints.len() as f64
        };
        let nominal = tip(self.nominal, &joints, &pointer.commanded);
        let off = |q: &Joints| {
            ((self.nominal.forward(q) * Point3::from(pointer.commanded)).coords - nominal).norm_squared()
        };
        let scatter = 3.0 * joints.iter().map(off).sum::<f64>().sqrt() / joints.len() as f64;
        let half = half_step_rad(&stated.teaching_deg);
        let round = rounded(&joints, half, |q| Some(at(&tip(self.nominal, q, &pointer.commanded))));
        let loaded = self.loaded_with(pointer.load);
        let estimated = loaded.as_ref().unwrap_or(self.estimated);
        Ok((nominal, tip(estimated, &joints, &pointer.real), explained(round, scatter)))
    }

    /// The same for a tip that was held at one point (on the flange), or a point that was touched by one tip (in the base).
    fn fixed_tip(&self, stated: &CellFrame, held: bool, load: Option<Load>) -> Result<TaughtTip, String> {
        let name = &stated.name;
        let joints = radians(&stated.teaching_deg);
        let pick = |found: FixedPoint| if held { found.on_flange } else { found.in_base };
        let alike = || {
            format!(
                "cell file: tool \"{name}\": its {} teaching points are too much alike to determine \
                 the TCP: give four or more with the tool turned by 30° and more between them",
                joints.len()
            )
        };
        if joints.len() < 4 {
            return Err(format!(
                "cell file: tool \"{name}\": {} teaching points, expected at least 4 (a stationary \
                 tool needs fewer with taught_with)",
                joints.len()
            ));
        }
        let nominal = fixed_point(self.nominal, &joints).ok_or_else(alike)?;
        let loaded = self.loaded_with(load.filter(|_| held));
        let estimated = fixed_point(loaded.as_ref().unwrap_or(self.estimated), &joints).ok_or_else(alike)?;
        let half = half_step_rad(&stated.teaching_deg);
        let round = rounded(&joints, half, |q| fixed_point(self.nominal, q).map(|found| at(&pick(found))));
        let scatter = 3.0 * nominal.sigma_mm[usize::from(!held)];
        Ok((pick(nominal), pick(estimated), explained(round, scatter)))
    }

    /// Resolves a work object.
    ///
    /// # Errors
    /// A sentence where the cell file contradicts the program or itself.
    pub(crate) fn object(&self, object: &WorkObject, value: &WorkObjectValue) -> Result<RealObject, String> {
        let user = value.user_frame.pose();
        let within = value.object_frame.pose();
        let as_told = RealObject { pose: user * within, taught: None };
        let Some(stated) = self.stated.object(object) else { return Ok(as_told) };
        // A displacement is not taught: it applies on top of the taught frame.
        let displaced = object.displacement.map_or_else(Pose::identity, |frame| frame.pose());
        let undisplaced = user * within * displaced.inverse();
        if object.place.is_some() {
            agrees(FrameKind::Wobj, stated, &user)?;
        }
        if stated.origin == FrameOrigin::Metrology || stated.teaching_deg.is_empty() {
            return Ok(as_told);
        }
        let Ok(joints) = <[Joints; 3]>::try_from(radians(&stated.teaching_deg)) else {
            return Err(format!(
                "cell file: wobj \"{}\": {} teaching points, expected 3: two on x, one on y",
                stated.name,
                stated.teaching_deg.len()
            ));
        };
        let teaches = stated.teaches.unwrap_or_default();
        let (commanded, on_top) = match teaches {
            Teaches::Uframe => (user, within),
            Teaches::Oframe => (undisplaced, displaced),
        };
        let part = value.robhold;
        let pointer = self.pointer(FrameKind::Wobj, stated, !part)?;
        let in_line = || {
            format!(
                "cell file: wobj \"{}\": its three teaching points are collinear: the third must be off the \
                 x axis",
                stated.name
            )
        };
        let nominal = frame_of(self.nominal, &joints, &pointer.commanded, part).ok_or_else(in_line)?;
        let half = half_step_rad(&stated.teaching_deg);
        let round = rounded(&joints, half, |q| frame_of(self.nominal, q, &pointer.commanded, part));
        let bound = explained(round, 0.0);
        if !FrameDistance::of(&nominal, &commanded).within(bound) {
            let other = match teaches {
                Teaches::Uframe => undisplaced,
                Teaches::Oframe => user,
            };
            return Err(self.other_frame(
                stated,
                &joints,
                part,
                (&nominal, &commanded, &other),
                bound,
                &pointer,
            ));
        }
        let loaded = self.loaded_with(pointer.load);
        let points = touched(loaded.as_ref().unwrap_or(self.estimated), &joints, &pointer.real, part);
        let frame = taught_frame(&points).ok_or_else(in_line)?;
        let pose = frame * nominal.inverse() * commanded * on_top;
        Ok(RealObject { pose, taught: Some(TaughtFrame { pointer, joints, points, frame }) })
    }

    /// The sentence for teaching points that define another frame than the programmed one, with a cause where one explains
    /// it.
    fn other_frame(
        &self,
        stated: &CellFrame,
        joints: &[Joints; 3],
        part: bool,
        (nominal, commanded, other): (&Pose, &Pose, &Pose),
        bound: FrameDistance,
        pointer: &TouchingTool,
    ) -> String {
        let teaches = stated.teaches.unwrap_or_default();
        let (frame, other_frame) = match teaches {
            Teaches::Uframe => ("user frame (uframe)", "with its object frame: write teaches = \"oframe\""),
            Teaches::Oframe => (
                "user frame with its object frame (uframe · oframe)",
                "without its object frame: write teaches = \"uframe\"",
            ),
        };
        let fits = |known: &&KnownTool| {
            known.held != part
                && frame_of(self.nominal, joints, &known.frame.translation.vector, part)
                    .is_some_and(|found| FrameDistance::of(&found, commanded).within(bound))
        };
        let known = &self.tools().list;
        let cause = if FrameDistance::of(nominal, other).within(bound) {
            format!("they define the frame {other_frame}")
        } else if let Some(tool) = known.iter().find(fits) {
            format!("they fit tool {}: write taught_with = \"{}\"", tool.name, tool.name)
        } else {
            "another tool touched them, they are the joint angles of another arm, or the frame was changed \
             since: correct taught_with or teaching_deg, or write origin = \"metrology\" without them if the \
             frame's numbers are exact"
                .to_owned()
        };
        let apart = FrameDistance::of(nominal, commanded);
        format!(
            "cell file: wobj \"{}\": with the nominal arm and tool {} its teaching points define a frame at \
             {}, {:.2} mm and {:.3}° away from the programmed {frame}, at {} (up to {:.2} mm and {:.3}° is \
             explained by rounding): {cause}",
            stated.name,
            pointer.name,
            list(&nominal.translation.vector),
            apart.mm,
            apart.rad.to_degrees(),
            list(&commanded.translation.vector),
            bound.mm,
            bound.rad.to_degrees()
        )
    }

    /// The tool that touched the teaching points of `stated`; `held`: whether the robot must hold it.
    fn pointer(&self, kind: FrameKind, stated: &CellFrame, held: bool) -> Result<TouchingTool, String> {
        let here = format!("cell file: {kind} \"{}\"", stated.name);
        let known = self.tools();
        let holds = if held { "that the robot holds" } else { "that is stationary" };
        let found = match &stated.taught_with {
            Some(name) => {
                let mut same = known.called(name);
                let Some(found) = same.next() else {
                    return Err(format!(
                        "{here}: taught_with = \"{name}\": no such tool has a known value, neither in the program nor in the \
                         cell file: declare it in a module that is given, or write [[tool]] name = \"{name}\" with origin and \
                         position_mm"
                    ));
                };
                if same.any(|other| !FrameDistance::of(&other.frame, &found.frame).within(WRITTEN_TOLERANCE))
                {
                    return Err(format!(
                        "{here}: taught_with = \"{name}\": the program has several tools of that name with different values: \
                         give the module of the one that touched the points alone"
                    ));
                }
                if found.held != held {
                    return Err(format!(
                        "{here}: taught_with = \"{name}\": its points must be touched by a tool {holds}, but \
                         {name} is not one"
                    ));
                }
                found
            }
            None => {
                let fit =
                    |known: &&KnownTool| known.held == held && !known.name.eq_ignore_ascii_case("tool0");
                let mut fitting: Vec<&KnownTool> = known.list.iter().filter(fit).collect();
                fitting.dedup_by(|a, b| a.is(&b.name));
                match fitting[..] {
                    [only] => only,
                    [] => {
                        return Err(format!(
                            "{here}: which tool touched its teaching points is not said, and no tool {holds} is known: write \
                             taught_with = \"NAME\""
                        ));
                    }
                    _ => {
                        let names = fitting.iter().map(|known| known.name.as_str()).take(MAX_NAMES);
                        let more = match fitting.len().saturating_sub(MAX_NAMES) {
                            0 => String::new(),
                            more => format!(" and {more} more"),
                        };
                        return Err(format!(
                            "{here}: which tool touched its teaching points is not said, and it may have been any of {}{more}: \
                             write taught_with = \"NAME\"",
                            names.collect::<Vec<_>>().join(", ")
                        ));
                    }
                }
            }
        };
        let real = match found.stated {
            Some(stated) => self.commanded_tool(stated, &found.frame, (found.held, found.load))?.pose,
            None => found.frame,
        };
        Ok(TouchingTool {
            name: found.name.clone(),
            held,
            commanded: found.frame.translation.vector,
            real: real.translation.vector,
            load: found.load.filter(|_| held),
        })
    }

    /// Every tool of known value, by name: those of the program, those that the cell file places, and tool0.
    fn tools(&self) -> &KnownTools<'a> {
        self.known.get_or_init(|| KnownTools::of(self.known()))
    }

    fn known(&self) -> Vec<KnownTool<'a>> {
        let mut out: Vec<KnownTool<'a>> = Vec::new();
        let mut seen = HashSet::new();
        let tools = self.listing.declared_tools.iter().chain(&self.listing.tools);
        for tool in tools {
            let Ok(value) = &tool.value else { continue };
            let (in_text, held, frame) = (tool.place.is_some(), value.robhold, value.frame.pose());
            let frame_value = frame.translation.vector.iter().chain(frame.rotation.coords.iter());
            // Adding 0 maps −0 to 0.
            let bits: Vec<u64> = frame_value.map(|v| (v + 0.0).to_bits()).collect();
            if seen.insert((tool.name.as_str(), in_text, held, bits)) {
                let labels = self.stated.labels_of(&tool.name).to_vec();
                let stated = self.stated.tool(tool);
                let (name, load) = (tool.name.clone(), own_load(value));
                out.push(KnownTool { name, in_text, frame, held, load, labels, stated });
            }
        }
        let declared = KnownTools::of(std::mem::take(&mut out));
        for stated in &self.stated.cell.tool {
            if let Some(frame) = stated.pose()
                && declared.called(&stated.name).next().is_none()
            {
                let name = stated.name.clone();
                out.push(KnownTool {
                    name,
                    in_text: false,
                    frame,
                    held: true,
                    load: None,
                    labels: Vec::new(),
                    stated: Some(stated),
                });
            }
        }
        out.splice(..0, declared.list);
        if !out.iter().any(|known| known.is("tool0")) {
            let (name, frame) = ("tool0".to_owned(), Pose::identity());
            let (load, labels) = (None, Vec::new());
            out.push(KnownTool { name, in_text: true, frame, held: true, load, labels, stated: None });
        }
        out.sort_by_key(|known| known.name.to_ascii_lowercase());
        out
    }
}

/// Mass of a tool with its centre in the flange frame, where the program states it.
fn own_load(tool: &ToolValue) -> Option<Load> {
    let load = Load { mass_kg: tool.mass_kg, centre_mm: tool.centre_of_gravity_mm };
    (tool.mass_kg > 0.0).then_some(load)
}

/// Whether the cell file agrees with the program about the position of a frame, if it states one.
fn agrees(kind: FrameKind, stated: &CellFrame, commanded: &Pose) -> Result<(), String> {
    let Some(placed) = stated.pose() else { return Ok(()) };
    let apart = FrameDistance::of(&placed, commanded);
    if apart.within(WRITTEN_TOLERANCE) {
        return Ok(());
    }
    let what = match kind {
        FrameKind::Tool => "frame",
        FrameKind::Wobj => "user frame",
    };
    Err(format!(
        "cell file: {kind} \"{}\": position_mm and quaternion_wxyz are {:.2} mm and {:.3}° away from the \
         {what} that the program declares, at {}: a RAPID program states it itself; remove them, or correct \
         the one that is wrong",
        stated.name,
        apart.mm,
        apart.rad.to_degrees(),
        list(&commanded.translation.vector)
    ))
}
