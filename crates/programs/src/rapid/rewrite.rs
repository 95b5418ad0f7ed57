//! Rewriting: new target values as edits of the RAPID text.
//!
//! The origin of a target's numbers decides how it changes: a literal in the instruction in place; a declaration in
//! place where every use agrees on the new value and nothing else reads it, else a clone beside it under a new name;
//! an array element in place or as a literal in the instruction; a computed target as a literal in the instruction.

mod extra;

use std::collections::{BTreeMap, HashMap, HashSet};

use rayon::prelude::*;

use super::instruction::{self, INSTRUCTIONS, InsertedForm, Instruction};
use super::lexer::lex;
use super::mark;
use super::print::{self, NewValue};
use super::task::Task;
use super::token::{Token, folded, keyword, same_name};
use crate::edit::{EditError, Edits, line_end};
use crate::motion::{Motion, MotionKind, Offset, Origin, Reason, Span, TargetValue};
use crate::rewrite::{Change, FileEdits, NewTarget, RewriteOptions, RewriteOutcome, Rewritten};

/// Changes that one thread processes at a time.
const CHUNK: usize = 1024;

/// Greatest length of a data name.
const NAME_LENGTH: usize = 32;

impl Task<'_> {
    /// The edits that make the changes. Per file they are sorted and disjoint; [`Edits::apply`] makes the new bytes.
    ///
    /// A change of a motion that must be left ([`Motion::reason`]) is refused with that reason; two changes of one
    /// motion would overlap and are an error.
    pub fn rewrite(&self, changes: &[Change], options: &RewriteOptions) -> Result<Rewritten, EditError> {
        let mut rewriter = Rewriter::new(self, options);
        let outcomes = rewriter.all(changes);
        let mut files = Vec::with_capacity(self.sources.len());
        for ((edits, source), places) in rewriter.edits.into_iter().zip(&self.sources).zip(&self.marks) {
            let mut file = FileEdits { edits, unmarked: false };
            if let Some(mark) = options.mark.as_ref().filter(|_| !file.edits.is_empty()) {
                // Before the others, so that the list stays in order.
                let mut marked = places.edits(source, &file.edits, mark::text(mark).as_bytes());
                file.unmarked = marked.is_empty();
                marked.append(std::mem::take(&mut file.edits));
                file.edits = marked;
            }
            file.edits.sort()?;
            files.push(file);
        }
        Ok(Rewritten { files, outcomes })
    }

    /// Whether none of the changes would be refused.
    pub fn accepts(&self, changes: &[Change]) -> bool {
        changes.par_iter().with_min_len(CHUNK).all(|change| {
            let motion = self.listing.motions.get(change.motion as usize);
            // Whether persistent targets can be edited in place depends on the other changes.
            let is_accepted = |motion: &Motion| {
                !self.listing.has_persistent_target(motion) && self.refusal(motion, change).is_none()
            };
            motion.is_some_and(is_accepted)
        })
    }

    /// Why a change is refused.
    fn refusal(&self, motion: &Motion, change: &Change) -> Option<Reason> {
        if let Some(reason) = motion.reason() {
            return Some(reason);
        }
        if !change.is_representable() {
            return Some(Reason::NumberRange);
        }
        let instruction = || instruction_of(motion);
        for (target, new) in motion.targets.iter().zip(&change.targets) {
            let Ok(value) = &target.value else { continue };
            match (new, value) {
                (NewTarget::Cartesian { .. }, TargetValue::Joint(_)) => return Some(Reason::WrongKind),
                (NewTarget::Joint { .. }, TargetValue::Cartesian(_))
                    if instruction().is_none_or(|instruction| instruction.joint_form.is_none()) =>
                {
                    return Some(Reason::NoJointForm);
                }
                // Joints would not follow the data.
                (NewTarget::Joint { .. }, TargetValue::Cartesian(_))
                    if self.listing.follows_persistent(target) =>
                {
                    return Some(Reason::Persistent);
                }
                _ => {}
            }
        }
        if change.straightens() && !motion.can_straighten {
            return Some(Reason::NoInsertion);
        }
        if change.before.is_empty() {
            return None;
        }
        // Inserted targets would not follow the data.
        let follows =
            |motion: &Motion| motion.targets.iter().any(|target| self.listing.follows_persistent(target));
        let previous = motion.previous.and_then(|index| self.listing.motions.get(index as usize));
        if follows(motion) || previous.is_some_and(follows) {
            return Some(Reason::NoInsertion);
        }
        let guarded = self.guarded[change.motion as usize];
        let written = instruction().and_then(|instruction| written_as(instruction, change));
        let inserted = written.map_or(InsertedForm::Nothing, |instruction| instruction.inserted);
        if guarded || motion.timed || inserted == InsertedForm::Nothing {
            return Some(Reason::NoInsertion);
        }
        for extra in &change.before {
            match (extra.kind, &extra.target) {
                (MotionKind::Linear | MotionKind::Joint, NewTarget::Cartesian { .. }) => {}
                (MotionKind::AbsoluteJoint, NewTarget::Joint { .. }) if inserted == InsertedForm::Plain => {}
                (MotionKind::AbsoluteJoint, NewTarget::Joint { .. }) => return Some(Reason::NoJointForm),
                _ => return Some(Reason::WrongKind),
            }
        }
        None
    }
}

