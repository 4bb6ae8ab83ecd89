//! What the programs that run poses or motions of two meshes are given.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use collided_kernel::Object;

use crate::meshes;

/// Two mesh files, and the order of their voxel matrices.
#[derive(Debug, clap::Args)]
pub struct TwoMeshes {
    /// First mesh
    #[arg(long)]
    pub mesh_a: PathBuf,
    /// Second mesh
    #[arg(long)]
    pub mesh_b: PathBuf,
    /// Order of the voxel matrices; chosen from the polygons unless given
    #[arg(long)]
    pub order: Option<u32>,
}

impl TwoMeshes {
    /// The two objects as the kernel holds them; prints how large they are.
    ///
    /// # Panics
    /// When a file cannot be read, or the kernel refuses the mesh; the message says why.
    pub fn build(&self) -> [Arc<Object>; 2] {
        let build = |path: &Path| meshes::build(meshes::read(path), self.order);
        let [a, b] = [build(&self.mesh_a), build(&self.mesh_b)];
        println!("orders {} and {}, {} and {} triangles", a.order(), b.order(), a.triangle_count(), b.triangle_count());
        [a, b]
    }
}
