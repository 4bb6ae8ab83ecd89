//! Polygon file format (PLY), text or binary of either byte order.
//!
//! Read are the scalar properties `x`, `y` and `z` of the element `vertex`, of any scalar type, and the list
//! `vertex_indices` (or `vertex_index`) of the element `face`. Other elements and properties are skipped. In text files
//! each entry of an element has a line of its own, and coordinates keep what is written, whatever type the header says.

mod header;
mod values;

use collided_kernel::PolygonMesh;

use super::Meter;
use super::error::{Malformed, Place, excerpt};
use super::text::Lines;
use header::{Element, Encoding, Header, Kind, Property};
use values::{BinaryValues, Scalar, TextValues, Value, Values};

const LENGTH_REMEDY: &str = "make the counts in the header fit the data, or export the mesh again";

pub(super) fn parse(bytes: &[u8], meter: &mut Meter<'_>) -> Result<PolygonMesh, Malformed> {
    let mut lines = Lines::new(bytes, meter);
    let header = header::read(&mut lines)?;
    match header.encoding {
        Encoding::Text => {
            let mesh = elements(&header, &mut TextValues::new(&mut lines))?;
            no_more_lines(&mut lines)?;
            Ok(mesh)
        }
        Encoding::Binary(order) => {
            let position = lines.position();
            let mut values = BinaryValues::new(bytes, position, order, meter);
            let mesh = elements(&header, &mut values)?;
            no_more_bytes(values.place(), values.left())?;
            Ok(mesh)
        }
    }
}

fn no_more_lines(lines: &mut Lines<'_, '_, '_>) -> Result<(), Malformed> {
    while let Some(line) = lines.next() {
        if line.words().next().is_some() {
            let problem = format!("{} after the last entry that the header counts", excerpt(line.bytes));
            return Err(Malformed::new(line.place(), problem, LENGTH_REMEDY));
        }
    }
    Ok(())
}

fn no_more_bytes(place: Place, left: &[u8]) -> Result<(), Malformed> {
    if left.trim_ascii().is_empty() {
        return Ok(());
    }
    let problem = format!("{} bytes after the last entry that the header counts", left.len());
    Err(Malformed::new(place, problem, LENGTH_REMEDY))
}

fn elements(header: &Header, values: &mut impl Values) -> Result<PolygonMesh, Malformed> {
    let mut mesh = PolygonMesh::default();
    // Entries without properties take no room in the file, however many the header counts.
    for element in header.elements.iter().filter(|element| !element.properties.is_empty()) {
        for _ in 0..element.count {
            values.begin_entry(element)?;
            entry(element, values, &mut mesh)?;
            values.end_entry()?;
        }
    }
    Ok(mesh)
}

fn entry(element: &Element, values: &mut impl Values, mesh: &mut PolygonMesh) -> Result<(), Malformed> {
    let mut vertex = [0.0; 3];
    for property in &element.properties {
        match (property.kind, property.axis) {
            (Kind::Scalar(scalar), Some(axis)) => vertex[axis] = values.next(scalar, &property.name)?.as_number(),
            (Kind::Scalar(scalar), None) => drop(values.next(scalar, &property.name)?),
            (Kind::List { count, item }, _) => list(property, count, item, values, mesh)?,
        }
    }
    if element.is_vertex() {
        mesh.vertices.push(vertex);
    }
    Ok(())
}

/// Reads a list: the corners of a polygon, or something to skip.
fn list(
    property: &Property,
    count: Scalar,
    item: Scalar,
    values: &mut impl Values,
    mesh: &mut PolygonMesh,
) -> Result<(), Malformed> {
    let length = index(values.next(count, &property.name)?, "length of the list", property, values.place())?;
    for _ in 0..length {
        let value = values.next(item, &property.name)?;
        if property.is_corners {
            mesh.corners.push(index(value, "vertex index", property, values.place())?);
        }
    }
    if property.is_corners {
        mesh.corner_counts.push(length);
    }
    Ok(())
}

fn index(value: Value, what: &str, property: &Property, place: Place) -> Result<u32, Malformed> {
    match value {
        Value::Whole(whole) => u32::try_from(whole).ok(),
        Value::Number(_) => None,
    }
    .ok_or_else(|| {
        let problem =
            format!("{what} {value} in property \"{}\" is not a whole number from 0 to {}", property.name, u32::MAX);
        Malformed::new(place, problem, "export the mesh again with indices from 0")
    })
}
