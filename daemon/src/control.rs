//! The control channel: one thread a connection, requests answered in turn.

use std::collections::BTreeMap;
use std::io;
use std::ops::ControlFlow;
use std::os::unix::net::{UnixListener, UnixStream};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::thread;
use std::time::Duration;

use collided_client::frame::{self, FrameError};
use collided_protocol::control::{BodySpec, ClientStatus, InterestRule, Reply, Request, Target, UploadSize};
use collided_protocol::{Effects, ErrorCode, ICEORYX2_VERSION, PROTOCOL_VERSION, PROTOCOL_VERSION_MIN, WireError};

use crate::bad_request;
use crate::names;
use crate::object_loading;
use crate::scene::SharedScene;
use crate::scene_thread::RunningScene;
use crate::state::Daemon;
use crate::upload::Upload;

/// Uploads that one connection may have under way.
const MAX_UPLOADS: usize = 16;
/// A client that does not read its replies for so long is taken for dead: its thread must not wait for ever.
const WRITE_TIMEOUT: Duration = Duration::from_secs(30);
/// After a failed accept (no descriptor left) nothing is better for so long.
const ACCEPT_PAUSE: Duration = Duration::from_millis(100);

/// Accepts connections until the daemon shuts down, and then waits for all of them to end.
pub fn accept(daemon: &Arc<Daemon>, listener: &UnixListener) {
    thread::scope(|scope| {
        while !daemon.is_shutting_down() {
            let started = listener.accept().and_then(|(stream, _)| {
                let run = || Connection::new(daemon, stream).and_then(Connection::run);
                thread::Builder::new().name("control".to_owned()).spawn_scoped(scope, || {
                    // A bug that one request meets ends that connection, and no other.
                    match catch_unwind(AssertUnwindSafe(run)) {
                        Ok(Ok(())) => {}
                        Ok(Err(error)) => tracing::info!(%error, "a connection failed"),
                        Err(_) => tracing::error!("the thread of a connection has panicked"),
                    }
                })
            });
            if let Err(error) = started {
                tracing::warn!(%error, "a connection could not be accepted");
                thread::sleep(ACCEPT_PAUSE);
            }
        }
    });
}

/// A connection, and what ends with it.
struct Connection<'a> {
    daemon: &'a Arc<Daemon>,
    stream: UnixStream,
    id: u32,
    pid: i32,
    scenes: BTreeMap<u32, RunningScene>,
    uploads: BTreeMap<u32, Upload>,
}

impl Drop for Connection<'_> {
    fn drop(&mut self) {
        self.daemon.remove_client(self.id);
        for &scene in self.scenes.keys() {
            self.daemon.remove_scene(scene);
        }
        self.scenes.clear();
        self.uploads.clear();
        self.daemon.cleaner.client_gone();
    }
}

