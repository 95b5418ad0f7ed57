//! NC programs of four controls: random ones, an interpreter for each, and what their correction does to the arm.
//!
//! The interpreters are written from the manuals and know nothing of truegrind's own reader:
//! - Fanuc series 30i operator's manual and custom macros,
//! - LinuxCNC G-code, O-code and overview of the language,
//! - Siemens 840D sl "Fundamentals" and "Job planning",
//! - Heidenhain iTNC 530 conversational programming.
//!
//! Two things are the convention of robots that run such programs and not of the controls: A, B and C are angles of the
//! tool in the coordinates of the program, and a tool that is changed or compensated is known by its name. After a
//! change of tool, a cycle or a return to a reference the place of the tool is taken as not told.

mod align;
mod arc;
mod compare;
mod fanuc;
mod formula;
mod heidenhain;
mod linuxcnc;
pub mod machine;
mod make;
pub mod setting;
mod siemens;
#[cfg(test)]
mod tests;
mod words;

pub use compare::{Shown, run, shown};
pub use make::Features;

/// The controls.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Control {
    /// Fanuc and those like it.
    Fanuc,
    /// LinuxCNC.
    LinuxCnc,
    /// Siemens 840D.
    Siemens,
    /// Heidenhain conversational.
    Heidenhain,
}

/// How a run ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum End {
    /// At its end.
    Done,
    /// After too many blocks.
    Budget,
    /// At a block that the interpreter does not know: line from 0, and what it is.
    Fault(usize, String),
}

/// Runs a program; what it did, and how it ended.
pub fn execute(
    control: Control,
    text: &str,
    setting: &setting::Setting,
    budget: usize,
) -> (Vec<machine::Event>, End) {
    match control {
        Control::Fanuc => fanuc::run(text, setting, budget),
        Control::LinuxCnc => linuxcnc::run(text, setting, budget),
        Control::Siemens => siemens::run(text, setting, budget),
        Control::Heidenhain => heidenhain::run(text, setting, budget),
    }
}
