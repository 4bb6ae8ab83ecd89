//! The control channel: length-prefixed JSON over the instance's unix socket.
//!
//! A frame is a `u32`, little endian, the number of bytes that follow (at most
//! [`MAX_CONTROL_MESSAGE`](crate::limits::MAX_CONTROL_MESSAGE)), then one JSON value. A client sends [`Request`]s, the first
//! one [`Request::Hello`]; each is answered in turn by zero or more [`Reply::Progress`] and one other [`Reply`].

use bytemuck::{Pod, Zeroable};
use iceoryx2::prelude::ZeroCopySend;
use serde::{Deserialize, Serialize};

use crate::report::Level;
use crate::{Effects, WireError};

/// What a client may ask for.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "request", rename_all = "snake_case", deny_unknown_fields)]
#[non_exhaustive]
pub enum Request {
    /// The first message of a connection.
    Hello {
        /// Oldest protocol version that the client understands.
        protocol_min: u32,
        /// Newest protocol version that the client understands.
        protocol_max: u32,
        /// The client's iceoryx2 version.
        iceoryx2: String,
        /// What the client calls itself; shown by `status`.
        client: String,
    },
    /// Load an object from a mesh file (OBJ, STL, PLY or OFF, told by its ending) that the daemon can read.
    Load {
        /// Where the object goes.
        target: Target,
        /// Absolute path of the mesh file.
        path: String,
    },
    /// Ask for one object. Answered by [`Reply::Object`].
    GetObject {
        /// The database.
        database: String,
        /// The object.
        object: String,
    },
    /// Announce a mesh in the client's memory. Answered by [`Reply::UploadReady`].
    BeginUpload {
        /// Where the object goes.
        target: Target,
        /// How much will come.
        size: UploadSize,
    },
    /// One part of an upload was published: take it. Answered when its memory may be used for the next part.
    TakeUploadPart {
        /// The number from [`Reply::UploadReady`].
        upload: u32,
    },
    /// Give an upload up.
    CancelUpload {
        /// The number from [`Reply::UploadReady`].
        upload: u32,
    },
    /// All parts of an upload were taken: build the object.
    FinishUpload {
        /// The number from [`Reply::UploadReady`].
        upload: u32,
    },
    /// List the objects of one database, or of all.
    List {
        /// The database; `None` lists all.
        database: Option<String>,
    },
    /// Remove an object. Refused while bodies use it.
    Unload {
        /// The database.
        database: String,
        /// The object.
        object: String,
    },
    /// What the daemon is doing.
    Status,
    /// Create a scene, owned by this connection and dropped with it.
    CreateScene {
        /// Shown by `status`.
        name: String,
        /// Effects of every pair without a rule of its own.
        effects: Effects,
    },
    /// Place objects in a scene. All are added, or none.
    AddBodies {
        /// The scene.
        scene: u32,
        /// What to add.
        bodies: Vec<BodySpec>,
    },
    /// Take bodies out of a scene. All are removed, or none. Their ids are never used again in that scene.
    RemoveBodies {
        /// The scene.
        scene: u32,
        /// Their ids.
        bodies: Vec<u32>,
    },
    /// Change the effects of every pair without a rule of its own.
    SetEffects {
        /// The scene.
        scene: u32,
        /// The new effects.
        effects: Effects,
    },
    /// Change how exactly pairs without an accuracy of their own are answered, and what a step may cost.
    SetAccuracy {
        /// The scene.
        scene: u32,
        /// The new accuracy.
        accuracy: Accuracy,
    },
    /// Give pairs an accuracy of their own, or take it back. All are set, or none.
    SetPairAccuracy {
        /// The scene.
        scene: u32,
        /// The pairs.
        pairs: Vec<PairAccuracy>,
    },
    /// Give bodies mass, or take it from them. All are set, or none.
    SetDynamics {
        /// The scene.
        scene: u32,
        /// The bodies.
        bodies: Vec<BodyDynamics>,
    },
    /// Change entries of the collision interest matrix. All are set, or none.
    SetInterest {
        /// The scene.
        scene: u32,
        /// The entries.
        rules: Vec<InterestRule>,
    },
    /// End a scene.
    DropScene {
        /// The scene.
        scene: u32,
    },
}

