//! Stereolithography (STL), text or binary.
//!
//! The format repeats a vertex for each triangle at it; vertices at equal positions (−0 equals +0) become one here, in the
//! order of their first mention. Normals, names and attribute bytes are skipped. A text loop of more than three vertices
//! is one polygon.

use std::collections::HashMap;

use collided_kernel::PolygonMesh;

use super::error::{Malformed, Place, excerpt};
use super::text::{Line, Lines, point};
use super::{Meter, push_polygon};

/// Length of what stands before the triangles of a binary file, in bytes: a free text and the number of triangles.
const HEADER_LENGTH: usize = 84;
/// Offset of the number of triangles in a binary file.
const COUNT_OFFSET: usize = 80;
/// Length of a triangle in a binary file: normal, three vertices, attribute.
const TRIANGLE_LENGTH: usize = 50;
/// Offset of the first vertex in a triangle.
const VERTEX_OFFSET: usize = 12;
/// Length of a vertex in a triangle: three f32.
const VERTEX_LENGTH: usize = 12;
/// How far a file that begins like text is searched for a zero byte, which tells a binary one.
const SNIFF_LENGTH: usize = 1024;

pub(super) fn parse(bytes: &[u8], meter: &mut Meter<'_>) -> Result<PolygonMesh, Malformed> {
    // Many binary files begin with "solid" too, so the length that the count calls for decides first.
    if binary_length(bytes) == Some(bytes.len() as u64) {
        return Ok(parse_triangles(&bytes[HEADER_LENGTH..], meter));
    }
    let begin = &bytes[..bytes.len().min(SNIFF_LENGTH)];
    if begin.trim_ascii_start().get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid")) && !begin.contains(&0)
    {
        return parse_text(bytes, meter);
    }
    Err(wrong_length(bytes))
}

/// How long a binary file with this beginning must be; `None` when the beginning is not complete.
fn binary_length(bytes: &[u8]) -> Option<u64> {
    let count = bytes.get(COUNT_OFFSET..HEADER_LENGTH)?.first_chunk::<4>()?;
    Some(HEADER_LENGTH as u64 + u64::from(u32::from_le_bytes(*count)) * TRIANGLE_LENGTH as u64)
}

fn wrong_length(bytes: &[u8]) -> Malformed {
    let found = bytes.len();
    let problem = match binary_length(bytes) {
        None => format!(
            "{found} bytes, neither text that begins with \"solid\" nor a binary header of {HEADER_LENGTH} bytes"
        ),
        Some(expected) => {
            let count = (expected - HEADER_LENGTH as u64) / TRIANGLE_LENGTH as u64;
            format!("the file ends here, but its {count} triangles need {expected} bytes")
        }
    };
    Malformed::new(Place::Byte(found as u64), problem, "export the mesh again: the file is not complete, or not STL")
}

fn parse_triangles(bytes: &[u8], meter: &mut Meter<'_>) -> PolygonMesh {
    let mut weld = Weld::default();
    for (number, triangle) in bytes.chunks_exact(TRIANGLE_LENGTH).enumerate() {
        meter.at(HEADER_LENGTH + (number + 1) * TRIANGLE_LENGTH);
        let vertices = triangle[VERTEX_OFFSET..VERTEX_OFFSET + 3 * VERTEX_LENGTH].as_chunks::<VERTEX_LENGTH>().0;
        for vertex in vertices {
            let [x, y, z] =
                [0, 4, 8].map(|at| f32::from_le_bytes([vertex[at], vertex[at + 1], vertex[at + 2], vertex[at + 3]]));
            let corner = weld.index([x.into(), y.into(), z.into()]);
            weld.mesh.corners.push(corner);
        }
        weld.mesh.corner_counts.push(3);
    }
    weld.mesh
}

fn parse_text(bytes: &[u8], meter: &mut Meter<'_>) -> Result<PolygonMesh, Malformed> {
    let mut lines = Lines::of_text(bytes, meter)?;
    let mut weld = Weld::default();
    let mut state = State::File;
    let mut polygon = Vec::new();
    while let Some(line) = lines.next() {
        state = statement(line, state, &mut polygon, &mut weld)?;
    }
    match state {
        State::File => Ok(weld.mesh),
        _ => Err(Malformed::new(
            lines.place(),
            format!("the file ends where {} was expected", state.expected()),
            "export the mesh again: the file is not complete",
        )),
    }
}

/// What a line of a text file stands in.
#[derive(Clone, Copy, PartialEq)]
enum State {
    File,
    Solid,
    Facet,
    Loop,
    AfterLoop,
}

impl State {
    const fn expected(self) -> &'static str {
        match self {
            State::File => "\"solid\"",
            State::Solid => "\"facet\" or \"endsolid\"",
            State::Facet => "\"outer loop\"",
            State::Loop => "\"vertex\" or \"endloop\"",
            State::AfterLoop => "\"endfacet\"",
        }
    }
}

/// Takes in one line and returns what the next one stands in. `polygon` holds the corners of the open loop.
fn statement(line: Line<'_>, state: State, polygon: &mut Vec<u32>, weld: &mut Weld) -> Result<State, Malformed> {
    let mut words = line.words();
    let Some(keyword) = words.next() else {
        return Ok(state);
    };
    match (state, keyword.to_ascii_lowercase().as_slice()) {
        (State::File, b"solid") => Ok(State::Solid),
        (State::Solid, b"facet") => Ok(State::Facet),
        (State::Facet, b"outer") => Ok(State::Loop),
        (State::Loop, b"vertex") => {
            polygon.push(weld.index(point(&mut words, line.place())?));
            Ok(State::Loop)
        }
        (State::Loop, b"endloop") => {
            push_polygon(&mut weld.mesh, polygon.drain(..).map(Ok))?;
            Ok(State::AfterLoop)
        }
        (State::AfterLoop, b"endfacet") => Ok(State::Solid),
        (State::Solid, b"endsolid") => Ok(State::File),
        _ => Err(Malformed::new(
            line.place(),
            format!("{} where {} was expected", excerpt(keyword), state.expected()),
            "check the file, or export the mesh again",
        )),
    }
}

/// A mesh that grows by vertices which are one where their positions are equal.
#[derive(Default)]
struct Weld {
    mesh: PolygonMesh,
    seen: HashMap<[u64; 3], u32>,
}

impl Weld {
    fn index(&mut self, vertex: [f64; 3]) -> u32 {
        // Adding zero turns -0 into +0 and leaves every other number as it is.
        let key = vertex.map(|coordinate| (coordinate + 0.0).to_bits());
        *self.seen.entry(key).or_insert_with(|| {
            self.mesh.vertices.push(vertex);
            (self.mesh.vertices.len() - 1) as u32
        })
    }
}
