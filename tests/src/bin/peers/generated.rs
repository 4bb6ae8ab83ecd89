//! Meshes, poses, motions and steps as files.

use std::f64::consts::TAU;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use collided_kernel::affine::IDENTITY;
use collided_kernel::{Effects, Object};
use collided_protocol::step::Rows;
use collided_tests::crowd::{self, Random};
use collided_tests::derived_meshes::subdivided;
use collided_tests::kernel_pair::KernelPair;
use collided_tests::near_contact::{Approach, random_poses};
use collided_tests::{meshes, npy};

use crate::{AnyError, Generated};

/// Cubic units that each body of a crowd, of unit size, has to itself.
const ROOM: f64 = 4.0;
const CROWD_STEPS: usize = 10;

pub fn export(mesh: &Path, subdivide: u32, out: &Path) -> Result<(), AnyError> {
    let triangles = subdivided(&meshes::read(mesh), subdivide);
    let mut file = std::io::BufWriter::new(std::fs::File::create(out)?);
    for count in [triangles.vertices.len(), triangles.polygon_count()] {
        file.write_all(&u32::try_from(count)?.to_le_bytes())?;
    }
    for coordinate in triangles.vertices.iter().flatten() {
        file.write_all(&coordinate.to_le_bytes())?;
    }
    for corner in &triangles.corners {
        file.write_all(&corner.to_le_bytes())?;
    }
    Ok(file.flush()?)
}

pub fn generate(what: Generated, paths: [&PathBuf; 2], count: usize, out: &Path) -> Result<(), AnyError> {
    let [a, b] = paths.map(|path| meshes::build(meshes::read(path), None));
    let still = |rows: Rows| [IDENTITY, rows];
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    pool.install(|| match what {
        Generated::Poses => npy::write(out, &[2], poses(&a, &b, count).into_iter().flat_map(still)),
        Generated::Smooth => npy::write(out, &[2], smooth(&a, &b, count).into_iter().flat_map(still)),
        Generated::Lin | Generated::Rot => {
            let motions = motions(&a, &b, count, what == Generated::Rot);
            let rows = motions.into_iter().flat_map(|[from, to]| [IDENTITY, IDENTITY, from, to]);
            npy::write(out, &[2, 2], rows)
        }
        Generated::Crowd => npy::write(out, &[count], unit_crowd(&a, count)),
    })?;
    Ok(())
}

/// The longest sides of two objects together.
fn size(a: &Object, b: &Object) -> f64 {
    meshes::longest_side(a) + meshes::longest_side(b)
}

/// Approaches of a vertex of B to a vertex of A, from random directions: of any two meshes, be one a room around the other.
fn approaches(a: &Arc<Object>, b: &Arc<Object>, count: usize, seed: u64) -> Vec<Approach> {
    let mut pair = KernelPair::new(a, b, Effects::INTERFERENCE);
    let mut random = Random::new(seed);
    let mut approach = |(rotation, away): ([[f64; 3]; 3], [f64; 3])| {
        let [on_a, on_b] = [a, b].map(|object| {
            let triangle = object.triangles()[(random.unit() * object.triangle_count() as f64) as usize];
            object.vertices()[triangle[0] as usize]
        });
        let turned = rotation.map(|row| (0..3).map(|axis| row[axis] * on_b[axis]).sum::<f64>());
        let middle = [0, 1, 2].map(|axis| on_a[axis] - turned[axis]);
        // Rounding may part the two vertices.
        let inside = -1e-6 * size(a, b);
        let start = Approach { rotation, middle, away, meets: inside, clear: 4.0 * size(a, b) };
        let mut interferes = |rows| pair.step(IDENTITY, rows).expect("good transforms").interfering;
        interferes(start.at(inside)).then(|| start.narrowed(interferes))
    };
    let tries = random_poses(2 * count, seed).into_iter();
    tries.filter_map(&mut approach).take(count).collect()
}

/// In turn apart, near and interfering, or nearly so: a mesh that is pushed in may come out on the other side.
fn poses(a: &Arc<Object>, b: &Arc<Object>, count: usize) -> Vec<Rows> {
    let size = size(a, b);
    let mut random = Random::new(11);
    let place = |(number, near): (usize, &Approach)| match number % 3 {
        0 => near.at(near.clear + size * (0.2 + 0.8 * random.unit())),
        1 => near.at(near.clear + 0.02 * size * random.unit()),
        _ => near.at(near.meets - 0.1 * size * random.unit()),
    };
    approaches(a, b, count, 5).iter().enumerate().map(place).collect()
}

/// B passes the middle of A a little aside, and turns once.
fn smooth(a: &Object, b: &Object, count: usize) -> Vec<Rows> {
    let size = size(a, b);
    let middles = [a, b].map(|object| {
        let container = object.container().expect("the object has polygons");
        [0, 1, 2].map(|axis| 0.5 * (container.min[axis] + container.max[axis]))
    });
    let place = |step: usize| {
        let t = step as f64 / count as f64;
        let (sine, cosine) = (TAU * t).sin_cos();
        let turn = [[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]];
        let aside = [1.2 * size * (t - 0.5), 0.25 * size, 0.05 * size];
        [0, 1, 2].map(|row| {
            let turned: f64 = (0..3).map(|axis| turn[row][axis] * middles[1][axis]).sum();
            let [x, y, z] = turn[row];
            [x, y, z, middles[0][row] + aside[row] - turned]
        })
    };
    (0..count).map(place).collect()
}

/// From apart into the other body or past it; `turning`: with a turn of up to 2 radians about the z axis.
fn motions(a: &Arc<Object>, b: &Arc<Object>, count: usize, turning: bool) -> Vec<[Rows; 2]> {
    let size = size(a, b);
    let mut random = Random::new(13);
    let motion = |near: &Approach| {
        let (sine, cosine) = if turning { (2.0 * random.unit()).sin_cos() } else { (0.0, 1.0) };
        let [from, mut to] = [near.clear + 0.2 * size * random.unit(), near.meets - 0.2 * size].map(|out| near.at(out));
        for column in 0..3 {
            let [x, y] = [from[0][column], from[1][column]];
            (to[0][column], to[1][column]) = (cosine * x - sine * y, sine * x + cosine * y);
        }
        to.iter_mut().for_each(|row| row[3] += 0.2 * size * (random.unit() - 0.5));
        [from, to]
    };
    approaches(a, b, count, 7).iter().map(motion).collect()
}

/// Bodies in the mesh's own size.
fn unit_crowd(object: &Object, count: usize) -> impl Iterator<Item = Rows> {
    let size = meshes::longest_side(object);
    let scaled = move |rows: Rows| rows.map(|[x, y, z, at]| [x, y, z, size * at]);
    crowd::moving(count, CROWD_STEPS, ROOM, 7).into_iter().flatten().map(scaled)
}
