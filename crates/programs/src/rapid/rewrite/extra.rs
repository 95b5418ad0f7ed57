//! Motions inserted before another: they take its speed, tool, work object and process.

use super::{Rewriter, circle_point, fresh, indent, instruction_of, written_as};
use crate::edit::{Edits, line_end};
use crate::motion::{Motion, MotionKind, Role, Span, TargetValue};
use crate::rapid::instruction::{InsertedForm, Instruction, Slot};
use crate::rapid::parser::parse_statement;
use crate::rapid::print;
use crate::rapid::syntax::{RapidTree, Syntax, arguments, tokens_of};
use crate::rapid::token::{Token, same_name};
use crate::rewrite::{Change, Extra};
use crate::tree::Child;

impl Rewriter<'_, '_> {
    /// Inserts the motions of a change.
    pub(super) fn extras(&mut self, change: &Change) {
        let motion = &self.task.listing.motions[change.motion as usize];
        let Some(instruction) = instruction_of(motion) else { return };
        let source = self.task.sources[motion.place.file as usize];
        let start = motion.statement.start as usize;
        let statement = &source[motion.statement.range()];
        let parts = Parts::of(&parse_statement(statement), instruction);
        let mut text = Vec::new();
        for extra in &change.before {
            let Some(written) = written_as(instruction, change) else { return };
            self.extra(&mut text, motion, written, source, &parts, extra);
            text.extend_from_slice(line_end(source));
            text.extend_from_slice(indent(source, start));
        }
        self.edits[motion.place.file as usize].insert(start, &text);
    }

    fn extra(
        &self,
        out: &mut Vec<u8>,
        motion: &Motion,
        instruction: &Instruction,
        source: &[u8],
        parts: &Parts,
        extra: &Extra,
    ) {
        let (Some(fresh), Some(Ok(old))) = (fresh(&extra.target), motion.to().map(|target| target.value))
        else {
            return;
        };
        let mut value = print::merged(&old, &fresh);
        if let Some(external) = extra.external {
            match &mut value {
                TargetValue::Cartesian(target) => target.external = external,
                TargetValue::Joint(target) => target.external = external,
            }
        }
        let statement = &source[motion.statement.range()];
        let mut target = Vec::new();
        print::literal(&mut target, &value, self.options);
        let same = match instruction.inserted {
            InsertedForm::Same => Some(instruction.name),
            InsertedForm::Other(name) => Some(name),
            InsertedForm::Plain | InsertedForm::Nothing => None,
        };
        let Some(name) = same else {
            self.plain(out, extra.kind, &target, statement, parts);
            return;
        };
        // The same instruction, with another target and a fly-by zone.
        let base = motion.statement.start as usize;
        let mut edits = Edits::new();
        edits.replace(0..motion.instruction.len(), name.as_bytes());
        for range in circle_point(source, motion).into_iter().flatten() {
            edits.replace(range.start - base..range.end - base, b"");
        }
        if let Some(to) = motion.targets.iter().find(|target| target.role == Role::To) {
            let range = to.argument.range();
            edits.replace(range.start - base..range.end - base, &target);
        }
        if let Some(zone) = parts.zone {
            edits.replace(zone.range(), self.options.extra_zone.as_bytes());
        }
        for option in &parts.stop_options {
            edits.replace(option.range(), b"");
        }
        if let Ok(copy) = edits.apply(statement) {
            out.extend_from_slice(&copy);
        }
    }

    /// A motion without process: speed, tool and work object are those of the motion, the zone is a fly-by.
    fn plain(&self, out: &mut Vec<u8>, kind: MotionKind, target: &[u8], statement: &[u8], parts: &Parts) {
        out.extend_from_slice(match kind {
            MotionKind::Joint => b"MoveJ ",
            MotionKind::AbsoluteJoint => b"MoveAbsJ ",
            _ => b"MoveL ",
        });
        out.extend_from_slice(target);
        out.push(b',');
        if let Some(speed) = &parts.speed {
            for part in [speed].into_iter().chain(&parts.speed_options) {
                out.extend_from_slice(&statement[part.range()]);
            }
            out.push(b',');
        }
        out.extend_from_slice(self.options.extra_zone.as_bytes());
        out.push(b',');
        for part in parts.tool.iter().chain(&parts.tool_options) {
            out.extend_from_slice(&statement[part.range()]);
        }
        out.push(b';');
    }
}

/// The arguments of an instruction that extra motions take over, as bytes of its statement.
#[derive(Default)]
struct Parts {
    speed: Option<Span>,
    zone: Option<Span>,
    tool: Option<Span>,
    /// `\V`.
    speed_options: Vec<Span>,
    /// `\WObj`, `\TLoad`.
    tool_options: Vec<Span>,
    /// `\Inpos`, `\Z`, which belong to the stop at the end.
    stop_options: Vec<Span>,
}

impl Parts {
    fn of(tree: &RapidTree<'_>, instruction: &Instruction) -> Parts {
        let mut parts = Parts::default();
        let mut nodes = 0..tree.nodes.len();
        let Some(node) = nodes.find(|&node| tree.nodes.kind(node) == Syntax::Call) else { return parts };
        let count = arguments(tree, node).filter(|argument| !argument.optional).count();
        let span = |child: Child| {
            let (first, end) = tokens_of(tree, child);
            tree.span(first, end)
        };
        let mut index = 0;
        for argument in arguments(tree, node) {
            if argument.optional {
                let Some(name) = argument.name else { continue };
                let end = argument.value.map_or(name + 1, |value| tokens_of(tree, value).1);
                // From the backslash before the name.
                let mut first = name;
                while first > 0 && tree.kind(first) != Some(Token::Backslash) {
                    first -= 1;
                }
                let option = tree.span(first, end);
                let is = |wanted: &[u8]| same_name(tree.text(name), wanted);
                if is(b"V") {
                    parts.speed_options.push(option);
                } else if is(b"WObj") || is(b"TLoad") {
                    parts.tool_options.push(option);
                } else if is(b"Inpos") || is(b"Z") {
                    parts.stop_options.push(option);
                }
                continue;
            }
            let slot = instruction.slot(index, count);
            index += 1;
            let Some(value) = argument.value else { continue };
            match slot {
                Some(Slot::Speed) => parts.speed = Some(span(value)),
                Some(Slot::Zone) => parts.zone = Some(span(value)),
                Some(Slot::Tool) => parts.tool = Some(span(value)),
                _ => {}
            }
        }
        parts
    }
}
