//! Notes of a plan: what was not checked, what was assumed, and how backlash and payload enter.

use std::collections::HashMap;

use crate::arms::Arms;
use crate::condition::payload::{is_load_dependent, payload_at};
use crate::frames::frame_table::FrameTable;
use crate::line_list::{lines_of, numbered};
use crate::options::Options;
use crate::plan::MotionOutcome;
use crate::risk::beyond_noise::ALIKE_RAD;
use crate::risk::cut_risk::UnseenShare;
use crate::target::solved_target::SolvedTargets;
use truegrind_arm::effect::Effect;
use truegrind_arm::estimated::Estimated;
use truegrind_programs::motion::load::Grip;
use truegrind_programs::motion::{Frame, Listing, Motion, MotionKind, Origin, Place, ReplacedFrame, Switch};

/// How backlash enters this program.
pub(crate) fn backlash_note(arms: &Arms<'_>, solved: &SolvedTargets<'_>) -> Option<String> {
    let plays = arms.conditions.play_rad.iter().enumerate().filter(|(_, play)| **play != 0.0);
    let plays: Vec<String> =
        plays.map(|(j, play)| format!("joint {}: {:.4}°", j + 1, play.abs().to_degrees())).collect();
    if plays.is_empty() || !solved.has_any() {
        return None;
    }
    let unknown = match solved.in_play() {
        (0, _) => String::new(),
        (count, most) => format!(
            "; at {} the backlash side of a joint is unknown (it has not moved yet, or the \
             previous motion is unknown): mid-play is assumed, and half the backlash is included in the σ there \
             (up to {most:.3} mm)",
            counted(count, "target", "targets")
        ),
    };
    Some(format!(
        "backlash ({}): the side from which each joint arrives follows from the program's own motion{unknown}",
        plays.join(", ")
    ))
}

/// Doubtful effects: not corrected, but included in every σ.
pub(crate) fn doubtful_effects_note(arms: &Arms<'_>) -> Option<String> {
    let still = arms.estimated.arm().model.effects.iter().filter(|effect| effect.is_zero());
    let named: Vec<String> = still
        .map(|effect| match effect.joint() {
            Some(joint) => format!("{} of joint {}", effect.name(), joint + 1),
            None => effect.name().to_owned(),
        })
        .collect();
    (!named.is_empty())
        .then(|| format!("not certain, so included in every σ but not corrected: {}", named.join(", ")))
}

/// How many times the largest σ an error beyond the noise is from which it is stated, where no σ counts it.
const BEYOND_SIGMA: f64 = 2.0;

/// Share of the largest σ from which an error that it counts is stated.
const COUNTED_SHARE: f64 = 0.5;

/// Sets of missing words that are reported.
const TOLD_SETS: usize = 4;

/// The words that motions lack after labels, jumps, calls and loops, each set with its lines.
fn unstated_notes(listing: &Listing) -> Vec<String> {
    let mut sets: Vec<(&str, Vec<u32>)> = Vec::new();
    for (motion, words) in &listing.nc.unstated {
        match sets.iter_mut().find(|(known, _)| known == words) {
            Some((_, motions)) => motions.push(*motion),
            None => sets.push((words, vec![*motion])),
        }
    }
    let note = |(words, motions): &(&str, Vec<u32>)| {
        let lines = lines_of(listing, motions)?;
        Some(format!(
            "after a label, jump, call, loop or branch the program text does not determine {words}, so {}. State these words in the first of these \
             blocks, or between it and the label ({lines})",
            counted(motions.len(), "motion is not corrected", "motions are not corrected")
        ))
    };
    sets.iter().take(TOLD_SETS).filter_map(note).collect()
}

