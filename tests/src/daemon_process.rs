//! Daemon processes to test with, each with a runtime directory of its own.

use std::fs;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Output, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

use collided_client::{Client, ClientBuilder};
use collided_protocol::names::{DEFAULT_INSTANCE, RENDEZVOUS_FILE, Rendezvous};
use rustix::process::{Pid, Signal, kill_process};

/// How long anything may take that is waited for: far more than it should.
pub const PATIENCE: Duration = Duration::from_secs(30);

/// What a client finds that names no instance; the runtime directory is the test's own.
const INSTANCE: &str = DEFAULT_INSTANCE;
static NEXT_DIRECTORY: AtomicU32 = AtomicU32::new(0);

/// A program of this package, which cargo builds beside the tests.
///
/// # Panics
/// When the running test, benchmark or program is not where cargo puts it.
pub fn program(name: &str) -> PathBuf {
    let own = std::env::current_exe().expect("a program knows its own path");
    let mut directory = own.parent().expect("a program stands in a folder");
    if directory.ends_with("deps") {
        directory = directory.parent().expect("tests stand in target/<profile>/deps, programs above");
    }
    directory.join(name)
}

/// A directory for `XDG_RUNTIME_DIR`; removed when dropped.
#[derive(Debug)]
pub struct RuntimeDirectory(PathBuf);

impl Default for RuntimeDirectory {
    fn default() -> Self {
        RuntimeDirectory::new()
    }
}

impl RuntimeDirectory {
    /// A new, empty directory.
    ///
    /// # Panics
    /// When it cannot be made.
    pub fn new() -> RuntimeDirectory {
        let number = NEXT_DIRECTORY.fetch_add(1, Ordering::Relaxed);
        let path = std::env::temp_dir().join(format!("collided-test-{}-{number}", std::process::id()));
        fs::create_dir(&path).expect("a directory for the test can be made");
        RuntimeDirectory(path)
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.0
    }

    /// The rendezvous directory of `instance` in it.
    pub fn instance(&self, instance: &str) -> PathBuf {
        self.0.join("collided").join(instance)
    }

    /// A command of the `collided` program with this runtime directory.
    pub fn collided(&self) -> Command {
        let mut command = Command::new(program("collided-under-test"));
        command.env("XDG_RUNTIME_DIR", &self.0);
        command
    }
}

impl Drop for RuntimeDirectory {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// A running daemon. When dropped it is killed, and all that it has left is removed.
#[derive(Debug)]
pub struct DaemonProcess {
    child: Child,
    runtime: RuntimeDirectory,
    epochs: Vec<Rendezvous>,
}

impl DaemonProcess {
    /// Starts a daemon and waits until it is ready.
    ///
    /// # Panics
    /// When it does not become ready.
    pub fn start() -> DaemonProcess {
        DaemonProcess::start_with(&[])
    }

    /// As [`DaemonProcess::start`], with more arguments for `collided serve`.
    ///
    /// # Panics
    /// When it does not become ready.
    pub fn start_with(arguments: &[&str]) -> DaemonProcess {
        let runtime = RuntimeDirectory::new();
        let child = spawn(&runtime, arguments);
        let mut daemon = DaemonProcess { child, runtime, epochs: Vec::new() };
        daemon.await_ready();
        daemon
    }

    fn await_ready(&mut self) {
        let stderr = self.child.stderr.take().expect("stderr is piped");
        let mut lines = BufReader::new(stderr);
        let mut line = String::new();
        lines.read_line(&mut line).expect("the daemon's stderr can be read");
        assert!(line.starts_with("ready: "), "the daemon said: {line}");
        // The pipe must neither fill up nor close under the daemon.
        std::thread::spawn(move || std::io::copy(&mut lines, &mut std::io::stderr()));
        let json = fs::read(self.directory().join(RENDEZVOUS_FILE)).expect("a ready daemon has published itself");
        self.epochs.push(serde_json::from_slice(&json).expect("the rendezvous file is JSON"));
    }

    /// Starts a daemon again, in the place of one that has ended.
    ///
    /// # Panics
    /// When it does not become ready.
    pub fn restart(&mut self) {
        self.child = spawn(&self.runtime, &[]);
        self.await_ready();
    }

    /// Its process id.
    pub fn pid(&self) -> u32 {
        self.child.id()
    }

    /// The runtime directory that it shares with its clients.
    pub fn runtime(&self) -> &RuntimeDirectory {
        &self.runtime
    }

    /// The rendezvous directory.
    pub fn directory(&self) -> PathBuf {
        self.runtime.instance(INSTANCE)
    }

    /// What the daemon published when it started last.
    ///
    /// # Panics
    /// Never: a daemon process has been ready once.
    pub fn rendezvous(&self) -> &Rendezvous {
        self.epochs.last().expect("a daemon process has been ready")
    }

