//! An aligned table for people.

use std::io::{self, Write};
use std::path::Path;

use collided_client::{Containment, TimeOfContact, Verdict};
use collided_protocol::Effect;

use super::output::{Output, Pair, PairEffects, StepResult};
use crate::scene_file::SceneFile;

const NAME_HEADINGS: [&str; 2] = ["body a", "body b"];

/// Prints to `writer`.
pub(super) struct Table<W> {
    writer: W,
    /// Width of the columns of body names, in characters.
    name_width: usize,
    /// Whether there are columns for relation and polygon pairs.
    with_polygon_pairs: bool,
    steps: usize,
    interfering_steps: usize,
    /// Whether some pair was left possible.
    is_open: bool,
    scenes: usize,
}

impl<W: Write> Table<W> {
    pub fn new(writer: W) -> Table<W> {
        Table {
            writer,
            name_width: 0,
            with_polygon_pairs: false,
            steps: 0,
            interfering_steps: 0,
            is_open: false,
            scenes: 0,
        }
    }

    fn row(&mut self, step: &str, names: [&str; 2], verdict: &str, polygons: [&str; 2], more: &str) -> io::Result<()> {
        let ([a, b], [relation, count], width) = (names, polygons, self.name_width);
        let mut line = format!("{step:>6}  {a:width$}  {b:width$}  {verdict:11}");
        if self.with_polygon_pairs {
            line += &format!("  {relation:8}  {count:>13}");
        }
        line += &format!("  {more}");
        writeln!(self.writer, "{}", line.trim_end())
    }

    fn pair(&mut self, step: &str, pair: &Pair<'_>) -> io::Result<()> {
        let (relation, count) = match pair.effects.contains(Effect::PolygonPairs) {
            true => (pair.found.relation().name(), pair.found.polygon_pairs().len().to_string()),
            false => ("", String::new()),
        };
        let verdict = pair.found.verdict().name();
        self.row(step, [pair.a, pair.b], verdict, [relation, &count], &more(pair).join("; "))
    }
}

/// What the effects say of a pair, in a few words each.
fn more(pair: &Pair<'_>) -> Vec<String> {
    let found = &pair.found;
    let mut more = Vec::new();
    more.extend(found.bound().map(|bound| {
        let (level, [a, b]) = (found.level().name(), bound.orders);
        format!(
            "{level}, orders {a} and {b}: at most {:.3e} apart or {:.3e} deep",
            bound.apart_at_most, bound.deep_at_most
        )
    }));
    if found.is_unfinished() {
        more.push("unfinished within the budget".to_owned());
    }
    if pair.effects.contains(Effect::Containment) && found.containment() != Containment::None {
        let reason = found.containment().reason().map_or(String::new(), |reason| format!(": {reason}"));
        more.push(format!("{}{reason}", found.containment().name()));
    }
    more.extend(found.distance().map(|distance| format!("distance {}", distance.value)));
    if pair.effects.contains(Effect::Contacts) {
        more.push(counted(found.contacts().len(), "contact region", "contact regions"));
    }
    more.extend(found.penetration().map(|penetration| format!("penetration {}", penetration.depth)));
    more.extend(found.time_of_contact().map(|time| match time {
        TimeOfContact::Contact { lo, hi } => format!("first contact at {lo} to {hi} of the step"),
        TimeOfContact::Possible { lo, hi, distance } => {
            format!("first contact possible at {lo} to {hi} of the step, {distance} apart")
        }
    }));
    if pair.effects.contains(Effect::Response) {
        more.push(counted(found.impulses().len(), "impulse", "impulses"));
    }
    more
}

/// What there is to say of the step as a whole.
fn notes(result: &StepResult<'_>) -> Vec<String> {
    let mut notes = Vec::new();
    notes.extend(result.report.response_fault().map(|body| {
        let name = result.name(body);
        format!("no response: the inertia of {name} is not positive definite where it stands")
    }));
    if result.report.response_was_capped() {
        notes.push("the response was ended by a cap: bodies may still approach or slide".to_owned());
    }
    let still =
        |name| format!("{name} counts as still: this step is the first to place it, so its motion is not looked at");
    notes.extend(result.time_fault().map(still));
    notes
}

impl<W: Write> Output for Table<W> {
    fn begin(&mut self, path: &Path, file: &SceneFile) -> io::Result<()> {
        let names = file.bodies.iter().map(|body| body.name.as_str()).chain(NAME_HEADINGS);
        self.name_width = names.map(|name| name.chars().count()).max().unwrap_or(0);
        self.with_polygon_pairs = PairEffects::of(file).any(Effect::PolygonPairs);
        (self.steps, self.interfering_steps, self.is_open) = (0, 0, false);
        if self.scenes > 0 {
            writeln!(self.writer)?;
        }
        self.scenes += 1;
        let (bodies, steps) =
            (counted(file.bodies.len(), "body", "bodies"), counted(file.steps.len(), "step", "steps"));
        writeln!(self.writer, "{}: {bodies}, {steps}", path.display())?;
        self.row("step", NAME_HEADINGS, "verdict", ["relation", "polygon pairs"], "")
    }

    fn step(&mut self, result: &StepResult<'_>) -> io::Result<()> {
        let mut step = result.index.to_string();
        self.steps += 1;
        self.interfering_steps += usize::from(result.is_interfering());
        let is_open = |pair: collided_client::Pair<'_>| pair.verdict() == Verdict::Possible;
        self.is_open |= !result.report.is_complete() || result.report.pairs().any(is_open);
        if !result.report.is_complete() {
            self.row(
                &step,
                ["-", "-"],
                "possible",
                ["", ""],
                "every pair not listed: the budget was too small to find them",
            )?;
            step.clear();
        } else if result.report.pairs().len() == 0 {
            self.row(&step, ["-", "-"], "clear", ["", ""], "")?;
        }
        for pair in result.pairs() {
            self.pair(&step, &pair)?;
            step.clear();
        }
        notes(result).iter().try_for_each(|note| self.row("", ["", ""], "", ["", ""], note))
    }

    fn end(&mut self) -> io::Result<()> {
        let steps = counted(self.steps, "step", "steps");
        let what = if self.is_open { "interfere, or may interfere," } else { "interfere" };
        writeln!(self.writer, "pairs {what} in {} of {steps}", self.interfering_steps)
    }
}

/// A number with the thing it counts.
fn counted(count: usize, one: &str, more: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { more })
}
