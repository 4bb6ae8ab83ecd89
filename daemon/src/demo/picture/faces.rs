//! From bodies to coloured triangles on a picture, the farthest first.

use std::collections::BTreeSet;

use collided_kernel::PolygonMesh;
use collided_protocol::step::Rows;

use super::super::camera::View;
use super::super::vector::{cross, dot, middle, normalised, sub};

/// Colour of interfering polygons: red, green and blue.
const INTERFERING: [u8; 3] = [255, 66, 14];
/// Where the light comes from, seen from the camera: to the right, down and away.
const LIGHT: [f64; 3] = [-0.45, -0.7, -0.55];
/// How bright a face is that is turned away from the light, of 1.
const AMBIENT: f64 = 0.35;
/// Longest side of a triangle in the picture, in pixels. Larger ones are halved, so that the order of their distances
/// is the order in which they hide each other.
const LONGEST_SIDE: f64 = 20.0;

/// A triangle of the picture.
pub struct Face {
    /// Its corners, in pixels.
    pub corners: [[f64; 2]; 3],
    /// Its colour: red, green and blue.
    pub colour: [u8; 3],
    /// Distance from the camera to its farthest corner, squared. What stands on a floor then hides the floor behind it.
    distance: f64,
}

/// What is drawn of a body.
pub struct Drawn<'a> {
    pub mesh: &'a PolygonMesh,
    pub rows: Rows,
    pub colour: [u8; 3],
    /// Numbers of its interfering polygons.
    pub interfering: &'a BTreeSet<u32>,
}

/// The faces turned to the camera, the farthest first. What is not `visible` in the world is cut away, unless it
/// interferes.
pub fn faces(bodies: &[Drawn<'_>], view: &View, visible: fn([f64; 3]) -> bool) -> Vec<Face> {
    let mut faces = Vec::new();
    for body in bodies {
        let world: Vec<[f64; 3]> = body.mesh.vertices.iter().map(|&vertex| transformed(&body.rows, vertex)).collect();
        for (number, polygon) in body.mesh.polygons().enumerate() {
            let interferes = body.interfering.contains(&(number as u32));
            let colour = if interferes { INTERFERING } else { body.colour };
            for pair in polygon.windows(2).skip(1) {
                let triangle = [polygon[0], pair[0], pair[1]].map(|corner| world[corner as usize]);
                if interferes || visible(centre(triangle)) {
                    add_triangle(triangle, colour, view, &mut faces);
                }
            }
        }
    }
    faces.sort_by(|a, b| b.distance.total_cmp(&a.distance));
    faces
}

fn transformed(rows: &Rows, vertex: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|row| dot([rows[row][0], rows[row][1], rows[row][2]], vertex) + rows[row][3])
}

fn centre(triangle: [[f64; 3]; 3]) -> [f64; 3] {
    std::array::from_fn(|axis| triangle.iter().map(|corner| corner[axis]).sum::<f64>() / 3.0)
}

fn add_triangle(triangle: [[f64; 3]; 3], colour: [u8; 3], view: &View, faces: &mut Vec<Face>) {
    let normal = normalised(cross(sub(triangle[1], triangle[0]), sub(triangle[2], triangle[0])));
    if dot(normal, view.ray(triangle[0])) < 0.0 {
        add_pieces(triangle, shaded(colour, normal, view), view, faces);
    }
}

/// Lambert's law, wrapped round to the faces turned away, so that these have shades too.
fn shaded(colour: [u8; 3], normal: [f64; 3], view: &View) -> [u8; 3] {
    let light = normalised(view.to_world(LIGHT));
    let brightness = AMBIENT + (1.0 - AMBIENT) * (1.0 + dot(normal, light)) / 2.0;
    colour.map(|channel| (f64::from(channel) * brightness).round() as u8)
}

/// Adds a triangle as pieces that are small in the picture; nothing of one that reaches behind the camera.
fn add_pieces(triangle: [[f64; 3]; 3], colour: [u8; 3], view: &View, faces: &mut Vec<Face>) {
    let [Some(a), Some(b), Some(c)] = triangle.map(|corner| view.project(corner)) else { return };
    let sides = [(a, b), (b, c), (c, a)].map(|(from, to)| f64::hypot(to[0] - from[0], to[1] - from[1]));
    let longest = (0..3).max_by(|&one, &other| sides[one].total_cmp(&sides[other])).unwrap_or(0);
    if sides[longest] > LONGEST_SIDE {
        let [from, to, opposite] = [0, 1, 2].map(|corner| triangle[(longest + corner) % 3]);
        let halfway = middle(from, to);
        add_pieces([from, halfway, opposite], colour, view, faces);
        add_pieces([halfway, to, opposite], colour, view, faces);
        return;
    }
    let distances = triangle.map(|corner| dot(view.ray(corner), view.ray(corner)));
    let distance = distances.into_iter().fold(0.0, f64::max);
    faces.push(Face { corners: [a, b, c], colour, distance });
}