/// The instruction of a motion as the source has it.
fn instruction_of(motion: &Motion) -> Option<&'static Instruction> {
    instruction::find(motion.instruction.as_bytes()).map(|index| &INSTRUCTIONS[index])
}

/// Update of one target: index of the change, motion, target, and the new value.
#[derive(Clone, Copy)]
struct TargetUpdate {
    change: usize,
    motion: u32,
    target: u32,
    fresh: NewValue,
}

/// Updates by declaration and first byte of the literal.
type UpdatesByDeclaration = BTreeMap<(u32, u32), Vec<TargetUpdate>>;

/// Uses of the declared targets.
struct Users {
    /// Motions that use each declaration; array elements are distinguished by the first byte of their literal.
    own: HashMap<(u32, u32), Vec<(u32, u32)>>,
    /// Declarations with a reader that will not be replaced by a literal.
    read_elsewhere: HashSet<u32>,
}

impl Users {
    fn of(task: &Task<'_>, replaced: &HashSet<(u32, u32)>) -> Users {
        let mut users = Users { own: HashMap::new(), read_elsewhere: HashSet::new() };
        for (index, declaration) in (0_u32..).zip(&task.listing.declarations) {
            for &user in &declaration.uses {
                let target = &task.listing.motions[user.0 as usize].targets[user.1 as usize];
                let start = match target.origin {
                    Origin::Element { literal, .. } => literal.start,
                    _ => 0,
                };
                users.own.entry((index, start)).or_default().push(user);
            }
            let mut others = declaration.other_uses.iter();
            if others.any(|other| other.motion.is_none_or(|user| !replaced.contains(&user))) {
                users.read_elsewhere.insert(index);
            }
        }
        users
    }
}

/// The name of an argument, `Name :=`, right before its value.
fn named_before(source: &[u8], value: usize) -> Option<std::ops::Range<usize>> {
    let assign = source[..value].trim_ascii_end().strip_suffix(b":=")?.trim_ascii_end();
    let letters =
        assign.iter().rev().take_while(|byte| byte.is_ascii_alphanumeric() || **byte == b'_').count();
    (letters > 0).then_some(assign.len() - letters..assign.len())
}

struct Rewriter<'r, 's> {
    task: &'r Task<'s>,
    options: &'r RewriteOptions,
    edits: Vec<Edits>,
    /// Every name in use, lower case, once a new one is needed.
    names: Option<HashSet<Vec<u8>>>,
    /// Declarations that were edited in place; the elements of an array count as one.
    moved_bases: HashSet<u32>,
}

impl<'r, 's> Rewriter<'r, 's> {
    fn new(task: &'r Task<'s>, options: &'r RewriteOptions) -> Self {
        let edits = vec![Edits::new(); task.sources.len()];
        Rewriter { task, options, edits, names: None, moved_bases: HashSet::new() }
    }

