//! Triangles and captions as SVG text.

use std::fmt::Write;

use super::faces::Face;

/// Room round the panels, in pixels.
const MARGIN: f64 = 20.0;
/// Room for a caption above a panel, in pixels.
const CAPTION: f64 = 64.0;

/// Each path's colour fills it and closes the hairline gaps to its neighbours.
const STYLE: &str = "text{font-family:Helvetica,Arial,sans-serif;fill:#22303c}\
    .title{font-size:22px;font-weight:bold}.text{font-size:15px;fill:#5b6b79}\
    path{fill:currentColor;stroke:currentColor;stroke-width:.9;stroke-linejoin:round}";

/// One scene of the picture.
pub struct Panel {
    /// First line of the caption.
    pub title: &'static str,
    /// Second line of the caption.
    pub text: String,
    /// The farthest first.
    pub faces: Vec<Face>,
}

/// The panels, of `width` by `height` pixels each, side by side.
pub fn write(panels: &[Panel], [width, height]: [f64; 2]) -> String {
    let total_width = MARGIN + panels.len() as f64 * (width + MARGIN);
    let total_height = CAPTION + height + MARGIN;
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {total_width} {total_height}\" \
         width=\"{total_width}\" height=\"{total_height}\">\n<style>{STYLE}</style>\n\
         <rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n\
         <linearGradient id=\"sky\" x2=\"0\" y2=\"1\"><stop stop-color=\"#f3f6f9\"/><stop offset=\"1\" stop-color=\"#dfe6ec\"/></linearGradient>\n\
         <clipPath id=\"panel\"><rect width=\"{width}\" height=\"{height}\" rx=\"12\"/></clipPath>\n"
    );
    for (number, panel) in panels.iter().enumerate() {
        let left = MARGIN + number as f64 * (width + MARGIN);
        write_panel(&mut svg, panel, left, [width, height]);
    }
    svg.push_str("</svg>\n");
    svg
}

fn write_panel(svg: &mut String, panel: &Panel, left: f64, [width, height]: [f64; 2]) {
    add(svg, format_args!("<text class=\"title\" x=\"{left}\" y=\"32\">{}</text>\n", panel.title));
    add(svg, format_args!("<text class=\"text\" x=\"{left}\" y=\"54\">{}</text>\n", panel.text));
    add(svg, format_args!("<g transform=\"translate({left} {CAPTION})\" clip-path=\"url(#panel)\">\n"));
    add(svg, format_args!("<rect width=\"{width}\" height=\"{height}\" fill=\"url(#sky)\"/>\n"));
    for face in panel.faces.iter().filter(|face| reaches(face, [width, height])) {
        write_face(svg, face);
    }
    svg.push_str("</g>\n");
}

/// Whether some of a face may lie within the panel.
fn reaches(face: &Face, size: [f64; 2]) -> bool {
    (0..2).all(|axis| {
        let range = face.corners.map(|corner| corner[axis]);
        range.iter().any(|&at| at >= 0.0) && range.iter().any(|&at| at <= size[axis])
    })
}

/// Corners at a tenth of a pixel, the second and third relative to the one before, which is shortest.
fn write_face(svg: &mut String, face: &Face) {
    let [red, green, blue] = face.colour;
    let tenths = face.corners.map(|corner| corner.map(|at| (10.0 * at).round()));
    add(
        svg,
        format_args!(
            "<path color=\"#{red:02x}{green:02x}{blue:02x}\" d=\"M{} {}l",
            tenths[0][0] / 10.0,
            tenths[0][1] / 10.0
        ),
    );
    for (from, to) in [(tenths[0], tenths[1]), (tenths[1], tenths[2])] {
        add(svg, format_args!("{} {} ", (to[0] - from[0]) / 10.0, (to[1] - from[1]) / 10.0));
    }
    svg.push_str("z\"/>\n");
}

fn add(svg: &mut String, text: std::fmt::Arguments<'_>) {
    svg.write_fmt(text).expect("a string takes any text");
}
