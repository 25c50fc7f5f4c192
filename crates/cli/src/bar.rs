//! The progress of long work, on standard error where that is a terminal.

use apprentice::replay;
use apprentice_study as study;
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

impl replay::Progress for Bar {
    fn expect(&self, records: u64) {
        self.0.inc_length(records);
    }

    fn advance(&self, records: u64) {
        self.0.inc(records);
    }
}

impl study::parallel::Progress for Bar {
    fn expect(&self, count: usize) {
        self.0.inc_length(count as u64);
    }

    fn advance(&self) {
        self.0.inc(1);
    }
}
