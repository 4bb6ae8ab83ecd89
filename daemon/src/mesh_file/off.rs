//! Geomview's object file format (OFF), text.
//!
//! The header word may carry the prefixes `ST`, `C` and `N`, or be left out; the counts may stand in its line or the next
//! one. A vertex is the first three numbers of its line, whatever normals, colours and texture coordinates follow, and a
//! colour may follow the corners of a polygon. `#` begins a comment.

use collided_kernel::PolygonMesh;

use super::error::{Malformed, Place, excerpt};
use super::text::{Line, Lines, point, whole};
use super::{Meter, push_polygon};

const COUNT_REMEDY: &str = "make the counts in the header fit the lines that follow";

pub(super) fn parse(bytes: &[u8], meter: &mut Meter<'_>) -> Result<PolygonMesh, Malformed> {
    let mut lines = Lines::of_text(bytes, meter)?;
    let Counts { vertices, polygons } = header(&mut lines)?;
    let mut mesh = PolygonMesh::default();
    for index in 0..vertices {
        let line = counted_line(&mut lines, "vertex", index, vertices)?;
        mesh.vertices.push(point(&mut line.words(), line.place())?);
    }
    for index in 0..polygons {
        polygon(counted_line(&mut lines, "polygon", index, polygons)?, &mut mesh)?;
    }
    match lines.next_filled() {
        None => Ok(mesh),
        Some(line) => {
            let problem = format!("{} after the last of {polygons} polygons", excerpt(line.bytes));
            Err(Malformed::new(line.place(), problem, COUNT_REMEDY))
        }
    }
}

struct Counts {
    vertices: u64,
    polygons: u64,
}

fn header(lines: &mut Lines<'_, '_, '_>) -> Result<Counts, Malformed> {
    let first = lines.next_filled().ok_or_else(|| no_header(lines.place(), "the file is empty".into()))?;
    let bytes = after_keyword(first)?;
    let rest = Line { bytes, ..first };
    if rest.words().next().is_some() {
        return counts(rest);
    }
    match lines.next_filled() {
        Some(line) => counts(line),
        None => Err(no_header(lines.place(), "the file ends before its counts".into())),
    }
}

/// What follows the header word in its line; the whole line when it begins with a number.
fn after_keyword(line: Line<'_>) -> Result<&[u8], Malformed> {
    let bytes = line.bytes.trim_ascii();
    let prefixes = [&b"ST"[..], b"C", b"N"];
    let keyword = prefixes.into_iter().fold(bytes, |rest, prefix| rest.strip_prefix(prefix).unwrap_or(rest));
    match keyword.strip_prefix(b"OFF") {
        Some(rest) if rest.trim_ascii_start().starts_with(b"BINARY") => {
            let remedy = "convert the mesh to text OFF, or to PLY or STL, of which binary files are read";
            Err(Malformed::new(line.place(), "a binary OFF file", remedy))
        }
        Some(rest) => Ok(rest),
        None if line.words().all(|word| word.iter().all(u8::is_ascii_digit)) => Ok(bytes),
        None => Err(no_header(line.place(), format!("{} is no header of a mesh in three dimensions", excerpt(bytes)))),
    }
}

fn no_header(place: Place, problem: String) -> Malformed {
    Malformed::new(
        place,
        problem,
        "begin the file with OFF, COFF, NOFF or STOFF, then the numbers of vertices, polygons and edges",
    )
}

/// The counts of vertices and polygons; that of edges, which may be missing, is not used.
fn counts(line: Line<'_>) -> Result<Counts, Malformed> {
    let mut words = line.words();
    let vertices = whole(words.next(), "the number of vertices", line.place())?;
    let polygons = whole(words.next(), "the number of polygons", line.place())?;
    Ok(Counts { vertices, polygons })
}

fn counted_line<'a>(lines: &mut Lines<'a, '_, '_>, what: &str, index: u64, count: u64) -> Result<Line<'a>, Malformed> {
    lines.next_filled().ok_or_else(|| {
        Malformed::new(lines.place(), format!("the file ends at {what} {index} of {count}"), COUNT_REMEDY)
    })
}

fn polygon(line: Line<'_>, mesh: &mut PolygonMesh) -> Result<(), Malformed> {
    let mut words = line.words();
    let count: u32 = whole(words.next(), "the number of corners", line.place())?;
    push_polygon(mesh, (0..count).map(|_| whole(words.next(), "a vertex index", line.place())))
}
