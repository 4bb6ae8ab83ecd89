//! The step channel of a scene: transforms out, reports in.

use std::fmt;
use std::mem::MaybeUninit;
use std::os::fd::BorrowedFd;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use collided_protocol::limits::{MAX_REPORTS_HELD, MAX_STEPS_IN_FLIGHT};
use collided_protocol::names::{reply_service, step_service, wake_service};
use collided_protocol::report::ReportHeader;
use collided_protocol::step::{
    MOTION_LINEAR, ROWS_WORDS, RigidRecord, Rows, STEP_BATCH, STEP_DENSE, STEP_SPARSE, STOP_NEVER, StepHeader,
    VelocityRecord, Word, batch_words, payload_words, step_words,
};
use collided_protocol::{ErrorCode, PROTOCOL_VERSION, WireError};
use iceoryx2::port::client::RequestSendError;
use iceoryx2::prelude::*;

use crate::batch::{Batch, BatchReport};
use crate::connect::Client;
use crate::error::{Error, TransportError};
use crate::report::{Held, Report};
use crate::scene::BodyId;
use crate::transport::{
    self, EmptyStepRequest, EventService, Listener, Notifier, StepClient, StepPending, StepRequest, StepResponse,
    StepService, Waits, Woken, failed, look_for,
};

/// How long a waiting client sleeps at most: another thread that waits on the same scene may take its wake-up.
const SLICE: Duration = Duration::from_millis(20);
/// Room for the transforms of this many bodies is made at once; more when a step needs it.
const INITIAL_BODIES: usize = 64;

/// The ports of one scene.
pub(crate) struct StepChannel {
    scene: u32,
    requests: StepClient,
    wake: Notifier,
    reply: Listener,
    sequence: AtomicU64,
    reports_held: Arc<AtomicUsize>,
    /// How long the daemon took for the steps that were collected last.
    waits: Waits,
}

impl fmt::Debug for StepChannel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("StepChannel").field("scene", &self.scene).finish_non_exhaustive()
    }
}

/// What a step brings. What is left out stays as it is.
///
/// ```
/// use collided_client::{BodyId, RigidMotion, StepInput};
/// let door = RigidMotion { axis: [0.0, 0.0, 1.0], angle: 1.5, ..RigidMotion::default() };
/// let step = StepInput { rigid: &[(BodyId(3), door)], delta_time: 0.001, ..StepInput::default() };
/// ```
#[derive(Debug, Clone, Copy, Default)]
pub struct StepInput<'a> {
    /// Where bodies are at the end of the step; they get there along straight lines.
    pub transforms: &'a [(BodyId, Rows)],
    /// Bodies that turn on their way, from where they are; none of these may be in `transforms`.
    pub rigid: &'a [(BodyId, RigidMotion)],
    /// Velocities at the end of the step, for the effect `response`. A body keeps its velocity until another one comes.
    pub velocities: &'a [(BodyId, Velocity)],
    /// The time since the last step, in the caller's unit; 0 when unknown.
    pub delta_time: f64,
}

/// A rigid motion within a step: at the time t from 0 to 1 a vertex that was at v is at
/// `centre + t·translate + Rot(axis, angle·t)·(v − centre)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RigidMotion {
    /// Direction of the axis, of any length but zero; world.
    pub axis: [f64; 3],
    /// A point on the axis; world.
    pub centre: [f64; 3],
    /// In radians, counterclockwise seen against the axis; may exceed π.
    pub angle: f64,
    /// How far the centre moves; world.
    pub translate: [f64; 3],
}

impl Default for RigidMotion {
    /// No motion, about the world's z axis.
    fn default() -> Self {
        RigidMotion { axis: [0.0, 0.0, 1.0], centre: [0.0; 3], angle: 0.0, translate: [0.0; 3] }
    }
}

/// How fast a body moves.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Velocity {
    /// Of its centre of mass; world.
    pub linear: [f64; 3],
    /// In radians over the time unit, about the world's axes.
    pub angular: [f64; 3],
}

