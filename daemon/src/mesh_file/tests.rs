use std::path::PathBuf;

use collided_kernel::PolygonMesh;
use proptest::prelude::*;

use super::{Format, Malformed, MeshFileError, Place, parse, read};

const FORMATS: [Format; 4] = [Format::Obj, Format::Stl, Format::Ply, Format::Off];

fn parsed(bytes: &[u8], format: Format) -> Result<PolygonMesh, Malformed> {
    parse(bytes, format, &mut |_, _| {})
}

/// `bytes` hold these polygons, whose vertices are given by position.
fn holds(bytes: &[u8], format: Format, vertex_count: usize, polygons: &[&[[f64; 3]]]) {
    let mesh = parsed(bytes, format).unwrap_or_else(|error| panic!("{}: {error}", String::from_utf8_lossy(bytes)));
    assert_eq!(mesh.vertices.len(), vertex_count);
    let found: Vec<Vec<[f64; 3]>> =
        mesh.polygons().map(|polygon| polygon.iter().map(|&corner| mesh.vertices[corner as usize]).collect()).collect();
    assert_eq!(found, polygons);
}

/// `bytes` are refused at `place`, with `problem` in the message.
fn refused(bytes: &[u8], format: Format, place: Place, problem: &str) {
    let error = parsed(bytes, format).expect_err(problem);
    assert_eq!(error.place, place, "{error}");
    assert!(error.problem.contains(problem), "{error} does not say {problem}");
    assert!(!error.remedy.is_empty());
}

const A: [f64; 3] = [0.0, 0.0, 0.0];
const B: [f64; 3] = [1.0, 0.0, 0.0];
const C: [f64; 3] = [1.0, 1.0, 0.0];
const D: [f64; 3] = [0.0, 1.0, 0.5];

#[test]
fn obj_keeps_n_gons_and_their_order() {
    let text =
        b"# two polygons\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 .5 1.0\nvt 0 0\nf 1 2 3 4\ng side\nf 4/1 3//2 1/1/2\n";
    holds(text, Format::Obj, 4, &[&[A, B, C, D], &[D, C, A]]);
}

#[test]
fn obj_counts_negative_indices_from_the_last_vertex_so_far() {
    let text = b"v 0 0 0\nv 1 0 0\nv 1 1 0\nf -3 -2 -1\nv 0 1 0.5\nf -4 -2 -1";
    holds(text, Format::Obj, 4, &[&[A, B, C], &[A, C, D]]);
}

#[test]
fn obj_joins_continued_lines_and_ends_lines_anyhow() {
    holds(b"v 0 0 \\\n0\r\nv 1 0 0\rv 1 1 0\nf 1 \\\r\n 2 \\\n3 # end \\\n", Format::Obj, 3, &[&[A, B, C]]);
}

#[test]
fn obj_takes_a_vertex_after_its_polygon_and_leaves_the_range_to_the_kernel() {
    let mesh = parsed(b"f 1 2 9\nv 0 0 0\nv 1 0 0\nv 1 1 0\nf\n", Format::Obj).unwrap();
    assert_eq!((mesh.corner_counts, mesh.corners), (vec![3, 0], vec![0, 1, 8]));
}

#[test]
fn obj_refuses_what_is_no_vertex_or_index() {
    for (text, line, problem) in [
        ("v 0 0 0\nf 0 1 1", 2, "vertex index 0"),
        ("v 0 0 0\nf 1 1 -2", 2, "-2 after 1 vertices"),
        ("v 0 0 0\n\nf 1 x 1", 3, "\"x\" is not a vertex index"),
        ("f 1 2 99999999999", 1, "99999999999"),
        ("f 1 2 99999999999999999999", 1, "is not a vertex index"),
        ("v 0 0", 1, "coordinate z is missing"),
        ("v 0 1,5 0", 1, "coordinate y \"1,5\" is not a number"),
    ] {
        refused(text.as_bytes(), Format::Obj, Place::Line(line), problem);
    }
    refused(b"v 0 0 0\n\0", Format::Obj, Place::Byte(8), "a zero byte");
}

#[test]
fn numbers_are_rounded_once_to_f64() {
    let text = b"v 0.1 1.7976931348623157e308 4.9406564584124654e-324\nv 9007199254740993 nan -INF\nf 1 1 1";
    let mesh = parsed(text, Format::Obj).unwrap();
    assert_eq!(mesh.vertices[0], [0.1, f64::MAX, f64::from_bits(1)]);
    assert_eq!(mesh.vertices[1][0], 9007199254740992.0);
    assert!(mesh.vertices[1][1].is_nan());
    assert_eq!(mesh.vertices[1][2], f64::NEG_INFINITY);
}

