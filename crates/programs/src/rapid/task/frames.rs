//! Speed, zone, tool and work object of a motion: each distinct one once in the listing.

use super::super::flow::AbstractState;
use super::ListingBuilder;
use crate::motion::{Frame, Place, Reason, Speed, Tool, WorkObject, Zone, intern};
use crate::rapid::evaluate::{Context, Known};
use crate::rapid::symbol::{Body, SymbolKind};
use crate::rapid::syntax::{text_of, tokens_of};
use crate::rapid::token::{Token, display};
use crate::rapid::value::{MAX_NUM, Value, built_in};
use crate::tree::Child;

impl<'s> ListingBuilder<'_, 's> {
    /// Whether a name or expression may have different values at different motions.
    pub(super) fn varies(&self, body: Body, value: Child) -> bool {
        let tree = &self.trees[body.file as usize];
        let (first, end) = tokens_of(tree, value);
        (first..end).any(|token| {
            tree.kind(token) == Some(Token::Ident)
                && self
                    .symbols
                    .find(body.scope, tree.text(token))
                    .is_some_and(|symbol| self.symbols.symbols[symbol as usize].assigned)
        })
    }

    pub(super) fn evaluated(&self, body: Body, state: &AbstractState, value: Child) -> Value {
        self.evaluator.value(Context::new(body.file, body.scope, &state.known), value)
    }

    pub(super) fn speed(&mut self, body: Body, state: &AbstractState, value: Child) -> u32 {
        let text = text_of(&self.trees[body.file as usize], value);
        if let Some(index) = self.speeds.get(body.scope, text) {
            return index;
        }
        let speed = Speed { text: display(text), value: self.evaluated(body, state, value).speed() };
        let index = intern(&mut self.listing.speeds, speed);
        if !self.varies(body, value) {
            self.speeds.put(body.scope, text, index);
        }
        index
    }

    /// The speed of a motion with the TCP velocity of its option `\V`.
    pub(super) fn overridden(
        &mut self,
        speed: u32,
        body: Body,
        state: &AbstractState,
        velocity: Child,
    ) -> u32 {
        let mut speed = self.listing.speeds[speed as usize].clone();
        match (&mut speed.value, self.evaluated(body, state, velocity).number()) {
            (speed @ Ok(_), Ok(velocity)) if !(velocity > 0.0 && velocity <= MAX_NUM) => {
                *speed = Err(Reason::NumberRange);
            }
            (Ok(value), Ok(velocity)) => value.tcp_mm_s = velocity,
            (value, Err(reason)) => *value = Err(reason),
            (Err(_), Ok(_)) => {}
        }
        intern(&mut self.listing.speeds, speed)
    }

    pub(super) fn zone(&mut self, body: Body, state: &AbstractState, value: Child) -> u32 {
        let text = text_of(&self.trees[body.file as usize], value);
        if let Some(index) = self.zones.get(body.scope, text) {
            return index;
        }
        let zone = Zone { text: display(text), value: self.evaluated(body, state, value).zone() };
        let index = intern(&mut self.listing.zones, zone);
        if !self.varies(body, value) {
            self.zones.put(body.scope, text, index);
        }
        index
    }

    pub(super) fn declared_at(&self, body: Body, value: Child) -> Option<Place> {
        let tree = &self.trees[body.file as usize];
        let symbol = &self.symbols.symbols[self.symbols.root(tree, body.scope, value)? as usize];
        Some(self.place(symbol.file, symbol.name))
    }

    pub(super) fn tool(&mut self, body: Body, state: &AbstractState, value: Child) -> u32 {
        let text = text_of(&self.trees[body.file as usize], value);
        if let Some(index) = self.tools.get(body.scope, text) {
            return index;
        }
        let tool = match self.passed_data(body, value) {
            Some((name, place, value)) => {
                Tool { name, value: value.tool(), place: Some(place), assigned: false }
            }
            None => Tool {
                name: display(text),
                value: self.evaluated(body, state, value).tool(),
                place: self.declared_at(body, value),
                assigned: self.varies(body, value),
            },
        };
        let index = intern(&mut self.listing.tools, tool);
        if !self.varies(body, value) {
            self.tools.put(body.scope, text, index);
        }
        index
    }

    /// Name, place and value of the data that every call hands over for a parameter.
    fn passed_data(&self, body: Body, value: Child) -> Option<(String, Place, Value)> {
        let tree = &self.trees[body.file as usize];
        let Child::Token(token) = value else { return None };
        let parameter = self.symbols.find(body.scope, tree.text(token))?;
        let data = *self.passed_data.get(&parameter)?;
        let symbol = &self.symbols.symbols[data as usize];
        let name = display(self.trees[symbol.file as usize].text(symbol.name));
        let known = Known::default();
        let value = self.evaluator.symbol_value(Context::new(symbol.file, symbol.scope, &known), data);
        Some((name, self.place(symbol.file, symbol.name), value))
    }

    /// The tools that the files declare, whether motions use them or not.
    pub(super) fn declared_tools(&mut self) {
        let known = Known::default();
        for (id, symbol) in (0..).zip(&self.symbols.symbols) {
            let SymbolKind::Data(data) = &symbol.kind else { continue };
            if *symbol.type_name != *b"tooldata" || data.dimensions.is_some() {
                continue;
            }
            let context = Context::new(symbol.file, symbol.scope, &known);
            let tree = &self.trees[symbol.file as usize];
            let tool = Tool {
                name: display(tree.text(symbol.name)),
                value: self.evaluator.symbol_value(context, id).tool(),
                place: Some(self.place(symbol.file, symbol.name)),
                assigned: symbol.assigned,
            };
            self.listing.declared_tools.push(tool);
        }
    }

    /// The work object of a motion, a known displacement included.
    pub(super) fn work_object(&mut self, body: Body, state: &AbstractState, value: Option<Child>) -> u32 {
        let displacement =
            state.displacement().and_then(Result::ok).filter(|frame| *frame != Frame::IDENTITY);
        let text: &'s [u8] = match value {
            Some(value) => text_of(&self.trees[body.file as usize], value),
            None => b"wobj0",
        };
        // Without an argument it is wobj0, even where a scope declares that name.
        let scope = if value.is_some() { body.scope } else { u32::MAX };
        if displacement.is_none()
            && let Some(index) = self.work_objects.get(scope, text)
        {
            return index;
        }
        let passed_data = value.and_then(|value| self.passed_data(body, value));
        let mut found = match (&passed_data, value) {
            (Some((.., value)), _) => value.work_object(),
            (None, Some(value)) => self.evaluated(body, state, value).work_object(),
            (None, None) => built_in(text).ok_or(Reason::Undeclared).and_then(|v| v.work_object()),
        };
        if let (Ok(found), Some(displacement)) = (&mut found, &displacement) {
            found.object_frame = Frame::from_pose(&(found.object_frame.pose() * displacement.pose()));
        }
        let (name, place) = match passed_data {
            Some((name, place, _)) => (name, Some(place)),
            None => (display(text), value.and_then(|value| self.declared_at(body, value))),
        };
        let work_object = WorkObject {
            name,
            value: found,
            place,
            assigned: value.is_some_and(|value| self.varies(body, value)),
            displacement,
        };
        let index = intern(&mut self.listing.work_objects, work_object);
        if displacement.is_none() && value.is_none_or(|value| !self.varies(body, value)) {
            self.work_objects.put(scope, text, index);
        }
        index
    }
}
