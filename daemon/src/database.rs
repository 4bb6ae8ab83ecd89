//! Object databases: named sets of objects, shared by all clients.
//!
//! A scene's bodies hold a [`BodyUse`] of an object's slot. Replacing an object exchanges what is in the slot and raises
//! one counter; a scene compares that counter at each step (one atomic load), and only if it changed looks at its slots.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, RwLock, RwLockReadGuard, RwLockWriteGuard};

use collided_kernel::Object;
use collided_protocol::control::{ObjectInfo, Target};
use collided_protocol::{ErrorCode, WireError};

use crate::names;

type Objects = BTreeMap<String, Arc<Slot>>;

/// All databases of the daemon.
#[derive(Default)]
pub struct Databases {
    databases: RwLock<BTreeMap<String, Objects>>,
    /// How many replacements there were, over all objects.
    revision: AtomicU64,
}

/// The place of one object. The object in it is exchanged when it is replaced.
struct Slot {
    database: String,
    name: String,
    current: Mutex<Current>,
    bodies: AtomicU64,
}

struct Current {
    object: Arc<Object>,
    revision: u64,
}

/// Keeps an object from being unloaded for as long as a body uses it.
pub struct BodyUse(Arc<Slot>);

/// While this lives, no object is replaced, loaded or unloaded.
pub struct Unchanged<'a> {
    _databases: RwLockReadGuard<'a, BTreeMap<String, Objects>>,
    /// The counter of replacements.
    pub revision: u64,
}

impl BodyUse {
    fn new(slot: &Arc<Slot>) -> BodyUse {
        slot.bodies.fetch_add(1, Ordering::Relaxed);
        BodyUse(Arc::clone(slot))
    }

    /// The object as it is now.
    pub fn object(&self) -> Arc<Object> {
        Arc::clone(&self.0.current().object)
    }

    /// The names of its database and of itself.
    pub fn names(&self) -> (&str, &str) {
        (&self.0.database, &self.0.name)
    }
}

impl Drop for BodyUse {
    fn drop(&mut self) {
        self.0.bodies.fetch_sub(1, Ordering::Relaxed);
    }
}

impl Slot {
    fn current(&self) -> MutexGuard<'_, Current> {
        self.current.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn info(&self) -> ObjectInfo {
        let (object, revision) = {
            let current = self.current();
            (Arc::clone(&current.object), current.revision)
        };
        ObjectInfo {
            database: self.database.clone(),
            object: self.name.clone(),
            vertices: object.vertex_count() as u64,
            polygons: object.polygon_count() as u64,
            triangles: object.triangle_count() as u64,
            order: object.order(),
            occupied_voxels: object.occupied_voxels() as u64,
            memory: object.memory_bytes() as u64,
            container: object.container().map(|container| [container.min, container.max]),
            revision,
            bodies: self.bodies.load(Ordering::Relaxed),
        }
    }
}