    /// Settings of a connection to it from this process.
    pub fn client_builder(&self) -> ClientBuilder {
        Client::builder().directory(self.directory())
    }

    /// A connection to it from this process.
    ///
    /// # Panics
    /// When it does not answer.
    pub fn client(&self) -> Client {
        self.client_builder().connect().expect("the daemon answers")
    }

    /// Runs a command of `collided` on its instance to its end.
    ///
    /// # Panics
    /// When the program cannot be started.
    pub fn command(&self, arguments: &[&str]) -> Output {
        let mut command = self.runtime.collided();
        command.args(arguments).args(["--instance", INSTANCE]).output().expect("the program can be started")
    }

    /// Sends it a signal.
    ///
    /// # Panics
    /// When the process is not there.
    pub fn signal(&self, signal: Signal) {
        let pid = Pid::from_raw(self.child.id() as i32).expect("a process id is not 0");
        kill_process(pid, signal).expect("the daemon is there");
    }

    /// Stops it, as Ctrl-Z does, and waits until none of its threads runs: the signal reaches them one after another.
    ///
    /// # Panics
    /// When the process is not there.
    pub fn pause(&self) {
        self.signal(Signal::STOP);
        let tasks = PathBuf::from(format!("/proc/{}/task", self.pid()));
        await_some("all threads of the daemon stop", || {
            let mut tasks = fs::read_dir(&tasks).ok()?.flatten();
            tasks.all(|task| is_stopped(&task.path())).then_some(())
        });
    }

    /// Lets it go on after [`DaemonProcess::pause`].
    ///
    /// # Panics
    /// When the process is not there.
    pub fn resume(&self) {
        self.signal(Signal::CONT);
    }

    /// Waits for its end.
    ///
    /// # Panics
    /// When it does not end.
    pub fn wait(&mut self) -> ExitStatus {
        await_end(&mut self.child)
    }

    /// What is left of all its starts: files in shared memory, iceoryx2 roots, and what stands in the runtime directory.
    pub fn leftovers(&self) -> Vec<PathBuf> {
        let mut left: Vec<PathBuf> = self.epochs.iter().flat_map(shared_files).collect();
        left.extend(self.epochs.iter().map(|epoch| PathBuf::from(&epoch.iceoryx2_root)).filter(|root| root.exists()));
        left.extend(fs::read_dir(self.runtime.path()).into_iter().flatten().flatten().map(|entry| entry.path()));
        left
    }
}

impl Drop for DaemonProcess {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
        for epoch in &self.epochs {
            shared_files(epoch).iter().for_each(|file| drop(fs::remove_file(file)));
            let _ = fs::remove_dir_all(&epoch.iceoryx2_root);
        }
    }
}

/// The files in shared memory that belong to an epoch.
pub fn shared_files(epoch: &Rendezvous) -> Vec<PathBuf> {
    let of_epoch = |entry: &fs::DirEntry| entry.file_name().to_string_lossy().starts_with(&epoch.iceoryx2_prefix);
    let entries = fs::read_dir("/dev/shm").into_iter().flatten().flatten();
    entries.filter(of_epoch).map(|entry| entry.path()).collect()
}

/// Whether a thread is stopped, by its directory in `/proc`.
fn is_stopped(task: &Path) -> bool {
    let stat = fs::read_to_string(task.join("stat")).unwrap_or_default();
    // The state stands after the name, which is in brackets and may hold anything.
    stat.rsplit_once(") ").is_some_and(|(_, state)| state.starts_with('T'))
}

fn spawn(runtime: &RuntimeDirectory, arguments: &[&str]) -> Child {
    let mut command = runtime.collided();
    command.args(["serve", "--instance", INSTANCE]).args(arguments);
    command.stdin(Stdio::null()).stderr(Stdio::piped()).spawn().expect("the program can be started")
}

/// Waits for the end of a process.
///
/// # Panics
/// When it does not end.
pub fn await_end(child: &mut Child) -> ExitStatus {
    await_some("the process ends", || child.try_wait().expect("a child can be waited for"))
}

/// Waits until `look` finds something.
///
/// # Panics
/// When it does not within [`PATIENCE`].
pub fn await_some<T>(what: &str, mut look: impl FnMut() -> Option<T>) -> T {
    let start = Instant::now();
    loop {
        if let Some(found) = look() {
            return found;
        }
        assert!(start.elapsed() < PATIENCE, "waited {PATIENCE:?} in vain: {what}");
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// All that a stream holds.
///
/// # Panics
/// When it cannot be read.
pub fn read_all(mut stream: impl Read) -> String {
    let mut text = String::new();
    stream.read_to_string(&mut text).expect("the stream can be read");
    text
}
