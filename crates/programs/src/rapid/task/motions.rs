//! Motions of the listing: targets, options and frames of one instruction, and the reason where it must not be changed.

use std::sync::Arc;

use super::wrappers::Given;
use super::{ListingBuilder, Literal, literals};
use crate::dataflow::Nesting;
use crate::motion::{
    Declaration, Modal, Motion, MotionKind, MotionTarget, Origin, OutsideCall, PersistentOffset, Reason,
    Role, Routine,
};
use crate::rapid::evaluate::Context;
use crate::rapid::evaluate::target::ValueOrigin;
use crate::rapid::flow::AbstractState;
use crate::rapid::instruction::{INSTRUCTIONS, Instruction, Slot, named_slot};
use crate::rapid::predefined;
use crate::rapid::symbol::computed_name::computed_name;
use crate::rapid::symbol::{Body, SymbolKind};
use crate::rapid::syntax::{Argument, RapidTree, Syntax, arguments, expressions, parts, text_of, tokens_of};
use crate::rapid::token::{Token, display, folded, same_name};
use crate::tree::Child;

impl ListingBuilder<'_, '_> {
    fn name_of(&mut self, known: usize) -> Arc<str> {
        self.names[known].get_or_insert_with(|| INSTRUCTIONS[known].name.into()).clone()
    }

    fn routine_of(&mut self, body: Body) -> Option<u32> {
        let routine = body.routine?;
        if let Some(index) = self.routines[routine as usize] {
            return Some(index);
        }
        let scope = &self.symbols.routines[routine as usize];
        let tree = &self.trees[scope.file as usize];
        self.listing.routines.push(Routine {
            name: display(tree.text(scope.head.name)),
            module: scope.module.clone(),
            place: self.place(scope.file, scope.head.name),
        });
        let index = self.listing.routines.len() as u32 - 1;
        self.routines[routine as usize] = Some(index);
        Some(index)
    }

    fn motion(&mut self, body: Body, node: u32, state: &AbstractState, nesting: Nesting) -> Motion {
        let tree = &self.trees[body.file as usize];
        let (place, statement) = (self.place(body.file, tree.nodes.first(node)), tree.node_span(node));
        Motion {
            accepts_configuration: true,
            in_loop: nesting.in_loop,
            conditional: nesting.conditional,
            previous: state.previous,
            routine: self.routine_of(body),
            ..Motion::new(place, statement, Arc::default(), MotionKind::Unknown, Modal::START)
        }
    }

    fn target(
        &mut self,
        body: Body,
        state: &AbstractState,
        argument: Child,
        joints: bool,
        role: Role,
    ) -> MotionTarget {
        let tree = &self.trees[body.file as usize];
        let context = Context::new(body.file, body.scope, &state.known);
        let (value, source) = self.evaluator.target(context, argument, joints);
        self.impure |= self.evaluator.may_raise()
            || self.symbols.is_impure(tree, body.scope, argument)
            || matches!(source, ValueOrigin::Symbol(symbol) | ValueOrigin::Element(symbol, _) if self.has_impure_initial(symbol));
        let (first, end) = tokens_of(tree, argument);
        let origin = match source {
            ValueOrigin::Inline => Origin::Inline,
            ValueOrigin::Computed => Origin::Computed,
            ValueOrigin::Unknown => Origin::Unknown,
            ValueOrigin::Offset(base, offset) => {
                let (first, end) = tokens_of(tree, base);
                self.listing.offsets.push(PersistentOffset { base: tree.span(first, end), offset });
                Origin::Offset(self.listing.offsets.len() as u32 - 1)
            }
            ValueOrigin::Symbol(symbol) => Origin::Declared(self.declaration(symbol)),
            ValueOrigin::Element(symbol, literal) => {
                Origin::Element { declaration: self.declaration(symbol), literal }
            }
        };
        MotionTarget { role, value, origin, argument: tree.span(first, end) }
    }

