//! What must hold for the judge itself. No mark of the diagnosis is asserted: that is what the example is for.

mod arms;
mod cases;
mod effects;
mod files;
mod judging;
mod runs;
