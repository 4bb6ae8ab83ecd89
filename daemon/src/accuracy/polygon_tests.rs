//! The polygon tests of a scene alone: the same pairs of triangles in f32, in plain f64 and exactly.

use std::hint::black_box;
use std::time::Instant;

use collided_kernel::affine::world_vertex;
use collided_kernel::candidates::candidates;
use collided_kernel::glam::{DVec3, Vec3};
use collided_kernel::polygon_test::{interference, triangles, triangles_in};
use collided_kernel::predicates::{Tame, is_tame};
use collided_kernel::{Object, Rows};

use super::arithmetic::{PlainF32, PlainF64};
use super::measurement::{Precision, Worth};
use super::scene::StudyScene;
use super::truth::Place;

type Pair<V> = [[V; 3]; 2];

/// No pair of bodies is added to so many tests: a hundred megabytes of triangles say enough.
const ENOUGH: usize = 1 << 19;

/// Candidates of a scene, at world positions, those of a pair of bodies together.
pub struct PolygonTests {
    /// Of each pair of bodies, where its candidates end.
    ends: Vec<usize>,
    double: Vec<Pair<DVec3>>,
    /// The same, rounded.
    single: Vec<Pair<Vec3>>,
    tame: bool,
    exact: Vec<bool>,
}

impl PolygonTests {
    /// The candidates of these pairs of bodies, or of the first ones where there are very many.
    pub fn of(scene: &StudyScene, places: &[Place]) -> PolygonTests {
        let (mut ends, mut double) = (Vec::with_capacity(places.len()), Vec::new());
        for &(step, a, b) in places {
            if double.len() >= ENOUGH {
                break;
            }
            let placed = [a, b].map(|body| (&**scene.object_of(body as usize), &scene.steps[step].end[body as usize]));
            let found = candidates(placed[0], placed[1]);
            double.extend(found.iter().map(|&[p, q]| [corners(placed[0], p), corners(placed[1], q)]));
            ends.push(double.len());
        }
        let single =
            double.iter().map(|pair: &Pair<DVec3>| pair.map(|corners| corners.map(|at| at.as_vec3()))).collect();
        let tame = double.iter().flatten().all(is_tame);
        let exact = double.iter().map(|[a, b]| triangles(a, b).is_some()).collect();
        PolygonTests { ends, double, single, tame, exact }
    }

    /// Nanoseconds of a test, all of them one after the other in one thread.
    pub fn time(&self, precision: Precision) -> f64 {
        let start = Instant::now();
        match (precision, self.tame) {
            (Precision::F32, _) => self.single.iter().for_each(|pair| {
                black_box(in_f32(black_box(pair)));
            }),
            (Precision::F64, _) => self.double.iter().for_each(|[a, b]| {
                black_box(triangles_in(PlainF64, black_box(a), b));
            }),
            (Precision::Exact, true) => self.double.iter().for_each(|[a, b]| {
                black_box(triangles_in(Tame, black_box(a), b));
            }),
            (Precision::Exact, false) => self.double.iter().for_each(|[a, b]| {
                black_box(triangles(black_box(a), b));
            }),
        }
        start.elapsed().as_nanos() as f64 / self.double.len().max(1) as f64
    }

    /// How many tests, and how many verdicts about pairs of bodies, come out wrong.
    pub fn worth(&self, precision: Precision) -> Worth {
        let found: Vec<bool> = match precision {
            Precision::F32 => self.single.iter().map(in_f32).collect(),
            Precision::F64 => self.double.iter().map(|[a, b]| triangles_in(PlainF64, a, b).is_some()).collect(),
            Precision::Exact => self.exact.clone(),
        };
        let wrong_tests = found.iter().zip(&self.exact).filter(|(found, exact)| found != exact).count();
        let starts = [0].into_iter().chain(self.ends.iter().copied());
        let meets = |verdicts: &[bool]| verdicts.contains(&true);
        let wrong =
            starts.zip(&self.ends).filter(|&(start, &end)| meets(&found[start..end]) != meets(&self.exact[start..end]));
        Worth {
            pairs: self.ends.len() as u64,
            wrong: wrong.count() as u64,
            tests: Some([found.len() as u64, wrong_tests as u64]),
            ..Worth::default()
        }
    }
}

fn in_f32([a, b]: &Pair<Vec3>) -> bool {
    let Ok(relation) = interference(PlainF32, a, b);
    relation.is_some()
}

fn corners((object, rows): (&Object, &Rows), triangle: u32) -> [DVec3; 3] {
    object.triangles()[triangle as usize].map(|vertex| world_vertex(rows, object.vertices()[vertex as usize]))
}
