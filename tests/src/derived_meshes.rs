//! Meshes made of other meshes, so that what is found of the one tells what must be found of the other.

use std::cmp::Reverse;
use std::collections::HashMap;

use collided_kernel::PolygonMesh;

use crate::meshes;

/// A mesh whose polygons are, each, one of an original mesh or a part of it.
#[derive(Debug, Clone)]
pub struct Derived {
    /// The mesh.
    pub mesh: PolygonMesh,
    /// The original of each polygon.
    pub origin: Vec<u32>,
}

impl Derived {
    fn new(vertices: Vec<[f64; 3]>, polygons: impl IntoIterator<Item = (Vec<u32>, u32)>) -> Derived {
        let (polygons, origin): (Vec<_>, Vec<_>) = polygons.into_iter().unzip();
        Derived { mesh: PolygonMesh::from_polygons(vertices, polygons), origin }
    }
}

fn numbered_polygons(mesh: &PolygonMesh) -> Vec<(Vec<u32>, u32)> {
    mesh.polygons().zip(0..).map(|(polygon, number)| (polygon.to_vec(), number)).collect()
}

/// Vertices and polygons in other orders, `keys` deciding; triangles also run the other way.
///
/// # Panics
/// Without keys.
pub fn renumbered(mesh: &PolygonMesh, keys: &[u32]) -> Derived {
    let ranking = |count: usize| {
        let mut ranking: Vec<usize> = (0..count).collect();
        ranking.sort_by_key(|&i| (keys[i % keys.len()], Reverse(i)));
        ranking
    };
    let vertex_order = ranking(mesh.vertices.len());
    let mut place = vec![0; vertex_order.len()];
    vertex_order.iter().zip(0..).for_each(|(&old, new)| place[old] = new);
    let polygons = numbered_polygons(mesh);
    let renumber = |number: usize| {
        let (polygon, origin) = &polygons[number];
        let mut corners: Vec<u32> = polygon.iter().map(|&vertex| place[vertex as usize]).collect();
        if let [a, b, c] = corners[..] {
            corners = vec![c, b, a];
        }
        (corners, *origin)
    };
    let vertices = vertex_order.iter().map(|&old| mesh.vertices[old]).collect();
    Derived::new(vertices, ranking(polygons.len()).into_iter().map(renumber))
}

/// No corner shares its vertex with another, and every other zero is negative.
pub fn without_shared_vertices(mesh: &PolygonMesh) -> Derived {
    let signed = |(number, &vertex): (usize, &u32)| {
        mesh.vertices[vertex as usize].map(|x| if x == 0.0 && number % 2 == 0 { -x } else { x })
    };
    let vertices = mesh.corners.iter().enumerate().map(signed).collect();
    let mut next = 0..;
    let own = |polygon: &[u32]| next.by_ref().take(polygon.len()).collect();
    Derived::new(vertices, mesh.polygons().map(own).collect::<Vec<_>>().into_iter().zip(0..))
}

/// Every polygon twice, and a vertex that none uses.
pub fn doubled(mesh: &PolygonMesh) -> Derived {
    let mut vertices = mesh.vertices.clone();
    vertices.push([0.5, -0.5, 0.25]);
    let polygons = numbered_polygons(mesh);
    Derived::new(vertices, [polygons.clone(), polygons].concat())
}

/// Every polygon in its triangles.
///
/// # Panics
/// When the kernel refuses the mesh.
pub fn in_triangles(mesh: &PolygonMesh) -> Derived {
    let object = meshes::build(mesh.clone(), Some(0));
    let triangle = |number: usize| (object.triangles()[number].to_vec(), object.polygon_of(number));
    Derived::new(mesh.vertices.clone(), (0..object.triangle_count()).map(triangle))
}

/// Every polygon in triangles, and each of these in four at the middles of its sides, `times` times over.
///
/// # Panics
/// When the kernel refuses the mesh.
pub fn subdivided(mesh: &PolygonMesh, times: u32) -> PolygonMesh {
    (0..times).fold(in_triangles(mesh).mesh, |mesh, _| in_quarters(&mesh))
}

fn in_quarters(triangles: &PolygonMesh) -> PolygonMesh {
    let mut vertices = triangles.vertices.clone();
    let mut middles = HashMap::new();
    let mut quarters = Vec::with_capacity(4 * triangles.polygon_count());
    for triangle in triangles.corners.as_chunks::<3>().0 {
        let &[a, b, c] = triangle;
        let [ab, bc, ca] = [[a, b], [b, c], [c, a]].map(|[from, to]| {
            *middles.entry([from.min(to), from.max(to)]).or_insert_with(|| {
                let [from, to] = [from, to].map(|corner| vertices[corner as usize]);
                vertices.push([0, 1, 2].map(|axis| from[axis] / 2.0 + to[axis] / 2.0));
                vertices.len() as u32 - 1
            })
        });
        quarters.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
    }
    PolygonMesh::from_polygons(vertices, quarters)
}

/// Every triangle cut: in two at the middle of a side, the next in three at its centroid. Exact where
/// coordinates are integers that 6 divides.
///
/// # Panics
/// When the kernel refuses the mesh.
pub fn in_pieces(mesh: &PolygonMesh) -> Derived {
    let whole = in_triangles(mesh);
    let mut vertices = whole.mesh.vertices.clone();
    let mut pieces = Vec::new();
    for (number, (triangle, &origin)) in whole.mesh.polygons().zip(&whole.origin).enumerate() {
        let corners = [0, 1, 2].map(|i| vertices[triangle[i] as usize]);
        let new = vertices.len() as u32;
        let &[a, b, c] = triangle else { unreachable!("every polygon is a triangle") };
        if number % 2 == 0 {
            vertices.push([0, 1, 2].map(|axis| (corners[0][axis] + corners[1][axis]) / 2.0));
            pieces.extend([[a, new, c], [new, b, c]].map(|piece| (piece.to_vec(), origin)));
        } else {
            vertices.push([0, 1, 2].map(|axis| corners.iter().map(|corner| corner[axis]).sum::<f64>() / 3.0));
            pieces.extend([[a, b, new], [b, c, new], [c, a, new]].map(|piece| (piece.to_vec(), origin)));
        }
    }
    Derived::new(vertices, pieces)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quarters_share_the_middles_of_sides() {
        let square = vec![[0.0; 3], [2.0, 0.0, 0.0], [2.0, 2.0, 0.0], [0.0, 2.0, 0.0]];
        let once = subdivided(&PolygonMesh::from_polygons(square, [[0, 1, 2, 3]]), 1);
        assert_eq!((once.vertices.len(), once.polygon_count()), (9, 8));
        for corners in once.corners.as_chunks::<3>().0 {
            let [a, b, c] = corners.map(|corner| once.vertices[corner as usize]);
            let doubled_area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
            assert_eq!(doubled_area, 1.0, "{a:?} {b:?} {c:?}");
        }
    }
}