/// Where a loaded or uploaded object goes.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Target {
    /// The database; made when it does not exist.
    pub database: String,
    /// The object's name there.
    pub object: String,
    /// Order M of the voxel matrix; `None` lets the daemon choose from the polygons.
    pub order: Option<u32>,
    /// Whether an object of that name is replaced. Running steps see the old object or the new one, never half.
    pub replace: bool,
}

/// How much an upload brings.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct UploadSize {
    /// Number of vertices.
    pub vertices: u64,
    /// Number of polygons.
    pub polygons: u64,
    /// Number of polygon corners, summed over the polygons.
    pub corners: u64,
}

/// A body to add.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BodySpec {
    /// Its name, unique among the scene's bodies.
    pub name: String,
    /// The database of its object.
    pub database: String,
    /// Its object.
    pub object: String,
    /// Pairs within a group are ignored.
    pub group: Option<String>,
}

/// How exactly a scene, or a pair, is answered. What is left out has its default.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Accuracy {
    /// Where the refinement of verdicts ends; `polygons`, the exact answer, unless given. What is not proven clear there is possible.
    pub level: Option<Level>,
    /// With level `voxels`, the order of the voxels that are compared; orders above an object's own count as that. Its own unless given.
    pub order: Option<u32>,
    /// A distance may be larger than the minimum by this share of itself, from 0 to below 1; 0 unless given: as exact as f64 allows.
    pub distance_tolerance: Option<f64>,
    /// Larger distances are not wanted, in the caller's length unit; no limit unless given.
    pub distance_up_to: Option<f64>,
    /// Width of the bracket of a time of contact, as a share of the step, above 0; 1e-6 unless given.
    pub time_tolerance: Option<f64>,
    /// Work that the time of contact of one pair may cost, in comparisons of two voxels; 4,194,304 unless given.
    pub iterations: Option<u32>,
    /// What a step may take from its arrival in the daemon to the report, in microseconds, above 0; no limit unless given. When it is used up, what
    /// is not decided is possible. Of a whole scene, never of a pair.
    pub budget_us: Option<f64>,
}

/// A pair, and its accuracy.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PairAccuracy {
    /// One body.
    pub a: u32,
    /// The other body.
    pub b: u32,
    /// `None`: that of the scene.
    pub accuracy: Option<Accuracy>,
}

/// A body and its mass.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BodyDynamics {
    /// The body.
    pub body: u32,
    /// `None` makes it static: of infinite mass, with restitution 0 and friction 1.
    pub dynamics: Option<Dynamics>,
}

/// Mass of a body, and how it rebounds, for the effect `response`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Dynamics {
    /// Where the mass comes from.
    pub mass: Mass,
    /// From 0, no rebound, to 1, all of the speed; of two bodies the larger one counts.
    pub restitution: f64,
    /// Coulomb's coefficient, 0 or more; of two bodies the geometric mean counts.
    pub friction: f64,
}

/// Mass, its centre and its inertia.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Mass {
    /// As given.
    Given {
        /// Above 0, in the caller's unit.
        mass: f64,
        /// Centre of mass, in the object's frame.
        centre: [f64; 3],
        /// Inertia tensor about the centre, along the object's axes: symmetric, positive definite.
        inertia: [[f64; 3]; 3],
    },
    /// Infinite: the body never moves, and has a restitution and a friction of its own.
    Static,
    /// Of the volume of the object's closed mesh, in its own frame.
    Density {
        /// Mass by volume, above 0.
        density: f64,
    },
}

/// One entry of the collision interest matrix.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InterestRule {
    /// One body.
    pub a: u32,
    /// The other body.
    pub b: u32,
    /// What to compute for the pair.
    pub interest: Interest,
}

/// What a scene wants to know of a pair.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Interest {
    /// The scene's effects, or nothing within a group: as if no rule had been given.
    Default,
    /// Nothing.
    Ignore,
    /// These effects instead of the scene's, also within a group.
    Effects(Effects),
}

