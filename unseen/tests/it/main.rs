//! What must hold for the judge itself. No mark of the diagnosis is asserted but in `kept`: that is what the
//! example is for.

mod arms;
mod cases;
mod effects;
mod files;
mod judging;
mod kept;
mod runs;
