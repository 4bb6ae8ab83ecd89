//! The step channel of a scene: one thread that waits for its own wake-up and answers steps.

use std::os::fd::{AsFd, OwnedFd};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use collided_client::TransportError;
use collided_client::transport::{
    self, EventService, Listener, Notifier, SHORT_STEP, Service, StepActive, StepServer, StepService, Waits, Woken,
    failed, look_for,
};
use collided_kernel::{Budget, CostPerPair, StepError};
use collided_protocol::limits::{MAX_REPORTS_HELD, MAX_STEPS_IN_FLIGHT};
use collided_protocol::names::{reply_service, step_service, wake_service};
use collided_protocol::report::{ReportHeader, StageTimes};
use collided_protocol::step::{STEP_BATCH, StepHeader, Word};
use collided_protocol::{ErrorCode, WireError};
use iceoryx2::prelude::{AllocationStrategy, BackpressureStrategy, Node};

use crate::budget::Slot;
use crate::kernel_errors;
use crate::processor::Neighbour;
use crate::report_writer::{self, INITIAL_REPORT_WORDS};
use crate::scene::{Scene, SharedScene};
use crate::state::Daemon;
use crate::step_payload::{self, Message};

/// Chunks of memory for reports: those that a client may hold while it has more steps under way, the one being written, and
/// one that travels back.
const REPORT_CHUNKS: usize = MAX_REPORTS_HELD + MAX_STEPS_IN_FLIGHT + 2;

/// A scene and its thread. Dropping it ends both: a step under way is finished first.
pub struct RunningScene {
    /// The scene, for the connection of its client.
    pub scene: Arc<SharedScene>,
    stop: Option<OwnedFd>,
    thread: Option<JoinHandle<()>>,
}

/// What the thread owns.
struct SceneThread {
    daemon: Arc<Daemon>,
    scene: Arc<SharedScene>,
    ports: Ports,
    stopped: OwnedFd,
    neighbour: Neighbour,
    /// Whether it has not slept since the last step.
    is_awake: bool,
    /// When the last step was answered.
    answered: Instant,
    /// How long the client takes from a report to the next step.
    waits: Waits,
    /// What is copied out of the client's reach.
    copied: step_payload::Copied,
    /// What a pair costs when the report is known: the daemon writes it, and the client reads it.
    report_cost: CostPerPair,
}

/// The daemon's ports of a scene, with the services they belong to.
struct Ports {
    requests: StepServer,
    wake: Listener,
    reply: Notifier,
    _services: (StepService, EventService, EventService),
}

impl RunningScene {
    /// Creates the services of scene `id` and starts its thread.
    ///
    /// # Errors
    /// `OutOfMemory` when shared memory has no room, `Internal` when iceoryx2 or the system refuses.
    pub fn start(daemon: &Arc<Daemon>, id: u32, scene: SharedScene) -> Result<RunningScene, WireError> {
        check_memory()?;
        let ports = Ports::create(&daemon.node, id).map_err(|error| internal(&error))?;
        let (stop, stopped) = transport::stop_pair().map_err(|error| internal(&error))?;
        let scene = Arc::new(scene);
        let (daemon, thread_scene) = (Arc::clone(daemon), Arc::clone(&scene));
        let thread = SceneThread {
            daemon,
            scene: thread_scene,
            ports,
            stopped,
            neighbour: Neighbour::default(),
            is_awake: false,
            answered: Instant::now(),
            waits: Waits::default(),
            copied: step_payload::Copied::default(),
            report_cost: CostPerPair::default(),
        };
        let thread = thread::Builder::new()
            .name(format!("scene-{id}"))
            .spawn(move || thread.run())
            .map_err(|error| internal(&error))?;
        Ok(RunningScene { scene, stop: Some(stop), thread: Some(thread) })
    }
}

impl Drop for RunningScene {
    fn drop(&mut self) {
        self.scene.end();
        drop(self.stop.take());
        if let Some(thread) = self.thread.take()
            && thread.join().is_err()
        {
            tracing::error!("a scene's thread has panicked");
        }
    }
}

fn check_memory() -> Result<(), WireError> {
    let bytes = REPORT_CHUNKS * INITIAL_REPORT_WORDS * size_of::<Word>();
    transport::check_shared_memory(bytes as u64).map_err(|short| {
        WireError::new(
            ErrorCode::OutOfMemory,
            format!(
                "a scene needs {} bytes of shared memory with the reserve, and {} are free",
                short.needed, short.free
            ),
            "enlarge /dev/shm, or drop other scenes",
        )
    })
}

