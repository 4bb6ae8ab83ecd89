//! The table that lives while the demonstration runs.

use std::io::{IsTerminal, Write};

use indicatif::{MultiProgress, ProgressBar, ProgressStyle};

use super::columns;
use super::event::{Event, Step};
use super::scenes::SCENES;
use crate::load_bar::LoadBar;

/// How many lines a scene has when there is no terminal to redraw.
const PLAIN_LINES: u64 = 6;
/// Width of the column of scenes.
const NAME_WIDTH: usize = 8;

/// Shows events as they come.
pub struct Live {
    steps: u64,
    kind: Kind,
}

/// How it is shown.
enum Kind {
    /// A row a scene, redrawn in place.
    Terminal(Box<Rows>),
    /// Now and then a line.
    Plain,
}

struct Rows {
    bars: MultiProgress,
    heading: ProgressBar,
    scenes: Vec<Row>,
}

impl Drop for Rows {
    fn drop(&mut self) {
        // The table stays on the screen, also when a client ended early.
        self.heading.abandon();
        self.scenes.iter().for_each(|row| row.bar.abandon());
    }
}

struct Row {
    bar: ProgressBar,
    /// The object under way, and its progress.
    load: Option<(String, LoadBar)>,
}

impl Live {
    /// A table for scenes of `steps` steps each; on stderr when that is a terminal, else as lines on stdout.
    pub fn new(steps: u64) -> Live {
        if std::io::stderr().is_terminal() {
            return Live { steps, kind: Kind::Terminal(Box::new(Rows::new(steps))) };
        }
        print_line(format_args!("{:<NAME_WIDTH$}{:>11}{}", "scene", "step", columns::headings()));
        Live { steps, kind: Kind::Plain }
    }

    /// Shows what the client of scene number `scene` tells.
    pub fn show(&mut self, scene: usize, event: &Event) {
        match &mut self.kind {
            Kind::Terminal(rows) => rows.show(scene, event),
            Kind::Plain => plain(scene, event, self.steps),
        }
    }
}

fn plain(scene: usize, event: &Event, steps: u64) {
    let Event::Step(step) = event else { return };
    let (number, stride) = (step.step + 1, steps.div_ceil(PLAIN_LINES).max(1));
    if number % stride == 0 || number == steps {
        let progress = format!("{number}/{steps}");
        print_line(format_args!("{:<NAME_WIDTH$}{progress:>11}{}", SCENES[scene].name, columns::row(step)));
    }
}

/// A failure is reported when the summary is printed.
fn print_line(line: std::fmt::Arguments<'_>) {
    let _ = writeln!(std::io::stdout(), "{line}");
}

impl Rows {
    fn new(steps: u64) -> Rows {
        let bars = MultiProgress::new();
        let heading = bars.add(ProgressBar::new(0));
        heading.set_style(style("{msg:.bold}"));
        heading.set_message(format!("{:<NAME_WIDTH$} {:12} {:>9}{}", "scene", "", "step", columns::headings()));
        let scenes = SCENES
            .iter()
            .map(|scene| {
                let bar = bars.add(ProgressBar::new(steps));
                bar.set_style(
                    style("{prefix:8} [{bar:10.cyan/blue}] {human_pos:>4}/{human_len:4}{msg}").progress_chars("=> "),
                );
                bar.set_prefix(scene.name);
                Row { bar, load: None }
            })
            .collect();
        Rows { bars, heading, scenes }
    }

    fn show(&mut self, scene: usize, event: &Event) {
        let row = &mut self.scenes[scene];
        match event {
            Event::Load { object, stage, done, total } => {
                if row.load.as_ref().is_none_or(|(name, _)| name != object) {
                    let bar = self.bars.add(ProgressBar::no_length());
                    row.load = Some((object.clone(), LoadBar::over(bar, object)));
                }
                if let Some((_, bar)) = &row.load {
                    bar.show(stage, *done, *total);
                }
            }
            Event::Step(step) => row.show(step),
            Event::Done(_) => {}
        }
    }
}

impl Row {
    fn show(&mut self, step: &Step) {
        self.load = None;
        self.bar.set_position(step.step + 1);
        self.bar.set_message(columns::row(step));
    }
}

fn style(template: &str) -> ProgressStyle {
    ProgressStyle::with_template(template).expect("the template is well formed")
}