/// What the measurement of the arm deviates from its model beyond the noise: where a σ is mostly that, how it is counted; in a model of an
/// earlier version, where it is more than every σ of the program; where the noise is unknown, that it is not counted.
pub(crate) fn beyond_noise_note(arms: &Arms<'_>, sigmas_mm: impl Iterator<Item = f64>) -> Option<String> {
    let largest = sigmas_mm.reduce(f64::max)?;
    let knowledge = arms.knowledge?;
    let Some(beyond) = knowledge.beyond_noise_mm else {
        return noise_unknown_note(knowledge, largest);
    };
    // Beside doubtful effects it is known from these alone, and they are in every σ (`doubtful_effects_note`).
    if knowledge.beyond_noise_rad.is_none() && knowledge.model.effects.iter().any(Effect::is_zero) {
        return None;
    }
    if let Some(rad) = knowledge.beyond_noise_rad {
        return (beyond > COUNTED_SHARE * largest).then(|| {
            let (least, most) = rad.iter().fold((f64::INFINITY, 0.0_f64), |(a, b), rad| (a.min(*rad), b.max(*rad)));
            format!(
                "every σ includes the {beyond:.3} mm RMS by which the measurement deviates from this model beyond noise, as errors of {:.4} to \
                 {:.4}° in the joints (a longer tool is off by more) that are alike in poses less than {:.0}° apart; `truegrind diagnose` looks \
                 for their causes",
                least.to_degrees(),
                most.to_degrees(),
                ALIKE_RAD.to_degrees()
            )
        });
    }
    (beyond > BEYOND_SIGMA * largest).then(|| {
        format!(
            "the measurement deviates from this model by {beyond:.3} mm RMS more than noise explains: programs may be off by as much beyond every σ \
             stated here; `truegrind diagnose` looks for the causes"
        )
    })
}

/// Where no poses were repeated all that the measurement deviates from the model may be noise, or all of it the arm's: no σ counts it.
fn noise_unknown_note(knowledge: &Estimated, largest_sigma_mm: f64) -> Option<String> {
    let left_mm = knowledge.calibrated.held_out.rmse;
    (left_mm > BEYOND_SIGMA * largest_sigma_mm).then(|| {
        format!(
            "no σ stated here counts what this model may lack: it leaves a held-out error of {left_mm:.3} mm RMSE, and too few poses were repeated to \
             tell how much of that is the arm's and how much noise. Programs may be off by as much; a measurement with repeated poses \
             (`truegrind plan`) tells"
        )
    })
}

/// A smaller σ is small enough whatever it comes from (mm).
const WORTH_TELLING_MM: f64 = 0.05;

/// What of the stated σ comes from parameters that the measurement did not show, where that is most of it.
pub(crate) fn unseen_note(knowledge: &Estimated, unseen: &UnseenShare) -> Option<String> {
    let name = &knowledge.parameters.get(unseen.parameter?)?.name;
    // The parts of a σ can cancel in part, so that one of them is larger than the whole.
    let part = if unseen.unseen_mm < unseen.sigma_mm {
        format!("of the {:.3} mm (1σ) stated for a cut, {:.3} mm", unseen.sigma_mm, unseen.unseen_mm)
    } else {
        format!("the {:.3} mm (1σ) stated for a cut", unseen.sigma_mm)
    };
    (unseen.unseen_mm > WORTH_TELLING_MM).then(|| {
        format!(
            "{part} come from parameters that the measurement did not determine: above all {name} keeps the tolerance of this arm's links, since \
             the place of the target on the flange is not known independently. Where tool and work object are taught with this arm (cell file, \
             origin = \"taught\"), such errors cancel"
        )
    })
}

/// Lines and arcs that may start at several places.
pub(crate) fn several_starts_note(listing: &Listing, motions: &[u32]) -> Option<String> {
    let lines = lines_of(listing, motions)?;
    Some(format!(
        "{} at more than one place: the path from each was checked against --tolerance, but not for joint limits, singularities or speed, and no \
         targets were inserted ({lines})",
        counted(motions.len(), "line or arc may start", "lines or arcs may start")
    ))
}

/// A smaller tilt is not worth a note (rad).
const TILT_RAD: f64 = 1e-4;

