//! The numbers after the header, in text or in bytes.

use std::fmt;

use super::super::Meter;
use super::super::error::{Malformed, Place, excerpt};
use super::super::text::{Line, Lines, number, parse_word};
use super::LENGTH_REMEDY;
use super::header::Element;

/// Order of the bytes of a number.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum ByteOrder {
    Little,
    Big,
}

/// The type of a number.
#[derive(Clone, Copy)]
pub(super) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    pub fn of_name(name: &[u8]) -> Option<Scalar> {
        Some(match name {
            b"char" | b"int8" => Scalar::I8,
            b"uchar" | b"uint8" => Scalar::U8,
            b"short" | b"int16" => Scalar::I16,
            b"ushort" | b"uint16" => Scalar::U16,
            b"int" | b"int32" => Scalar::I32,
            b"uint" | b"uint32" => Scalar::U32,
            b"float" | b"float32" => Scalar::F32,
            b"double" | b"float64" => Scalar::F64,
            _ => return None,
        })
    }

    const fn size(self) -> usize {
        match self {
            Scalar::I8 | Scalar::U8 => 1,
            Scalar::I16 | Scalar::U16 => 2,
            Scalar::I32 | Scalar::U32 | Scalar::F32 => 4,
            Scalar::F64 => 8,
        }
    }

    const fn is_whole(self) -> bool {
        !matches!(self, Scalar::F32 | Scalar::F64)
    }

    /// The value whose little-endian bytes begin `bytes`.
    fn decode(self, bytes: [u8; 8]) -> Value {
        let [b0, b1, b2, b3, ..] = bytes;
        match self {
            Scalar::I8 => Value::Whole(i8::from_le_bytes([b0]).into()),
            Scalar::U8 => Value::Whole(b0.into()),
            Scalar::I16 => Value::Whole(i16::from_le_bytes([b0, b1]).into()),
            Scalar::U16 => Value::Whole(u16::from_le_bytes([b0, b1]).into()),
            Scalar::I32 => Value::Whole(i32::from_le_bytes([b0, b1, b2, b3]).into()),
            Scalar::U32 => Value::Whole(u32::from_le_bytes([b0, b1, b2, b3]).into()),
            Scalar::F32 => Value::Number(f32::from_le_bytes([b0, b1, b2, b3]).into()),
            Scalar::F64 => Value::Number(f64::from_le_bytes(bytes)),
        }
    }
}

/// A number of the file.
#[derive(Clone, Copy)]
pub(super) enum Value {
    Whole(i64),
    Number(f64),
}

impl Value {
    /// The value as a coordinate. No whole type of PLY has more digits than an f64.
    pub fn as_number(self) -> f64 {
        match self {
            Value::Whole(whole) => whole as f64,
            Value::Number(number) => number,
        }
    }
}

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Value::Whole(whole) => write!(f, "{whole}"),
            Value::Number(number) => write!(f, "{number:?}"),
        }
    }
}

/// The numbers of the file, one after the other.
pub(super) trait Values {
    /// Goes to the next entry of `element`.
    fn begin_entry(&mut self, element: &Element) -> Result<(), Malformed>;
    /// The next number of the entry; `property` is the name of its column.
    fn next(&mut self, scalar: Scalar, property: &str) -> Result<Value, Malformed>;
    /// Checks that nothing of the entry is left.
    fn end_entry(&mut self) -> Result<(), Malformed>;
    /// Where the number read last stands.
    fn place(&self) -> Place;
}

/// Numbers in text, a line for each entry.
pub(super) struct TextValues<'a, 'l, 'm, 'p> {
    lines: &'l mut Lines<'a, 'm, 'p>,
    line: Line<'a>,
}

impl<'a, 'l, 'm, 'p> TextValues<'a, 'l, 'm, 'p> {
    pub fn new(lines: &'l mut Lines<'a, 'm, 'p>) -> Self {
        TextValues { lines, line: Line { number: 1, bytes: b"" } }
    }

    /// Takes the next word off the line.
    fn next_word(&mut self) -> Option<&'a [u8]> {
        let word = self.line.words().next()?;
        let start = self.line.bytes.trim_ascii_start();
        self.line.bytes = &start[word.len()..];
        Some(word)
    }
}

impl Values for TextValues<'_, '_, '_, '_> {
    fn begin_entry(&mut self, element: &Element) -> Result<(), Malformed> {
        loop {
            self.line = self.lines.next().ok_or_else(|| {
                let problem = format!("the file ends before all {} entries of \"{}\"", element.count, element.name);
                Malformed::new(self.lines.place(), problem, LENGTH_REMEDY)
            })?;
            if self.line.words().next().is_some() {
                return Ok(());
            }
        }
    }

    fn next(&mut self, scalar: Scalar, property: &str) -> Result<Value, Malformed> {
        let place = self.place();
        let word = self.next_word();
        if let Some(whole) = word.filter(|_| scalar.is_whole()).and_then(parse_word) {
            return Ok(Value::Whole(whole));
        }
        number(word, &format!("property \"{property}\""), place).map(Value::Number)
    }

    fn end_entry(&mut self) -> Result<(), Malformed> {
        match self.line.words().next() {
            None => Ok(()),
            Some(word) => {
                let problem = format!("{} after the last property of the entry", excerpt(word));
                Err(Malformed::new(self.place(), problem, "give each entry a line with the properties of the header"))
            }
        }
    }

    fn place(&self) -> Place {
        self.line.place()
    }
}

/// Numbers in bytes, without anything between them.
pub(super) struct BinaryValues<'a, 'm, 'p> {
    bytes: &'a [u8],
    position: usize,
    order: ByteOrder,
    meter: &'m mut Meter<'p>,
}

impl<'a, 'm, 'p> BinaryValues<'a, 'm, 'p> {
    pub fn new(bytes: &'a [u8], position: usize, order: ByteOrder, meter: &'m mut Meter<'p>) -> Self {
        BinaryValues { bytes, position, order, meter }
    }

    /// What was not read.
    pub fn left(&self) -> &'a [u8] {
        &self.bytes[self.position..]
    }
}

impl Values for BinaryValues<'_, '_, '_> {
    fn begin_entry(&mut self, _: &Element) -> Result<(), Malformed> {
        self.meter.at(self.position);
        Ok(())
    }

    fn next(&mut self, scalar: Scalar, property: &str) -> Result<Value, Malformed> {
        let size = scalar.size();
        let Some(written) = self.left().get(..size) else {
            let problem = format!("the file ends in property \"{property}\"");
            return Err(Malformed::new(self.place(), problem, LENGTH_REMEDY));
        };
        let mut bytes = [0; 8];
        bytes[..size].copy_from_slice(written);
        if self.order == ByteOrder::Big {
            bytes[..size].reverse();
        }
        self.position += size;
        Ok(scalar.decode(bytes))
    }

    fn end_entry(&mut self) -> Result<(), Malformed> {
        Ok(())
    }

    fn place(&self) -> Place {
        Place::Byte(self.position as u64)
    }
}
