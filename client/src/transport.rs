//! What daemon and client share of iceoryx2: the node of an epoch, the types of the services, and waiting.

mod words;

use std::fmt::Display;
use std::io;
use std::mem::MaybeUninit;
use std::os::fd::{BorrowedFd, OwnedFd};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use collided_protocol::control::UploadHeader;
use collided_protocol::limits::MIN_FREE_SHARED_MEMORY;
use collided_protocol::names::Rendezvous;
use collided_protocol::report::ReportHeader;
use collided_protocol::step::{StepHeader, Word};
use iceoryx2::prelude::*;
use iceoryx2::service::port_factory::{event, publish_subscribe, request_response};
use rustix::event::{PollFd, PollFlags, Timespec, poll};

use crate::error::TransportError;

pub use words::{copy, fill};

/// Ports of this service may be sent to another thread, and match those of `ipc::Service` in another process.
pub type Service = ipc_threadsafe::Service;
/// The request-response service of a scene's steps.
pub type StepService = request_response::PortFactory<Service, [Word], StepHeader, [Word], ReportHeader>;
/// Sends steps.
pub type StepClient = iceoryx2::port::client::Client<Service, [Word], StepHeader, [Word], ReportHeader>;
/// Receives steps.
pub type StepServer = iceoryx2::port::server::Server<Service, [Word], StepHeader, [Word], ReportHeader>;
/// A step being written.
pub type StepRequest = iceoryx2::request_mut::RequestMut<Service, [Word], StepHeader, [Word], ReportHeader>;
/// Memory for a step.
pub type EmptyStepRequest =
    iceoryx2::request_mut_uninit::RequestMutUninit<Service, [MaybeUninit<Word>], StepHeader, [Word], ReportHeader>;
/// A step that was sent.
pub type StepPending = iceoryx2::pending_response::PendingResponse<Service, [Word], StepHeader, [Word], ReportHeader>;
/// A step that was received.
pub type StepActive = iceoryx2::active_request::ActiveRequest<Service, [Word], StepHeader, [Word], ReportHeader>;
/// A report that was received.
pub type StepResponse = iceoryx2::response::Response<Service, [Word], ReportHeader>;
/// The event services of a scene.
pub type EventService = event::PortFactory<Service>;
/// Wakes the other side.
pub type Notifier = iceoryx2::port::notifier::Notifier<Service>;
/// Is woken by the other side.
pub type Listener = iceoryx2::port::listener::Listener<Service>;
/// The publish-subscribe service of one upload.
pub type UploadService = publish_subscribe::PortFactory<Service, [Word], UploadHeader>;
/// Receives the parts of an upload.
pub type UploadSubscriber = iceoryx2::port::subscriber::Subscriber<Service, [Word], UploadHeader>;

/// What takes longer than this is slept through: what is lost by waking late is little beside it.
pub const SHORT_STEP: Duration = Duration::from_micros(200);

/// How long the other side has let one wait, the last two times.
#[derive(Debug)]
pub struct Waits {
    last: AtomicU64,
    before: AtomicU64,
}

impl Default for Waits {
    fn default() -> Self {
        Waits { last: AtomicU64::new(u64::MAX), before: AtomicU64::new(u64::MAX) }
    }
}

impl Waits {
    /// The other side has let one wait for so long.
    pub fn learn(&self, nanoseconds: u64) {
        self.before.store(self.last.load(Ordering::Relaxed), Ordering::Relaxed);
        self.last.store(nanoseconds, Ordering::Relaxed);
    }

    /// How long to look at shared memory before sleeping: where one need not wait for long, as long as it is likely to take again. One long
    /// wait does not count: the system interrupts everybody now and then, and who then sleeps is late the next time, too.
    pub fn patience(&self) -> Duration {
        /// A wake-up costs about as much.
        const SPIN: Duration = Duration::from_micros(30);
        let [last, before] = [&self.last, &self.before].map(|wait| wait.load(Ordering::Relaxed));
        let wait = Duration::from_nanos(last.min(before));
        // The other side may have to be woken first.
        if wait <= SHORT_STEP { wait + 2 * SPIN } else { SPIN }
    }
}

/// Looks for something until it is there, or for as long as `time`, but once at least.
///
/// After a moment, other threads are let go first between two looks. The one that is waited for may be among them: the system often
/// puts a thread that is woken where the one runs that has woken it, because that one, as a rule, sleeps next.
///
/// # Errors
/// Those of `look`.
pub fn look_for<T, E>(time: Duration, mut look: impl FnMut() -> Result<Option<T>, E>) -> Result<Option<T>, E> {
    /// An answer that takes no longer is worth more than what others could do meanwhile.
    const ALONE: Duration = Duration::from_micros(10);
    /// Looks between two at the clock, which takes as long as one.
    const LOOKS: usize = 4;
    let mut found = look()?;
    if found.is_some() || time.is_zero() {
        return Ok(found);
    }
    let start = Instant::now();
    loop {
        for _ in 0..LOOKS {
            found = look()?;
            if found.is_some() {
                return Ok(found);
            }
            std::hint::spin_loop();
        }
        let waited = start.elapsed();
        if waited >= time {
            return Ok(None);
        }
        if waited >= ALONE {
            std::thread::yield_now();
        }
    }
}