fn internal(error: &dyn std::fmt::Display) -> WireError {
    WireError::new(ErrorCode::Internal, format!("the scene cannot be started: {error}"), "look at the daemon's log")
}

impl Ports {
    fn create(node: &Node<Service>, scene: u32) -> Result<Ports, TransportError> {
        let steps = create_step_service(node, scene)?;
        let wake = create_event_service(node, &wake_service(scene))?;
        let reply = create_event_service(node, &reply_service(scene))?;
        Ok(Ports {
            requests: create_server(&steps)?,
            wake: wake.listener_builder().create().map_err(failed("create a scene's wake event"))?,
            reply: reply.notifier_builder().create().map_err(failed("create a scene's reply event"))?,
            _services: (steps, wake, reply),
        })
    }
}

fn create_step_service(node: &Node<Service>, scene: u32) -> Result<StepService, TransportError> {
    node.service_builder(&transport::service_name(&step_service(scene))?)
        .request_response::<[Word], [Word]>()
        .request_user_header::<StepHeader>()
        .response_user_header::<ReportHeader>()
        .max_clients(1)
        .max_servers(1)
        .max_nodes(2)
        .max_active_requests_per_client(MAX_STEPS_IN_FLIGHT)
        .max_loaned_requests(1)
        .max_response_buffer_size(1)
        .max_borrowed_responses_per_pending_response(MAX_REPORTS_HELD)
        .enable_safe_overflow_for_requests(false)
        .enable_safe_overflow_for_responses(false)
        // A step whose client no longer waits for the report still moves the bodies.
        .enable_fire_and_forget_requests(true)
        .create()
        .map_err(failed("create a scene's step service"))
}

fn create_server(steps: &StepService) -> Result<StepServer, TransportError> {
    steps
        .server_builder()
        .initial_max_slice_len(INITIAL_REPORT_WORDS)
        .allocation_strategy(AllocationStrategy::PowerOfTwo)
        .max_loaned_responses_per_request(1)
        .override_response_preallocation(|_| REPORT_CHUNKS)
        // A client that is dead or gone must not hold the daemon up.
        .backpressure_strategy(BackpressureStrategy::DiscardData)
        .create()
        .map_err(failed("create a scene's step server"))
}

fn create_event_service(node: &Node<Service>, name: &str) -> Result<EventService, TransportError> {
    node.service_builder(&transport::service_name(name)?)
        .event()
        .max_notifiers(1)
        .max_listeners(1)
        .max_nodes(2)
        .event_id_max_value(1)
        .create()
        .map_err(failed("create a scene's event service"))
}

impl SceneThread {
    fn run(mut self) {
        if let Err(error) = self.answer_until_stopped() {
            tracing::error!(%error, "a scene's step channel failed");
            self.scene.end();
        }
        // The client that waits for a report now learns that no server is left.
        let Ports { requests, reply, .. } = self.ports;
        drop(requests);
        let _ = reply.notify();
    }

    /// What a step takes besides the kernel, whatever it finds: what it took the client to write it, and what an answer takes.
    fn outside(header: &StepHeader, words: usize, budget: Duration) -> Duration {
        /// Measured (benchmark `budgets`): to write a word and to have it in the other process, at most. What a step waited for others is
        /// not its own, and a client may write what it likes.
        const WORD: f64 = 3.5e-9;
        const MESSAGE: Duration = Duration::from_micros(10);
        const ANSWER: Duration = Duration::from_micros(30);
        const WAKE_UP: Duration = Duration::from_micros(60);
        let answer = if budget > SHORT_STEP + ANSWER { ANSWER + WAKE_UP } else { ANSWER };
        let written = under_way(header).unwrap_or(Duration::MAX);
        written.min(MESSAGE + Duration::from_secs_f64(words as f64 * WORD)) + answer
    }

    fn answer_until_stopped(&mut self) -> Result<(), TransportError> {
        loop {
            while self.answer_next(self.waits.patience())? {}
            // A step that comes from here on wakes this thread again.
            transport::forget_notifications(&self.ports.wake)?;
            if self.answer_next(Duration::ZERO)? {
                continue;
            }
            if transport::wait(&self.ports.wake, self.stopped.as_fd(), None)? == Woken::HungUp {
                return Ok(());
            }
            self.is_awake = false;
        }
    }

    /// Answers the next step, if one comes within as long as `patience`.
    fn answer_next(&mut self, patience: Duration) -> Result<bool, TransportError> {
        if self.scene.has_ended() {
            return Ok(false);
        }
        let received = look_for(patience, || self.ports.requests.receive().map_err(failed("receive a step")))?;
        let Some(active) = received else { return Ok(false) };
        let start = Instant::now();
        self.waits.learn((start - self.answered).as_nanos() as u64);
        if self.is_awake {
            self.neighbour.step_has_come(active.user_header().processor);
        }
        self.is_awake = true;
        self.answer(&active, start);
        drop(active);
        self.ports.reply.notify().map_err(failed("wake a client"))?;
        self.answered = Instant::now();
        Ok(true)
    }

