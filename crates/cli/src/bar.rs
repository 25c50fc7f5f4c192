//! The progress of long work, on standard error where that is a terminal.

use apprentice::parallel::Progress;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

pub struct Bar(ProgressBar);

impl Bar {
    /// - `unit`: what is counted, in the plural; empty where the reader knows.
    pub fn new(unit: &str) -> Bar {
        let bar = ProgressBar::with_draw_target(Some(0), ProgressDrawTarget::stderr_with_hz(5));
        let style = ProgressStyle::with_template("{bar:40} {pos}/{len}{msg} {eta} left");
        bar.set_style(style.expect("the template is well-formed"));
        if !unit.is_empty() {
            bar.set_message(format!(" {unit}"));
        }
        Bar(bar)
    }

    pub fn finish(&self) {
        self.0.finish_and_clear();
    }
}

impl Progress for Bar {
    fn expect(&self, count: u64) {
        self.0.inc_length(count);
    }

    fn advance(&self, count: u64) {
        self.0.inc(count);
    }
}