const SOLID: &str = "solid a b\n facet normal 0 0 1\n  outer loop\n   vertex 0 0 0\n   vertex 1 0 0\n   vertex 1 1 0\n  endloop\n endfacet\nendsolid\n";

#[test]
fn stl_text_welds_equal_positions_and_keeps_n_gons() {
    let second = "SOLID\nfacet normal nan nan nan\nouter loop\nvertex -0 0 0\nvertex 1 0 0\nvertex 1 1 0\nvertex 0 1 .5\nendloop\nendfacet\nendsolid";
    holds((SOLID.to_owned() + second).as_bytes(), Format::Stl, 4, &[&[A, B, C], &[A, B, C, D]]);
}

#[test]
fn stl_text_refuses_what_is_out_of_place_or_missing() {
    for (text, line, problem) in [
        (SOLID.replace("endloop", "facet"), 7, "\"facet\" where \"vertex\" or \"endloop\" was expected"),
        (SOLID.replace("outer loop\n", "\n"), 4, "\"vertex\" where \"outer loop\""),
        (SOLID.replace("endsolid\n", ""), 8, "the file ends where \"facet\" or \"endsolid\""),
        (SOLID.replace("1 1 0", "1 1"), 6, "coordinate z is missing"),
    ] {
        refused(text.as_bytes(), Format::Stl, Place::Line(line), problem);
    }
}

