//! `collided accuracy`: what accuracy costs in time, on a scene of one's own.
//!
//! In reading order: [`scene`] reads the scene file and builds its objects, [`plan`] says what is run, [`study`] runs it, a [`run`] a setting, with
//! [`player`] going through the steps, [`truth`] comparing answers with the exact ones, [`polygon_tests`] and [`arithmetic`]
//! trying other arithmetics, and [`statistics`] reducing repetitions. Each [`measurement`] is a row of [`table`] and
//! [`record`] (CSV, JSON), and a point of [`figures`], drawn by [`plot`]; [`advice`] says what they come to; [`page`] holds all of it.

pub mod advice;
pub mod arithmetic;
pub mod error;
pub mod figures;
pub mod machine;
pub mod measurement;
pub mod page;
pub mod plan;
pub mod player;
pub mod plot;
pub mod polygon_tests;
pub mod progress;
pub mod record;
pub mod run;
pub mod scene;
pub mod statistics;
pub mod study;
pub mod table;
pub mod truth;
pub mod units;

use std::path::{Path, PathBuf};
use std::{fs, io};

use error::StudyError;
use measurement::{Family, Measurement};
use scene::StudyScene;

/// A finished study.
pub struct Report {
    /// The scene file, as it was given.
    pub scene: String,
    /// The scene and the command, as lines of (what, value).
    pub facts: Vec<(&'static str, String)>,
    /// Where it was measured, likewise.
    pub machine: Vec<(&'static str, String)>,
    /// All rows.
    pub measured: Vec<Measurement>,
    /// What they come to; the last sentence is the most important one.
    pub advice: Vec<String>,
}

impl Report {
    /// Studies a scene. `command` is what the user has typed.
    ///
    /// # Errors
    /// [`StudyError`] names the file, and the object or step.
    pub fn of(scene: &StudyScene, plan: &plan::Plan, command: String) -> Result<Report, StudyError> {
        let machine = machine::describe();
        let measured = study::run(scene, plan)?;
        let advice = advice::sentences(&measured);
        let mut facts = vec![("command", command)];
        facts.extend(scene.describe());
        Ok(Report { scene: scene.path.display().to_string(), facts, machine, measured, advice })
    }

    /// Writes the CSV file, the diagrams and the page into a folder, which is made if need be. Returns the files.
    ///
    /// # Errors
    /// [`StudyError::Output`] names the file that cannot be written.
    pub fn write(&self, folder: &Path) -> Result<Vec<PathBuf>, StudyError> {
        let failed = |path: &Path| {
            let path = path.to_owned();
            move |source: io::Error| StudyError::Output { path, source }
        };
        fs::create_dir_all(folder).map_err(failed(folder))?;
        let mut files =
            vec![("study.html".to_owned(), page::html(self)), ("study.csv".to_owned(), record::csv(&self.measured))];
        for family in Family::ALL {
            let figure = figures::plot(family, &self.measured);
            files.extend(figure.map(|figure| (format!("{}.svg", family.name()), plot::draw(&figure))));
        }
        let write = |(name, text): (String, String)| {
            let path = folder.join(name);
            fs::write(&path, text).map_err(failed(&path))?;
            Ok(path)
        };
        files.into_iter().map(write).collect()
    }
}
