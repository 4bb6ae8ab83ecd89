//! A diagram as SVG text.

use std::fmt::{Arguments, Write};

use super::axis::Scale;
use super::labels::Labels;
use super::{Curve, Plot, Point};

const WIDTH: f64 = 940.0;
const HEIGHT: f64 = 520.0;
/// The rectangle that the axes span: left, top, right, bottom.
const LEFT: f64 = 92.0;
const TOP: f64 = 56.0;
const RIGHT: f64 = 686.0;
const BOTTOM: f64 = 452.0;
/// Where the legend begins, and the height of its lines.
const LEGEND: f64 = 706.0;
const LEGEND_LINE: f64 = 24.0;

/// Colours that people with any kind of colour vision tell apart (Okabe and Ito, "Color Universal Design", 2008), darkened
/// where they are too light on white; shapes differ too.
const COLOURS: [&str; 8] = ["#0072b2", "#d55e00", "#009e73", "#b0569a", "#b58900", "#3a9bd4", "#c03a3a", "#7d8590"];

/// The style of all diagrams: a panel of its own, so that labels are readable on any page.
pub const STYLE: &str = ".panel{fill:#fff}.frame{fill:none;stroke:#57606a}.grid{stroke:#d8dee4}.fine{stroke:#eef1f4}.text{font:12px Helvetica,Arial,sans-serif;fill:#24292f}.title{font-size:16px;font-weight:bold}.point{font-size:11px;paint-order:stroke;stroke:#fff;stroke-width:3px}.curve{fill:none;stroke-width:2}.companion{stroke-dasharray:5 4;stroke-width:1.5}.spread{stroke-width:1;opacity:.6}@media(prefers-color-scheme:dark){.panel{fill:#161b22}.frame{stroke:#8b949e}.grid{stroke:#30363d}.fine{stroke:#21262d}.text{fill:#e6edf3}.point{stroke:#161b22}}";

/// The diagram as the text of an SVG file.
pub fn draw(plot: &Plot) -> String {
    let numbers = |number: fn(&Point) -> f64| plot.points().map(number).collect::<Vec<_>>();
    let x = Scale::covering(plot.x.unit, numbers(|point| point.x).into_iter(), [LEFT, RIGHT]);
    let y = Scale::covering(plot.y.unit, numbers(|point| point.y).into_iter(), [BOTTOM, TOP]);
    let mut svg = Svg(format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" width=\"{WIDTH}\" height=\"{HEIGHT}\" role=\"img\">\n\
         <title>{title}</title>\n<style>{STYLE}</style>\n<rect class=\"panel\" width=\"{WIDTH}\" height=\"{HEIGHT}\" rx=\"8\"/>\n",
        title = escape(&plot.title)
    ));
    svg.axes(plot, &x, &y);
    let at = |point: &Point| [x.at(point.x), y.at(point.y)];
    plot.curves.iter().for_each(|curve| svg.curve(curve, &x, &at));
    svg.labels(plot, &at);
    plot.curves.iter().enumerate().for_each(|(line, curve)| svg.legend(curve, line));
    svg.0.push_str("</svg>\n");
    svg.0
}

/// Text that stands between tags.
pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

struct Svg(String);

impl Svg {
    fn add(&mut self, text: Arguments<'_>) {
        self.0.write_fmt(text).expect("a string takes any text");
        self.0.push('\n');
    }

    fn text(&mut self, class: &str, anchor: &str, [x, y]: [f64; 2], text: &str) {
        let text = escape(text);
        self.add(format_args!(
            "<text class=\"text {class}\" text-anchor=\"{anchor}\" x=\"{x:.1}\" y=\"{y:.1}\">{text}</text>"
        ));
    }

    fn line(&mut self, class: &str, [x1, y1]: [f64; 2], [x2, y2]: [f64; 2]) {
        self.add(format_args!("<line class=\"{class}\" x1=\"{x1:.1}\" y1=\"{y1:.1}\" x2=\"{x2:.1}\" y2=\"{y2:.1}\"/>"));
    }