    /// Adds a target to the motion as number `before`; one written as numbers is inserted later.
    fn add_target(
        &mut self,
        motion: &mut Motion,
        (body, call, state): (Body, u32, &AbstractState),
        argument: Child,
        joints: bool,
        (role, before): (Role, u32),
    ) {
        match literals::plain(&self.trees[body.file as usize], argument) {
            Some(node) => {
                let motion = self.listing.motions.len() as u32;
                let file = body.file;
                self.literals.push(Literal { motion, target: before, role, file, call, node, joints });
            }
            None => {
                motion.targets.push(self.target(body, state, argument, joints, role));
            }
        }
    }

    /// Whether the initial value of data is impure.
    fn has_impure_initial(&mut self, symbol: u32) -> bool {
        let (trees, symbols) = (self.trees, self.symbols);
        *self.impure_initials.entry(symbol).or_insert_with(|| {
            let found = &symbols.symbols[symbol as usize];
            let SymbolKind::Data(data) = &found.kind else { return false };
            let initial = |value| symbols.is_impure(&trees[found.file as usize], found.scope, value);
            data.value.is_some_and(initial)
        })
    }

    fn declaration(&mut self, symbol: u32) -> u32 {
        if let Some(&index) = self.declarations.get(&symbol) {
            return index;
        }
        let found = &self.symbols.symbols[symbol as usize];
        let tree = &self.trees[found.file as usize];
        let data = match &found.kind {
            SymbolKind::Data(data) => Some(data),
            _ => None,
        };
        self.listing.declarations.push(Declaration {
            name: display(tree.text(found.name)),
            place: self.place(found.file, found.name),
            statement: data.map(|data| tree.node_span(data.node)).unwrap_or_default(),
            literal: data.and_then(|data| data.value).map(|value| {
                let (first, end) = tokens_of(tree, value);
                tree.span(first, end)
            }),
            array: data.is_some_and(|data| data.dimensions.is_some()),
            persistent: data.is_some_and(|data| data.storage == Token::Pers),
            uses: Vec::new(),
            other_uses: Vec::new(),
        });
        let index = self.listing.declarations.len() as u32 - 1;
        self.declarations.insert(symbol, index);
        index
    }

    /// A motion instruction of the table.
    pub(super) fn table_motion(
        &mut self,
        body: Body,
        node: u32,
        state: &AbstractState,
        nesting: Nesting,
        known: usize,
    ) -> Motion {
        let tree = &self.trees[body.file as usize];
        let given = arguments(tree, node).map(|argument| Given { argument, named_in: body.file, body });
        let count = arguments(tree, node).filter(|argument| !argument.optional).count();
        let mut motion = self.motion_of((body, node, state), nesting, (known, count), given);
        motion.instruction = self.name_of(known);
        motion
    }

    /// A call of a routine whose only statement is a motion on its parameters. What is inserted before it would have to be another such call,
    /// and another form of it another instruction: neither is written.
    pub(super) fn inlined_motion(
        &mut self,
        body: Body,
        node: u32,
        state: &AbstractState,
        nesting: Nesting,
    ) -> Option<Motion> {
        let wrappers = Arc::clone(&self.wrappers);
        let inlined = wrappers.motion(body.file, node)?;
        let count = inlined.given.iter().filter(|given| !given.argument.optional).count();
        let given = inlined.given.iter().copied();
        let mut motion = self.motion_of((body, node, state), nesting, (inlined.known, count), given);
        let tree = &self.trees[body.file as usize];
        motion.instruction = display(tree.text(tree.nodes.first(node))).into();
        (motion.insertable, motion.can_straighten) = (false, false);
        Some(motion)
    }

