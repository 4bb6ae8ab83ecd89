//! The hard cases through `collided` and through other libraries, as a table.
//!
//! `cargo test -p collided-tests --features parry --test others_on_hard_cases -- --nocapture` prints it.
//!
//! Every library gets the same triangles: the rounded world vertices of a case, in the triangulation of the table, placed by the
//! identity. The f32 library gets them rounded to f32. What is counted is the verdict about surfaces alone.

use std::fmt;
use std::panic::{AssertUnwindSafe, catch_unwind};

use collided_kernel::{Effects, PolygonMesh};
use collided_tests::hardcases::{self, Case};
use collided_tests::kernel_pair::KernelPair;
use collided_tests::{meshes, oracle};

/// World vertices and triangles of one body.
struct Body<'a> {
    vertices: Vec<[f64; 3]>,
    triangles: &'a [[u32; 3]],
}

/// Whether two bodies interfere, or why the library does not say.
type Library = fn(&Body<'_>, &Body<'_>) -> Result<bool, String>;

const LIBRARIES: [(&str, Library); 3] =
    [("collided", collided), ("parry3d-f64 0.31", parry_f64), ("parry3d 0.31", parry_f32)];

fn collided(a: &Body<'_>, b: &Body<'_>) -> Result<bool, String> {
    let object =
        |body: &Body<'_>| meshes::build(PolygonMesh::from_polygons(body.vertices.clone(), body.triangles), None);
    let still = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];
    let outcome = KernelPair::new(&object(a), &object(b), Effects::INTERFERENCE).step(still, still);
    outcome.map(|outcome| outcome.interfering).map_err(|error| error.to_string())
}

/// The same code for either width of parry.
macro_rules! parry {
    ($name:ident, $parry:ident, $real:ty) => {
        fn $name(a: &Body<'_>, b: &Body<'_>) -> Result<bool, String> {
            use $parry::math::{Pose, Vector};
            use $parry::query::intersection_test;
            use $parry::shape::TriMesh;
            let mesh = |body: &Body<'_>| {
                let vertices = body.vertices.iter().map(|[x, y, z]| Vector::new(*x as $real, *y as $real, *z as $real));
                TriMesh::new(vertices.collect(), body.triangles.to_vec()).map_err(|error| error.to_string())
            };
            let still = Pose::identity();
            let found = intersection_test(&still, &mesh(a)?, &still, &mesh(b)?);
            found.map(|found| found.intersecting).map_err(|error| error.to_string())
        }
    };
}

parry!(parry_f64, parry3d_f64, f64);
parry!(parry_f32, parry3d, f32);

/// What a library answered to the valid cases, by their names.
#[derive(Debug, Default, PartialEq, Eq)]
struct Tally {
    right: usize,
    missed: Vec<String>,
    invented: Vec<String>,
    asymmetric: Vec<String>,
    refused: Vec<String>,
    crashed: Vec<String>,
}

impl Tally {
    fn add(&mut self, library: Library, case: &Case, interfering: bool) {
        let world = [(&case.a, &case.rows_a), (&case.b, &case.rows_b)].map(|(mesh, rows)| Body {
            vertices: oracle::world_vertices(rows, &mesh.vertices),
            triangles: &mesh.triangles,
        });
        let ask = |first: &Body<'_>, second: &Body<'_>| catch_unwind(AssertUnwindSafe(|| library(first, second)));
        let (there, back) = (ask(&world[0], &world[1]), ask(&world[1], &world[0]));
        let [Ok(there), Ok(back)] = [there, back] else { return self.crashed.push(case.id.clone()) };
        if there != back {
            self.asymmetric.push(case.id.clone());
        }
        match there {
            Err(reason) => self.refused.push(format!("{} ({reason})", case.id)),
            Ok(found) if found == interfering => self.right += 1,
            Ok(true) => self.invented.push(case.id.clone()),
            Ok(false) => self.missed.push(case.id.clone()),
        }
    }

    fn of(library: Library) -> Tally {
        let mut tally = Tally::default();
        for case in hardcases::static_cases() {
            if let Some(answer) = case.answer() {
                tally.add(library, &case, answer.surface_contact);
            }
        }
        tally
    }

    fn wrong(&self) -> [(&'static str, &[String]); 5] {
        [
            ("FN", &self.missed),
            ("FP", &self.invented),
            ("A-B not B-A", &self.asymmetric),
            ("refused", &self.refused),
            ("crashed", &self.crashed),
        ]
    }
}

impl fmt::Display for Tally {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:>6}", self.right)?;
        self.wrong().into_iter().try_for_each(|(_, cases)| write!(f, " {:>12}", cases.len()))
    }
}

#[test]
fn ours_is_right_everywhere() {
    let [names, ..] = [Tally::default().wrong().map(|(name, _)| name)];
    print!("{:<18} {:>6}", "238 valid cases", "right");
    names.iter().for_each(|name| print!(" {name:>12}"));
    println!();
    let tallies = LIBRARIES.map(|(name, library)| (name, Tally::of(library)));
    tallies.iter().for_each(|(name, tally)| println!("{name:<18} {tally}"));
    for (name, tally) in &tallies {
        tally.wrong().iter().filter(|(_, cases)| !cases.is_empty()).for_each(|(kind, cases)| {
            println!("{name}, {kind}: {}", cases.join(", "));
        });
    }
    assert_eq!(tallies[0].1, Tally { right: 238, ..Tally::default() });
}