    fn axes(&mut self, plot: &Plot, x: &Scale, y: &Scale) {
        self.text("title", "start", [LEFT, 34.0], &plot.title);
        let [floor, ceiling] = y.pixels();
        x.fine_lines().into_iter().for_each(|at| self.line("fine", [at, ceiling], [at, floor]));
        y.fine_lines().into_iter().for_each(|at| self.line("fine", [LEFT, at], [RIGHT, at]));
        for (at, text) in x.lines() {
            self.line("grid", [at, ceiling], [at, floor]);
            self.text("", "middle", [at, BOTTOM + 20.0], &text);
        }
        for (at, text) in y.lines() {
            self.line("grid", [LEFT, at], [RIGHT, at]);
            self.text("", "end", [LEFT - 8.0, at + 4.0], &text);
        }
        if let Some(zero) = y.zero() {
            self.line("grid", [LEFT, zero], [RIGHT, zero]);
            self.text("", "end", [LEFT - 8.0, zero + 4.0], "none");
        }
        let height = floor - ceiling;
        let width = RIGHT - LEFT;
        self.add(format_args!(
            "<rect class=\"frame\" x=\"{LEFT}\" y=\"{ceiling:.1}\" width=\"{width}\" height=\"{height:.1}\"/>"
        ));
        self.text("", "middle", [0.5 * (LEFT + RIGHT), HEIGHT - 22.0], &plot.x.title);
        let middle = 0.5 * (TOP + BOTTOM);
        let title = escape(&plot.y.title);
        self.add(format_args!(
            "<text class=\"text\" text-anchor=\"middle\" transform=\"translate(20 {middle}) rotate(-90)\">{title}</text>"
        ));
    }

    fn curve(&mut self, curve: &Curve, x: &Scale, at: &dyn Fn(&Point) -> [f64; 2]) {
        let colour = COLOURS[curve.style % COLOURS.len()];
        self.add(format_args!("<g stroke=\"{colour}\" fill=\"{colour}\">"));
        for point in &curve.points {
            let [_, height] = at(point);
            let [low, high] = point.spread.map(|end| x.at(end));
            if high - low > 2.0 {
                self.line("spread", [low, height], [high, height]);
            }
        }
        if curve.points.len() > 1 {
            let points: Vec<String> = curve.points.iter().map(at).map(|[x, y]| format!("{x:.1},{y:.1}")).collect();
            let class = if curve.companion { "curve companion" } else { "curve" };
            self.add(format_args!("<polyline class=\"{class}\" points=\"{}\"/>", points.join(" ")));
        }
        curve.points.iter().for_each(|point| self.mark(curve, at(point)));
        self.add(format_args!("</g>"));
    }

    /// A shape that differs where colours do; hollow for a companion.
    fn mark(&mut self, curve: &Curve, [x, y]: [f64; 2]) {
        let shape = match curve.style % 6 {
            0 => "M-4 0a4 4 0 1 0 8 0a4 4 0 1 0 -8 0z",
            1 => "M-4 -4h8v8h-8z",
            2 => "M0 -5l5 9h-10z",
            3 => "M0 -5.5l5 5.5l-5 5.5l-5 -5.5z",
            4 => "M0 5l5 -9h-10z",
            _ => "M-5 -2h3v-3h4v3h3v4h-3v3h-4v-3h-3z",
        };
        let class = if curve.companion { " class=\"panel\"" } else { "" };
        self.add(format_args!("<path{class} d=\"{shape}\" transform=\"translate({x:.1} {y:.1})\"/>"));
    }

    fn labels(&mut self, plot: &Plot, at: &dyn Fn(&Point) -> [f64; 2]) {
        let mut labels = Labels::around(plot.points().map(at), [LEFT, TOP - 14.0, RIGHT + 12.0, BOTTOM + 8.0]);
        for curve in plot.curves.iter().filter(|curve| !curve.companion) {
            for point in curve.points.iter().filter(|point| !point.label.is_empty()) {
                if let Some(place) = labels.place(at(point), &point.label) {
                    self.text("point", "middle", place, &point.label);
                }
            }
        }
    }

    fn legend(&mut self, curve: &Curve, line: usize) {
        let y = TOP + 8.0 + LEGEND_LINE * line as f64;
        let colour = COLOURS[curve.style % COLOURS.len()];
        let class = if curve.companion { "curve companion" } else { "curve" };
        self.add(format_args!("<g stroke=\"{colour}\" fill=\"{colour}\">"));
        self.line(class, [LEGEND, y], [LEGEND + 30.0, y]);
        self.mark(curve, [LEGEND + 15.0, y]);
        self.add(format_args!("</g>"));
        self.text("", "start", [LEGEND + 38.0, y + 4.0], &curve.name);
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Axis, Unit};
    use super::*;

    fn plot(y: f64) -> Plot {
        let axis = |unit| Axis { title: "a < b & c".into(), unit };
        let point = Point { x: 1e4, spread: [1e4, 2e4], y, label: "7".into() };
        let curve = Curve { name: "voxels".into(), companion: false, style: 1, points: vec![point.clone(), point] };
        Plot { title: "t".into(), x: axis(Unit::Time), y: axis(Unit::Share), curves: vec![curve] }
    }

    #[test]
    fn text_is_escaped_and_points_are_labelled() {
        let svg = draw(&plot(0.5));
        assert!(svg.contains("a &lt; b &amp; c") && svg.contains(">7</text>") && svg.contains(">voxels</text>"));
        assert!(!svg.contains(">none<") && !svg.contains("NaN"));
    }

    #[test]
    fn zeros_are_shown_as_none() {
        assert!(draw(&plot(0.0)).contains(">none</text>"));
    }
}
