//! The objects of a scene file in the daemon, under a database of their own, as long as they are needed.

use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};

use collided_client::{Client, Database, Mesh, Object};

use super::error::CheckError;
use crate::load_bar::LoadBar;
use crate::scene_file::{self, SceneFile, Source};

/// Loaded objects, in the order of the file. Unloaded when dropped.
pub(super) struct Objects {
    database: Database,
    loaded: Vec<Object>,
}

impl Objects {
    pub fn load(client: &Client, path: &Path, file: &SceneFile) -> Result<Objects, CheckError> {
        let database = client.database(database_name());
        let mut objects = Objects { database, loaded: Vec::with_capacity(file.objects.len()) };
        for object in &file.objects {
            let loaded = objects.load_one(object).map_err(|source| CheckError::Object {
                path: path.to_owned(),
                object: object.name.clone(),
                source: source.into(),
            })?;
            objects.loaded.push(loaded);
        }
        Ok(objects)
    }

    fn load_one(&self, object: &scene_file::Object) -> Result<Object, collided_client::Error> {
        let bar = LoadBar::new(&object.name);
        let loading = self.database.loading(&object.name).on_progress(bar.observer());
        let loading = match object.order {
            Some(order) => loading.order(order),
            None => loading,
        };
        match &object.source {
            Source::File(mesh) => loading.file(mesh),
            Source::Inline(mesh) => loading.mesh(&Mesh {
                vertices: &mesh.vertices,
                corner_counts: &mesh.corner_counts,
                corners: &mesh.corners,
            }),
        }
    }

    /// The object at this place in the file.
    pub fn get(&self, place: usize) -> &Object {
        &self.loaded[place]
    }
}

/// A name that no other check has: not one in another container with the same process id, nor one that was killed, and has
/// left its objects in a running daemon.
fn database_name() -> String {
    let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    format!("check-{}-{:x}", std::process::id(), now.as_nanos())
}

impl Drop for Objects {
    fn drop(&mut self) {
        for object in &self.loaded {
            // A daemon that is gone holds nothing any more, and a drop has nobody to tell.
            let _ = self.database.unload(object.name());
        }
    }
}