/// Targets near a pole of A, B and C, in an orientation that is not quite the intended one.
pub(crate) fn at_poles_note(
    listing: &Listing,
    solved: &SolvedTargets<'_>,
    outcomes: &[MotionOutcome],
    frame_table: &FrameTable,
    arms: &Arms<'_>,
) -> Option<String> {
    let mut largest_rad = 0.0_f64;
    let mut tilted: Vec<u32> = Vec::new();
    let written = |motion: &&u32| outcomes[**motion as usize].status.is_written();
    for motion in listing.nc.at_poles.keys().filter(written) {
        let Some(Ok(target)) = solved.of(*motion as usize).last() else { continue };
        let flange = arms.conditions.arm(target.condition_index).forward(&target.after);
        let reached = frame_table.list[target.frames_index].real.target_of(&flange);
        let tilt_rad = reached.rotation.angle_to(&target.intended.pose().rotation);
        if tilt_rad > TILT_RAD {
            largest_rad = largest_rad.max(tilt_rad);
            tilted.push(*motion);
        }
    }
    let lines = lines_of(listing, &tilted)?;
    Some(format!(
        "{} near a pole of A, B and C (B beyond 80° from 0), where they would have to run far for a small turn of the tool: the position is \
         corrected, and the tool stays tilted by up to {:.3}° ({lines})",
        counted(tilted.len(), "target lies", "targets lie"),
        largest_rad.to_degrees()
    ))
}

/// What was not checked or was assumed, with line numbers.
pub(crate) fn unchecked_notes(
    listing: &Listing,
    solved: &SolvedTargets<'_>,
    unchecked: &[u32],
) -> Vec<String> {
    let mut out = Vec::new();
    if let Some(lines) = lines_of(listing, unchecked) {
        out.push(format!(
            "{} at a place that is unknown or not corrected: the end is corrected, the path to it is not checked ({lines})",
            counted(unchecked.len(), "line or arc starts", "lines or arcs start")
        ));
    }
    let by_persistent: Vec<u32> = (0..listing.motions.len() as u32)
        .filter(|motion| {
            let targets = &listing.motions[*motion as usize].targets;
            targets.iter().any(|target| matches!(target.origin, Origin::Offset(_)))
        })
        .collect();
    if let Some(lines) = lines_of(listing, &by_persistent) {
        out.push(format!(
            "{} offset by persistent data (PERS): corrected for the values in the files; the offset stays in the program, and no targets are inserted \
             ({lines})",
            counted(by_persistent.len(), "motion is", "motions are")
        ));
    }
    let to_persistent: Vec<u32> = (0..listing.motions.len() as u32)
        .filter(|motion| listing.has_persistent_target(&listing.motions[*motion as usize]))
        .collect();
    if let Some(lines) = lines_of(listing, &to_persistent) {
        out.push(format!(
            "{} to persistent targets (PERS): corrected for the values in the files; values that an operator or another task writes later are not \
             ({lines})",
            counted(to_persistent.len(), "motion goes", "motions go")
        ));
    }
    out.extend(unstated_notes(listing));
    if let Some(lines) = lines_of(listing, &listing.nc.external_calls) {
        out.push(format!(
            "{} that is not followed: each NC program is read by itself, even if the other one is given too, lies in the same folder or is in the \
             same archive file (--together does not join NC programs). Of work offset, shifts, tool, units and tool centre point \
             control it is assumed to leave unchanged only what the text sets to a single value; state again after the call what the text \
             switches or the call changes ({lines})",
            counted(listing.nc.external_calls.len(), "block calls another program", "blocks call another program")
        ));
    }
    out.extend(several_mains_note(listing));
    out.extend(outside_calls_note(listing));
    out.extend(position_decisions_note(listing));
    out.extend(open_control_note(listing));
    out.extend(unstated_length_note(listing));
    out.extend(unstated_turn_note(listing));
    out.extend(
        listing.nc.replaced_frames.iter().map(|(place, frame)| replaced_frame_note(listing, *place, frame)),
    );
    let curve = |m: &u32| {
        let motion = &listing.motions[*m as usize];
        motion.own_reason.is_none()
            && motion.modal.wrist_interpolation == Switch::On
            && matches!(motion.kind, MotionKind::Linear | MotionKind::Circular)
    };
    let wrist: Vec<u32> = (0..listing.motions.len() as u32).filter(curve).collect();
    if let Some(lines) = lines_of(listing, &wrist) {
        out.push(format!(
            "on {} the controller turns the wrist joint by joint (SingArea \\Wrist): the path is checked as if the orientation \
             were interpolated evenly, and no targets are inserted ({lines})",
            counted(wrist.len(), "line or arc", "lines or arcs")
        ));
    }
    if let Some(lines) = lines_of(listing, &solved.guessed) {
        let count = solved.guessed.len();
        out.push(if listing.numbered {
            format!(
                "the position of the arm before {} is unknown, and NC states no configuration. Assumed, unchecked: wrist in front, elbow not turned \
                 back, joints nearest to zero ({lines}). State where the arm starts, in the cell file (start_deg) or in a comment (truegrind start [q1,…,q6])",
                counted(count, "motion", "motions")
            )
        } else {
            format!(
                "{} from an unknown start with the configuration not monitored (ConfL \\Off, ConfJ \\Off). Assumed, unchecked: the configuration that matches \
                 the stated quarter turns best ({lines})",
                counted(count, "motion goes", "motions go")
            )
        });
    }
    out
}