/// The iceoryx2 node of this process in the daemon's epoch.
///
/// # Errors
/// When the epoch's names cannot be used as file names, or the node cannot be made.
pub fn create_node(rendezvous: &Rendezvous) -> Result<Node<Service>, TransportError> {
    const ACTION: &str = "create the iceoryx2 node";
    set_log_level_from_env_or(LogLevel::Fatal);
    let mut config = Config::default();
    config.global.prefix = FileName::new(rendezvous.iceoryx2_prefix.as_bytes()).map_err(failed(ACTION))?;
    config.global.set_root_path(&Path::new(rendezvous.iceoryx2_root.as_bytes()).map_err(failed(ACTION))?);
    // Dead processes are cleaned up by one thread of the daemon, off everybody's way.
    config.global.node.cleanup_dead_nodes_on_creation = false;
    config.global.node.cleanup_dead_nodes_on_destruction = false;
    config.global.service.cleanup_dead_nodes_on_open = false;
    NodeBuilder::new()
        .config(&config)
        .signal_handling_mode(SignalHandlingMode::Disabled)
        .create::<Service>()
        .map_err(failed(ACTION))
}

/// The number of the processor that this thread runs on.
pub fn processor() -> usize {
    rustix::thread::sched_getcpu()
}

/// A service name.
///
/// # Errors
/// When iceoryx2 does not take the name.
pub fn service_name(name: &str) -> Result<ServiceName, TransportError> {
    ServiceName::new(name).map_err(failed("name a service"))
}

/// Nanoseconds of the host's monotonic clock: the same for all of its processes.
pub fn monotonic_nanoseconds() -> u64 {
    let now = rustix::time::clock_gettime(rustix::time::ClockId::Monotonic);
    // The clock starts at 0 when the host does.
    now.tv_sec.unsigned_abs() * 1_000_000_000 + now.tv_nsec.unsigned_abs()
}

/// Turns an error of a lower layer into a [`TransportError`].
pub fn failed<E: Display>(action: &'static str) -> impl Fn(E) -> TransportError {
    move |cause| TransportError::new(action, cause)
}

/// Why [`wait`] returned.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Woken {
    /// The listener has been notified, or a signal came: look again.
    Notified,
    /// The other side of the stream is gone.
    HungUp,
    /// The time is over.
    TimedOut,
}

/// Takes the notifications that have come. What they were for must be looked for once more before the next [`wait`].
///
/// This is done before a side sleeps, not when it wakes: then nobody waits for it.
///
/// # Errors
/// When the listener cannot be emptied.
pub fn forget_notifications(listener: &Listener) -> Result<(), TransportError> {
    listener.try_wait(|_| {}).map(drop).map_err(failed("take a notification"))
}

/// Sleeps while the listener has no notification, until the other end of `stream` is closed or the time is over (`None`: never).
///
/// # Errors
/// When the system cannot wait on the two.
pub fn wait(listener: &Listener, stream: BorrowedFd<'_>, timeout: Option<Duration>) -> Result<Woken, TransportError> {
    // SAFETY: the listener owns the descriptor and outlives this borrow of it, which ends with this function.
    let listener_fd = unsafe { BorrowedFd::borrow_raw(listener.file_descriptor().native_handle()) };
    let mut fds = [PollFd::new(&listener_fd, PollFlags::IN), PollFd::new(&stream, PollFlags::RDHUP)];
    let timeout = timeout.map(timespec);
    match poll(&mut fds, timeout.as_ref()) {
        Ok(0) => return Ok(Woken::TimedOut),
        Ok(_) => {}
        Err(rustix::io::Errno::INTR) => return Ok(Woken::Notified),
        Err(error) => return Err(TransportError::new("wait for the other side", error)),
    }
    Ok(if fds[1].revents().is_empty() { Woken::Notified } else { Woken::HungUp })
}

fn timespec(duration: Duration) -> Timespec {
    Timespec {
        tv_sec: i64::try_from(duration.as_secs()).unwrap_or(i64::MAX),
        tv_nsec: i64::from(duration.subsec_nanos()),
    }
}

/// Whether the other end of a stream is closed.
pub fn is_hung_up(stream: BorrowedFd<'_>) -> bool {
    let mut fds = [PollFd::new(&stream, PollFlags::RDHUP)];
    matches!(poll(&mut fds, Some(&timespec(Duration::ZERO))), Ok(count) if count > 0)
}

/// A message that the host's shared memory cannot take: a write there would be a bus error.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SharedMemoryShort {
    /// Bytes needed, the reserve included.
    pub needed: u64,
    /// Bytes free.
    pub free: u64,
}

/// Checks that shared memory has room for `bytes` more and a reserve.
///
/// # Errors
/// [`SharedMemoryShort`] when it has not.
pub fn check_shared_memory(bytes: u64) -> Result<(), SharedMemoryShort> {
    let needed = bytes.saturating_add(MIN_FREE_SHARED_MEMORY);
    // Where /dev/shm cannot be asked, nothing is known against writing.
    let Ok(space) = rustix::fs::statvfs("/dev/shm") else { return Ok(()) };
    let free = space.f_bavail.saturating_mul(space.f_frsize);
    if free < needed { Err(SharedMemoryShort { needed, free }) } else { Ok(()) }
}

/// The two ends of a stream inside one process: dropping one end wakes whoever [`wait`]s with the other.
///
/// # Errors
/// When the system has no descriptor left.
pub fn stop_pair() -> io::Result<(OwnedFd, OwnedFd)> {
    let (a, b) = std::os::unix::net::UnixStream::pair()?;
    Ok((a.into(), b.into()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn short_waits_are_looked_through_and_one_long_wait_does_not_end_that() {
        let waits = Waits::default();
        let asleep_after = waits.patience();
        waits.learn(100_000);
        assert_eq!(waits.patience(), Duration::from_micros(160));
        waits.learn(5_000_000);
        assert_eq!(waits.patience(), Duration::from_micros(160));
        waits.learn(5_000_000);
        assert_eq!(waits.patience(), asleep_after);
    }
}