    /// The motion of an instruction of the table with these arguments, of which so many are required, but for its name.
    fn motion_of(
        &mut self,
        (body, node, state): (Body, u32, &AbstractState),
        nesting: Nesting,
        (known, count): (usize, usize),
        given: impl Iterator<Item = Given>,
    ) -> Motion {
        let trees = self.trees;
        let instruction: &Instruction = &INSTRUCTIONS[known];
        let mut motion = self.motion(body, node, state, nesting);
        self.impure = false;
        motion.kind = instruction.kind;
        let (mut index, mut work_object) = (0, None);
        // Whether all frames and the target stand in the call itself.
        let mut is_here = true;
        let (mut velocity, mut time) = (None, None);
        let (mut targets, mut via) = (0, instruction.kind != MotionKind::Circular);
        let (mut to, mut tool) = (None, None);
        let mut options = Options::default();
        for Given { argument, named_in, body: home } in given {
            let tree = &trees[named_in as usize];
            if argument.optional {
                options.note(tree, argument);
                let value = argument.value.map(|value| (home, value));
                match argument.name.map(|name| tree.text(name)) {
                    Some(name) if same_name(name, b"WObj") => work_object = value,
                    Some(name) if same_name(name, b"V") => velocity = value,
                    Some(name) if same_name(name, b"T") => time = value,
                    _ => {}
                }
                continue;
            }
            let slot = match argument.name.map(|name| tree.text(name)) {
                None => instruction.slot(index, count),
                Some(name) => named_slot(name),
            };
            index += 1;
            let Some(value) = argument.value else { continue };
            match slot {
                Some(Slot::To) => {
                    let joints = instruction.takes_joints();
                    self.add_target(&mut motion, (home, node, state), value, joints, (Role::To, targets));
                    (targets, to) = (targets + 1, Some(value));
                    is_here &= home.node == body.node;
                }
                Some(Slot::Via) => {
                    self.add_target(&mut motion, (home, node, state), value, false, (Role::Via, targets));
                    (targets, via) = (targets + 1, true);
                }
                Some(Slot::Speed) => motion.speed = Some(self.speed(home, state, value)),
                Some(Slot::Zone) => motion.zone = Some(self.zone(home, state, value)),
                Some(Slot::Tool) => {
                    tool = Some(value);
                    motion.tool = Some(self.tool(home, state, value));
                    is_here &= home.node == body.node;
                }
                _ => {}
            }
        }
        motion.timed = options.timed;
        if let (Some(speed), Some((home, velocity))) = (motion.speed, velocity) {
            motion.speed = Some(self.overridden(speed, home, state, velocity));
        }
        if let Some((home, time)) = time {
            let duration_s = self.evaluated(home, state, time).number();
            self.listing.durations_s.insert(self.listing.motions.len() as u32, duration_s);
        }
        let free =
            !options.timed && !options.whole && !nesting.guarded && !self.has_impure_argument(body, node);
        motion.insertable = free && instruction.splits();
        motion.can_straighten = free
            && instruction.kind == MotionKind::Circular
            && instruction.line_form().is_some_and(Instruction::splits);
        if tool.is_some() {
            let (home, value) = work_object.map_or((body, None), |(home, value)| (home, Some(value)));
            motion.work_object = Some(self.work_object(home, state, value));
            is_here &= home.node == body.node;
        }
        if motion.to().is_some_and(|to| to.value.is_err())
            && is_here
            && self.follows_position(body, to, tool, work_object.map(|(_, value)| value))
        {
            let to = motion.targets.iter_mut().rev().find(|target| target.role == Role::To);
            to.into_iter().for_each(|to| to.value = Err(Reason::CurrentPosition));
        }
        let complete = to.is_some() && via && count >= instruction.least();
        motion.own_reason =
            self.refusal(&motion, instruction, &options, complete).or_else(|| self.side_effect(&motion));
        motion
    }

    /// Replacing an impure expression would drop its effect. An unknown target is refused for that reason instead.
    fn side_effect(&self, motion: &Motion) -> Option<Reason> {
        let known = motion.targets.iter().all(|target| target.value.is_ok());
        (self.impure && known).then_some(Reason::SideEffect)
    }

    /// Why a motion instruction must not be changed: by its own kind, its frames or its speed. `complete`: it has all arguments.
    fn refusal(
        &self,
        motion: &Motion,
        instruction: &Instruction,
        options: &Options,
        complete: bool,
    ) -> Option<Reason> {
        let own = if instruction.kind == MotionKind::External {
            Some(Reason::ExternalOnly)
        } else if !complete {
            Some(Reason::MissingArgument)
        } else if instruction.sensor_guided || options.corrected {
            Some(Reason::SensorGuided)
        } else if options.synchronised {
            Some(Reason::Synchronised)
        } else if instruction.kind == MotionKind::AbsoluteJoint {
            None
        } else {
            self.listing.frame_reason(motion)
        };
        let speed = self.listing.speed(motion).map(|speed| &speed.value);
        own.or((speed == Some(&Err(Reason::NumberRange))).then_some(Reason::NumberRange))
    }

