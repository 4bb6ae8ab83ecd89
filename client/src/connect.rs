//! The connection to a daemon, and its control channel.

use std::io;
use std::net::Shutdown;
use std::os::fd::{AsFd, BorrowedFd};
use std::os::unix::fs::MetadataExt;
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use collided_protocol::control::{ObjectInfo, Reply, Request, Status};
use collided_protocol::names::{DEFAULT_INSTANCE, RENDEZVOUS_FILE, Rendezvous, SOCKET_FILE};
use collided_protocol::{ErrorCode, ICEORYX2_VERSION, PROTOCOL_VERSION, PROTOCOL_VERSION_MIN, WireError};
use iceoryx2::prelude::Node;
use rustix::process::getuid;

use crate::database::Database;
use crate::error::{Error, TransportError};
use crate::frame::{self, FrameError};
use crate::instance;
use crate::scene::SceneBuilder;
use crate::transport::{self, Service};

const DEFAULT_CONNECT_TIMEOUT: Duration = Duration::from_secs(5);
const DEFAULT_CONTROL_TIMEOUT: Duration = Duration::from_secs(60);
/// How often a client that waits for the daemon to start looks for it.
const RETRY_INTERVAL: Duration = Duration::from_millis(10);
/// Root's user id: whom nothing is kept from.
const ROOT: u32 = 0;

/// A connection to the daemon of one instance. Cheap to clone; clones share the connection.
#[derive(Clone, Debug)]
pub struct Client {
    inner: Arc<Connection>,
}

#[derive(Debug)]
struct Connection {
    /// Held for a request and its replies.
    control: Mutex<()>,
    stream: UnixStream,
    node: Node<Service>,
    control_timeout: Duration,
    epoch: String,
}

/// Settings of a connection. See [`Client::builder`].
#[derive(Debug, Clone)]
pub struct ClientBuilder {
    instance: String,
    directory: Option<PathBuf>,
    name: String,
    connect_timeout: Duration,
    control_timeout: Duration,
}

impl ClientBuilder {
    /// The daemon's instance; `default` unless set.
    #[must_use]
    pub fn instance(mut self, instance: impl Into<String>) -> Self {
        self.instance = instance.into();
        self
    }

    /// The rendezvous directory itself, in place of where the instance is found by the environment.
    #[must_use]
    pub fn directory(mut self, directory: impl Into<PathBuf>) -> Self {
        self.directory = Some(directory.into());
        self
    }

    /// What this client is called in `collided status`; the program's name unless set.
    #[must_use]
    pub fn name(mut self, name: impl Into<String>) -> Self {
        self.name = name.into();
        self
    }

    /// How long to wait for the daemon to be there; 5 s unless set.
    #[must_use]
    pub fn timeout(mut self, timeout: Duration) -> Self {
        self.connect_timeout = timeout;
        self
    }

    /// How long the daemon may stay silent while a control request (not a step) is under way; 60 s unless set.
    /// A long load is not silent: it tells of its progress.
    #[must_use]
    pub fn control_timeout(mut self, timeout: Duration) -> Self {
        self.control_timeout = timeout;
        self
    }

    /// Connects, waiting for the daemon if need be.
    ///
    /// # Errors
    /// [`Error::NoDaemon`], [`Error::ProtocolMismatch`], [`Error::Iceoryx2Mismatch`], [`Error::Refused`] for a bad
    /// instance name, [`Error::Transport`].
    pub fn connect(self) -> Result<Client, Error> {
        let directory = match &self.directory {
            Some(directory) => directory.clone(),
            None => instance::directory(&self.instance).map_err(Error::Refused)?,
        };
        let (rendezvous, stream) = self.find(&directory)?;
        check_versions(&rendezvous)?;
        stream
            .set_read_timeout(Some(self.control_timeout))
            .and_then(|()| stream.set_write_timeout(Some(self.control_timeout)))
            .map_err(transport::failed("set a timeout"))?;
        let epoch = self.greet(&stream)?;
        if epoch != rendezvous.epoch {
            return Err(Error::DaemonGone);
        }
        let node = transport::create_node(&rendezvous)?;
        let control_timeout = self.control_timeout;
        let connection = Connection { control: Mutex::new(()), stream, node, control_timeout, epoch };
        Ok(Client { inner: Arc::new(connection) })
    }

