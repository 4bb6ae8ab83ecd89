//! The settings of `collided serve`: flags, and a TOML file below them.

use std::path::{Path, PathBuf};

use collided_protocol::names::DEFAULT_INSTANCE;
use serde::Deserialize;

const DEFAULT_THREADS: usize = 2;
/// More than any host has processors.
const MAX_THREADS: usize = 1024;

/// The flags of `collided serve`.
#[derive(Debug, Clone, Default, clap::Args)]
pub struct Args {
    /// The name under which clients find the daemon [default: default]
    #[arg(long)]
    pub instance: Option<String>,
    /// Worker threads for geometry [default: 2]
    #[arg(long)]
    pub threads: Option<usize>,
    /// A TOML file with the same settings; flags win
    #[arg(long, value_name = "FILE")]
    pub config: Option<PathBuf>,
    /// What is logged to stderr: error, warn, info, debug or trace, also by module [default: warn]
    #[arg(long, value_name = "FILTER")]
    pub log: Option<String>,
    /// End when standard input does: for a daemon that must not outlive those who started it
    #[arg(long, hide = true)]
    pub while_stdin_open: bool,
}

/// What the file may set.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct FileSettings {
    instance: Option<String>,
    threads: Option<usize>,
    log: Option<String>,
}

/// What holds in the end.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Settings {
    /// The instance.
    pub instance: String,
    /// Worker threads.
    pub threads: usize,
    /// The filter of the log.
    pub log: String,
}

/// Settings that cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SettingsError {
    /// The file cannot be read.
    #[error("cannot read the settings file {path}: {cause}; correct --config", path = path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What the system said.
        cause: std::io::Error,
    },
    /// The file is not TOML, or has a setting that there is not.
    #[error("the settings file {path} is wrong: {cause}; it may set `instance`, `threads` and `log`", path = path.display())]
    Malformed {
        /// The file.
        path: PathBuf,
        /// Where and why.
        cause: toml::de::Error,
    },
    /// A number of threads that cannot be used.
    #[error("{threads} worker threads cannot be used; ask for 1 to {MAX_THREADS}")]
    Threads {
        /// The number.
        threads: usize,
    },
}

impl Args {
    /// Reads the file, if one is named, and lets the flags win over it.
    ///
    /// # Errors
    /// All of [`SettingsError`].
    pub fn settings(self) -> Result<Settings, SettingsError> {
        let file = self.config.as_deref().map(read).transpose()?.unwrap_or_default();
        let threads = self.threads.or(file.threads).unwrap_or(DEFAULT_THREADS);
        if !(1..=MAX_THREADS).contains(&threads) {
            return Err(SettingsError::Threads { threads });
        }
        Ok(Settings {
            instance: self.instance.or(file.instance).unwrap_or_else(|| DEFAULT_INSTANCE.to_owned()),
            threads,
            log: self.log.or(file.log).unwrap_or_else(|| "warn".to_owned()),
        })
    }
}

fn read(path: &Path) -> Result<FileSettings, SettingsError> {
    let text =
        std::fs::read_to_string(path).map_err(|cause| SettingsError::Unreadable { path: path.to_owned(), cause })?;
    toml::from_str(&text).map_err(|cause| SettingsError::Malformed { path: path.to_owned(), cause })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_anything_the_defaults_hold() {
        let settings = Args::default().settings().unwrap();
        assert_eq!(settings, Settings { instance: "default".into(), threads: 2, log: "warn".into() });
    }

    #[test]
    fn a_file_may_set_what_a_flag_may_and_nothing_else() {
        let file: FileSettings = toml::from_str("instance = 'cell'\nthreads = 4\nlog = 'info'").unwrap();
        assert_eq!(file.threads, Some(4));
        assert!(toml::from_str::<FileSettings>("thread = 4").is_err());
    }

    #[test]
    fn no_threads_are_refused() {
        let args = Args { threads: Some(0), ..Args::default() };
        assert!(matches!(args.settings(), Err(SettingsError::Threads { threads: 0 })));
    }
}
