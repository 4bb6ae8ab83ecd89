//! Object databases: named sets of objects in the daemon, shared by all clients.

use std::fmt;
use std::path::Path;

use collided_protocol::control::{ObjectInfo, Reply, Request, Target};

use crate::connect::{Client, unexpected};
use crate::error::{Error, TransportError};
use crate::upload;

/// A handle to a database. Making one is no round trip.
#[derive(Clone, Debug)]
pub struct Database {
    client: Client,
    name: String,
}

/// An object in a database: polygons and their voxel matrix.
#[derive(Clone, Debug, PartialEq)]
pub struct Object {
    info: ObjectInfo,
}

/// Polygons in this process's memory, in their own frame, in the caller's length unit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Mesh<'a> {
    /// Positions.
    pub vertices: &'a [[f64; 3]],
    /// Number of corners of each polygon, 3 or more.
    pub corner_counts: &'a [u32],
    /// Vertex index of each corner, polygon after polygon.
    pub corners: &'a [u32],
}

/// Is told the stage, how much is done, and the total.
type Observer<'a> = dyn FnMut(&str, u64, u64) + 'a;

/// How an object is to be loaded. See [`Database::loading`].
#[must_use = "nothing is loaded before `file` or `mesh` is called"]
pub struct Loading<'a> {
    client: &'a Client,
    target: Target,
    progress: Box<Observer<'a>>,
}

impl fmt::Debug for Loading<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Loading").field("target", &self.target).finish_non_exhaustive()
    }
}

impl Object {
    /// Its database's name.
    pub fn database(&self) -> &str {
        &self.info.database
    }

    /// Its name.
    pub fn name(&self) -> &str {
        &self.info.object
    }

    /// What the daemon told of it when this handle was made.
    pub fn info(&self) -> &ObjectInfo {
        &self.info
    }
}

impl Database {
    pub(crate) fn new(client: Client, name: String) -> Database {
        Database { client, name }
    }

    /// Its name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Loads an object from a mesh file (OBJ, STL, PLY or OFF) that the daemon can read. A relative path is taken from
    /// this process's working directory.
    ///
    /// # Errors
    /// [`Error::Refused`] when the file or its mesh is bad, or an object of that name is there.
    pub fn load(&self, object: &str, path: impl AsRef<Path>) -> Result<Object, Error> {
        self.loading(object).file(path)
    }

    /// Loads an object from this process's memory, through shared memory.
    ///
    /// # Errors
    /// [`Error::Refused`] when the mesh is bad, or an object of that name is there; [`Error::OutOfSharedMemory`].
    pub fn upload(&self, object: &str, mesh: &Mesh<'_>) -> Result<Object, Error> {
        self.loading(object).mesh(mesh)
    }

    /// Settings of an object to be loaded.
    pub fn loading(&self, object: &str) -> Loading<'_> {
        let target = Target { database: self.name.clone(), object: object.to_owned(), order: None, replace: false };
        Loading { client: &self.client, target, progress: Box::new(|_, _, _| {}) }
    }

    /// An object that is there already.
    ///
    /// # Errors
    /// [`Error::Refused`] with `UnknownDatabase` or `UnknownObject`.
    pub fn get(&self, object: &str) -> Result<Object, Error> {
        let request = Request::GetObject { database: self.name.clone(), object: object.to_owned() };
        object_of(self.client.request(&request)?)
    }

    /// Its objects, ordered by name.
    ///
    /// # Errors
    /// [`Error::Refused`] with `UnknownDatabase`.
    pub fn list(&self) -> Result<Vec<ObjectInfo>, Error> {
        self.client.list_objects(Some(self.name.clone()))
    }

    /// Removes an object.
    ///
    /// # Errors
    /// [`Error::Refused`] with `UnknownDatabase`, `UnknownObject`, or `ObjectInUse` while bodies use it.
    pub fn unload(&self, object: &str) -> Result<(), Error> {
        self.client.expect_done(&Request::Unload { database: self.name.clone(), object: object.to_owned() })
    }
}

impl<'a> Loading<'a> {
    /// The order M of the voxel matrix, 0 to 30; chosen by the daemon unless set.
    pub fn order(mut self, order: u32) -> Self {
        self.target.order = Some(order);
        self
    }

    /// Whether an object of that name is replaced: bodies that use it have the new one from their next step on.
    pub fn replace(mut self, replace: bool) -> Self {
        self.target.replace = replace;
        self
    }

    /// Is told the stage (`upload`, `read`, `build`), how much is done, and the total (0 when not known).
    pub fn on_progress(mut self, progress: impl FnMut(&str, u64, u64) + 'a) -> Self {
        self.progress = Box::new(progress);
        self
    }

    /// Loads from a mesh file; see [`Database::load`].
    ///
    /// # Errors
    /// As [`Database::load`].
    pub fn file(mut self, path: impl AsRef<Path>) -> Result<Object, Error> {
        let path = std::path::absolute(path.as_ref())
            .map_err(|error| TransportError::new("make the mesh file's path absolute", error))?;
        let path = path.to_str().ok_or_else(|| TransportError::new("send the mesh file's path", "it is not UTF-8"))?;
        let request = Request::Load { target: self.target, path: path.to_owned() };
        object_of(self.client.request_with_progress(&request, &mut self.progress)?)
    }

    /// Loads from this process's memory; see [`Database::upload`].
    ///
    /// # Errors
    /// As [`Database::upload`].
    pub fn mesh(mut self, mesh: &Mesh<'_>) -> Result<Object, Error> {
        object_of(upload::upload(self.client, self.target, mesh, &mut self.progress)?)
    }
}

fn object_of(reply: Reply) -> Result<Object, Error> {
    match reply {
        Reply::Object(info) => Ok(Object { info }),
        other => Err(unexpected(&other)),
    }
}
