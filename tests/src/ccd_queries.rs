//! The queries of `data/ccd/queries` (Wang et al. 2021): two features whose points move on straight lines.

use std::fs;
use std::path::{Path, PathBuf};

use collided_kernel::affine::Rows;
use collided_kernel::motion::Motion;
use collided_kernel::{Object, PolygonMesh};

/// One query.
#[derive(Debug, Clone)]
pub struct Query {
    /// File and number in it, for messages.
    pub name: String,
    /// How many of the four points belong to the first feature: 2 for two edges, 1 for a vertex and a face.
    pub points_of_first: usize,
    /// Positions of the four points at the start and at the end.
    pub positions: [[[f64; 3]; 4]; 2],
    /// Whether they meet.
    pub collides: bool,
}

impl Query {
    /// The two features, each as a polygon whose corners are the unit vectors, and its motion: then the positions are
    /// the matrix's columns, exactly. A segment or a point is a polygon without area.
    pub fn bodies(&self) -> [(PolygonMesh, Motion); 2] {
        let first: Vec<usize> = (0..self.points_of_first).collect();
        let second: Vec<usize> = (self.points_of_first..4).collect();
        [first, second].map(|points| {
            let corner = |i: u32| i.min(points.len() as u32 - 1);
            let units = vec![[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
            let mesh = PolygonMesh::from_polygons(units, [[corner(0), corner(1), corner(2)]]);
            let rows = |positions: &[[f64; 3]; 4]| -> Rows {
                let column = |i: usize, axis: usize| points.get(i).map_or(0.0, |&point| positions[point][axis]);
                [0, 1, 2].map(|axis| [column(0, axis), column(1, axis), column(2, axis), 0.0])
            };
            (mesh, Motion::Linear { from: rows(&self.positions[0]), to: rows(&self.positions[1]) })
        })
    }

    /// The features as objects, and their motions.
    ///
    /// # Panics
    /// Never: every polygon is valid.
    pub fn objects(&self) -> [(Object, Motion); 2] {
        self.bodies().map(|(mesh, motion)| (Object::build(mesh, None, &()).expect("one polygon is valid"), motion))
    }
}

/// All queries, file after file in the order of their names.
///
/// # Panics
/// When the data are not as their FORMAT.md says.
pub fn all() -> Vec<Query> {
    let mut files = Vec::new();
    collect_tables(&crate::ccd::directory().join("queries"), &mut files);
    files.sort();
    files.iter().flat_map(|path| read(path)).collect()
}

fn collect_tables(directory: &Path, files: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(directory).expect("the data are in the repository") {
        let path = entry.expect("the directory can be read").path();
        if path.is_dir() {
            collect_tables(&path, files);
        } else if path.extension().is_some_and(|extension| extension == "csv") {
            files.push(path);
        }
    }
}

fn read(path: &Path) -> Vec<Query> {
    let text = fs::read_to_string(path).expect("the data can be read");
    let rows: Vec<([f64; 3], bool)> = text.lines().map(row).collect();
    let points_of_first = if path.to_string_lossy().contains("edge-edge") { 2 } else { 1 };
    let (queries, rest) = rows.as_chunks::<8>();
    assert!(rest.is_empty(), "{}: a query is eight rows", path.display());
    let query = |(number, rows): (usize, &[([f64; 3], bool); 8])| Query {
        name: format!("{} {number}", path.display()),
        points_of_first,
        positions: [0, 4].map(|first| [0, 1, 2, 3].map(|point| rows[first + point].0)),
        collides: rows[0].1,
    };
    queries.iter().enumerate().map(query).collect()
}

/// Three rationals, exactly representable, and the truth.
fn row(line: &str) -> ([f64; 3], bool) {
    let numbers: Vec<i128> = line.split(',').map(|number| number.trim().parse().expect("an integer")).collect();
    let [xn, xd, yn, yd, zn, zd, truth] = numbers[..] else { panic!("seven numbers: {line}") };
    // Denominators are powers of two: the quotient of the two rounded integers is exact where the rational is.
    ([(xn, xd), (yn, yd), (zn, zd)].map(|(numerator, denominator)| numerator as f64 / denominator as f64), truth == 1)
}