impl StepInput<'_> {
    fn word_count(&self) -> usize {
        payload_words(STEP_SPARSE, self.transforms.len(), self.rigid.len(), self.velocities.len())
    }

    /// The words of the payload.
    fn words(&self) -> impl Iterator<Item = Word> {
        let rows = self.transforms.iter().flat_map(|(_, rows)| words_of::<_, ROWS_WORDS>(*rows));
        let rigid = self.rigid.iter().map(rigid_record).flat_map(words_of::<_, { count_of::<RigidRecord>() }>);
        let velocities =
            self.velocities.iter().map(velocity_record).flat_map(words_of::<_, { count_of::<VelocityRecord>() }>);
        words_of_ids(self.transforms, |(body, _)| *body).chain(rows).chain(rigid).chain(velocities)
    }
}

/// How many words a record takes.
const fn count_of<T>() -> usize {
    size_of::<T>() / size_of::<Word>()
}

fn words_of<T: bytemuck::NoUninit, const N: usize>(record: T) -> [Word; N]
where
    [Word; N]: bytemuck::Pod,
{
    bytemuck::cast(record)
}

/// Ids as words, two to a word.
pub(crate) fn words_of_ids<T>(of: &[T], id: impl Fn(&T) -> BodyId) -> impl Iterator<Item = Word> {
    of.chunks(2).map(move |two| bytemuck::cast([id(&two[0]).0, two.get(1).map_or(0, |second| id(second).0)]))
}

fn rigid_record(&(body, RigidMotion { axis, centre, angle, translate }): &(BodyId, RigidMotion)) -> RigidRecord {
    RigidRecord { body: body.0, reserved: 0, axis, centre, angle, translate }
}

fn velocity_record(&(body, Velocity { linear, angular }): &(BodyId, Velocity)) -> VelocityRecord {
    VelocityRecord { body: body.0, reserved: 0, linear, angular }
}

/// A step that was sent. Dropping it gives its report up; the step is taken all the same.
#[derive(Debug)]
#[must_use = "the report is given up when this is dropped"]
pub struct Pending {
    client: Client,
    channel: Arc<StepChannel>,
    pending: Option<StepPending>,
}

impl StepChannel {
    /// Opens the services that the daemon has created for a scene.
    pub(crate) fn open(client: &Client, scene: u32) -> Result<StepChannel, Error> {
        let requests = open_step_service(client, scene)?
            .client_builder()
            .initial_max_slice_len(step_words(STEP_SPARSE, INITIAL_BODIES))
            .allocation_strategy(AllocationStrategy::PowerOfTwo)
            .backpressure_strategy(BackpressureStrategy::DiscardData)
            .create()
            .map_err(failed("open a scene's step channel"))?;
        let wake = open_event_service(client, &wake_service(scene))?
            .notifier_builder()
            .create()
            .map_err(failed("open a scene's wake event"))?;
        let reply = open_event_service(client, &reply_service(scene))?
            .listener_builder()
            .create()
            .map_err(failed("open a scene's reply event"))?;
        let (sequence, reports_held, waits) = Default::default();
        Ok(StepChannel { scene, requests, wake, reply, sequence, reports_held, waits })
    }

    pub(crate) fn send_dense(self: &Arc<Self>, client: &Client, transforms: &[Rows]) -> Result<Pending, Error> {
        let (header, words) = (header(STEP_DENSE, transforms.len()), bytemuck::cast_slice::<Rows, Word>(transforms));
        let request = written(self.loan(words.len())?, |memory| transport::copy(memory, words));
        self.send(client, request, header)
    }

    pub(crate) fn send_input(self: &Arc<Self>, client: &Client, input: &StepInput<'_>) -> Result<Pending, Error> {
        let header = StepHeader {
            rigid_count: input.rigid.len() as u32,
            velocity_count: input.velocities.len() as u32,
            delta_time: input.delta_time,
            ..header(STEP_SPARSE, input.transforms.len())
        };
        let request = written(self.loan(input.word_count())?, |memory| transport::fill(memory, input.words()));
        self.send(client, request, header)
    }