    fn all(&mut self, changes: &[Change]) -> Vec<RewriteOutcome> {
        let task = self.task;
        let (mut outcomes, updates, computed) = self.in_place(changes);
        let replaced: HashSet<(u32, u32)> =
            computed.iter().map(|update| (update.motion, update.target)).collect();
        if !updates.is_empty() {
            let users = Users::of(task, &replaced);
            for ((declaration, literal), updates) in updates {
                self.declared((declaration, literal), &updates, &users, &mut outcomes);
            }
        }
        self.computed(&computed, &mut outcomes);
        for (change, outcome) in changes.iter().zip(&mut outcomes) {
            if !change.before.is_empty() && !matches!(outcome, RewriteOutcome::Refused(_)) {
                self.extras(change);
                if *outcome == RewriteOutcome::Unchanged {
                    *outcome = RewriteOutcome::InPlace;
                }
            }
        }
        outcomes
    }

    /// Edits within the instructions, in parallel, since none depends on another. Updates of declared and computed targets are
    /// collected in the order of the changes.
    fn in_place(
        &mut self,
        changes: &[Change],
    ) -> (Vec<RewriteOutcome>, UpdatesByDeclaration, Vec<TargetUpdate>) {
        let (task, options) = (self.task, self.options);
        let chunks: Vec<_> = changes
            .par_chunks(CHUNK)
            .enumerate()
            .map(|(chunk, changes)| {
                let mut part = Rewriter::new(task, options);
                if let [edits] = &mut part.edits[..] {
                    // Of a target the numbers before the external axes change, some 60 digits.
                    *edits = Edits::with_capacity(changes.len(), 80 * changes.len());
                }
                let (mut updates, mut computed) = (UpdatesByDeclaration::new(), Vec::new());
                let outcomes: Vec<RewriteOutcome> = (chunk * CHUNK..)
                    .zip(changes)
                    .map(|(index, change)| match task.listing.motions.get(change.motion as usize) {
                        None => RewriteOutcome::Refused(Reason::MissingArgument),
                        Some(motion) => match task.refusal(motion, change) {
                            Some(reason) => RewriteOutcome::Refused(reason),
                            None => part.one(index, motion, change, &mut updates, &mut computed),
                        },
                    })
                    .collect();
                (part.edits, outcomes, updates, computed)
            })
            .collect();
        let (mut outcomes, mut updates, mut computed) =
            (Vec::with_capacity(changes.len()), UpdatesByDeclaration::new(), Vec::new());
        for (edits, mut some, updated, mut left) in chunks {
            self.edits.iter_mut().zip(edits).for_each(|(all, some)| all.append(some));
            outcomes.append(&mut some);
            for (place, mut more) in updated {
                updates.entry(place).or_default().append(&mut more);
            }
            computed.append(&mut left);
        }
        (outcomes, updates, computed)
    }

    /// The targets of one motion: literals in the instruction at once, the others collected.
    fn one(
        &mut self,
        index: usize,
        motion: &Motion,
        change: &Change,
        updates: &mut UpdatesByDeclaration,
        computed: &mut Vec<TargetUpdate>,
    ) -> RewriteOutcome {
        let mut outcome = RewriteOutcome::Unchanged;
        if change.straightens() {
            self.straighten(motion);
            outcome = RewriteOutcome::InPlace;
        }
        for (position, (target, new)) in motion.targets.iter().zip(&change.targets).enumerate() {
            let Some(fresh) = fresh(new) else { continue };
            let Ok(old) = target.value else { continue };
            let (motion_index, position) = (change.motion, position as u32);
            let update = TargetUpdate { change: index, motion: motion_index, target: position, fresh };
            if matches!((&fresh, &old), (NewValue::Joint { .. }, TargetValue::Cartesian(_))) {
                self.take_joint_form(motion, target.argument, &old, &fresh);
                outcome = worse(outcome, RewriteOutcome::Inlined);
                continue;
            }
            match target.origin {
                Origin::Inline => {
                    if self.literal(motion.place.file, target.argument, (&old, true), &fresh) {
                        outcome = worse(outcome, RewriteOutcome::InPlace);
                    }
                }
                Origin::Declared(declaration) => {
                    updates.entry((declaration, 0)).or_default().push(update);
                }
                Origin::Element { declaration, literal } => {
                    updates.entry((declaration, literal.start)).or_default().push(update);
                }
                Origin::Computed | Origin::Offset(_) => computed.push(update),
                Origin::Unknown => {}
            }
        }
        outcome
    }

