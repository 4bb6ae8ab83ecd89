//! Numbers from the issue trackers of other collision libraries, and configurations on which they were measured to be wrong, as
//! polygon meshes: what is expected, what the oracle says, what the kernel says.
//!
//! `cargo test -p collided-tests --test cases_from_issues -- --nocapture` prints the table. Issues about spheres and
//! cylinders are not here: they are not polygon meshes, and stay what they are in any triangulation only approximately.

use collided_kernel::{Effects, PolygonMesh};
use collided_protocol::step::Rows;
use collided_tests::hardcases::{self, Mesh};
use collided_tests::kernel_pair::{KernelPair, Outcome};
use collided_tests::oracle::{self, Triangle};
use collided_tests::{meshes, small_meshes};
use serde::Deserialize;

/// Even and odd orders of the voxel matrices, below, at and above one level of the pyramid.
const ORDERS: [Option<u32>; 5] = [None, Some(0), Some(6), Some(13), Some(20)];

/// Two meshes, where they are, and whether their surfaces have a point in common.
struct Case {
    name: String,
    meshes: [Mesh; 2],
    rows: [Rows; 2],
    interfering: bool,
}

/// A box around the origin of its frame, and its transform.
struct PlacedBox {
    mesh: Mesh,
    rows: Rows,
}

fn still() -> Rows {
    small_meshes::at(0.0, 0.0, 0.0)
}

fn parse<'de, T: Deserialize<'de>>(text: &'de str) -> T {
    serde_json::from_str(text).unwrap_or_else(|error| panic!("malformed case: {error}"))
}

/// The twelve triangles of a box of the given sides around the origin.
fn cuboid(sides: [f64; 3]) -> Mesh {
    let mut mesh = hardcases::unit_cube();
    mesh.vertices.iter_mut().for_each(|vertex| *vertex = [0, 1, 2].map(|axis| (vertex[axis] - 0.5) * sides[axis]));
    mesh
}

