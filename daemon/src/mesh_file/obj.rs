//! Wavefront OBJ.
//!
//! `v x y z` and `f i i/t i//n i/t/n …` are read, with indices from 1 or, negative, back from the last vertex. A vertex may
//! be defined after the polygon that names it. A backslash at the end of a line continues it, `#` begins a comment, and
//! every other statement is skipped.

use std::borrow::Cow;

use collided_kernel::PolygonMesh;

use super::error::{Malformed, Place, excerpt};
use super::text::{Line, Lines, parse_word, point};
use super::{Meter, push_polygon};

const INDEX_REMEDY: &str = "number vertices from 1, or from -1 backwards from the last one";

pub(super) fn parse(bytes: &[u8], meter: &mut Meter<'_>) -> Result<PolygonMesh, Malformed> {
    let mut lines = Lines::of_text(bytes, meter)?;
    let mut mesh = PolygonMesh::default();
    while let Some(line) = lines.next() {
        let whole = continued(line, &mut lines);
        statement(Line { number: line.number, bytes: &whole }, &mut mesh)?;
    }
    Ok(mesh)
}

/// `line` without its comment, joined with the lines that a backslash at its end calls for.
fn continued<'a>(line: Line<'a>, lines: &mut Lines<'a, '_, '_>) -> Cow<'a, [u8]> {
    let mut whole = Cow::Borrowed(line.before_comment().bytes);
    while let Some(start) = whole.trim_ascii_end().strip_suffix(b"\\") {
        let mut joined = start.to_vec();
        joined.push(b' ');
        joined.extend_from_slice(lines.next().map_or(&[][..], |next| next.before_comment().bytes));
        whole = Cow::Owned(joined);
    }
    whole
}

fn statement(line: Line<'_>, mesh: &mut PolygonMesh) -> Result<(), Malformed> {
    let mut words = line.words();
    match words.next() {
        Some(b"v") => mesh.vertices.push(point(&mut words, line.place())?),
        Some(b"f") => {
            let vertex_count = mesh.vertices.len();
            push_polygon(mesh, words.map(|word| vertex_index(word, vertex_count, line.place())))?;
        }
        _ => {}
    }
    Ok(())
}

/// The vertex that a corner names, from 0. `vertex_count` vertices stand before the corner.
fn vertex_index(corner: &[u8], vertex_count: usize, place: Place) -> Result<u32, Malformed> {
    let written = corner.split(|&byte| byte == b'/').next().unwrap_or_default();
    let index: i64 = parse_word(written)
        .ok_or_else(|| Malformed::new(place, format!("{} is not a vertex index", excerpt(corner)), INDEX_REMEDY))?;
    let from_zero = match index {
        0 => return Err(Malformed::new(place, "vertex index 0", INDEX_REMEDY)),
        1.. => index - 1,
        _ => vertex_count as i64 + index,
    };
    u32::try_from(from_zero).map_err(|_| {
        let problem = format!("vertex index {index} after {vertex_count} vertices names none");
        Malformed::new(place, problem, INDEX_REMEDY)
    })
}