    /// Replaces the numbers of a literal, or the whole literal where it does not consist of plain numbers. `plain`: it does.
    fn literal(
        &mut self,
        file: u32,
        span: Span,
        (old, plain): (&TargetValue, bool),
        fresh: &NewValue,
    ) -> bool {
        let text = &self.task.sources[file as usize][span.range()];
        let edits = &mut self.edits[file as usize];
        let known = Some(old).filter(|_| plain);
        match print::replace_numbers(text, span.start as usize, known, fresh, self.options, edits) {
            Some(changed) => changed,
            None if print::changes(old, fresh, self.options) => {
                let value = print::merged(old, fresh);
                edits.replace_with(span.range(), |out| print::literal(out, &value, self.options));
                true
            }
            None => false,
        }
    }

    fn inline(&mut self, motion: &Motion, span: Span, old: &TargetValue, fresh: &NewValue) {
        let value = print::merged(old, fresh);
        let edits = &mut self.edits[motion.place.file as usize];
        edits.replace_with(span.range(), |out| print::literal(out, &value, self.options));
    }

    /// Changes the instruction to the linear one and deletes the circle point with the comma after it; a comment between them
    /// is kept.
    fn straighten(&mut self, motion: &Motion) {
        let Some(line) = instruction_of(motion).and_then(Instruction::line_form) else { return };
        let start = motion.statement.start as usize;
        let edits = &mut self.edits[motion.place.file as usize];
        edits.replace(start..start + motion.instruction.len(), line.name.as_bytes());
        let source = self.task.sources[motion.place.file as usize];
        for range in circle_point(source, motion).into_iter().flatten() {
            edits.replace(range, b"");
        }
    }

    /// Changes the instruction to the one that takes joints.
    fn take_joint_form(&mut self, motion: &Motion, span: Span, old: &TargetValue, fresh: &NewValue) {
        let Some(name) = instruction_of(motion).and_then(|instruction| instruction.joint_form) else {
            return;
        };
        let start = motion.statement.start as usize;
        let source = self.task.sources[motion.place.file as usize];
        let edits = &mut self.edits[motion.place.file as usize];
        edits.replace(start..start + motion.instruction.len(), name.as_bytes());
        if let Some(argument) = named_before(source, span.start as usize) {
            edits.replace(argument, b"ToJointPos");
        }
        self.inline(motion, span, old, fresh);
    }

    // ---- declarations ----

    /// Updates of one declared target or array element.
    fn declared(
        &mut self,
        (index, start): (u32, u32),
        updates: &[TargetUpdate],
        users: &Users,
        outcomes: &mut [RewriteOutcome],
    ) {
        let task = self.task;
        let declaration = &task.listing.declarations[index as usize];
        let target = |update: &TargetUpdate| {
            &task.listing.motions[update.motion as usize].targets[update.target as usize]
        };
        let Some(first) = updates.first() else { return };
        let Ok(old) = target(first).value else { return };
        let literal = match target(first).origin {
            Origin::Element { literal, .. } => literal,
            _ => declaration.literal.unwrap_or_default(),
        };
        // Updates with the same text.
        let mut groups: Vec<(Vec<u8>, Vec<&TargetUpdate>)> = Vec::new();
        let mut group_of: HashMap<Vec<u8>, usize> = HashMap::new();
        let source = task.sources[declaration.place.file as usize];
        let original = source[literal.range()].to_vec();
        for update in updates {
            let text = self.written(&original, &old, &update.fresh);
            let group = *group_of.entry(text.clone()).or_insert_with(|| {
                groups.push((text, Vec::new()));
                groups.len() - 1
            });
            groups[group].1.push(update);
        }
        // Other uses that need the old value.
        let updated: HashSet<(u32, u32)> =
            updates.iter().map(|update| (update.motion, update.target)).collect();
        let own = users.own.get(&(index, start)).map_or(&[][..], Vec::as_slice);
        let others_hold = users.read_elsewhere.contains(&index)
            || own.iter().any(|user| !updated.contains(user))
            || groups.iter().any(|(text, _)| *text == original)
            // Of several wanted values of persistent data none is written: those whose own is not would follow the one that is.
            || declaration.persistent && groups.len() > 1;
        let mut free = !others_hold;
        for (text, group) in groups {
            if text == original {
                continue;
            }
            let outcome = if free {
                free = false;
                self.literal(declaration.place.file, literal, (&old, false), &group[0].fresh);
                self.moved_bases.insert(index);
                RewriteOutcome::InPlace
            } else if declaration.persistent {
                // A copy would not follow the data.
                RewriteOutcome::Refused(Reason::Persistent)
            } else if declaration.array {
                for update in &group {
                    let motion = &task.listing.motions[update.motion as usize];
                    self.inline(motion, target(update).argument, &old, &update.fresh);
                }
                RewriteOutcome::Inlined
            } else {
                let name = self.clone_of(index, &old, &text);
                for update in &group {
                    let motion = &task.listing.motions[update.motion as usize];
                    let edits = &mut self.edits[motion.place.file as usize];
                    edits.replace(target(update).argument.range(), name.as_bytes());
                }
                RewriteOutcome::Split(name)
            };
            for update in group {
                let was = std::mem::replace(&mut outcomes[update.change], RewriteOutcome::Unchanged);
                outcomes[update.change] = worse(was, outcome.clone());
            }
        }
    }

