//! Objects from mesh files and from memory: read here, built within the budget.

use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::thread;
use std::time::{Duration, Instant};

use collided_kernel::{Object, ObjectError, PolygonMesh, Workforce};
use collided_protocol::control::{ObjectInfo, Target};
use collided_protocol::{ErrorCode, WireError};

use crate::budget::Slot;
use crate::state::Daemon;
use crate::{kernel_errors, mesh_file};

/// How often a client is told of the progress.
const PROGRESS_INTERVAL: Duration = Duration::from_millis(50);
/// A client is told that the daemon is at work at least this often.
const HEARTBEAT: Duration = Duration::from_secs(1);

/// Is told the stage, how much is done, and the total; breaks when nobody wants the object any more.
pub type Progress<'a> = &'a mut dyn FnMut(&str, u64, u64) -> ControlFlow<()>;

/// Loads an object from a mesh file.
///
/// # Errors
/// What [`Databases::check_target`](crate::database::Databases::check_target) says, `MeshUnreadable`, `MeshMalformed`, and
/// what the kernel finds wrong with the mesh.
pub fn load(
    daemon: &Arc<Daemon>,
    target: &Target,
    path: &str,
    progress: Progress<'_>,
) -> Result<ObjectInfo, WireError> {
    daemon.databases.check_target(target)?;
    let path = Path::new(path);
    if !path.is_absolute() {
        return Err(WireError::new(
            ErrorCode::MeshUnreadable,
            format!("the mesh file's path {} is not absolute", path.display()),
            "send an absolute path: the daemon's working directory is another",
        ));
    }
    let (mut last, mut wanted) = (Instant::now(), ControlFlow::Continue(()));
    let mut throttled = |done, total| {
        if last.elapsed() >= PROGRESS_INTERVAL || done == total {
            last = Instant::now();
            wanted = progress("read", done, total);
        }
    };
    let mesh = mesh_file::read(path, &mut throttled).map_err(|error| file_error(&error))?;
    if wanted.is_break() {
        return Err(unwanted(target));
    }
    build(daemon, target, mesh, progress)
}

fn file_error(error: &mesh_file::MeshFileError) -> WireError {
    if error.is_unreadable() {
        return WireError::new(
            ErrorCode::MeshUnreadable,
            error.to_string(),
            "name a mesh file (.obj, .stl, .ply or .off) that the daemon's user can read",
        );
    }
    WireError::new(ErrorCode::MeshMalformed, error.to_string(), "correct the file, or export it anew")
}

enum Event {
    Advanced(u64, u64),
    Built(Box<Result<Object, ObjectError>>),
    Panicked,
}

/// Builds an object within the budget, and puts it into its database.
///
/// # Errors
/// What the kernel finds wrong with the mesh, and `DuplicateObject`.
pub fn build(
    daemon: &Arc<Daemon>,
    target: &Target,
    mesh: PolygonMesh,
    progress: Progress<'_>,
) -> Result<ObjectInfo, WireError> {
    let (events, received) = channel();
    let (order, building) = (target.order, Arc::clone(daemon));
    let build = move || {
        let slot = building.budget.slot();
        let (started, intervals_told) = (Instant::now(), AtomicU64::new(0));
        let told = BuildProgress { slot, started, intervals_told, events: events.clone() };
        let built = catch_unwind(AssertUnwindSafe(|| Object::build(mesh, order, &told)));
        let _ = events.send(built.map_or(Event::Panicked, |built| Event::Built(Box::new(built))));
    };
    thread::Builder::new().name("build".to_owned()).spawn(build).map_err(|error| no_thread(target, &error))?;
    let mut last = (0, 0);
    loop {
        match received.recv_timeout(HEARTBEAT) {
            Ok(Event::Advanced(done, total)) => last = (done, total),
            Ok(Event::Built(built)) => {
                let object = built.map_err(|error| kernel_errors::object_error(&error, target))?;
                return daemon.databases.insert(target, object);
            }
            Ok(Event::Panicked) | Err(RecvTimeoutError::Disconnected) => return Err(build_failed(target)),
            Err(RecvTimeoutError::Timeout) => {}
        }
        // The build goes on to its end, and is then let go.
        if progress("build", last.0, last.1).is_break() || daemon.is_shutting_down() {
            return Err(unwanted(target));
        }
    }
}

fn unwanted(target: &Target) -> WireError {
    WireError::new(
        ErrorCode::ShuttingDown,
        format!(
            "object {:?} of database {:?} is not kept: its client or the daemon ends",
            target.object, target.database
        ),
        "load it again",
    )
}

fn build_failed(target: &Target) -> WireError {
    WireError::new(
        ErrorCode::Internal,
        format!("building object {:?} of database {:?} failed inside the daemon", target.object, target.database),
        "report this as a bug, with the mesh",
    )
}

fn no_thread(target: &Target, error: &std::io::Error) -> WireError {
    WireError::new(
        ErrorCode::OutOfMemory,
        format!("no thread to build object {:?} of database {:?}: {error}", target.object, target.database),
        "end other work on this host, and try again",
    )
}

/// Builds within the budget, and passes the kernel's progress on, at most once an interval: a worker must not wait for a client's socket.
struct BuildProgress<'b> {
    slot: Slot<'b>,
    started: Instant,
    intervals_told: AtomicU64,
    events: Sender<Event>,
}

impl Workforce for BuildProgress<'_> {
    fn threads(&self) -> usize {
        self.slot.threads()
    }

    fn share(&self, job: &mut (dyn FnMut() + Send)) {
        self.slot.share(job);
    }
}

impl collided_kernel::Progress for BuildProgress<'_> {
    fn advanced(&self, done: u64, total: u64) {
        let interval = (self.started.elapsed().as_millis() / PROGRESS_INTERVAL.as_millis()) as u64;
        if self.intervals_told.fetch_max(interval, Ordering::Relaxed) < interval {
            let _ = self.events.send(Event::Advanced(done, total));
        }
    }
}