fn soup(triangles: &[Triangle]) -> Mesh {
    let corners: Vec<[u32; 3]> = (0..triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    Mesh {
        vertices: triangles.concat(),
        polygons: corners.iter().map(|triangle| triangle.to_vec()).collect(),
        polygon_of: (0..corners.len() as u32).collect(),
        triangles: corners,
    }
}

/// The two boxes of an issue of FCL, or of Coal, which writes rotation and translation apart.
fn boxes(text: &str) -> [PlacedBox; 2] {
    #[derive(Deserialize)]
    struct Shape {
        r#box: [f64; 3],
        #[serde(rename = "X")]
        rows: Option<Rows>,
        #[serde(rename = "R", default)]
        rotation: [[f64; 3]; 3],
        #[serde(default)]
        t: [f64; 3],
    }
    #[derive(Deserialize)]
    struct File {
        shape1: Shape,
        shape2: Shape,
    }
    let placed = |shape: Shape| {
        let row = |i: usize| {
            let [x, y, z] = shape.rotation[i];
            [x, y, z, shape.t[i]]
        };
        PlacedBox { mesh: cuboid(shape.r#box), rows: shape.rows.unwrap_or_else(|| [0, 1, 2].map(row)) }
    };
    let file: File = parse(text);
    [placed(file.shape1), placed(file.shape2)]
}

fn box_case(name: &str, text: &str, interfering: bool) -> Case {
    let [a, b] = boxes(text);
    Case { name: name.to_owned(), meshes: [a.mesh, b.mesh], rows: [a.rows, b.rows], interfering }
}

/// Issues about pairs of boxes, whose answers are not stated there but can be computed.
fn box_cases() -> Vec<Case> {
    vec![
        box_case(
            "fcl#395, a thin box and a turned one",
            include_str!("../data/hardcases/from-issues/fcl_395_thin_box_box.json"),
            true,
        ),
        box_case(
            "fcl#493, kissing boxes",
            include_str!("../data/hardcases/from-issues/fcl_493_box_box_kissing.json"),
            true,
        ),
        box_case(
            "coal#604, boxes very close",
            include_str!("../data/hardcases/from-issues/coal_604_box_box_distance.json"),
            false,
        ),
    ]
}

/// Pairs of cubes on which a library was measured to be wrong, by the exact answer.
fn measured_cases() -> impl Iterator<Item = Case> {
    hardcases::cube_cases().into_iter().map(|case| Case {
        interfering: case.surface_contact(),
        name: case.name,
        meshes: [hardcases::unit_cube(), hardcases::unit_cube()],
        rows: [case.rows_a, case.rows_b],
    })
}

/// Pairs of triangles that are apart and were called intersecting, or led to a panic.
fn triangle_cases() -> impl Iterator<Item = Case> {
    const NAMES: [&str; 4] = ["three-bvh-csg#56, 1", "three-bvh-csg#56, 2", "three-bvh-csg#56, 3", "parry#253"];
    let pairs = hardcases::apart_triangles();
    assert_eq!(pairs.len(), NAMES.len());
    NAMES.into_iter().zip(pairs).map(|(name, (a, b))| Case {
        name: name.to_owned(),
        meshes: [soup(&[a]), soup(&[b])],
        rows: [still(), still()],
        interfering: false,
    })
}

/// A mesh wholly inside another: their surfaces are apart.
fn nested_case() -> Case {
    let meshes = [cuboid([3.0; 3]), cuboid([1.0; 3])];
    Case { name: "fcl#492, nested meshes: surfaces".to_owned(), meshes, rows: [still(), still()], interfering: false }
}

/// The cube of parry#17 at its own tiny size and at others.
fn scaled_cube(scale: f64) -> Mesh {
    #[derive(Deserialize)]
    struct File {
        vertices: Vec<[f64; 3]>,
        indices: Vec<[u32; 3]>,
    }
    let file: File = parse(include_str!("../data/hardcases/from-issues/parry_17_tiny_scale.json"));
    Mesh {
        vertices: file.vertices.iter().map(|vertex| vertex.map(|x| scale * x)).collect(),
        polygons: file.indices.iter().map(|triangle| triangle.to_vec()).collect(),
        polygon_of: (0..file.indices.len() as u32).collect(),
        triangles: file.indices,
    }
}

const SCALES: [f64; 6] = [1.0, 1e-10, 1e-30, 1e-150, 1e-300, 1e150];

/// Beside itself: overlapping by half a side, sharing a face, and one unit in the last place beyond it.
fn scaled_cases(scale: f64) -> [Case; 3] {
    let case = |what: &str, shift: f64, interfering| Case {
        name: format!("parry#17, cubes of side {scale:e}, {what}"),
        meshes: [scaled_cube(scale), scaled_cube(scale)],
        rows: [still(), small_meshes::at(shift, 0.0, 0.0)],
        interfering,
    };
    [
        case("half apart", scale / 2.0, true),
        case("a face shared", scale, true),
        case("next to it", scale.next_up(), false),
    ]
}

fn cases() -> Vec<Case> {
    let mut cases = box_cases();
    cases.push(nested_case());
    cases.extend(triangle_cases());
    cases.extend(SCALES.into_iter().flat_map(scaled_cases));
    cases.extend(measured_cases());
    cases
}

fn by_oracle(case: &Case) -> Outcome {
    let vertices = [0, 1].map(|i| oracle::world_vertices(&case.rows[i], &case.meshes[i].vertices));
    let [a, b] = [0, 1].map(|i| case.meshes[i].surface(&vertices[i]));
    Outcome::of(oracle::polygon_pairs(a, b))
}

fn by_kernel(case: &Case, order: Option<u32>) -> Outcome {
    let [a, b] = case
        .meshes
        .each_ref()
        .map(|mesh| meshes::build(PolygonMesh::from_polygons(mesh.vertices.clone(), &mesh.polygons), order));
    let step = KernelPair::new(&a, &b, Effects::POLYGON_PAIRS).step(case.rows[0], case.rows[1]);
    step.expect("the transforms are finite")
}

fn word(interfering: bool) -> &'static str {
    if interfering { "interfering" } else { "clear" }
}

#[test]
fn the_whole_table() {
    let cases = cases();
    let mut faults = Vec::new();
    println!("{:<50} {:<12} {:<12} {:<12} polygon pairs", "case", "expected", "oracle", "ours");
    for case in &cases {
        let (expected, ours) = (by_oracle(case), by_kernel(case, None));
        let verdicts = [case.interfering, expected.interfering, ours.interfering];
        let [a, b, c] = verdicts.map(word);
        let (pairs, relation) = (ours.polygon_pairs.len(), ours.relation.name());
        println!("{:<50} {a:<12} {b:<12} {c:<12} {pairs} ({relation})", case.name);
        if verdicts != [case.interfering; 3] {
            faults.push(format!("{}: expected {a}, the oracle says {b}, the kernel {c}", case.name));
        }
        let differ = ORDERS.into_iter().filter(|&order| by_kernel(case, order) != expected);
        faults.extend(differ.map(|order| format!("{}: other polygon pairs at order {order:?}", case.name)));
    }
    assert!(faults.is_empty(), "{} faults:\n{}", faults.len(), faults.join("\n"));
    assert_eq!(cases.len(), 3 + 1 + 4 + 3 * SCALES.len() + 20);
}

/// Not the verdict alone: every polygon pair and its relation.
#[test]
fn the_answer_does_not_depend_on_the_scale() {
    let outcomes = SCALES.map(|scale| scaled_cases(scale).map(|case| by_kernel(&case, None)));
    for (scale, outcome) in SCALES.iter().zip(&outcomes) {
        assert_eq!(outcome, &outcomes[0], "scale {scale:e}");
    }
}
