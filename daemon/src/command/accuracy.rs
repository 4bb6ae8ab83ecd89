//! `collided accuracy`.

use std::io::{self, Write};
use std::path::PathBuf;
use std::process::ExitCode;

use super::Outcome;
use crate::accuracy::error::StudyError;
use crate::accuracy::measurement::Family;
use crate::accuracy::plan::Plan;
use crate::accuracy::scene::StudyScene;
use crate::accuracy::table::Table;
use crate::accuracy::{Report, record};

/// Repetitions unless given.
const REPETITIONS: u32 = 15;
/// Repetitions of a quick study unless given.
const QUICK_REPETITIONS: u32 = 3;

/// Shows what accuracy costs in time on a scene of your own.
///
/// Runs the scene at every level, order, tolerance and budget, in this process, and compares with the exact answers. Prints
/// tables and a sentence of advice; writes CSV, diagrams (SVG) and a page (HTML). Run it on a quiet machine, in a release build.
///
/// Exit status: 0, or 2 for trouble, with the reason on stderr.
#[derive(Debug, Clone, clap::Args)]
pub struct Args {
    /// Scene file, TOML or JSON by its ending
    #[arg(value_name = "SCENE")]
    scene: PathBuf,
    /// Folder for the files of the study
    #[arg(long, default_value = "collided-accuracy")]
    out: PathBuf,
    /// How often the steps are repeated for each setting [default: 15, with --quick 3]
    #[arg(long, value_name = "COUNT", value_parser = clap::value_parser!(u32).range(1..))]
    repetitions: Option<u32>,
    /// Every third order and decade, and less patience
    #[arg(long)]
    quick: bool,
    /// How results are printed
    #[arg(long, value_enum, default_value_t = Format::Table)]
    format: Format,
}

/// How results are printed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Format {
    /// Aligned tables for people.
    Table,
    /// One JSON object a line, a line a measurement; the last one has the advice.
    Json,
}

impl Args {
    fn plan(&self) -> Plan {
        let repetitions = |otherwise: u32| self.repetitions.unwrap_or(otherwise) as usize;
        match self.quick {
            true => Plan::quick(repetitions(QUICK_REPETITIONS)),
            false => Plan::thorough(repetitions(REPETITIONS)),
        }
    }
}

/// Studies the scene, writes the files and prints the tables.
///
/// # Errors
/// The scene cannot be used, or the files not be written.
pub fn run(args: &Args) -> Outcome {
    let scene = StudyScene::read(&args.scene)?;
    let command = std::env::args().collect::<Vec<_>>().join(" ");
    let report = Report::of(&scene, &args.plan(), command)?;
    let files = report.write(&args.out)?;
    let out = io::stdout().lock();
    let printed = match args.format {
        Format::Table => print_tables(out, &report, &files),
        Format::Json => print_json(out, &report),
    };
    printed.map_err(StudyError::Print)?;
    Ok(ExitCode::SUCCESS)
}

fn print_tables(mut out: impl Write, report: &Report, files: &[PathBuf]) -> io::Result<()> {
    for (what, value) in report.facts.iter().chain(&report.machine) {
        writeln!(out, "{what}: {value}")?;
    }
    for table in Family::ALL.into_iter().filter_map(|family| Table::of(family, &report.measured)) {
        write!(out, "\n{}", table.text())?;
    }
    writeln!(out)?;
    files.iter().try_for_each(|file| writeln!(out, "written: {}", file.display()))?;
    writeln!(out)?;
    report.advice.iter().try_for_each(|sentence| writeln!(out, "{sentence}"))
}

fn print_json(mut out: impl Write, report: &Report) -> io::Result<()> {
    report.measured.iter().try_for_each(|measurement| writeln!(out, "{}", record::json(measurement)))?;
    writeln!(out, "{}", serde_json::json!({ "scene": report.scene, "advice": report.advice }))
}
