//! The whole pipeline on real meshes against its brute-force twin, and on small random ones against the oracle.

use std::sync::{Arc, LazyLock};

use collided_kernel::{Effects, Object};
use collided_protocol::report::Relation;
use collided_protocol::step::Rows;
use collided_tests::kernel_pair::{self, KernelPair, Outcome};
use collided_tests::meshes;
use collided_tests::oracle::{self, Surface};
use collided_tests::small_meshes::small_mesh;
use collided_tests::transforms::{Linear, direction, linear, placed};
use proptest::array::uniform3;
use proptest::prelude::*;
use proptest::sample::select;
use rayon::ThreadPool;

/// Every mesh of the project, at the order that the kernel chooses.
static SHIPPED: LazyLock<Vec<Arc<Object>>> =
    LazyLock::new(|| meshes::SHIPPED.iter().map(|name| meshes::shipped(name, None)).collect());

static POOLS: LazyLock<[ThreadPool; 2]> = LazyLock::new(kernel_pair::pools);

/// Two objects and where they are.
#[derive(Clone)]
struct Placement {
    objects: [Arc<Object>; 2],
    rows: [Rows; 2],
}

impl Placement {
    /// The bodies' centres are apart by `offset`.
    fn new(objects: [Arc<Object>; 2], linear: [Linear; 2], offset: [f64; 3]) -> Placement {
        let rows = [placed(&objects[0], &linear[0], [0.0; 3]), placed(&objects[1], &linear[1], offset)];
        Placement { objects, rows }
    }

    fn swapped(&self) -> Placement {
        let ([a, b], [rows_a, rows_b]) = (self.objects.clone(), self.rows);
        Placement { objects: [b, a], rows: [rows_b, rows_a] }
    }

    fn step(&self, effects: Effects) -> Outcome {
        let [a, b] = &self.objects;
        KernelPair::new(a, b, effects).step(self.rows[0], self.rows[1]).expect("the transforms are finite")
    }

    fn brute_force(&self) -> Outcome {
        kernel_pair::brute_force(self.objects.each_ref().map(|object| &**object), self.rows.each_ref())
    }

    /// Whatever is named first, however many threads: what the twin finds, and the same verdict when only that is asked for.
    fn check(&self) -> Result<(), TestCaseError> {
        let expected = self.brute_force();
        for pool in POOLS.iter() {
            let (there, back, alone) = pool.install(|| {
                let swapped = self.swapped();
                (
                    self.step(Effects::POLYGON_PAIRS),
                    swapped.step(Effects::POLYGON_PAIRS),
                    self.step(Effects::INTERFERENCE),
                )
            });
            let threads = pool.current_num_threads();
            prop_assert!(there == expected, "{} threads: {}", threads, difference(&there, &expected));
            let back = back.swapped();
            prop_assert!(back == expected, "{} threads, swapped: {}", threads, difference(&back, &expected));
            prop_assert_eq!(alone.interfering, expected.interfering);
            prop_assert!(alone.polygon_pairs.is_empty() && alone.relation == Relation::None);
        }
        Ok(())
    }
}

/// The pairs that only one of the two has: short enough to read.
fn difference(found: &Outcome, expected: &Outcome) -> String {
    let only = |of: &Outcome, other: &Outcome| {
        let missing = of.polygon_pairs.iter().filter(|pair| !other.polygon_pairs.contains(pair));
        missing.take(10).copied().collect::<Vec<_>>()
    };
    let (extra, missing) = (only(found, expected), only(expected, found));
    format!("extra {extra:?}, missing {missing:?}, relation {:?}, not {:?}", found.relation, expected.relation)
}

fn shipped_pair() -> impl Strategy<Value = [Arc<Object>; 2]> {
    let mesh = || (0..SHIPPED.len()).prop_map(|i| Arc::clone(&SHIPPED[i]));
    (mesh(), mesh()).prop_map(|(a, b)| [a, b])
}

/// Moves the second body along `offset` from where the bodies meet to where they do not, and stops at neighbouring positions.
fn nearest_contact(objects: &[Arc<Object>; 2], linear: [Linear; 2], offset: [f64; 3]) -> [Placement; 2] {
    let at = |reach: f64| Placement::new(objects.clone(), linear, offset.map(|x| x * reach));
    let (mut meeting, mut apart) = (0.0, 4.0);
    for _ in 0..52 {
        let middle = f64::midpoint(meeting, apart);
        let interfering = at(middle).step(Effects::INTERFERENCE).interfering;
        *(if interfering { &mut meeting } else { &mut apart }) = middle;
    }
    [at(meeting), at(apart)]
}