/// What the daemon answers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "reply", rename_all = "snake_case")]
#[non_exhaustive]
pub enum Reply {
    /// To [`Request::Hello`].
    Hello {
        /// The protocol version both sides will use.
        protocol: u32,
        /// The daemon's epoch.
        epoch: String,
    },
    /// Something is done, and there is nothing to say of it.
    Done,
    /// A long request is under way.
    Progress {
        /// What is being done: `read`, `build`.
        stage: String,
        /// Done so far, in the stage's own unit.
        done: u64,
        /// When `done` reaches this the stage ends; 0 when not known.
        total: u64,
    },
    /// To [`Request::Load`], [`Request::GetObject`] and [`Request::FinishUpload`].
    Object(ObjectInfo),
    /// To [`Request::BeginUpload`].
    UploadReady {
        /// Names the service (see [`crate::names::upload_service`]) and the upload.
        upload: u32,
    },
    /// To [`Request::List`].
    Objects {
        /// Ordered by database, then object.
        objects: Vec<ObjectInfo>,
    },
    /// To [`Request::Status`].
    Status(Status),
    /// To [`Request::CreateScene`].
    SceneCreated {
        /// Names the services (see [`crate::names`]) and the scene.
        scene: u32,
    },
    /// To [`Request::AddBodies`].
    BodiesAdded {
        /// Their ids, in the order asked.
        ids: Vec<u32>,
    },
    /// To [`Request::SetAccuracy`] and [`Request::SetPairAccuracy`].
    AccuracySet {
        /// The objects, of the bodies meant, whose own order is below the one asked for; ordered by database, then object.
        clamped: Vec<ClampedOrder>,
    },
    /// The request failed; nothing was changed.
    Error(WireError),
}

/// An object whose own order M is below the order that an accuracy asks for: M counts for its bodies.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct ClampedOrder {
    /// Its database.
    pub database: String,
    /// Its name.
    pub object: String,
    /// The order asked for; the highest one, of several pairs.
    pub asked: u32,
    /// Its own order M.
    pub order: u32,
}

/// What is known of an object.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ObjectInfo {
    /// Its database.
    pub database: String,
    /// Its name.
    pub object: String,
    /// Number of vertices.
    pub vertices: u64,
    /// Number of polygons.
    pub polygons: u64,
    /// Number of triangles that the polygons were cut into.
    pub triangles: u64,
    /// Order M of its voxel matrix.
    pub order: u32,
    /// Voxels that hold at least one polygon.
    pub occupied_voxels: u64,
    /// Memory held, in bytes.
    pub memory: u64,
    /// Container: smallest corner, then largest, in the object's frame; `None` for an empty object.
    pub container: Option<[[f64; 3]; 2]>,
    /// How many times the object was replaced.
    pub revision: u64,
    /// Bodies of living scenes that use it.
    pub bodies: u64,
}

/// What the daemon is doing.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Status {
    /// The daemon's version.
    pub version: String,
    /// Its process id.
    pub pid: u32,
    /// Its epoch.
    pub epoch: String,
    /// Seconds since it started.
    pub uptime_seconds: f64,
    /// Worker threads.
    pub threads: u32,
    /// Objects, over all databases.
    pub objects: u64,
    /// Memory held by objects, in bytes.
    pub object_memory: u64,
    /// Connected clients.
    pub clients: Vec<ClientStatus>,
    /// Living scenes.
    pub scenes: Vec<SceneStatus>,
}

/// A connected client.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ClientStatus {
    /// What it calls itself.
    pub name: String,
    /// Its process id, as the kernel gives it.
    pub pid: i32,
}

/// A living scene.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct SceneStatus {
    /// Its id.
    pub scene: u32,
    /// Its name.
    pub name: String,
    /// Process id of the client that owns it.
    pub owner: i32,
    /// Living bodies.
    pub bodies: u64,
    /// Steps answered.
    pub steps: u64,
}

/// [`UploadHeader::kind`]: vertices, three f64 (as words) each.
pub const UPLOAD_VERTICES: u32 = 0;
/// [`UploadHeader::kind`]: number of corners of each polygon, one word each.
pub const UPLOAD_CORNER_COUNTS: u32 = 1;
/// [`UploadHeader::kind`]: vertex index of each corner, polygon after polygon, one word each.
pub const UPLOAD_CORNERS: u32 = 2;

/// The user header of one part of an upload. Kinds come in ascending order, the parts of a kind in order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Pod, Zeroable, ZeroCopySend)]
#[repr(C)]
#[type_name("collided.UploadHeader")]
pub struct UploadHeader {
    /// [`crate::PROTOCOL_VERSION`] of the sender.
    pub protocol: u32,
    /// `UPLOAD_VERTICES`, `UPLOAD_CORNER_COUNTS` or `UPLOAD_CORNERS`.
    pub kind: u32,
    /// Words of this kind that came before.
    pub first_word: u64,
}

const _: () = assert!(size_of::<UploadHeader>() == 16);