    fn find(&self, directory: &Path) -> Result<(Rendezvous, UnixStream), Error> {
        let start = Instant::now();
        loop {
            let reason = match look(directory) {
                Ok(found) => return Ok(found),
                Err(reason) => reason,
            };
            let waited = start.elapsed();
            if waited >= self.connect_timeout {
                let (instance, directory) = (self.instance.clone(), PathBuf::from(directory));
                return Err(Error::NoDaemon { instance, directory, waited, reason });
            }
            thread::sleep(RETRY_INTERVAL.min(self.connect_timeout - waited));
        }
    }

    fn greet(&self, stream: &UnixStream) -> Result<String, Error> {
        let hello = Request::Hello {
            protocol_min: PROTOCOL_VERSION_MIN,
            protocol_max: PROTOCOL_VERSION,
            iceoryx2: ICEORYX2_VERSION.to_owned(),
            client: self.name.clone(),
        };
        match exchange(stream, &hello, self.control_timeout, &mut |_, _, _| {})? {
            Reply::Hello { epoch, .. } => Ok(epoch),
            other => Err(unexpected(&other)),
        }
    }
}

impl Client {
    /// Connects to the instance `default`, waiting up to 5 s for the daemon.
    ///
    /// # Errors
    /// As [`ClientBuilder::connect`].
    pub fn connect() -> Result<Client, Error> {
        Client::builder().connect()
    }

    /// Settings of a connection to be made.
    pub fn builder() -> ClientBuilder {
        ClientBuilder {
            instance: DEFAULT_INSTANCE.to_owned(),
            directory: None,
            name: program_name(),
            connect_timeout: DEFAULT_CONNECT_TIMEOUT,
            control_timeout: DEFAULT_CONTROL_TIMEOUT,
        }
    }

    /// A handle to a database; it comes into being with its first object.
    pub fn database(&self, name: impl Into<String>) -> Database {
        Database::new(self.clone(), name.into())
    }

    /// Settings of a scene to be created.
    pub fn scene(&self, name: impl Into<String>) -> SceneBuilder {
        SceneBuilder::new(self.clone(), name.into())
    }

    /// The objects of all databases, ordered by database, then name.
    ///
    /// # Errors
    /// [`Error::DaemonGone`], [`Error::Deadline`].
    pub fn list(&self) -> Result<Vec<ObjectInfo>, Error> {
        self.list_objects(None)
    }

    /// What the daemon is doing.
    ///
    /// # Errors
    /// [`Error::DaemonGone`], [`Error::Deadline`].
    pub fn status(&self) -> Result<Status, Error> {
        match self.request(&Request::Status)? {
            Reply::Status(status) => Ok(status),
            other => Err(unexpected(&other)),
        }
    }

    /// The daemon's epoch: different for every start of a daemon.
    pub fn epoch(&self) -> &str {
        &self.inner.epoch
    }

    /// Sends a control request as it is on the wire and waits for its final reply. For tools that need what the rest of
    /// this API does not offer.
    ///
    /// # Errors
    /// [`Error::Refused`] for a [`Reply::Error`], [`Error::DaemonGone`], [`Error::Deadline`], [`Error::BadReply`].
    pub fn request(&self, request: &Request) -> Result<Reply, Error> {
        self.request_with_progress(request, &mut |_, _, _| {})
    }

    pub(crate) fn request_with_progress(
        &self,
        request: &Request,
        progress: &mut dyn FnMut(&str, u64, u64),
    ) -> Result<Reply, Error> {
        let _turn = self.inner.control.lock().unwrap_or_else(PoisonError::into_inner);
        exchange(&self.inner.stream, request, self.inner.control_timeout, progress)
    }

    pub(crate) fn expect_done(&self, request: &Request) -> Result<(), Error> {
        match self.request(request)? {
            Reply::Done => Ok(()),
            other => Err(unexpected(&other)),
        }
    }

    pub(crate) fn list_objects(&self, database: Option<String>) -> Result<Vec<ObjectInfo>, Error> {
        match self.request(&Request::List { database })? {
            Reply::Objects { objects } => Ok(objects),
            other => Err(unexpected(&other)),
        }
    }

    pub(crate) fn node(&self) -> &Node<Service> {
        &self.inner.node
    }