fn small_transform() -> impl Strategy<Value = Rows> {
    let whole = uniform3(uniform3(select(vec![-1.0, 0.0, 0.0, 1.0, 2.0])));
    let shift = uniform3((-2..=2i32).prop_map(|x| f64::from(x) / 2.0));
    (prop_oneof![whole, linear()], shift)
        .prop_map(|(linear, shift)| [0, 1, 2].map(|i| [linear[i][0], linear[i][1], linear[i][2], shift[i]]))
}

fn oracle_outcome(meshes: [&Object; 2], rows: [Rows; 2]) -> Outcome {
    let polygon_of = meshes.map(|mesh| (0..mesh.triangle_count()).map(|t| mesh.polygon_of(t)).collect::<Vec<_>>());
    let vertices = [0, 1].map(|i| oracle::world_vertices(&rows[i], meshes[i].vertices()));
    let [a, b] = [0, 1].map(|i| Surface {
        vertices: &vertices[i],
        triangles: meshes[i].triangles(),
        polygon_of: &polygon_of[i],
    });
    Outcome::of(oracle::polygon_pairs(a, b))
}

fn config(cases: u32) -> ProptestConfig {
    ProptestConfig { cases, max_shrink_iters: 200, failure_persistence: None, ..ProptestConfig::default() }
}

proptest! {
    #![proptest_config(config(16))]

    #[test]
    fn real_meshes_at_random_poses(
        objects in shipped_pair(), a in linear(), b in linear(), offset in direction(), reach in 0.0..1.2,
    ) {
        Placement::new(objects, [a, b], offset.map(|x| x * reach)).check()?;
    }
}

proptest! {
    #![proptest_config(config(6))]

    #[test]
    fn real_meshes_in_and_out_of_contact_by_the_smallest_motion(
        objects in shipped_pair(), a in linear(), b in linear(), offset in direction(),
    ) {
        for placement in nearest_contact(&objects, [a, b], offset) {
            placement.check()?;
        }
    }
}

proptest! {
    #![proptest_config(config(2000))]

    #[test]
    fn small_meshes_as_the_oracle(
        a in small_mesh(), b in small_mesh(), rows_a in small_transform(), rows_b in small_transform(), order in 0..=20u32,
    ) {
        let objects = [a, b].map(|mesh| meshes::build(mesh, Some(order)));
        let expected = oracle_outcome([&objects[0], &objects[1]], [rows_a, rows_b]);
        prop_assert_eq!(Placement { objects, rows: [rows_a, rows_b] }.step(Effects::POLYGON_PAIRS), expected);
    }
}

#[test]
fn a_mesh_on_itself() {
    for object in SHIPPED.iter() {
        let still = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let placement = Placement::new([Arc::clone(object), Arc::clone(object)], [still; 2], [0.0; 3]);
        placement.check().unwrap_or_else(|error| panic!("{error}"));
    }
}

/// One placement of each kind: deep, grazing, flattened, mirrored and sheared.
fn fixed_placements(a: &Arc<Object>, b: &Arc<Object>) -> Vec<Placement> {
    let turned = [[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]];
    let still = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let flattened = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.5, 0.25, 0.0]];
    let mirrored = [[-1.0, 0.3, 0.0], [0.0, 0.7, 0.2], [0.0, 0.0, 1.3]];
    let objects = [Arc::clone(a), Arc::clone(b)];
    let place = |linear_b, offset| Placement::new(objects.clone(), [still, linear_b], offset);
    let mut placements =
        vec![place(turned, [0.3, 0.1, -0.2]), place(flattened, [0.1, 0.05, 0.15]), place(mirrored, [-0.4, 0.2, 0.3])];
    placements.extend(nearest_contact(&objects, [still, turned], [0.7, -0.2, 0.4]));
    placements
}

#[test]
fn every_order_gives_the_same_report() {
    for (name_a, name_b) in [("rob", "env"), ("low_poly_bunny", "low_poly_bunny"), ("spot", "rob")] {
        let [a, b] = [name_a, name_b].map(|name| meshes::shipped(name, None));
        let placements = fixed_placements(&a, &b);
        let expected: Vec<Outcome> = placements.iter().map(Placement::brute_force).collect();
        for order in 0..=24 {
            let [a, b] = [name_a, name_b].map(|name| meshes::shipped(name, Some(order)));
            let mut pair = KernelPair::new(&a, &b, Effects::POLYGON_PAIRS);
            for (placement, expected) in placements.iter().zip(&expected) {
                let found = pair.step(placement.rows[0], placement.rows[1]).expect("the transforms are finite");
                assert!(found == *expected, "{name_a} and {name_b}, order {order}: {}", difference(&found, expected));
            }
        }
    }
}