    pub(crate) fn send_written(
        self: &Arc<Self>,
        client: &Client,
        count: usize,
        write: impl FnOnce(&mut [Rows]),
    ) -> Result<Pending, Error> {
        let (header, words) = (header(STEP_DENSE, count), step_words(STEP_DENSE, count));
        self.check_room(words)?;
        let mut request = self.requests.loan_slice(words).map_err(loan_error)?;
        write(bytemuck::cast_slice_mut(request.payload_mut()));
        self.send(client, request, header)
    }

    pub(crate) fn send_batch(self: &Arc<Self>, client: &Client, batch: &Batch<'_>) -> Result<Pending, Error> {
        let count = batch.count()?;
        let header = StepHeader {
            candidate_count: count as u32,
            stop_at: batch.stop_at.map_or(STOP_NEVER, |verdict| STOP_NEVER + 1 + verdict as u32),
            ..header(STEP_BATCH, batch.bodies.len())
        };
        let request = written(self.loan(batch_words(batch.bodies.len(), count))?, |memory| {
            transport::fill(memory, batch.words())
        });
        self.send(client, request, header)
    }

    /// Memory for so many words.
    fn loan(&self, words: usize) -> Result<EmptyStepRequest, Error> {
        self.check_room(words)?;
        self.requests.loan_slice_uninit(words).map_err(loan_error)
    }

    fn check_room(&self, words: usize) -> Result<(), Error> {
        if self.reports_held.load(Ordering::Relaxed) >= MAX_REPORTS_HELD {
            return Err(Error::TooManyReportsHeld);
        }
        if words <= step_words(STEP_SPARSE, INITIAL_BODIES) {
            return Ok(());
        }
        transport::check_shared_memory(words as u64 * size_of::<Word>() as u64)
            .map_err(|short| Error::OutOfSharedMemory { needed: short.needed, free: short.free })
    }

    fn send(self: &Arc<Self>, client: &Client, mut request: StepRequest, header: StepHeader) -> Result<Pending, Error> {
        let sequence = self.sequence.fetch_add(1, Ordering::Relaxed);
        *request.user_header_mut() = StepHeader { sequence, ..header };
        let pending = request.send().map_err(send_error)?;
        if pending.number_of_server_connections() == 0 {
            return Err(self.undelivered(client));
        }
        self.wake.notify().map_err(failed("wake the daemon"))?;
        Ok(Pending { client: client.clone(), channel: Arc::clone(self), pending: Some(pending) })
    }

    /// Why a step did not reach the daemon.
    fn undelivered(&self, client: &Client) -> Error {
        match self.absence(client) {
            Ok(()) => Error::TooManyInFlight,
            Err(error) => error,
        }
    }

    /// Asks the daemon whether the scene is there.
    fn absence(&self, client: &Client) -> Result<(), Error> {
        if transport::is_hung_up(client.stream()) {
            return Err(Error::DaemonGone);
        }
        let status = client.status()?;
        if status.scenes.iter().any(|scene| scene.scene == self.scene) {
            return Ok(());
        }
        Err(Error::Refused(WireError::new(
            ErrorCode::UnknownScene,
            format!("scene {} was dropped", self.scene),
            "create it again",
        )))
    }
}

impl Pending {
    /// Waits for the report, at most `timeout` (zero: looks once). After [`Error::Deadline`] it may be called again.
    ///
    /// # Errors
    /// As [`Scene::step`](crate::Scene::step); [`Error::AlreadyCollected`] when the report was collected before.
    pub fn collect(&mut self, timeout: Duration) -> Result<Report, Error> {
        let (response, held) = self.collect_response(timeout)?;
        Report::new(response, held)
    }

    /// The same for a batch of so many candidates.
    pub(crate) fn collect_batch(&mut self, count: usize, timeout: Duration) -> Result<BatchReport, Error> {
        let (response, held) = self.collect_response(timeout)?;
        BatchReport::new(response, held, count)
    }

    fn collect_response(&mut self, timeout: Duration) -> Result<(StepResponse, Held), Error> {
        let pending = self.pending.as_ref().ok_or(Error::AlreadyCollected)?;
        let answer = self.channel.wait(&self.client, pending, timeout);
        if matches!(answer, Err(Error::Deadline { .. })) {
            return Err(Error::Deadline { waited: timeout });
        }
        self.pending = None;
        let response = answer?;
        self.channel.waits.learn(response.user_header().times.total);
        Ok((response, Held::new(&self.channel.reports_held)))
    }
}