/// NC files of which nothing shows the control, on which the meaning of X, Y, Z depends.
fn open_control_note(listing: &Listing) -> Option<String> {
    let lines = numbered(&listing.files, listing.nc.open_controls.iter().copied())?;
    Some(format!(
        "nothing says which control the program is for. It was read as ISO 6983: X Y Z are the tool tip, and numbers without a decimal point are \
         mm (from {lines}). A Fanuc reads both differently. State the control in a comment of the program: \
         (truegrind control fanuc), or linuxcnc, siemens, heidenhain, iso"
    ))
}

/// LinuxCNC files that change the tool without activating its length.
fn unstated_length_note(listing: &Listing) -> Option<String> {
    let lines = numbered(&listing.files, listing.nc.unstated_lengths.iter().copied())?;
    Some(format!(
        "no G43: on LinuxCNC, T and M6 do not activate the tool length, so X Y Z are the tool tip only if G43 is still active from before. Program \
         G43 after M6, or G49 where X Y Z are not those of the tip (before {lines})"
    ))
}

/// NC files that state a tool vector, and nowhere the turn about it.
pub(crate) fn unstated_turn_note(listing: &Listing) -> Option<String> {
    let lines = numbered(&listing.files, listing.nc.unstated_turns.iter().copied())?;
    Some(format!(
        "no word states the turn about the tool vector, on which the joints of a six-axis arm depend. It was taken as 0: x of the tool lies in the \
         plane of its axis and x of the work object. State it (THETA on an 840D), or A, B and C in place of the vector (from {lines})"
    ))
}

/// A work offset or tool that the program sets otherwise than the cell file or a comment states it.
fn replaced_frame_note(listing: &Listing, place: Place, frame: &ReplacedFrame) -> String {
    let ReplacedFrame { name, set, stated } = frame;
    let [to, from] = [set.pose(), stated.pose()];
    let text = |frame: &Frame| {
        let [x, y, z] = frame.position_mm;
        format!("[{x:.2}, {y:.2}, {z:.2}]")
    };
    let line = numbered(&listing.files, [place].into_iter()).unwrap_or_default();
    format!(
        "{name}: {line} sets it to {}, the cell file or a comment states {}: {:.2} mm and {:.3}° apart. Behind that line the motions in it are corrected \
         for what the program sets. Correct the one that is wrong, or leave its value out of the cell file",
        text(set),
        text(stated),
        (to.translation.vector - from.translation.vector).norm(),
        to.rotation.angle_to(&from.rotation).to_degrees()
    )
}

/// Decisions by the position that the robot reads, at the end of motions that are corrected.
fn position_decisions_note(listing: &Listing) -> Option<String> {
    let lines = numbered(&listing.files, listing.position_decisions.iter().copied())?;
    Some(format!(
        "the program decides by the position that the robot reads (CRobT, CPos, CJointT). After a corrected motion that is the corrected position: \
         check that each tolerance there is wider than the largest correction ({lines})"
    ))
}

/// Files that are no modules of one task: each begins a program.
fn several_mains_note(listing: &Listing) -> Option<String> {
    let lines = numbered(&listing.files, listing.mains.iter().copied())?;
    Some(format!(
        "{} procedures main: a controller loads a task with one. The files were read as the modules of one task, so that their cuts were placed and \
         judged together; if they are separate programs, give --each ({lines})",
        listing.mains.len()
    ))
}