    /// The text of a literal with new values.
    fn written(&self, text: &[u8], old: &TargetValue, fresh: &NewValue) -> Vec<u8> {
        let mut edits = Edits::new();
        match print::replace_numbers(text, 0, None, fresh, self.options, &mut edits) {
            Some(_) => edits.apply(text).unwrap_or_else(|_| text.to_vec()),
            None if print::changes(old, fresh, self.options) => {
                let mut out = Vec::new();
                print::literal(&mut out, &print::merged(old, fresh), self.options);
                out
            }
            None => text.to_vec(),
        }
    }

    /// Declares a constant with this value beside a declaration, of the type of its `old` value; returns its name.
    fn clone_of(&mut self, index: u32, old: &TargetValue, literal: &[u8]) -> String {
        let declaration = &self.task.listing.declarations[index as usize];
        let file = declaration.place.file as usize;
        let source = self.task.sources[file];
        let name = self.new_name(&declaration.name);
        let statement = &source[declaration.statement.range()];
        let local = statement.len() >= 5 && same_name(&statement[..5], b"LOCAL");
        let joints = matches!(old, TargetValue::Joint(_));
        // After the declaration and a comment on the same line.
        let end = declaration.statement.end as usize;
        let line = source[end..].iter().position(ends_line).map_or(source.len(), |at| end + at);
        let rest = source[end..line].trim_ascii();
        let at = if rest.is_empty() || rest[0] == b'!' {
            end + source[end..line].trim_ascii_end().len()
        } else {
            end
        };
        let mut text = line_end(source).to_vec();
        text.extend_from_slice(indent(source, declaration.statement.start as usize));
        text.extend_from_slice(if local { b"LOCAL CONST " } else { b"CONST " });
        text.extend_from_slice(if joints { b"jointtarget " } else { b"robtarget " });
        text.extend_from_slice(name.as_bytes());
        text.extend_from_slice(b":=");
        text.extend_from_slice(literal);
        text.push(b';');
        self.edits[file].insert(at, &text);
        name
    }

    /// `p10` to `p10_2`, `p10_3`, …: at most 32 characters, unused in the task.
    fn new_name(&mut self, like: &str) -> String {
        let task = self.task;
        let names = self.names.get_or_insert_with(|| {
            let mut names: HashSet<Vec<u8>> = task.symbols.names().map(<[u8]>::to_vec).collect();
            for source in &task.sources {
                let tree = lex(source);
                for token in 0..tree.len() as u32 {
                    if tree.kind(token) == Some(Token::Ident) {
                        names.insert(folded(tree.text(token)));
                    }
                }
            }
            names
        });
        // New text is ASCII, whatever encoding the file has.
        let stem: String = like.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
        let stem =
            if stem.starts_with(|c: char| c.is_ascii_alphabetic()) { stem } else { format!("p{stem}") };
        let mut number = 2_u64;
        loop {
            let tail = format!("_{number}");
            let head = &stem[..stem.len().min(NAME_LENGTH - tail.len())];
            let name = format!("{head}{tail}");
            if keyword(name.as_bytes()).is_none() && names.insert(folded(name.as_bytes())) {
                return name;
            }
            number += 1;
        }
    }

    // ---- computed targets ----

