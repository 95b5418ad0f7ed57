//! Talk on stderr: what is being done, with a spinner where a terminal shows it.

use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use truegrind::report::format::visible;

use super::colour::dumb;

/// A piece of work that takes a while. Nothing is shown where stderr is no terminal.
pub(super) struct Work(ProgressBar);

impl Work {
    /// Starts a spinner with a message.
    pub(super) fn start(message: impl Into<String>) -> Self {
        // A dumb terminal shows each turn of a spinner as a line of its own.
        let target = if dumb() { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() };
        let bar = ProgressBar::with_draw_target(None, target);
        if let Ok(style) = ProgressStyle::with_template("{spinner} {msg} [{elapsed}]") {
            bar.set_style(style);
        }
        bar.set_message(visible::line(&message.into()).into_owned());
        bar.enable_steady_tick(Duration::from_millis(120));
        Self(bar)
    }

    /// Shows what is being done now.
    pub(super) fn tell(&self, message: &str) {
        self.0.set_message(visible::line(message).into_owned());
    }

    /// Shows what it is told, from whatever thread.
    pub(super) fn listener(&self) -> impl Fn(&str) + Send + Sync + 'static {
        let bar = self.0.clone();
        move |message| bar.set_message(visible::line(message).into_owned())
    }
}

impl Drop for Work {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}
