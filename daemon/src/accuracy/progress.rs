//! How far the study is, on stderr when that is a terminal.

use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};

use super::measurement::Setting;

/// How often the bar is drawn anew while a setting is run.
const TICK: Duration = Duration::from_millis(200);

/// A bar with the setting under way and the time left; cleared when dropped.
pub struct Progress {
    bar: ProgressBar,
}

impl Progress {
    /// A bar over so many settings.
    pub fn new(settings: usize) -> Progress {
        let bar = ProgressBar::new(settings as u64);
        let style = ProgressStyle::with_template("{wide_msg} [{bar:30.cyan/blue}] {pos}/{len}, {eta} left");
        bar.set_style(style.expect("the template is well formed").progress_chars("=> "));
        if !bar.is_hidden() {
            bar.enable_steady_tick(TICK);
        }
        Progress { bar }
    }

    /// A setting is run.
    pub fn begin(&self, setting: Setting, threads: usize) {
        let (family, curve, label) = (setting.family().name(), setting.curve(), setting.label());
        self.bar.set_message(format!("{family}: {curve} {label}, threads {threads}"));
    }

    /// It has been run.
    pub fn end(&self) {
        // Orders of matrices that are given up, and budgets that turn out not to be needed, make the estimate too long, never too short.
        self.bar.inc(1);
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