    fn computed(&mut self, updates: &[TargetUpdate], outcomes: &mut [RewriteOutcome]) {
        let task = self.task;
        // A target computed from a changed declaration must be written out even where its own value is unchanged.
        let mut forced: HashSet<(u32, u32)> = HashSet::new();
        for (index, declaration) in task.listing.declarations.iter().enumerate() {
            if self.moved_bases.contains(&(index as u32)) {
                forced.extend(declaration.other_uses.iter().filter_map(|other| other.motion));
            }
        }
        for update in updates {
            let motion = &task.listing.motions[update.motion as usize];
            let target = &motion.targets[update.target as usize];
            let Ok(old) = target.value else { continue };
            if !print::changes(&old, &update.fresh, self.options)
                && !forced.contains(&(update.motion, update.target))
            {
                continue;
            }
            let (span, fresh) = match target.origin {
                Origin::Offset(offset) => {
                    let kept = &task.listing.offsets[offset as usize];
                    (kept.base, before_offset(update.fresh, &kept.offset))
                }
                _ => (target.argument, update.fresh),
            };
            self.inline(motion, span, &old, &fresh);
            let was = std::mem::replace(&mut outcomes[update.change], RewriteOutcome::Unchanged);
            outcomes[update.change] = worse(was, RewriteOutcome::Inlined);
        }
    }
}

/// The value from which an offset leads to a new one.
fn before_offset(fresh: NewValue, offset: &Offset) -> NewValue {
    match fresh {
        NewValue::Cartesian { position_mm, quaternion, conf } => {
            let (position_mm, quaternion) = offset.base_of(position_mm, quaternion);
            NewValue::Cartesian { position_mm, quaternion, conf }
        }
        NewValue::Joint { .. } => fresh,
    }
}

/// The instruction after a change.
fn written_as(instruction: &'static Instruction, change: &Change) -> Option<&'static Instruction> {
    if change.straightens() { instruction.line_form() } else { Some(instruction) }
}

/// The bytes of a circle point, and those of the comma after it with the blanks before the next argument.
fn circle_point(source: &[u8], motion: &Motion) -> Option<[std::ops::Range<usize>; 2]> {
    let via = motion.via()?;
    let mut argument = via.argument.range();
    // `CirPoint := p20` is deleted with its name.
    if let Some(name) = named_before(source, argument.start) {
        argument.start = name.start;
    }
    let mut at = argument.end;
    while let Some(&byte) = source.get(at).filter(|_| at < motion.statement.end as usize) {
        match byte {
            b',' => {
                let blanks = source[at + 1..].iter().take_while(|byte| matches!(byte, b' ' | b'\t')).count();
                return Some([argument, at..at + 1 + blanks]);
            }
            b'!' => at += source[at..].iter().take_while(|byte| !ends_line(byte)).count(),
            _ => at += 1,
        }
    }
    None
}

fn fresh(new: &NewTarget) -> Option<NewValue> {
    match *new {
        NewTarget::Keep | NewTarget::Drop => None,
        NewTarget::Cartesian { position_mm, quaternion, conf } => {
            Some(NewValue::Cartesian { position_mm, quaternion, conf })
        }
        NewTarget::Joint { robot_deg } => Some(NewValue::Joint { robot_deg }),
    }
}

/// The more significant outcome.
fn worse(a: RewriteOutcome, b: RewriteOutcome) -> RewriteOutcome {
    let rank = |outcome: &RewriteOutcome| match outcome {
        RewriteOutcome::Unchanged => 0,
        RewriteOutcome::InPlace => 1,
        RewriteOutcome::Split(_) => 2,
        RewriteOutcome::Inlined => 3,
        RewriteOutcome::Refused(_) => 4,
    };
    if rank(&b) > rank(&a) { b } else { a }
}

/// Whether a byte ends a line; of two, either does.
fn ends_line(byte: &u8) -> bool {
    matches!(byte, b'\n' | b'\r')
}

/// The white space before a statement on its line.
fn indent(source: &[u8], statement: usize) -> &[u8] {
    let line = source[..statement].iter().rposition(ends_line).map_or(0, |at| at + 1);
    let blank = source[line..statement].iter().take_while(|byte| matches!(byte, b' ' | b'\t')).count();
    &source[line..line + blank]
}
