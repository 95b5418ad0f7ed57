//! Transfer function of calls of routines, by their names and by names computed at run time.

use super::{AbstractState, CallSite, DISPLACEMENT, Interpreter};
use crate::dataflow::Lattice;
use crate::motion::{Frame, Reason};
use crate::rapid::modal::{Switch, SwitchSet};
use crate::rapid::reaching_motions::ReachingMotions;
use crate::rapid::syntax::Syntax;
use crate::rapid::value::Value;

impl Interpreter<'_, '_, '_> {
    /// Updates the reaching motions after a call of one of some routines; `may_skip`: or of none.
    pub(super) fn after_calls(&mut self, called: &[u32], may_skip: bool, state: &mut AbstractState) {
        if !self.tracks_motions {
            return;
        }
        let symbols = self.evaluator.symbols;
        let moving = called.iter().filter(|routine| symbols.effects_of(**routine).moves);
        let calls: Vec<u32> =
            moving.map(|routine| self.visitor.record_moving_call(*routine, &state.reaching)).collect();
        if calls.is_empty() {
            return;
        }
        // A handler may resume after a failed call.
        let also = (may_skip || self.resumes).then(|| state.reaching.clone());
        state.reaching = ReachingMotions::after_calls(&calls);
        if let Some(also) = also {
            state.reaching.join(&also);
        }
    }

    /// A call by a name computed at run time.
    pub(super) fn transfer_late_call(&mut self, state: &mut AbstractState) {
        let symbols = self.evaluator.symbols;
        if symbols.uses_position {
            self.visitor.record_position_use(&state.reaching);
        }
        if self.resumes {
            // RETRY may call it again after an error in it.
            self.join_switches(symbols.late_switches_of(self.body), state);
        }
        self.visitor.record_late_call(state.modal);
        if symbols.late_callees_of(self.body).is_empty() {
            self.visitor.record_external_call(state.modal);
        }
        self.join_switches(symbols.late_switches_of(self.body), state);
        self.invalidate_nonlocal(state);
        state.previous = None;
        if self.tracks_motions {
            // A name may be that of a routine in no file.
            state.reaching.elsewhere = true;
            let call = self.visitor.record_moving_late_call(&state.reaching);
            state.reaching.join(&ReachingMotions::after_calls(&[call]));
        }
    }

    /// A call of a routine of the program; of any of `called` where several modules declare the name.
    pub(super) fn transfer_routine_call(&mut self, called: &[u32], name: &[u8], state: &mut AbstractState) {
        let symbols = self.evaluator.symbols;
        let sets = |all: SwitchSet, routine: &u32| all.join(symbols.effects_of(*routine).switches);
        let sets = called.iter().fold(SwitchSet::EMPTY, sets);
        if self.resumes {
            // An error may have left it anywhere, and RETRY may call it again.
            self.join_switches(sets, state);
        }
        if called.iter().any(|routine| symbols.effects_of(*routine).uses_position) {
            self.visitor.record_position_use(&state.reaching);
        }
        let all_move = called.iter().all(|routine| symbols.effects_of(*routine).moves);
        self.after_calls(called, !all_move, state);
        let mut exit = SwitchSet::EMPTY;
        let mut gripped = None;
        for &routine in called {
            let AbstractState { modal, gripped: before, .. } = *state;
            self.visitor.record_call(CallSite { routine, modal, gripped: before });
            let end = self.visitor.exit_of(routine);
            exit = exit.join(end.modal);
            gripped.join(&end.gripped.map(|gripped| gripped.after(before)));
        }
        state.gripped = gripped.unwrap_or(state.gripped);
        if exit == SwitchSet::EMPTY {
            state.reachable = self.resumes;
            return;
        }
        state.modal = exit.substitute_entry(state.modal);
        if !exit.is_entry(Switch::Displacement) {
            let value = if exit.is_off(Switch::Displacement) {
                Value::from_frame(&Frame::IDENTITY)
            } else {
                Value::Unknown(Reason::Displacement)
            };
            state.known.insert(DISPLACEMENT, value);
        }
        if self.resumes {
            self.join_switches(sets, state);
        }
        self.invalidate_called(name, Syntax::Call, state);
    }
}