/// Calls of routines that are in none of the files, and what is assumed of them.
fn outside_calls_note(listing: &Listing) -> Option<String> {
    /// How many routines are named.
    const NAMED: usize = 5;
    let mut routines: Vec<(&str, Vec<Place>)> = Vec::new();
    let mut index_of: HashMap<String, usize> = HashMap::new();
    for call in &listing.outside_calls {
        let index = *index_of.entry(call.name.to_ascii_lowercase()).or_insert_with(|| {
            routines.push((call.name.as_str(), Vec::new()));
            routines.len() - 1
        });
        routines[index].1.push(call.place);
    }
    let named = routines.iter().take(NAMED).filter_map(|(name, places)| {
        Some(format!("{name} ({})", numbered(&listing.files, places.iter().copied())?))
    });
    let named: Vec<String> = named.collect();
    let more = routines.len().saturating_sub(NAMED);
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    (!named.is_empty()).then(|| {
        format!(
            "routines missing from the files are called: {}{more}. They are assumed not to change tools, work objects or targets of the files, \
             numbers that these are computed from, the program displacement, switches (ConfL, SingArea, SoftAct …) or the load; give their modules \
             too (--together)",
            named.join(", ")
        )
    })
}

/// A number of things, in the singular for one.
fn counted(count: usize, one: &str, several: &str) -> String {
    if count == 1 { format!("1 {one}") } else { format!("{count} {several}") }
}

/// A mass (kg) to the gram: a sum of tool and load has digits that nobody stated.
fn grams(kg: f64) -> f64 {
    (kg * 1e3).round() / 1e3
}

/// How many corrected motions have a load that is known only at run time, under a model whose deflection follows the load. At what is left the
/// load changes nothing.
pub(crate) fn unknown_loads(arms: &Arms<'_>, options: &Options, outcomes: &[MotionOutcome]) -> usize {
    let load_dependent = arms.estimated.arm().model.effects.iter().any(is_load_dependent);
    let Some(loads) = options.loads.as_ref().filter(|_| load_dependent) else { return 0 };
    let corrected = outcomes.iter().filter(|outcome| outcome.status.is_written());
    corrected.filter(|outcome| loads.grip(outcome.motion as usize) == Grip::Unknown).count()
}

/// Which payload was assumed.
pub(crate) fn load_notes(listing: &Listing, arms: &Arms<'_>, options: &Options) -> Vec<String> {
    let model = arms.estimated.arm().model;
    let load_dependent = model.effects.iter().any(is_load_dependent);
    let lumped = model.effects.iter().any(|e| e.holds_for_one_load() && !e.is_zero());
    let Some(loads) = options.loads.as_ref().filter(|_| load_dependent || lumped) else {
        return Vec::new();
    };
    let mut out = Vec::new();
    let motions =
        || listing.motions.iter().enumerate().filter(|(_, m)| m.own_reason.is_none() && m.tool.is_some());
    let at = |(index, motion): (usize, &Motion)| payload_at(loads, index, motion, listing);
    let stated: Vec<f64> = motions().filter_map(at).map(|load| load.mass_kg).collect();
    let silent = motions().count() - stated.len();
    let base = options.condition.payload_kg.map_or("no payload".to_owned(), |kg| format!("{} kg", grams(kg)));
    if load_dependent && let Some(&first) = stated.first() {
        let (low, high) = stated.iter().fold((first, first), |(a, b), kg| (a.min(*kg), b.max(*kg)));
        let (low, high) = (grams(low), grams(high));
        let range = if low == high { format!("{low} kg") } else { format!("{low} to {high} kg") };
        out.push(format!(
            "payload: {range}, as stated by the program's tools and loads (--payload overrides it)"
        ));
    }
    if load_dependent && silent > 0 {
        out.push(format!(
            "payload: at {} the tool states no mass, so that of the measurement is assumed \
             ({base}); --payload overrides it",
            counted(silent, "motion", "motions")
        ));
    }
    if loads.unknown() > 0 {
        out.push(format!(
            "payload: at {} the load set by GripLoad is unknown; only the load of the tool is used",
            counted(loads.unknown(), "motion", "motions")
        ));
    }
    if lumped {
        let what = if load_dependent { "part of the compliance" } else { "compliance" };
        out.push(format!(
            "{what} was identified without the masses of the arm: it applies to the payload of the \
             measurement ({base}) and does not follow that of the program"
        ));
    }
    out
}
