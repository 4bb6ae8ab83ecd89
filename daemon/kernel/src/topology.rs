//! What a mesh is as a surface: whether it is closed, and its connected parts. Decided once per object, when first asked.
//!
//! Vertices at equal positions (−0 equals +0) count as one. A surface is closed and consistently oriented when every edge is
//! passed as often in one direction as in the other: the boundary of the triangles, as a chain, is zero. Then the number of
//! times it winds around a point is the same all over each region of space that it bounds.

use std::cmp::Ordering;

/// Whether a surface bounds a volume.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Closure {
    /// Closed and consistently oriented.
    Closed,
    /// Edges belong to an odd number of triangles.
    Open {
        /// How many.
        edges: usize,
    },
    /// Every edge belongs to an even number of triangles, but neighbours disagree about which side is out.
    Inconsistent {
        /// Along how many edges.
        edges: usize,
    },
}

/// A mesh as a surface.
#[derive(Debug, Clone)]
pub struct Topology {
    closure: Closure,
    parts: Vec<u32>,
}

impl Topology {
    /// Of triangles over vertices.
    pub(crate) fn of(vertices: &[[f64; 3]], triangles: &[[u32; 3]]) -> Topology {
        let first = weld(vertices);
        let welded: Vec<[u32; 3]> =
            triangles.iter().map(|triangle| triangle.map(|vertex| first[vertex as usize])).collect();
        Topology { closure: closure(&welded), parts: parts(vertices.len(), &welded) }
    }

    /// Whether it bounds a volume.
    pub fn closure(&self) -> Closure {
        self.closure
    }

    /// One vertex of each connected part, ascending.
    pub fn parts(&self) -> &[u32] {
        &self.parts
    }

    /// Memory held, in bytes.
    pub(crate) fn memory_bytes(&self) -> usize {
        size_of_val(self.parts.as_slice())
    }
}

/// For each vertex, the first one at its position.
fn weld(vertices: &[[f64; 3]]) -> Vec<u32> {
    let at = |vertex: u32| vertices[vertex as usize];
    let mut order: Vec<u32> = (0..vertices.len() as u32).collect();
    order.sort_unstable_by(|&p, &q| compare(at(p), at(q)).then(p.cmp(&q)));
    let mut first = vec![0; vertices.len()];
    let mut current = 0;
    for (place, &vertex) in order.iter().enumerate() {
        if place == 0 || compare(at(order[place - 1]), at(vertex)).is_ne() {
            current = vertex;
        }
        first[vertex as usize] = current;
    }
    first
}

/// Positions are finite, and −0 equals +0.
fn compare(p: [f64; 3], q: [f64; 3]) -> Ordering {
    p.partial_cmp(&q).unwrap_or(Ordering::Equal)
}

fn closure(triangles: &[[u32; 3]]) -> Closure {
    let mut edges: Vec<(u32, u32, bool)> = triangles
        .iter()
        .flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)])
        .filter(|(from, to)| from != to)
        .map(|(from, to)| (from.min(to), from.max(to), from < to))
        .collect();
    edges.sort_unstable();
    let (mut odd, mut unbalanced) = (0, 0);
    for edge in edges.chunk_by(|one, other| (one.0, one.1) == (other.0, other.1)) {
        let forwards = edge.iter().filter(|(.., forwards)| *forwards).count();
        odd += edge.len() % 2;
        unbalanced += usize::from(2 * forwards != edge.len());
    }
    match (odd, unbalanced) {
        (0, 0) => Closure::Closed,
        (0, edges) => Closure::Inconsistent { edges },
        (edges, _) => Closure::Open { edges },
    }
}

/// One vertex of each set of triangles that hang together.
fn parts(vertex_count: usize, triangles: &[[u32; 3]]) -> Vec<u32> {
    let mut parent: Vec<u32> = (0..vertex_count as u32).collect();
    for &[a, b, c] in triangles {
        join(&mut parent, a, b);
        join(&mut parent, b, c);
    }
    let mut roots: Vec<u32> = triangles.iter().map(|triangle| root(&mut parent, triangle[0])).collect();
    roots.sort_unstable();
    roots.dedup();
    roots
}

/// Joins two sets in a forest of parents. The smaller root stays, so that parts are named by their first vertex.
pub(crate) fn join(parent: &mut [u32], a: u32, b: u32) {
    let (a, b) = (root(parent, a), root(parent, b));
    parent[a.max(b) as usize] = a.min(b);
}

/// The root of a set in a forest of parents. Halves the path on its way (Tarjan and van Leeuwen, "Worst-case Analysis of
/// Set Union Algorithms", JACM 1984).
pub(crate) fn root(parent: &mut [u32], mut vertex: u32) -> u32 {
    while parent[vertex as usize] != vertex {
        parent[vertex as usize] = parent[parent[vertex as usize] as usize];
        vertex = parent[vertex as usize];
    }
    vertex
}

#[cfg(test)]
mod tests {
    use super::*;

    const CORNERS: [[f64; 3]; 4] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    const TETRAHEDRON: [[u32; 3]; 4] = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];

    #[test]
    fn a_tetrahedron_is_closed_until_a_triangle_is_missing_or_turned() {
        assert_eq!(Topology::of(&CORNERS, &TETRAHEDRON).closure(), Closure::Closed);
        assert_eq!(Topology::of(&CORNERS, &TETRAHEDRON[..3]).closure(), Closure::Open { edges: 3 });
        let mut turned = TETRAHEDRON;
        turned[2].swap(0, 1);
        assert_eq!(Topology::of(&CORNERS, &turned).closure(), Closure::Inconsistent { edges: 3 });
        let mut doubled = TETRAHEDRON.to_vec();
        doubled.push(TETRAHEDRON[0]);
        assert_eq!(Topology::of(&CORNERS, &doubled).closure(), Closure::Open { edges: 3 });
    }

    #[test]
    fn vertices_at_equal_positions_count_as_one() {
        let apart: Vec<[f64; 3]> = TETRAHEDRON.iter().flatten().map(|&vertex| CORNERS[vertex as usize]).collect();
        let negative = apart.iter().enumerate().map(|(place, vertex)| {
            // Every other zero becomes −0.
            vertex.map(|coordinate| if coordinate == 0.0 && place % 2 == 1 { -0.0 } else { coordinate })
        });
        let negative: Vec<[f64; 3]> = negative.collect();
        let triangles: Vec<[u32; 3]> = (0..4).map(|triangle| [0, 1, 2].map(|corner| 3 * triangle + corner)).collect();
        for vertices in [&apart, &negative] {
            let topology = Topology::of(vertices, &triangles);
            assert_eq!((topology.closure(), topology.parts()), (Closure::Closed, &[0][..]));
        }
    }

    #[test]
    fn polygons_without_area_neither_open_nor_close() {
        let with_segment = [&TETRAHEDRON[..], &[[0, 0, 1], [2, 2, 2]]].concat();
        assert_eq!(Topology::of(&CORNERS, &with_segment).closure(), Closure::Closed);
        assert_eq!(Topology::of(&CORNERS, &[[0, 0, 1]]).closure(), Closure::Closed);
    }

    #[test]
    fn parts_are_named_by_their_first_vertex_and_unused_vertices_by_none() {
        let vertices: Vec<[f64; 3]> = (0..9).map(|vertex| [f64::from(vertex), 0.0, 1.0]).collect();
        assert_eq!(Topology::of(&vertices, &[[5, 4, 6], [1, 2, 8], [6, 7, 6]]).parts(), [1, 4]);
        assert!(Topology::of(&vertices, &[]).parts().is_empty());
    }
}