    pub(crate) fn stream(&self) -> BorrowedFd<'_> {
        self.inner.stream.as_fd()
    }
}

fn program_name() -> String {
    let program = std::env::args_os().next().map(PathBuf::from);
    let name = program.as_deref().and_then(Path::file_name);
    name.map_or_else(|| "client".to_owned(), |name| name.to_string_lossy().into_owned())
}

/// One attempt to find the daemon; the reason when it is not there.
fn look(directory: &Path) -> Result<(Rendezvous, UnixStream), String> {
    let file = directory.join(RENDEZVOUS_FILE);
    let json = std::fs::read(&file).map_err(|error| format!("cannot read {}: {error}", file.display()))?;
    let rendezvous = serde_json::from_slice(&json).map_err(|error| format!("{}: {error}", file.display()))?;
    let socket = directory.join(SOCKET_FILE);
    let stream =
        UnixStream::connect(&socket).map_err(|error| format!("cannot connect to {}: {error}", socket.display()))?;
    check_owner(directory)?;
    Ok((rendezvous, stream))
}

/// Where the runtime directory is in `/tmp`, another user may have made it before: no daemon in there is to be believed.
fn check_owner(directory: &Path) -> Result<(), String> {
    let metadata = std::fs::metadata(directory).map_err(|error| format!("{}: {error}", directory.display()))?;
    let (owner, user) = (metadata.uid(), getuid().as_raw());
    if owner == user || owner == ROOT || user == ROOT {
        return Ok(());
    }
    Err(format!("{} belongs to user {owner}, not to this one ({user})", directory.display()))
}

fn check_versions(daemon: &Rendezvous) -> Result<(), Error> {
    if daemon.protocol_min > PROTOCOL_VERSION || daemon.protocol_max < PROTOCOL_VERSION_MIN {
        return Err(Error::ProtocolMismatch {
            daemon_min: daemon.protocol_min,
            daemon_max: daemon.protocol_max,
            client_min: PROTOCOL_VERSION_MIN,
            client_max: PROTOCOL_VERSION,
        });
    }
    if daemon.iceoryx2 != ICEORYX2_VERSION {
        let (daemon, client) = (daemon.iceoryx2.clone(), ICEORYX2_VERSION.to_owned());
        return Err(Error::Iceoryx2Mismatch { daemon, client });
    }
    Ok(())
}

/// Sends a request and reads its replies up to the final one.
fn exchange(
    mut stream: &UnixStream,
    request: &Request,
    timeout: Duration,
    progress: &mut dyn FnMut(&str, u64, u64),
) -> Result<Reply, Error> {
    frame::write(&mut stream, request).map_err(|error| frame_error(error, stream, timeout))?;
    loop {
        match frame::read(&mut stream).map_err(|error| frame_error(error, stream, timeout))? {
            Some(Reply::Progress { stage, done, total }) => progress(&stage, done, total),
            Some(Reply::Error(error)) => return Err(Error::Refused(error)),
            Some(reply) => return Ok(reply),
            None => return Err(Error::DaemonGone),
        }
    }
}

fn frame_error(error: FrameError, stream: &UnixStream, timeout: Duration) -> Error {
    match error {
        FrameError::Io(error) if matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut) => {
            // A reply that comes after all would be taken for the next request's: the connection is of no more use.
            let _ = stream.shutdown(Shutdown::Both);
            Error::Deadline { waited: timeout }
        }
        FrameError::Io(error) if is_end(&error) => Error::DaemonGone,
        FrameError::Io(error) => TransportError::new("use the control socket", error).into(),
        FrameError::TooLarge { .. } => Error::Refused(WireError::new(
            ErrorCode::LimitExceeded,
            error.to_string(),
            "send the bodies or rules in several requests",
        )),
        FrameError::Json(error) => Error::BadReply(error.to_string()),
    }
}

fn is_end(error: &io::Error) -> bool {
    use io::ErrorKind::{BrokenPipe, ConnectionReset, NotConnected, UnexpectedEof};
    matches!(error.kind(), BrokenPipe | ConnectionReset | NotConnected | UnexpectedEof)
}

/// A reply of another kind than the request asks for.
pub(crate) fn unexpected(reply: &Reply) -> Error {
    Error::BadReply(format!("unexpected {reply:?}"))
}
