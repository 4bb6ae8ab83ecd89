//! Lines, words and numbers of the text formats.

use super::Meter;
use super::error::{Malformed, Place, excerpt};

/// The lines of a text, ended by LF, CR LF or CR, with their numbers.
pub(super) struct Lines<'a, 'm, 'p> {
    bytes: &'a [u8],
    position: usize,
    number: u64,
    meter: &'m mut Meter<'p>,
}

/// One line of a text, without its end.
#[derive(Clone, Copy)]
pub(super) struct Line<'a> {
    /// Counted from 1.
    pub number: u64,
    /// What stands in it.
    pub bytes: &'a [u8],
}

impl<'a, 'm, 'p> Lines<'a, 'm, 'p> {
    pub fn new(bytes: &'a [u8], meter: &'m mut Meter<'p>) -> Self {
        Lines { bytes, position: 0, number: 0, meter }
    }

    /// The lines of a file that must be text from end to end.
    ///
    /// # Errors
    /// When there is a zero byte, which no text has: a mistaken ending would else pass as an empty mesh.
    pub fn of_text(bytes: &'a [u8], meter: &'m mut Meter<'p>) -> Result<Self, Malformed> {
        match bytes.iter().position(|&byte| byte == 0) {
            None => Ok(Lines::new(bytes, meter)),
            Some(at) => Err(Malformed::new(
                Place::Byte(at as u64),
                "a zero byte in a text file",
                "check that the ending of the name fits the file, and that the file is complete",
            )),
        }
    }

    /// Offset of the next line, in bytes.
    pub fn position(&self) -> usize {
        self.position
    }

    /// The place of the line read last; the first one when none was read.
    pub fn place(&self) -> Place {
        Place::Line(self.number.max(1))
    }

    pub fn next(&mut self) -> Option<Line<'a>> {
        let rest = &self.bytes[self.position..];
        if rest.is_empty() {
            return None;
        }
        let length = rest.iter().position(|&byte| byte == b'\n' || byte == b'\r').unwrap_or(rest.len());
        let end = if rest[length..].starts_with(b"\r\n") { 2 } else { 1 };
        self.position += (length + end).min(rest.len());
        self.number += 1;
        self.meter.at(self.position);
        Some(Line { number: self.number, bytes: &rest[..length] })
    }

    /// The next line with something in it besides a comment, which `#` begins; without that comment.
    pub fn next_filled(&mut self) -> Option<Line<'a>> {
        loop {
            let line = self.next()?.before_comment();
            if line.words().next().is_some() {
                return Some(line);
            }
        }
    }
}

impl<'a> Line<'a> {
    pub fn place(&self) -> Place {
        Place::Line(self.number)
    }

    pub fn words(&self) -> impl Iterator<Item = &'a [u8]> + use<'a> {
        self.bytes.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty())
    }

    /// What stands before the first `#`.
    pub fn before_comment(self) -> Line<'a> {
        let length = self.bytes.iter().position(|&byte| byte == b'#').unwrap_or(self.bytes.len());
        Line { bytes: &self.bytes[..length], ..self }
    }
}

/// The next word as a number, rounded to the nearest f64. `nan` and `inf` are numbers here; building the object refuses
/// them with the vertex they stand in.
pub(super) fn number(word: Option<&[u8]>, what: &str, place: Place) -> Result<f64, Malformed> {
    let remedy = "write a decimal number such as -1.5e3, separated by spaces";
    let word = word.ok_or_else(|| Malformed::new(place, format!("{what} is missing"), remedy))?;
    parse_word(word).ok_or_else(|| Malformed::new(place, format!("{what} {} is not a number", excerpt(word)), remedy))
}

/// Three numbers.
pub(super) fn point<'a>(words: &mut impl Iterator<Item = &'a [u8]>, place: Place) -> Result<[f64; 3], Malformed> {
    Ok([
        number(words.next(), "coordinate x", place)?,
        number(words.next(), "coordinate y", place)?,
        number(words.next(), "coordinate z", place)?,
    ])
}

/// The next word as a count or an index from 0.
pub(super) fn whole<T: std::str::FromStr>(word: Option<&[u8]>, what: &str, place: Place) -> Result<T, Malformed> {
    let remedy = "write a whole number, zero or more";
    let word = word.ok_or_else(|| Malformed::new(place, format!("{what} is missing"), remedy))?;
    parse_word(word).ok_or_else(|| {
        Malformed::new(place, format!("{what} {} is not a whole number in range", excerpt(word)), remedy)
    })
}

/// A word as a value; `None` when it is not one.
pub(super) fn parse_word<T: std::str::FromStr>(word: &[u8]) -> Option<T> {
    std::str::from_utf8(word).ok()?.parse().ok()
}