fn binary_stl(header: &[u8], count: u32, triangles: &[[[f32; 3]; 3]]) -> Vec<u8> {
    let mut bytes = header.to_vec();
    bytes.resize(80, 0);
    bytes.extend(count.to_le_bytes());
    for triangle in triangles {
        bytes.extend([0; 12]);
        bytes.extend(triangle.as_flattened().iter().flat_map(|coordinate| coordinate.to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes
}

#[test]
fn stl_binary_is_told_by_its_length_even_when_it_begins_with_solid() {
    let [a, b, c, d] = [A, B, C, D].map(|point| point.map(|coordinate| coordinate as f32));
    for header in ["", "solid like text"] {
        let bytes = binary_stl(header.as_bytes(), 2, &[[a, b, c], [a, c, d]]);
        holds(&bytes, Format::Stl, 4, &[&[A, B, C], &[A, C, D]]);
        let short = &bytes[..bytes.len() - 1];
        refused(short, Format::Stl, Place::Byte(183), "its 2 triangles need 184 bytes");
    }
    assert!(parsed(&binary_stl(b"", 0, &[]), Format::Stl).unwrap().vertices.is_empty());
    refused(b"solo", Format::Stl, Place::Byte(4), "4 bytes, neither text");
}

const PLY_HEADER: &str = "ply\nformat ascii 1.0\ncomment made by hand\nelement vertex 4\nproperty uchar red\nproperty double x\nproperty float y\n\
    property short z\nproperty list uchar float weights\nelement edge 1\nproperty int a\nelement face 2\nproperty list uchar int vertex_indices\n\
    property uchar flags\nend_header\n";

#[test]
fn ply_text_skips_other_elements_and_properties() {
    let data = "255 0 0 0 0\n255 1 0 0 2 .5 .5\n255 1 1 0 1 1\n\n255 0 1 .5 0\n7\n4 0 1 2 3 1\n3 0 2 3 1\n\n";
    holds((PLY_HEADER.to_owned() + data).as_bytes(), Format::Ply, 4, &[&[A, B, C, D], &[A, C, D]]);
}

/// The bytes of a number in one order or the other.
fn ordered<const N: usize>(mut bytes: [u8; N], big: bool) -> [u8; N] {
    if big {
        bytes.reverse();
    }
    bytes
}

fn binary_ply(big: bool) -> Vec<u8> {
    let name = if big { "binary_big_endian" } else { "binary_little_endian" };
    let mut bytes = PLY_HEADER.replace("ascii", name).replace("property short z", "property float z").into_bytes();
    for [x, y, z] in [A, B, C, D] {
        bytes.push(255);
        bytes.extend(ordered(x.to_le_bytes(), big));
        bytes.extend(ordered((y as f32).to_le_bytes(), big));
        bytes.extend(ordered((z as f32).to_le_bytes(), big));
        bytes.push(1);
        bytes.extend([0; 4]);
    }
    bytes.extend([0; 4]);
    for polygon in [&[0i32, 1, 2, 3][..], &[0, 2, 3]] {
        bytes.push(polygon.len() as u8);
        bytes.extend(polygon.iter().flat_map(|index| ordered(index.to_le_bytes(), big)));
        bytes.push(1);
    }
    bytes
}

#[test]
fn ply_binary_is_read_in_either_byte_order() {
    for big in [false, true] {
        let bytes = binary_ply(big);
        holds(&bytes, Format::Ply, 4, &[&[A, B, C, D], &[A, C, D]]);
        let short = &bytes[..bytes.len() - 2];
        refused(
            short,
            Format::Ply,
            Place::Byte(short.len() as u64 - 3),
            "the file ends in property \"vertex_indices\"",
        );
        let long = [&bytes[..], b"xyz"].concat();
        refused(&long, Format::Ply, Place::Byte(bytes.len() as u64), "3 bytes after the last entry");
    }
}

#[test]
fn ply_refuses_headers_and_data_that_are_no_mesh() {
    let triangle = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n\
        property list uchar int vertex_index\nend_header\n0 0 0\n1 0 0\n1 1 0\n3 0 1 2\n";
    holds(triangle.as_bytes(), Format::Ply, 3, &[&[A, B, C]]);
    for (from, to, line, problem) in [
        ("ply\n", "plx\n", 1, "does not begin with \"ply\""),
        ("format ascii 1.0\n", "", 8, "without \"format\""),
        ("float z", "float32x z", 6, "\"float32x\" is no PLY type"),
        ("float z", "float w", 9, "one scalar property \"z\""),
        ("vertex_index", "corners", 9, "one list property \"vertex_indices\""),
        ("element face", "element tristrips", 9, "1 triangle strips"),
        ("vertex 3", "vertex x", 3, "the number of entries \"x\""),
        ("vertex 3", "vertex 2", 12, "\"0\" after the last property"),
        ("face 1", "face 2", 13, "before all 2 entries of \"face\""),
        ("face 1", "face 0", 13, "\"3 0 1 2\" after the last entry"),
        ("3 0 1 2", "3 0 1 -2", 13, "vertex index -2"),
        ("3 0 1 2", "3 0 1 2.5", 13, "vertex index 2.5"),
        ("3 0 1 2", "3 0 1", 13, "property \"vertex_index\" is missing"),
        ("1 1 0", "1 one 0", 12, "property \"y\" \"one\" is not a number"),
    ] {
        refused(triangle.replace(from, to).as_bytes(), Format::Ply, Place::Line(line), problem);
    }
    refused(b"ply\nformat ascii 1.0\n", Format::Ply, Place::Line(2), "before \"end_header\"");
}

#[test]
fn off_takes_prefixes_colours_comments_and_counts_anywhere() {
    for text in [
        "OFF\n4 2 5\n0 0 0\n1 0 0\n1 1 0\n0 1 .5\n4 0 1 2 3\n3 0 2 3",
        "OFF 4 2\n# vertices\n0 0 0\n1 0 0 # second\n\n1 1 0\n0 1 .5\n4 0 1 2 3 255 0 0\n3 0 2 3 0.5 0.5 0.5\n# end\n",
        "OFF4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 .5\n4 0 1 2 3\n3 0 2 3",
        "4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 .5\n4 0 1 2 3\n3 0 2 3",
        "# first\nSTCNOFF\n4 2 0\n0 0 0 0 0 1 9 9\n1 0 0 0 0 1 9 9\n1 1 0 0 0 1 9 9\n0 1 .5 0 0 1 9 9\n4 0 1 2 3\n3 0 2 3",
    ] {
        holds(text.as_bytes(), Format::Off, 4, &[&[A, B, C, D], &[A, C, D]]);
    }
    assert_eq!(parsed(b"OFF 0 0 0", Format::Off).unwrap(), PolygonMesh::default());
}

#[test]
fn off_refuses_counts_that_do_not_fit_and_other_dimensions() {
    let text = "OFF\n3 1 0\n0 0 0\n1 0 0\n1 1 0\n3 0 1 2\n";
    for (from, to, line, problem) in [
        ("OFF", "4OFF", 1, "no header of a mesh in three dimensions"),
        ("OFF", "OFF BINARY", 1, "a binary OFF file"),
        ("3 1 0", "three", 2, "the number of vertices \"three\""),
        ("3 1 0", "3", 2, "the number of polygons is missing"),
        ("3 1 0", "3 2 0", 6, "the file ends at polygon 1 of 2"),
        ("3 1 0", "3 0 0", 6, "\"3 0 1 2\" after the last of 0 polygons"),
        ("3 0 1 2", "3 0 1", 6, "a vertex index is missing"),
        ("3 0 1 2", "3 0 1 -1", 6, "a vertex index \"-1\""),
        ("1 1 0", "1 1", 5, "coordinate z is missing"),
    ] {
        refused(text.replace(from, to).as_bytes(), Format::Off, Place::Line(line), problem);
    }
    refused(b"", Format::Off, Place::Line(1), "the file is empty");
    refused(b"OFF\n", Format::Off, Place::Line(1), "before its counts");
}

#[test]
fn the_meshes_of_the_project_are_whole() {
    for (file, vertices, polygons) in
        [("spot", 2930, 5856), ("env", 6540, 2180), ("rob", 648, 216), ("low_poly_bunny", 350, 696)]
    {
        let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(format!("meshes/{file}.obj"));
        let mut last = (0, 0);
        let mesh = read(&path, &mut |done, total| last = (done, total)).unwrap();
        assert_eq!((mesh.vertices.len(), mesh.polygon_count()), (vertices, polygons), "{file}");
        assert!(mesh.corners.iter().all(|&corner| (corner as usize) < vertices), "{file}");
        assert!(last.0 == last.1 && last.0 > 0, "{file}: progress ends at {last:?}");
    }
}

#[test]
fn files_that_cannot_be_read_are_told_from_those_not_understood() {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    let missing = read(&folder.join("meshes/no such.OBJ"), &mut |_, _| {}).unwrap_err();
    assert!(missing.is_unreadable() && missing.to_string().contains("meshes/no such.OBJ"), "{missing}");
    let ending = read(&folder.join("Cargo.toml"), &mut |_, _| {}).unwrap_err();
    assert!(!ending.is_unreadable() && matches!(ending, MeshFileError::UnknownEnding { .. }), "{ending}");
    assert!(ending.to_string().contains(".ply"), "{ending}");
}

#[test]
fn endings_are_read_in_any_case() {
    let format = |name: &str| Format::of_path(&PathBuf::from(name));
    assert_eq!(format("a.b/c.STL"), Some(Format::Stl));
    assert_eq!(format("c.Obj"), Some(Format::Obj));
    assert_eq!(format("c.gltf"), None);
    assert_eq!(format(".ply"), None);
}

/// Bytes that get further into the parsers than random ones: a good file, cut or with bytes replaced.
fn spoiled() -> impl Strategy<Value = Vec<u8>> {
    let good = prop_oneof![
        Just(b"v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1/1 -2 3//1 \\\n2\n".to_vec()),
        Just(SOLID.as_bytes().to_vec()),
        Just(binary_stl(b"solid", 2, &[[[0.0, 1.0, 2.0]; 3]; 2])),
        Just(binary_ply(false)),
        Just(binary_ply(true)),
        Just(
            (PLY_HEADER.to_owned()
                + "255 0 0 0 0\n255 1 0 0 2 .5 .5\n255 1 1 0 1 1\n255 0 1 .5 0\n7\n4 0 1 2 3 1\n3 0 2 3 1")
                .into_bytes()
        ),
        Just(b"COFF\n3 1 0\n0 0 0 1\n1 0 0 1\n1 1 0 1\n3 0 1 2 255\n".to_vec()),
    ];
    (good, prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..6), any::<prop::sample::Index>())
        .prop_map(|(mut bytes, changes, cut)| {
            for (at, byte) in changes {
                let at = at.index(bytes.len());
                bytes[at] = byte;
            }
            bytes.truncate(cut.index(2 * bytes.len()).max(1));
            bytes
        })
}

/// Any bytes give a mesh whose counts add up, or an error that can be shown.
fn survives(bytes: &[u8]) {
    for format in FORMATS {
        match parsed(bytes, format) {
            Ok(mesh) => {
                assert_eq!(mesh.corner_counts.iter().map(|&count| count as usize).sum::<usize>(), mesh.corners.len())
            }
            Err(error) => assert!(!error.to_string().is_empty()),
        }
    }
}

proptest! {
    #[test]
    fn no_bytes_are_too_bad(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        survives(&bytes);
    }

    #[test]
    fn no_spoiled_file_is_too_bad(bytes in spoiled()) {
        survives(&bytes);
    }

    #[test]
    fn any_f64_survives_text(coordinates in prop::array::uniform3(any::<f64>())) {
        let [x, y, z] = coordinates;
        for (text, format) in [
            (format!("v {x:e} {y} {z:?}"), Format::Obj),
            (format!("OFF 1 0 0\n{x:e} {y} {z:?}"), Format::Off),
        ] {
            let found = parsed(text.as_bytes(), format).unwrap().vertices[0];
            prop_assert_eq!(found.map(f64::to_bits), coordinates.map(f64::to_bits));
        }
    }
}