    /// Whether an argument calls a function of the program or an impure one: each inserted target would evaluate it again.
    fn has_impure_argument(&self, body: Body, node: u32) -> bool {
        let tree = &self.trees[body.file as usize];
        let nodes = node..tree.nodes.subtree_end(node);
        let mut functions = nodes.filter(|&node| tree.nodes.kind(node) == Syntax::Function);
        functions.any(|function| {
            let name = tree.text(tree.nodes.first(function));
            self.symbols.routine(body.scope, name).is_some() || !predefined::is_pure(name)
        })
    }

    /// Whether the end of a motion is counted from where the robot stands, in the motion's own tool and work object: `CRobT`, perhaps
    /// with `Offs` or `RelTool`.
    fn follows_position(
        &self,
        body: Body,
        to: Option<Child>,
        tool: Option<Child>,
        work_object: Option<Child>,
    ) -> bool {
        let tree = &self.trees[body.file as usize];
        let function = |value: Option<Child>| match value {
            Some(Child::Node(node)) if tree.nodes.kind(node) == Syntax::Function => {
                let name = tree.text(tree.nodes.first(node));
                self.symbols.find(body.scope, name).is_none().then_some((node, name))
            }
            _ => None,
        };
        let Some((mut node, mut name)) = function(to) else { return false };
        if same_name(name, b"Offs") || same_name(name, b"RelTool") {
            let base = arguments(tree, node).find(|argument| argument.name.is_none());
            let Some(found) = function(base.and_then(|base| base.value)) else { return false };
            (node, name) = found;
        }
        let option = |wanted: &[u8]| {
            arguments(tree, node)
                .find(|argument| argument.name.is_some_and(|name| same_name(tree.text(name), wanted)))
                .and_then(|argument| argument.value)
        };
        let is_same = |stated: Option<Child>, own: Option<Child>, else_named: &[u8]| {
            let own = own.map_or(else_named, |own| text_of(tree, own));
            stated.is_some_and(|stated| same_name(text_of(tree, stated), own))
        };
        same_name(name, b"CRobT")
            && is_same(option(b"Tool"), tool, b"")
            && is_same(option(b"WObj"), work_object, b"wobj0")
    }

    /// A call that takes a target but is no motion instruction of the table.
    pub(super) fn other_motion(
        &mut self,
        body: Body,
        node: u32,
        state: &AbstractState,
        nesting: Nesting,
    ) -> Option<Motion> {
        let tree = &self.trees[body.file as usize];
        let late = tree.nodes.kind(node) == Syntax::LateCall;
        let name = match parts(tree, node).nth(1).filter(|_| late) {
            Some(expression) => text_of(tree, expression),
            None => tree.text(tree.nodes.first(node)),
        };
        let routine = if late { None } else { self.symbols.routine(body.scope, name) };
        let mut found: Vec<(Child, bool)> = Vec::new();
        if let Some(routine) = routine {
            let routine = &self.symbols.routines[routine as usize];
            let home = &self.trees[routine.file as usize];
            let mut required = routine.head.parameters.iter().filter(|parameter| !parameter.optional);
            for argument in arguments(tree, node) {
                let parameter = match argument.name {
                    None => required.next(),
                    Some(option) => routine
                        .head
                        .parameters
                        .iter()
                        .find(|parameter| same_name(home.text(parameter.name), tree.text(option))),
                };
                let (Some(parameter), Some(value)) = (parameter, argument.value) else { continue };
                if parameter.by_reference || parameter.array {
                    continue;
                }
                let type_name = folded(home.text(parameter.type_name));
                match self.symbols.resolved_type(routine.scope, &type_name) {
                    b"robtarget" => found.push((value, false)),
                    b"jointtarget" => found.push((value, true)),
                    _ => {}
                }
            }
        } else if let Some(moves) = predefined::displaces(name).filter(|_| !late) {
            let mut motion = self.motion(body, node, state, nesting);
            motion.instruction = display(name).into();
            motion.own_reason = Some(moves?);
            return Some(motion);
        } else if predefined::effect(name).is_none() || late {
            for argument in arguments(tree, node) {
                let Some(value) = argument.value else { continue };
                if let Some(joints) = self.looks_like_target(body, value) {
                    found.push((value, joints));
                }
            }
        }
        if found.is_empty() {
            return None;
        }
        let mut motion = self.motion(body, node, state, nesting);
        motion.instruction = display(name).into();
        for (value, joints) in found {
            let mut target = self.target(body, state, value, joints, Role::To);
            // Never rewritten here: no declaration counts it as a use by a motion.
            if let Origin::Declared(_) | Origin::Element { .. } = target.origin {
                target.origin = Origin::Computed;
            }
            motion.targets.push(target);
        }
        motion.own_reason = Some(match (late, routine) {
            (true, _) => Reason::LateBinding,
            (false, Some(_)) => Reason::OwnRoutine,
            (false, None) => Reason::UnknownInstruction,
        });
        Some(motion)
    }

