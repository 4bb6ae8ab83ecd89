//! An aligned table for people.

use std::io::{self, Write};
use std::path::Path;

use collided_protocol::Effect;

use super::output::{Output, Pair, PairEffects, StepResult};
use crate::scene_file::SceneFile;

const NAME_HEADINGS: [&str; 2] = ["body a", "body b"];

/// Prints to `writer`.
pub(super) struct Table<W> {
    writer: W,
    /// Width of the columns of body names, in characters.
    name_width: usize,
    /// Whether there are columns for relation and polygon pairs, and one for containment.
    with_polygon_pairs: bool,
    with_containment: bool,
    steps: usize,
    interfering_steps: usize,
    scenes: usize,
}

impl<W: Write> Table<W> {
    pub fn new(writer: W) -> Table<W> {
        Table {
            writer,
            name_width: 0,
            with_polygon_pairs: false,
            with_containment: false,
            steps: 0,
            interfering_steps: 0,
            scenes: 0,
        }
    }

    fn row(
        &mut self,
        step: &str,
        names: [&str; 2],
        verdict: &str,
        polygons: [&str; 2],
        containment: &str,
    ) -> io::Result<()> {
        let ([a, b], [relation, count], width) = (names, polygons, self.name_width);
        let mut line = format!("{step:>6}  {a:width$}  {b:width$}  {verdict:11}");
        if self.with_polygon_pairs {
            line += &format!("  {relation:8}  {count:>13}");
        }
        if self.with_containment {
            line += &format!("  {containment}");
        }
        writeln!(self.writer, "{}", line.trim_end())
    }

    fn pair(&mut self, step: &str, pair: &Pair<'_>) -> io::Result<()> {
        let (relation, count) = match &pair.polygon_pairs {
            Some(polygons) => (polygons.relation.name(), polygons.pairs.len().to_string()),
            None => ("", String::new()),
        };
        let containment = pair.containment.map_or(String::new(), |containment| match containment.reason() {
            Some(reason) => format!("{}: {reason}", containment.name()),
            None => containment.name().to_owned(),
        });
        self.row(step, [pair.a, pair.b], pair.verdict.name(), [relation, &count], &containment)
    }
}

impl<W: Write> Output for Table<W> {
    fn begin(&mut self, path: &Path, file: &SceneFile) -> io::Result<()> {
        let names = file.bodies.iter().map(|body| body.name.as_str()).chain(NAME_HEADINGS);
        self.name_width = names.map(|name| name.chars().count()).max().unwrap_or(0);
        let effects = PairEffects::of(file);
        self.with_polygon_pairs = effects.any(Effect::PolygonPairs);
        self.with_containment = effects.any(Effect::Containment);
        (self.steps, self.interfering_steps) = (0, 0);
        if self.scenes > 0 {
            writeln!(self.writer)?;
        }
        self.scenes += 1;
        let (bodies, steps) =
            (counted(file.bodies.len(), "body", "bodies"), counted(file.steps.len(), "step", "steps"));
        writeln!(self.writer, "{}: {bodies}, {steps}", path.display())?;
        self.row("step", NAME_HEADINGS, "verdict", ["relation", "polygon pairs"], "containment")
    }

    fn step(&mut self, result: &StepResult<'_>) -> io::Result<()> {
        let mut step = result.index.to_string();
        self.steps += 1;
        self.interfering_steps += usize::from(!result.report.is_clear());
        if result.report.pairs().len() == 0 {
            return self.row(&step, ["-", "-"], "clear", ["", ""], "");
        }
        for pair in result.pairs() {
            self.pair(&step, &pair)?;
            step.clear();
        }
        Ok(())
    }

    fn end(&mut self) -> io::Result<()> {
        let steps = counted(self.steps, "step", "steps");
        writeln!(self.writer, "pairs interfere in {} of {steps}", self.interfering_steps)
    }
}

/// A number with the thing it counts.
fn counted(count: usize, one: &str, more: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { more })
}
