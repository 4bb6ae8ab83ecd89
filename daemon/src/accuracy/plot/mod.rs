//! Work–precision diagrams as SVG: curves of labelled points over logarithmic axes, readable on light and on dark pages.

mod axis;
mod labels;
mod svg;

pub use axis::{Axis, Unit};
pub use svg::{STYLE, draw, escape};

/// A diagram.
#[derive(Debug, Clone, PartialEq)]
pub struct Plot {
    /// Above it.
    pub title: String,
    /// To the right.
    pub x: Axis,
    /// Upwards.
    pub y: Axis,
    /// In the order of the legend.
    pub curves: Vec<Curve>,
}

/// Points of one colour and shape, joined in their order.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// In the legend.
    pub name: String,
    /// A curve that stands beside another of the same colour, with dashes instead of labels.
    pub companion: bool,
    /// Its colour and shape.
    pub style: usize,
    /// In the order in which they are joined.
    pub points: Vec<Point>,
}

/// A point of a curve.
#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    /// To the right.
    pub x: f64,
    /// How far `x` spreads.
    pub spread: [f64; 2],
    /// Upwards; 0 stands on a line of its own below the axis.
    pub y: f64,
    /// Beside it.
    pub label: String,
}

impl Plot {
    /// Whether there is nothing to see.
    pub fn is_empty(&self) -> bool {
        self.curves.iter().all(|curve| curve.points.is_empty())
    }

    fn points(&self) -> impl Iterator<Item = &Point> {
        self.curves.iter().flat_map(|curve| &curve.points)
    }
}