    fn answer(&mut self, active: &StepActive, start: Instant) {
        // The client can still write what it has sent: the header is copied, and the length asked for once.
        let header: StepHeader = *active.user_header();
        let words: &[Word] = active.payload();
        // A batch moves nothing: it is no step.
        let is_step = header.kind != STEP_BATCH;
        let steps = if is_step { self.scene.count_step() } else { self.scene.step_count() };
        let reply = report_writer::header(header.sequence, steps);
        let scene = Arc::clone(&self.scene);
        if let Err(error) = self.step(&mut scene.lock(), active, &header, words, reply, start) {
            tracing::debug!(%error, "a step was refused");
            if let Err(error) = report_writer::send_error(active, reply, &error) {
                tracing::warn!(%error, "a step could not be answered");
            }
        }
    }

    fn step(
        &mut self,
        scene: &mut Scene,
        active: &StepActive,
        header: &StepHeader,
        words: &[Word],
        reply: ReportHeader,
        start: Instant,
    ) -> Result<(), WireError> {
        // Without a budget no time is looked at for it: that takes as long as the kernel does for two bodies.
        let outside = scene.budget.map_or(Duration::ZERO, |budget| Self::outside(header, words.len(), budget));
        let message = step_payload::read(header, words, &mut self.copied)?;
        if scene.broken {
            return Err(broken());
        }
        scene.refresh_objects(&self.daemon.databases);
        let slot = self.daemon.budget.slot();
        scene.kernel.set_budget(scene.budget.map_or(Budget::Unlimited, |budget| {
            Budget::Nanoseconds(budget.saturating_sub(start.elapsed() + outside).as_nanos() as u64)
        }));
        scene.kernel.set_report_cost(self.report_cost);
        let mut answer = Answer { active, reply, start, written: None };
        let kernel = &mut scene.kernel;
        let outcome = catch_unwind(AssertUnwindSafe(|| answer.compute(kernel, message, &slot)));
        if let Some((written, pairs)) = answer.written.filter(|_| scene.budget.is_some()) {
            self.report_cost.learn(2 * written.elapsed().as_nanos() as u64, pairs);
        }
        match outcome {
            Ok(Ok(sent)) => sent,
            Ok(Err(error)) => Err(kernel_errors::step_error(&error, &|id| scene.body_name(id))),
            Err(_) => {
                scene.broken = true;
                Err(broken())
            }
        }
    }
}

/// How long ago a client began to write a step, if it says so.
fn under_way(header: &StepHeader) -> Option<Duration> {
    // Read once: the client can still write it.
    let began = header.began;
    (began != 0).then(|| Duration::from_nanos(transport::monotonic_nanoseconds().saturating_sub(began)))
}

/// The answer to a step under way.
struct Answer<'s> {
    active: &'s StepActive,
    reply: ReportHeader,
    start: Instant,
    /// When writing began, and how many pairs there were.
    written: Option<(Instant, u64)>,
}

impl Answer<'_> {
    /// Computes and sends a report.
    fn compute(
        &mut self,
        kernel: &mut collided_kernel::Scene,
        message: Message<'_>,
        slot: &Slot<'_>,
    ) -> Result<Result<(), WireError>, StepError> {
        let (active, reply, start) = (self.active, self.reply, self.start);
        let written = &mut self.written;
        match message {
            Message::Step(input) => {
                let report = kernel.step(input, slot)?;
                let (written, _) = *written.insert((Instant::now(), report.pairs().len() as u64));
                Ok(report_writer::send_report(active, reply, &report, |times| complete(times, written, start)))
            }
            Message::Batch(input) => {
                let report = kernel.batch(&input, slot)?;
                let (written, _) = *written.insert((Instant::now(), 0));
                Ok(report_writer::send_batch(active, reply, &report, |times| complete(times, written, start)))
            }
        }
    }
}

/// The times that are known when the report is written.
fn complete(times: &mut StageTimes, written: Instant, start: Instant) {
    let now = Instant::now();
    times.report = (now - written).as_nanos() as u64;
    times.total = (now - start).as_nanos() as u64;
}

fn broken() -> WireError {
    WireError::new(
        ErrorCode::Internal,
        "a step failed inside the daemon, and the scene can no longer be stepped",
        "create the scene again, and report this as a bug with the scene",
    )
}
