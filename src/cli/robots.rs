//! `truegrind robots [NAME]`.

use clap::Args;
use truegrind::report::format;
use truegrind::report::robots as view;
use truegrind::robots;

use super::ending::Ending;
use super::inputs;
use super::terminal::{say, width};

/// Arguments of `robots`.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// A robot of the catalogue, or a TOML file.
    name: Option<String>,
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<Ending> {
    match &arguments.name {
        Some(name) => {
            let robot = inputs::robot(name)?;
            say(format::terminal::document(&view::document(&robot), width()))?;
        }
        None => {
            let all = robots::catalogue();
            let sheets = all.iter().map(|name| robots::load(name)).collect::<Result<Vec<_>, _>>()?;
            say(format::terminal::table(&view::catalogue_table(&sheets), width()))?;
        }
    }
    Ok(Ending::Done)
}
