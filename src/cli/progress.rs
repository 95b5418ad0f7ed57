//! Progress on stderr: a spinner, if stderr is a terminal.

use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use truegrind::report::format::visible;

use super::colour::is_dumb;

/// A spinner with a message and the elapsed time.
pub(super) struct Spinner(ProgressBar);

impl Spinner {
    /// Starts a spinner.
    pub(super) fn start(message: impl Into<String>) -> Self {
        // A dumb terminal would print every frame on a new line.
        let target = if is_dumb() { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() };
        let bar = ProgressBar::with_draw_target(None, target);
        if let Ok(style) = ProgressStyle::with_template("{spinner} {msg} [{elapsed}]") {
            bar.set_style(style);
        }
        bar.set_message(visible::line(&message.into()).into_owned());
        bar.enable_steady_tick(Duration::from_millis(120));
        Self(bar)
    }

    /// Replaces the message.
    pub(super) fn show(&self, message: &str) {
        self.0.set_message(visible::line(message).into_owned());
    }

    /// A callback that replaces the message, for any thread.
    pub(super) fn listener(&self) -> impl Fn(&str) + Send + Sync + 'static {
        let bar = self.0.clone();
        move |message| bar.set_message(visible::line(message).into_owned())
    }
}

impl Drop for Spinner {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}