impl<'a> Connection<'a> {
    fn new(daemon: &'a Arc<Daemon>, stream: UnixStream) -> io::Result<Connection<'a>> {
        stream.set_write_timeout(Some(WRITE_TIMEOUT))?;
        let pid = rustix::net::sockopt::socket_peercred(&stream)?.pid.as_raw_nonzero().get();
        let (scenes, uploads) = Default::default();
        Ok(Connection { daemon, stream, id: daemon.new_id(), pid, scenes, uploads })
    }

    fn run(mut self) -> io::Result<()> {
        // Listed before it has said who it is, so that a shutdown closes it in any case.
        let status = ClientStatus { name: "(unknown)".to_owned(), pid: self.pid };
        self.daemon.add_client(self.id, status, self.stream.try_clone()?);
        let mut greeted = false;
        while !self.daemon.is_shutting_down() {
            let reply = match self.receive()? {
                None => return Ok(()),
                Some(Ok(hello @ Request::Hello { .. })) if !greeted => {
                    let reply = self.greet(hello)?;
                    greeted = matches!(reply, Ok(Reply::Hello { .. }));
                    reply
                }
                Some(Ok(request)) if greeted => self.answer(request),
                Some(Ok(_)) => Err(not_greeted()),
                Some(Err(error)) => Err(error),
            };
            self.reply(&reply.unwrap_or_else(Reply::Error))?;
        }
        Ok(())
    }

    /// The next request, or what is wrong with it; `None` when the client is gone.
    fn receive(&self) -> io::Result<Option<Result<Request, WireError>>> {
        match frame::read_json(&mut &self.stream) {
            Ok(json) => Ok(json.map(|json| bad_request::parse(&json))),
            Err(FrameError::Io(error)) => Err(error),
            Err(error) => Ok(Some(Err(bad_request::too_large(&error)))),
        }
    }

    fn reply(&self, reply: &Reply) -> io::Result<()> {
        match frame::write(&mut &self.stream, reply) {
            Ok(()) => Ok(()),
            Err(FrameError::Io(error)) => Err(error),
            Err(error) => {
                let error = WireError::new(ErrorCode::LimitExceeded, error.to_string(), "ask for less at once");
                frame::write(&mut &self.stream, &Reply::Error(error)).map_err(io::Error::other)
            }
        }
    }

    fn greet(&mut self, hello: Request) -> io::Result<Result<Reply, WireError>> {
        let Request::Hello { protocol_min, protocol_max, iceoryx2, client } = hello else {
            return Ok(Err(not_greeted()));
        };
        let checked =
            check_versions(protocol_min, protocol_max, &iceoryx2).and_then(|()| names::check("client", &client));
        if let Err(error) = checked {
            return Ok(Err(error));
        }
        tracing::info!(client, pid = self.pid, "connected");
        let status = ClientStatus { name: client, pid: self.pid };
        self.daemon.add_client(self.id, status, self.stream.try_clone()?);
        let protocol = protocol_max.min(PROTOCOL_VERSION);
        Ok(Ok(Reply::Hello { protocol, epoch: self.daemon.epoch().to_owned() }))
    }

    fn answer(&mut self, request: Request) -> Result<Reply, WireError> {
        let databases = &self.daemon.databases;
        match request {
            Request::Load { target, path } => self.load(&target, &path),
            Request::GetObject { database, object } => databases.get(&database, &object).map(Reply::Object),
            Request::BeginUpload { target, size } => self.begin_upload(target, size),
            Request::TakeUploadPart { upload } => self.upload(upload)?.take_part().map(|()| Reply::Done),
            Request::CancelUpload { upload } => self.take_upload(upload).map(|_| Reply::Done),
            Request::FinishUpload { upload } => self.finish_upload(upload),
            Request::List { database } => databases.list(database.as_deref()).map(|objects| Reply::Objects { objects }),
            Request::Unload { database, object } => databases.unload(&database, &object).map(|()| Reply::Done),
            Request::Status => Ok(Reply::Status(self.daemon.status())),
            Request::CreateScene { name, effects } => self.create_scene(name, effects),
            Request::AddBodies { scene, bodies } => self.add_bodies(scene, bodies),
            Request::RemoveBodies { scene, bodies } => self.scene(scene)?.remove_bodies(&bodies).map(|()| Reply::Done),
            Request::SetEffects { scene, effects } => {
                self.scene(scene)?.set_effects(effects);
                Ok(Reply::Done)
            }
            Request::SetAccuracy { scene, accuracy } => {
                self.scene(scene)?.set_accuracy(accuracy).map(|clamped| Reply::AccuracySet { clamped })
            }
            Request::SetPairAccuracy { scene, pairs } => {
                self.scene(scene)?.set_pair_accuracy(&pairs).map(|clamped| Reply::AccuracySet { clamped })
            }
            Request::SetDynamics { scene, bodies } => self.scene(scene)?.set_dynamics(&bodies).map(|()| Reply::Done),
            Request::SetInterest { scene, rules } => self.set_interest(scene, &rules),
            Request::DropScene { scene } => self.drop_scene(scene),
            _ => Err(WireError::new(
                ErrorCode::BadMessage,
                "the request is out of turn, or not one of this protocol version",
                "send `hello` once, and requests of the version agreed upon",
            )),
        }
    }

    fn load(&self, target: &Target, path: &str) -> Result<Reply, WireError> {
        object_loading::load(self.daemon, target, path, &mut self.progress()).map(Reply::Object)
    }

    /// Tells the client of progress, until it cannot be told any more.
    fn progress(&self) -> impl FnMut(&str, u64, u64) -> ControlFlow<()> {
        |stage, done, total| match self.reply(&Reply::Progress { stage: stage.to_owned(), done, total }) {
            Ok(()) => ControlFlow::Continue(()),
            Err(_) => ControlFlow::Break(()),
        }
    }

    fn begin_upload(&mut self, target: Target, size: UploadSize) -> Result<Reply, WireError> {
        self.daemon.databases.check_target(&target)?;
        if self.uploads.len() >= MAX_UPLOADS {
            return Err(WireError::new(
                ErrorCode::LimitExceeded,
                format!("{MAX_UPLOADS} uploads of this client are under way, which is the limit"),
                "finish or cancel one first",
            ));
        }
        let upload = self.daemon.new_id();
        self.uploads.insert(upload, Upload::begin(&self.daemon.node, upload, target, size)?);
        Ok(Reply::UploadReady { upload })
    }

    fn upload(&mut self, upload: u32) -> Result<&mut Upload, WireError> {
        self.uploads.get_mut(&upload).ok_or_else(|| unknown_upload(upload))
    }

    fn take_upload(&mut self, upload: u32) -> Result<Upload, WireError> {
        self.uploads.remove(&upload).ok_or_else(|| unknown_upload(upload))
    }

    fn finish_upload(&mut self, upload: u32) -> Result<Reply, WireError> {
        let (target, mesh) = self.take_upload(upload)?.finish()?;
        object_loading::build(self.daemon, &target, mesh, &mut self.progress()).map(Reply::Object)
    }

    fn create_scene(&mut self, name: String, effects: Effects) -> Result<Reply, WireError> {
        names::check("scene", &name)?;
        let id = self.daemon.new_id();
        let running = RunningScene::start(self.daemon, id, SharedScene::new(effects))?;
        self.daemon.add_scene(id, name, self.pid, Arc::clone(&running.scene));
        self.scenes.insert(id, running);
        Ok(Reply::SceneCreated { scene: id })
    }

    fn scene(&self, scene: u32) -> Result<&SharedScene, WireError> {
        self.scenes.get(&scene).map(|running| &*running.scene).ok_or_else(|| unknown_scene(scene))
    }

    fn add_bodies(&self, scene: u32, bodies: Vec<BodySpec>) -> Result<Reply, WireError> {
        let ids = self.scene(scene)?.add_bodies(&self.daemon.databases, bodies)?;
        Ok(Reply::BodiesAdded { ids })
    }

    fn set_interest(&self, scene: u32, rules: &[InterestRule]) -> Result<Reply, WireError> {
        self.scene(scene)?.set_interest(rules).map(|()| Reply::Done)
    }

    fn drop_scene(&mut self, scene: u32) -> Result<Reply, WireError> {
        let running = self.scenes.remove(&scene).ok_or_else(|| unknown_scene(scene))?;
        self.daemon.remove_scene(scene);
        drop(running);
        Ok(Reply::Done)
    }
}

fn check_versions(min: u32, max: u32, iceoryx2: &str) -> Result<(), WireError> {
    if min > PROTOCOL_VERSION || max < PROTOCOL_VERSION_MIN {
        return Err(WireError::new(
            ErrorCode::ProtocolMismatch,
            format!(
                "the client speaks protocol {min} to {max}, this daemon {PROTOCOL_VERSION_MIN} to {PROTOCOL_VERSION}"
            ),
            "use client and daemon of the same release",
        ));
    }
    if iceoryx2 != ICEORYX2_VERSION {
        return Err(WireError::new(
            ErrorCode::Iceoryx2Mismatch,
            format!("the client was built with iceoryx2 {iceoryx2}, this daemon with {ICEORYX2_VERSION}"),
            "build both with the same version: their shared memory differs",
        ));
    }
    Ok(())
}

fn not_greeted() -> WireError {
    WireError::new(
        ErrorCode::BadMessage,
        "the connection has not been greeted, or was refused",
        "send `hello` first, with versions that the daemon knows",
    )
}

fn unknown_upload(upload: u32) -> WireError {
    WireError::new(
        ErrorCode::BadMessage,
        format!("upload {upload} is not under way on this connection"),
        "begin an upload first, and use its number",
    )
}

fn unknown_scene(scene: u32) -> WireError {
    WireError::new(
        ErrorCode::UnknownScene,
        format!("this client has no scene {scene}: it was dropped, or another client owns it"),
        "create a scene, and use its number on the same connection",
    )
}
