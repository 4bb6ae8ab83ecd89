//! Progress of a load, on stderr when that is a terminal.

use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};

/// How often the bar is drawn anew while nothing is heard.
const TICK: Duration = Duration::from_millis(100);

/// A progress bar of one object's load; cleared when dropped.
pub struct LoadBar {
    bar: ProgressBar,
}

impl LoadBar {
    /// A bar for the object called `name`. Draws nothing when stderr is not a terminal.
    pub fn new(name: &str) -> LoadBar {
        LoadBar::over(ProgressBar::no_length(), name)
    }

    /// Makes `bar` one for the object called `name`.
    pub fn over(bar: ProgressBar, name: &str) -> LoadBar {
        bar.set_style(style());
        bar.set_prefix(name.to_owned());
        if !bar.is_hidden() {
            bar.enable_steady_tick(TICK);
        }
        LoadBar { bar }
    }

    /// Shows that `done` of `total` is done in `stage`; a total of 0 is one not known.
    pub fn show(&self, stage: &str, done: u64, total: u64) {
        self.bar.set_message(stage.to_owned());
        match total {
            0 => self.bar.unset_length(),
            _ => self.bar.set_length(total),
        }
        self.bar.set_position(done);
    }

    /// What shows each progress it is told.
    pub fn observer(&self) -> impl FnMut(&str, u64, u64) + '_ {
        |stage, done, total| self.show(stage, done, total)
    }
}

impl Drop for LoadBar {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

fn style() -> ProgressStyle {
    ProgressStyle::with_template("{prefix:>16} {msg:6} [{bar:30.cyan/blue}] {percent:>3} %")
        .expect("the template is well formed")
        .progress_chars("=> ")
}