impl Databases {
    fn read(&self) -> RwLockReadGuard<'_, BTreeMap<String, Objects>> {
        self.databases.read().unwrap_or_else(PoisonError::into_inner)
    }

    fn write(&self) -> RwLockWriteGuard<'_, BTreeMap<String, Objects>> {
        self.databases.write().unwrap_or_else(PoisonError::into_inner)
    }

    /// Checks that an object could go there, before the work of building it.
    ///
    /// # Errors
    /// [`ErrorCode::BadName`], [`ErrorCode::DuplicateObject`].
    pub fn check_target(&self, target: &Target) -> Result<(), WireError> {
        names::check("database", &target.database)?;
        names::check("object", &target.object)?;
        match self.read().get(&target.database).and_then(|objects| objects.get(&target.object)) {
            Some(_) if !target.replace => Err(duplicate(target)),
            _ => Ok(()),
        }
    }

    /// Puts an object in its place, or replaces the one that is there if that was asked for.
    ///
    /// # Errors
    /// [`ErrorCode::DuplicateObject`].
    pub fn insert(&self, target: &Target, object: Object) -> Result<ObjectInfo, WireError> {
        let object = Arc::new(object);
        let mut databases = self.write();
        let objects = databases.entry(target.database.clone()).or_default();
        let Some(slot) = objects.get(&target.object) else {
            let slot = Arc::new(new_slot(target, object));
            objects.insert(target.object.clone(), Arc::clone(&slot));
            return Ok(slot.info());
        };
        if !target.replace {
            return Err(duplicate(target));
        }
        let slot = Arc::clone(slot);
        let old = {
            let mut current = slot.current();
            current.revision += 1;
            std::mem::replace(&mut current.object, object)
        };
        self.revision.fetch_add(1, Ordering::Release);
        // The old object may be the last of its kind and large: it is freed outside the lock.
        drop(databases);
        drop(old);
        Ok(slot.info())
    }

    /// Takes an object for a body.
    ///
    /// # Errors
    /// [`ErrorCode::UnknownDatabase`], [`ErrorCode::UnknownObject`].
    pub fn use_object(&self, database: &str, object: &str) -> Result<BodyUse, WireError> {
        find(&self.read(), database, object).map(BodyUse::new)
    }

    /// The counter of replacements.
    pub fn revision(&self) -> u64 {
        self.revision.load(Ordering::Acquire)
    }

    /// Holds all objects as they are, so that a scene takes either none or all of a replacement.
    pub fn hold(&self) -> Unchanged<'_> {
        let databases = self.read();
        Unchanged { _databases: databases, revision: self.revision() }
    }

    /// What is known of one object.
    ///
    /// # Errors
    /// [`ErrorCode::UnknownDatabase`], [`ErrorCode::UnknownObject`].
    pub fn get(&self, database: &str, object: &str) -> Result<ObjectInfo, WireError> {
        find(&self.read(), database, object).map(|slot| slot.info())
    }

    /// The objects of one database, or of all, ordered by database, then name.
    ///
    /// # Errors
    /// [`ErrorCode::UnknownDatabase`].
    pub fn list(&self, database: Option<&str>) -> Result<Vec<ObjectInfo>, WireError> {
        let databases = self.read();
        let infos = |objects: &Objects| objects.values().map(|slot| slot.info()).collect::<Vec<_>>();
        match database {
            None => Ok(databases.values().flat_map(infos).collect()),
            Some(name) => databases.get(name).map(infos).ok_or_else(|| unknown_database(name)),
        }
    }

    /// Removes an object; its database too when it was the last.
    ///
    /// # Errors
    /// [`ErrorCode::UnknownDatabase`], [`ErrorCode::UnknownObject`], [`ErrorCode::ObjectInUse`].
    pub fn unload(&self, database: &str, object: &str) -> Result<(), WireError> {
        let mut databases = self.write();
        let bodies = find(&databases, database, object)?.bodies.load(Ordering::Relaxed);
        if bodies > 0 {
            return Err(WireError::new(
                ErrorCode::ObjectInUse,
                format!("object {object:?} of database {database:?} is used by {bodies} bodies"),
                "remove these bodies or drop their scenes first",
            ));
        }
        let objects = databases.get_mut(database).ok_or_else(|| unknown_database(database))?;
        let removed = objects.remove(object);
        if objects.is_empty() {
            databases.remove(database);
        }
        drop(databases);
        drop(removed);
        Ok(())
    }
}

fn new_slot(target: &Target, object: Arc<Object>) -> Slot {
    Slot {
        database: target.database.clone(),
        name: target.object.clone(),
        current: Mutex::new(Current { object, revision: 0 }),
        bodies: AtomicU64::new(0),
    }
}

fn find<'a>(
    databases: &'a BTreeMap<String, Objects>,
    database: &str,
    object: &str,
) -> Result<&'a Arc<Slot>, WireError> {
    let objects = databases.get(database).ok_or_else(|| unknown_database(database))?;
    objects.get(object).ok_or_else(|| {
        WireError::new(
            ErrorCode::UnknownObject,
            format!("database {database:?} has no object {object:?}"),
            "load it first; `collided list` shows what is there",
        )
    })
}

fn unknown_database(database: &str) -> WireError {
    WireError::new(
        ErrorCode::UnknownDatabase,
        format!("there is no database {database:?}"),
        "load an object into it first; `collided list` shows what is there",
    )
}

fn duplicate(target: &Target) -> WireError {
    WireError::new(
        ErrorCode::DuplicateObject,
        format!("database {:?} already has an object {:?}", target.database, target.object),
        "choose another name, or ask for it to be replaced",
    )
}
