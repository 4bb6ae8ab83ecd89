//! Processes of the own executable that end with this one: the private daemon of `check` and `demo`, and its clients.

use std::io;
use std::process::{Child, Command, ExitStatus};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process};
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use signal_hook::iterator::Signals;

/// Exit status of a command that was interrupted, as shells give it for Ctrl-C.
pub const INTERRUPTED: u8 = 130;

/// How long a process may take to end after it was asked to; then it is killed.
const END_TIMEOUT: Duration = Duration::from_secs(10);
/// How often a process that was asked to end is looked at.
const END_POLL: Duration = Duration::from_millis(2);

/// Ctrl-C and its kin, passed on to the processes started here. Clones share their state.
///
/// The first signal asks the processes to end and leaves the rest to who looks at [`Interrupt::is_raised`]; the second
/// one ends this process at once.
#[derive(Clone)]
pub struct Interrupt {
    shared: Arc<Shared>,
}

#[derive(Default)]
struct Shared {
    raised: AtomicBool,
    /// Running processes. One that is not listed may have been waited for, and its id be another's.
    running: Mutex<Vec<Pid>>,
}

impl Shared {
    fn running(&self) -> MutexGuard<'_, Vec<Pid>> {
        self.running.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn raise(&self) {
        let running = self.running();
        self.raised.store(true, Ordering::SeqCst);
        running.iter().for_each(|&process| ask_to_end(process));
    }
}

impl Interrupt {
    /// Takes over the signals of this process. To be called once.
    ///
    /// # Errors
    /// When the system does not let signals be handled.
    pub fn install() -> io::Result<Interrupt> {
        let shared = Arc::new(Shared::default());
        let mut signals = Signals::new([SIGINT, SIGTERM, SIGHUP])?;
        let raised = Arc::clone(&shared);
        thread::Builder::new().name("signals".into()).spawn(move || {
            for _ in signals.forever() {
                if raised.raised.load(Ordering::SeqCst) {
                    std::process::exit(INTERRUPTED.into());
                }
                raised.raise();
            }
        })?;
        Ok(Interrupt { shared })
    }

    fn spawn(&self, command: &mut Command) -> io::Result<Child> {
        // Locked over the start, so that an interrupt finds the process listed or not started.
        let mut running = self.shared.running();
        let child = command.spawn()?;
        running.push(Pid::from_child(&child));
        if self.is_raised() {
            ask_to_end(Pid::from_child(&child));
        }
        Ok(child)
    }

    /// Whether this process was asked to end.
    pub fn is_raised(&self) -> bool {
        self.shared.raised.load(Ordering::SeqCst)
    }
}

fn ask_to_end(process: Pid) {
    // Fails only for a process that has ended already, which is what is wanted.
    let _ = kill_process(process, Signal::TERM);
}

/// A process of the own executable. Asked to end, and waited for, when dropped.
pub struct OwnProcess {
    child: Child,
    /// Where it is listed.
    interrupt: Option<Interrupt>,
    ended: bool,
}

impl OwnProcess {
    /// A command that starts the own executable.
    ///
    /// # Errors
    /// When the system does not say where the executable is.
    pub fn command() -> io::Result<Command> {
        Ok(Command::new(std::env::current_exe()?))
    }

    /// Starts a process in a process group of its own, so that Ctrl-C reaches it only through `interrupt`; `None`: not at
    /// all, its owner ends it in time.
    ///
    /// # Errors
    /// When the process cannot be started.
    pub fn spawn(command: &mut Command, interrupt: Option<&Interrupt>) -> io::Result<OwnProcess> {
        use std::os::unix::process::CommandExt;
        command.process_group(0);
        let child = match interrupt {
            None => command.spawn()?,
            Some(interrupt) => interrupt.spawn(command)?,
        };
        Ok(OwnProcess { child, interrupt: interrupt.cloned(), ended: false })
    }

    /// Its pipes.
    pub fn child(&mut self) -> &mut Child {
        &mut self.child
    }

    /// Asks the process to end and waits for it; kills it when it does not.
    ///
    /// # Errors
    /// When the system does not let it be waited for.
    pub fn end(mut self) -> io::Result<ExitStatus> {
        ask_to_end(Pid::from_child(&self.child));
        self.reap()
    }

    /// Waits for a process that is about to end by itself; kills it when it does not.
    ///
    /// # Errors
    /// When the system does not let it be waited for.
    pub fn wait(mut self) -> io::Result<ExitStatus> {
        self.reap()
    }

    /// How it has ended; `None` when it still runs.
    ///
    /// # Errors
    /// When the system does not let it be looked at.
    pub fn try_wait(&mut self) -> io::Result<Option<ExitStatus>> {
        // Under the lock, so that no signal is sent to an id that is free again.
        let mut running = self.interrupt.as_ref().map(|interrupt| interrupt.shared.running());
        let status = self.child.try_wait()?;
        if let (Some(running), Some(_)) = (&mut running, status) {
            let process = Pid::from_child(&self.child);
            running.retain(|&other| other != process);
        }
        Ok(status)
    }

    fn reap(&mut self) -> io::Result<ExitStatus> {
        self.ended = true;
        let patience = Instant::now() + END_TIMEOUT;
        let mut killed = false;
        loop {
            if let Some(status) = self.try_wait()? {
                return Ok(status);
            }
            if !killed && Instant::now() > patience {
                self.child.kill()?;
                killed = true;
            }
            thread::sleep(END_POLL);
        }
    }
}

impl Drop for OwnProcess {
    fn drop(&mut self) {
        if !self.ended {
            ask_to_end(Pid::from_child(&self.child));
            // A drop has nobody to tell.
            let _ = self.reap();
        }
    }
}