    /// Lists a call without targets if no file declares what it calls.
    pub(super) fn record_outside_call(&mut self, body: Body, node: u32) {
        let tree = &self.trees[body.file as usize];
        let name = tree.text(tree.nodes.first(node));
        let late = tree.nodes.kind(node) == Syntax::LateCall;
        if !late && !self.symbols.callees(body.scope, name).is_empty() {
            return;
        }
        let name = if late || predefined::calls_by_name(name) {
            let computed = computed_name(tree, node).filter(|_| !self.symbols.has_late_callee(tree, node));
            computed.map(|name| text_of(tree, name))
        } else {
            Some(name).filter(|name| predefined::effect(name).is_none())
        };
        if let Some(name) = name {
            let place = self.place(body.file, tree.nodes.first(node));
            self.listing.outside_calls.push(OutsideCall { name: display(name), place });
        }
    }

    /// Whether an argument is a target by its type: `Some(true)` for a jointtarget.
    fn looks_like_target(&self, body: Body, value: Child) -> Option<bool> {
        let tree = &self.trees[body.file as usize];
        if let Child::Node(node) = value {
            let mut inside = expressions(tree, node);
            match tree.nodes.kind(node) {
                Syntax::Paren => return self.looks_like_target(body, inside.next()?),
                Syntax::Aggregate => {
                    let parts: Vec<Child> = inside.collect();
                    let fits = |types: &[(&[u8], usize)]| {
                        parts.len() == types.len()
                            && parts.iter().zip(types).all(|(&part, of)| self.fits(body, part, *of))
                    };
                    let joints = fits(&[(b"robjoint", 6), (b"extjoint", 6)]);
                    let pose = fits(&[(b"pos", 3), (b"orient", 4), (b"confdata", 4), (b"extjoint", 6)]);
                    return (joints || pose).then_some(joints);
                }
                _ => {}
            }
        }
        match &*self.evaluator.type_of((body.file, body.scope), value)? {
            b"robtarget" => Some(false),
            b"jointtarget" => Some(true),
            _ => None,
        }
    }

    /// Whether a value may be of a type with this number of components.
    fn fits(&self, body: Body, value: Child, (type_name, count): (&[u8], usize)) -> bool {
        let tree = &self.trees[body.file as usize];
        match value {
            Child::Node(node) if tree.nodes.kind(node) == Syntax::Aggregate => {
                expressions(tree, node).count() == count
            }
            _ => self.evaluator.type_of((body.file, body.scope), value).is_some_and(|t| t == type_name),
        }
    }
}

/// The optional arguments that decide whether a motion may be changed.
#[derive(Default)]
struct Options {
    corrected: bool,
    synchronised: bool,
    timed: bool,
    /// Whether the instruction cannot be split: a process starts or ends with it, or the following statements run during it.
    whole: bool,
}

impl Options {
    fn note(&mut self, tree: &RapidTree<'_>, argument: Argument) {
        let Some(name) = argument.name.map(|name| tree.text(name)) else { return };
        self.corrected |= same_name(name, b"Corr") || same_name(name, b"Track");
        self.synchronised |= same_name(name, b"ID");
        self.timed |= same_name(name, b"T") || same_name(name, b"Time");
        self.whole |= [&b"On"[..], b"Off", b"Conc"].iter().any(|whole| same_name(name, whole));
    }
}
