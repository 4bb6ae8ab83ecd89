//! The header: what the file holds, and how it is written.

use super::super::error::{Malformed, Place, excerpt};
use super::super::text::{Line, Lines, whole};
use super::values::{ByteOrder, Scalar};

const HEADER_REMEDY: &str = "check the header, or export the mesh again";

/// What the file holds.
pub(super) struct Header {
    pub encoding: Encoding,
    pub elements: Vec<Element>,
}

/// How the data after the header is written.
#[derive(Clone, Copy)]
pub(super) enum Encoding {
    Text,
    Binary(ByteOrder),
}

/// A table of the file.
pub(super) struct Element {
    pub name: String,
    pub count: u64,
    pub properties: Vec<Property>,
}

/// A column of an element.
pub(super) struct Property {
    pub name: String,
    pub kind: Kind,
    /// The axis whose coordinate it holds, for the element `vertex`.
    pub axis: Option<usize>,
    /// Whether it lists the corners of polygons.
    pub is_corners: bool,
}

/// What an entry has in a column.
#[derive(Clone, Copy)]
pub(super) enum Kind {
    Scalar(Scalar),
    List { count: Scalar, item: Scalar },
}

impl Element {
    pub fn is_vertex(&self) -> bool {
        self.name == "vertex"
    }

    fn is_face(&self) -> bool {
        self.name == "face"
    }
}

/// Reads up to the line `end_header`, that line included.
pub(super) fn read(lines: &mut Lines<'_, '_, '_>) -> Result<Header, Malformed> {
    match lines.next() {
        Some(line) if line.bytes.trim_ascii() == b"ply" => {}
        _ => {
            return Err(Malformed::new(Place::Line(1), "the file does not begin with \"ply\"", HEADER_REMEDY));
        }
    }
    let mut encoding = None;
    let mut elements = Vec::new();
    loop {
        let line = lines.next().ok_or_else(|| {
            Malformed::new(
                lines.place(),
                "the file ends before \"end_header\"",
                "export the mesh again: it is not complete",
            )
        })?;
        let mut words = line.words();
        match words.next() {
            Some(b"format") => encoding = Some(read_encoding(line, words.next())?),
            Some(b"element") => elements.push(read_element(line)?),
            Some(b"property") => add_property(line, elements.last_mut())?,
            Some(b"end_header") => break,
            Some(b"comment" | b"obj_info") | None => {}
            Some(_) => return Err(unknown(line)),
        }
    }
    let encoding =
        encoding.ok_or_else(|| Malformed::new(lines.place(), "a header without \"format\"", HEADER_REMEDY))?;
    check(&elements, lines.place())?;
    Ok(Header { encoding, elements })
}

fn unknown(line: Line<'_>) -> Malformed {
    Malformed::new(line.place(), format!("{} is no line of a PLY header", excerpt(line.bytes)), HEADER_REMEDY)
}

fn read_encoding(line: Line<'_>, word: Option<&[u8]>) -> Result<Encoding, Malformed> {
    match word {
        Some(b"ascii") => Ok(Encoding::Text),
        Some(b"binary_little_endian") => Ok(Encoding::Binary(ByteOrder::Little)),
        Some(b"binary_big_endian") => Ok(Encoding::Binary(ByteOrder::Big)),
        _ => Err(unknown(line)),
    }
}

fn read_element(line: Line<'_>) -> Result<Element, Malformed> {
    let mut words = line.words().skip(1);
    let name = words.next().map(|word| String::from_utf8_lossy(word).into_owned()).ok_or_else(|| unknown(line))?;
    let count = whole(words.next(), "the number of entries", line.place())?;
    Ok(Element { name, count, properties: Vec::new() })
}

fn add_property(line: Line<'_>, element: Option<&mut Element>) -> Result<(), Malformed> {
    let element =
        element.ok_or_else(|| Malformed::new(line.place(), "a property before any element", HEADER_REMEDY))?;
    let words: Vec<&[u8]> = line.words().skip(1).collect();
    let scalar = |word: &[u8]| {
        Scalar::of_name(word)
            .ok_or_else(|| Malformed::new(line.place(), format!("{} is no PLY type", excerpt(word)), HEADER_REMEDY))
    };
    let (kind, name) = match words[..] {
        [b"list", count, item, name] => (Kind::List { count: scalar(count)?, item: scalar(item)? }, name),
        [item, name] => (Kind::Scalar(scalar(item)?), name),
        _ => return Err(unknown(line)),
    };
    let name = String::from_utf8_lossy(name).into_owned();
    let axis = ["x", "y", "z"].iter().position(|&axis| axis == name);
    let axis = axis.filter(|_| element.is_vertex() && matches!(kind, Kind::Scalar(_)));
    let is_list = matches!(kind, Kind::List { .. });
    let is_corners = element.is_face() && is_list && (name == "vertex_indices" || name == "vertex_index");
    element.properties.push(Property { name, kind, axis, is_corners });
    Ok(())
}

/// What a mesh needs: each coordinate once, and the corners of its polygons once.
fn check(elements: &[Element], place: Place) -> Result<(), Malformed> {
    let fail = |problem: String, remedy| Err(Malformed::new(place, problem, remedy));
    if let Some(strips) = elements.iter().find(|element| element.name == "tristrips" && element.count > 0) {
        let problem = format!("polygons written as {} triangle strips, which are not read", strips.count);
        return fail(problem, "export the mesh again with the element \"face\"");
    }
    for name in ["vertex", "face"] {
        if elements.iter().filter(|element| element.name == name).count() > 1 {
            return fail(format!("the element \"{name}\" is there twice"), HEADER_REMEDY);
        }
    }
    for element in elements.iter().filter(|element| element.count > 0) {
        let columns =
            |wanted: &dyn Fn(&Property) -> bool| element.properties.iter().filter(|&property| wanted(property)).count();
        for (axis, name) in ["x", "y", "z"].iter().enumerate() {
            if element.is_vertex() && columns(&|property| property.axis == Some(axis)) != 1 {
                return fail(
                    format!("the element \"vertex\" does not have one scalar property \"{name}\""),
                    HEADER_REMEDY,
                );
            }
        }
        if element.is_face() && columns(&|property| property.is_corners) != 1 {
            return fail(
                "the element \"face\" does not have one list property \"vertex_indices\"".into(),
                HEADER_REMEDY,
            );
        }
    }
    Ok(())
}
