//! What all threads of the daemon share.

use std::collections::BTreeMap;
use std::os::unix::net::UnixStream;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use collided_client::transport::Service;
use collided_protocol::control::{ClientStatus, SceneStatus, Status};
use iceoryx2::prelude::Node;

use crate::budget::Budget;
use crate::cleaner::Cleaner;
use crate::database::Databases;
use crate::scene::SharedScene;

/// The daemon.
pub struct Daemon {
    /// The geometry of all scenes and all builds takes its turn here.
    pub budget: Budget,
    /// The daemon's iceoryx2 node.
    pub node: Arc<Node<Service>>,
    /// The objects.
    pub databases: Databases,
    /// Clears up after dead clients.
    pub cleaner: Cleaner,
    /// Numbers for scenes, uploads and connections: never used twice.
    next_id: AtomicU32,
    epoch: String,
    started: Instant,
    shutting_down: AtomicBool,
    clients: Mutex<BTreeMap<u32, ConnectedClient>>,
    scenes: Mutex<BTreeMap<u32, ListedScene>>,
}

struct ConnectedClient {
    status: ClientStatus,
    stream: UnixStream,
}

struct ListedScene {
    name: String,
    owner: i32,
    scene: Arc<SharedScene>,
}

impl Daemon {
    /// A daemon without clients.
    pub fn new(budget: Budget, node: Arc<Node<Service>>, cleaner: Cleaner, epoch: String) -> Daemon {
        Daemon {
            budget,
            node,
            databases: Databases::default(),
            cleaner,
            next_id: AtomicU32::new(0),
            epoch,
            started: Instant::now(),
            shutting_down: AtomicBool::new(false),
            clients: Mutex::default(),
            scenes: Mutex::default(),
        }
    }

    /// A number that no scene, upload or connection had before.
    pub fn new_id(&self) -> u32 {
        self.next_id.fetch_add(1, Ordering::Relaxed)
    }

    /// Different for every start.
    pub fn epoch(&self) -> &str {
        &self.epoch
    }

    /// Whether [`Daemon::shut_down`] was called.
    pub fn is_shutting_down(&self) -> bool {
        self.shutting_down.load(Ordering::SeqCst)
    }

    /// Closes all connections, which ends their scenes; new ones are closed at once.
    pub fn shut_down(&self) {
        self.shutting_down.store(true, Ordering::SeqCst);
        for client in self.clients().values() {
            let _ = client.stream.shutdown(std::net::Shutdown::Both);
        }
    }

    /// Lists a client; its stream is kept so that [`Daemon::shut_down`] can close it.
    pub fn add_client(&self, id: u32, status: ClientStatus, stream: UnixStream) {
        self.clients().insert(id, ConnectedClient { status, stream });
        if self.is_shutting_down() {
            self.shut_down();
        }
    }

    /// Takes a client from the list.
    pub fn remove_client(&self, id: u32) {
        self.clients().remove(&id);
    }

    /// Lists a scene.
    pub fn add_scene(&self, id: u32, name: String, owner: i32, scene: Arc<SharedScene>) {
        self.scenes().insert(id, ListedScene { name, owner, scene });
    }

    /// Takes a scene from the list.
    pub fn remove_scene(&self, id: u32) {
        self.scenes().remove(&id);
    }

    /// What the daemon is doing.
    pub fn status(&self) -> Status {
        let objects = self.databases.list(None).unwrap_or_default();
        let scenes = self.scenes();
        let scene_status = |(&scene, listed): (&u32, &ListedScene)| SceneStatus {
            scene,
            name: listed.name.clone(),
            owner: listed.owner,
            bodies: listed.scene.body_count(),
            steps: listed.scene.step_count(),
        };
        Status {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            pid: std::process::id(),
            epoch: self.epoch.clone(),
            uptime_seconds: self.started.elapsed().as_secs_f64(),
            threads: self.budget.threads() as u32,
            objects: objects.len() as u64,
            object_memory: objects.iter().map(|object| object.memory).sum(),
            clients: self.clients().values().map(|client| client.status.clone()).collect(),
            scenes: scenes.iter().filter(|(_, listed)| !listed.scene.has_ended()).map(scene_status).collect(),
        }
    }

    fn clients(&self) -> MutexGuard<'_, BTreeMap<u32, ConnectedClient>> {
        self.clients.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn scenes(&self) -> MutexGuard<'_, BTreeMap<u32, ListedScene>> {
        self.scenes.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
