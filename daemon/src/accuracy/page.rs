//! The study as one HTML page that needs no other file.

use super::measurement::Family;
use super::table::Table;
use super::{Report, figures, plot};

const STYLE: &str = "body{font:15px/1.5 Helvetica,Arial,sans-serif;max-width:960px;margin:2em auto;padding:0 1em;background:#fff;color:#24292f}\
table{border-collapse:collapse;font-size:13px;margin:1em 0}th,td{padding:.2em .8em;text-align:right;border-bottom:1px solid #d8dee4}\
th:first-child,td:first-child{text-align:left}svg{max-width:100%;height:auto;border:1px solid #d8dee4;border-radius:8px}\
code{font-size:13px}.advice{font-size:17px;border-left:4px solid #0072b2;padding:.2em 1em}\
@media(prefers-color-scheme:dark){body{background:#0d1117;color:#e6edf3}th,td,svg{border-color:#30363d}}";

/// The page.
pub fn html(report: &Report) -> String {
    let title = escape(&format!("What accuracy costs: {}", report.scene));
    let advice: String = report.advice.iter().rev().map(|sentence| format!("<p>{}.</p>\n", escape(sentence))).collect();
    let families: String = Family::ALL.into_iter().map(|family| section(report, family)).collect();
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<title>{title}</title>\n<style>{STYLE}{}</style>\n</head>\n<body>\n\
         <h1>{title}</h1>\n<div class=\"advice\">\n{advice}</div>\n\
         <p>Times are of a whole step in one process, the median over repetitions; quartiles say how far they spread. Each step is answered \
         from scratch: what the daemon remembers of the step before, which only saves time, is forgotten. Pairs are those \
         of bodies whose global bounding boxes overlap, summed over the steps; all others are decided by these boxes.</p>\n\
         <h2>Scene</h2>\n{}<h2>Machine</h2>\n{}{families}</body>\n</html>\n",
        plot::STYLE,
        facts(&report.facts),
        facts(&report.machine),
    )
}

fn facts(facts: &[(&'static str, String)]) -> String {
    let row =
        |(name, value): &(&str, String)| format!("<tr><td>{}</td><td>{}</td></tr>\n", escape(name), escape(value));
    format!("<table>\n{}</table>\n", facts.iter().map(row).collect::<String>())
}

fn section(report: &Report, family: Family) -> String {
    let Some(table) = Table::of(family, &report.measured) else { return String::new() };
    let figure = figures::plot(family, &report.measured).map_or_else(String::new, |plot| plot::draw(&plot));
    let (title, explanation) = explained(family);
    format!(
        "<h2>{title}</h2>\n<p>{explanation}</p>\n{figure}\n<details><summary>The numbers</summary>\n{}</details>\n",
        rows(&table)
    )
}

fn rows(table: &Table) -> String {
    let cells = |tag: &str, cells: &mut dyn Iterator<Item = &str>| {
        let cells: String = cells.map(|cell| format!("<{tag}>{}</{tag}>", escape(cell))).collect();
        format!("<tr>{cells}</tr>\n")
    };
    let headings = cells("th", &mut table.headings.iter().copied());
    let rows: String = table.rows.iter().map(|row| cells("td", &mut row.iter().map(String::as_str))).collect();
    format!("<table>\n{headings}{rows}</table>\n")
}

/// A heading, and how to read what follows.
fn explained(family: Family) -> (&'static str, &'static str) {
    match family {
        Family::Level => (
            "Levels",
            "How far verdicts are refined. Down is more decided, left is cheaper; the numbers are orders of the voxels. A coarse level \
             proves pairs clear, never wrongly, and leaves the others possible; only polygons prove a pair interfering, so pairs that \
             do interfere stay open at every other level.",
        ),
        Family::Budget => (
            "Budgets",
            "Exact verdicts within a time per step. What is not decided in time is left open, never guessed. The overrun is what 99 of \
             100 steps stay below.",
        ),
        Family::Matrix => (
            "Orders of the voxel matrices",
            "The verdict is exact at every order M; only its price differs. Few large voxels hold many polygons, which must all be \
             compared; many small ones take longer to descend, and more memory.",
        ),
        Family::Distance => (
            "Distance",
            "The effect alone, at relative tolerances over ten decades. Errors are relative to the distance at tolerance 0.",
        ),
        Family::TimeOfContact => (
            "Time of contact",
            "The effect alone, at tolerances over ten decades. The error is how far the bracket reaches from the middle of the \
             tightest one, in shares of the step. A contact that grazes is left open where rounding hides it.",
        ),
        Family::Effect => ("Effects", "Each effect of the scene alone, as exactly as the scene asks for."),
        Family::Arithmetic => (
            "Arithmetics",
            "The polygon tests of the scene alone, without the search for them, one after the other: every pair of triangles that \
             boxes and voxels leave, of the first half a million. In f32 the world vertices are rounded to it first. A wrong test says of two triangles that meet that they do \
             not, or the reverse.",
        ),
    }
}

fn escape(text: &str) -> String {
    plot::escape(text)
}