impl StepChannel {
    fn wait(&self, client: &Client, pending: &StepPending, timeout: Duration) -> Result<StepResponse, Error> {
        let start = Instant::now();
        if let Some(response) = look(pending, self.waits.patience().min(timeout))? {
            return Ok(response);
        }
        let mut hung_up = false;
        loop {
            // A response that comes from here on wakes this thread again.
            transport::forget_notifications(&self.reply)?;
            if let Some(response) = look(pending, Duration::ZERO)? {
                return Ok(response);
            }
            if hung_up {
                return Err(Error::DaemonGone);
            }
            if !pending.is_connected() {
                return self.closed(client, pending);
            }
            let left = timeout.saturating_sub(start.elapsed());
            if left.is_zero() {
                return Err(Error::Deadline { waited: timeout });
            }
            hung_up = self.sleep(client.stream(), left)? == Woken::HungUp;
            if let Some(response) = look(pending, Duration::ZERO)? {
                return Ok(response);
            }
        }
    }

    fn sleep(&self, stream: BorrowedFd<'_>, left: Duration) -> Result<Woken, TransportError> {
        transport::wait(&self.reply, stream, Some(left.min(SLICE)))
    }

    /// The daemon has let the step go: with an answer that came just now, or without one.
    fn closed(&self, client: &Client, pending: &StepPending) -> Result<StepResponse, Error> {
        if let Some(response) = look(pending, Duration::ZERO)? {
            return Ok(response);
        }
        self.absence(client)?;
        Err(Error::Refused(WireError::new(
            ErrorCode::Internal,
            format!("the daemon let a step of scene {} go without an answer", self.scene),
            "look at the daemon's log",
        )))
    }
}

/// The header of a step, which begins here.
fn header(kind: u32, transform_count: usize) -> StepHeader {
    StepHeader {
        protocol: PROTOCOL_VERSION,
        kind,
        transform_count: transform_count as u32,
        candidate_count: 1,
        motion: MOTION_LINEAR,
        began: transport::monotonic_nanoseconds(),
        processor: 1 + transport::processor() as u32,
        ..StepHeader::default()
    }
}

/// Looks for the response at least once, and then for as long as `time`.
fn look(pending: &StepPending, time: Duration) -> Result<Option<StepResponse>, Error> {
    look_for(time, || Ok(pending.receive().map_err(failed("receive a report"))?))
}

/// A request whose words `write` has written, all of them.
fn written(mut request: EmptyStepRequest, write: impl FnOnce(&mut [MaybeUninit<Word>])) -> StepRequest {
    write(request.payload_mut());
    // SAFETY: every word of the payload was written.
    unsafe { request.assume_init() }
}

fn loan_error(error: iceoryx2::port::LoanError) -> Error {
    match error {
        iceoryx2::port::LoanError::OutOfMemory => Error::TooManyInFlight,
        other => TransportError::new("loan memory for a step", other).into(),
    }
}

fn send_error(error: RequestSendError) -> Error {
    match error {
        RequestSendError::ExceedsMaxActiveRequests => Error::TooManyInFlight,
        other => TransportError::new("send a step", other).into(),
    }
}

fn open_step_service(client: &Client, scene: u32) -> Result<StepService, TransportError> {
    client
        .node()
        .service_builder(&transport::service_name(&step_service(scene))?)
        .request_response::<[Word], [Word]>()
        .request_user_header::<StepHeader>()
        .response_user_header::<ReportHeader>()
        .max_active_requests_per_client(MAX_STEPS_IN_FLIGHT)
        .open()
        .map_err(failed("open a scene's step channel"))
}

fn open_event_service(client: &Client, name: &str) -> Result<EventService, TransportError> {
    client
        .node()
        .service_builder(&transport::service_name(name)?)
        .event()
        .open()
        .map_err(failed("open a scene's event"))
}
