//! The effect `response`: analytic cases, conservation, and what is refused.

use std::sync::Arc;

use collided_kernel::affine::{IDENTITY, world_vertex};
use collided_kernel::effects::contacts::Contacts;
use collided_kernel::effects::response::{
    ManifoldPoint, MassProperties, Response, ResponseBody, ResponseError, ResponsePair, Velocity, add_manifold,
};
use collided_kernel::{Object, PolygonMesh, Rows};
use collided_tests::contact_pairs::{Placed, triangle_pairs};
use collided_tests::meshes::{build, shipped};
use collided_tests::solids::{at, cuboid, octahedron, rows, sphere, tetrahedron};
use collided_tests::transforms::{direction, rotation};
use glam::{DMat3, DVec3};
use proptest::prelude::*;

fn manifold(a: Placed<'_>, b: Placed<'_>) -> Vec<ManifoldPoint> {
    let mut contacts = Contacts::default();
    contacts.find(a, b, &triangle_pairs(a, b));
    let mut points = Vec::new();
    contacts.regions().iter().for_each(|region| add_manifold(&contacts, region, &mut points));
    points
}

fn mass_of(object: &Object) -> MassProperties {
    MassProperties::of_closed_mesh(object, 1.0).expect("a closed mesh")
}

fn body(mass: MassProperties, rows: Rows, linear: [f64; 3]) -> ResponseBody {
    ResponseBody { mass, restitution: 0.0, friction: 0.0, rows, velocity: Velocity { linear, angular: [0.0; 3] } }
}

fn solved(bodies: &[ResponseBody], pairs: &[ResponsePair<'_>]) -> Response {
    let mut response = Response::default();
    response.solve(bodies, pairs).expect("good bodies");
    response
}

/// Of cases that the iterations must solve to the end.
fn solved_to_the_end(bodies: &[ResponseBody], pairs: &[ResponsePair<'_>]) -> Response {
    let response = solved(bodies, pairs);
    assert!(!response.was_capped());
    response
}

fn assert_near(found: [f64; 3], expected: [f64; 3], tolerance: f64) {
    let off = DVec3::from(found).distance(DVec3::from(expected));
    assert!(off <= tolerance, "{found:?}, not {expected:?}: {off} off");
}

/// Mass, centre and inertia in the world.
fn placed_mass(body: &ResponseBody) -> (f64, DVec3, DMat3) {
    let turn = DMat3::from_cols_array_2d(&body.rows.map(|[x, y, z, _]| [x, y, z])).transpose();
    let inertia = DMat3::from_cols_array_2d(&body.mass.inertia);
    (body.mass.mass, world_vertex(&body.rows, body.mass.centre), turn * inertia * turn.transpose())
}

/// Linear momentum, angular momentum about the origin, kinetic energy, and the sum of magnitudes of the momenta.
fn conserved(bodies: &[ResponseBody], velocities: &[Velocity]) -> (DVec3, DVec3, f64, f64) {
    let mut sums = (DVec3::ZERO, DVec3::ZERO, 0.0, 0.0);
    for (body, velocity) in bodies.iter().zip(velocities).filter(|(body, _)| body.mass.mass.is_finite()) {
        let (mass, centre, inertia) = placed_mass(body);
        let (linear, angular) = (DVec3::from(velocity.linear), DVec3::from(velocity.angular));
        sums.0 += linear * mass;
        sums.1 += centre.cross(linear * mass) + inertia * angular;
        sums.2 += mass * linear.length_squared() / 2.0 + angular.dot(inertia * angular) / 2.0;
        sums.3 += mass * linear.length() * (1.0 + centre.length()) + (inertia * angular).length();
    }
    sums
}

fn before(bodies: &[ResponseBody]) -> Vec<Velocity> {
    bodies.iter().map(|body| body.velocity).collect()
}

#[test]
fn equal_spheres_head_on_exchange_their_velocities() {
    let sphere = sphere(1.0, 8);
    let stands = [at(0.0, 0.0, 0.0), at(2.0, 0.0, 0.0)];
    let points = manifold((&sphere, &stands[0]), (&sphere, &stands[1]));
    assert_eq!(points.len(), 1);
    let mass = mass_of(&sphere);
    let mut bodies = [body(mass, stands[0], [3.0, 0.0, 0.0]), body(mass, stands[1], [-1.0, 0.0, 0.0])];
    for (restitution, after) in [(1.0, [-1.0, 3.0]), (0.5, [0.0, 2.0]), (0.0, [1.0, 1.0])] {
        bodies.iter_mut().for_each(|body| body.restitution = restitution);
        let response = solved_to_the_end(&bodies, &[ResponsePair { a: 0, b: 1, manifold: &points }]);
        for (velocity, after) in response.velocities().iter().zip(after) {
            assert_near(velocity.linear, [after, 0.0, 0.0], 1e-12);
        }
    }
}

#[test]
fn a_block_on_an_incline_sticks_below_the_friction_angle_and_slides_above() {
    let (floor, block) = (cuboid([9.0, 9.0, 1.0]), cuboid([0.6, 0.5, 0.3]));
    // A sixth of a turn in the plane of the incline, so that nothing is along an axis.
    let half_root = 0.75f64.sqrt();
    let stand = rows(&[[0.5, -half_root, 0.0], [half_root, 0.5, 0.0], [0.0, 0.0, 1.0]], [0.2, -0.4, 1.3]);
    let points = manifold((&floor, &IDENTITY), (&block, &stand));
    assert_eq!(points.len(), 4, "the corners of the base: {points:?}");
    let friction: f64 = 0.5;
    for (angle, sticks) in [(friction.atan() * 0.99, true), (friction.atan() * 1.2, false), (0.0, true)] {
        let gravity = 9.81 * 0.01;
        let fall = [gravity * angle.sin(), 0.0, -gravity * angle.cos()];
        let mut bodies = [body(MassProperties::STATIC, IDENTITY, [0.0; 3]), body(mass_of(&block), stand, fall)];
        bodies.iter_mut().for_each(|body| body.friction = friction);
        let response = solved_to_the_end(&bodies, &[ResponsePair { a: 0, b: 1, manifold: &points }]);
        let slide = if sticks { 0.0 } else { gravity * (angle.sin() - friction * angle.cos()) };
        assert_near(response.velocities()[1].linear, [slide, 0.0, 0.0], 1e-10);
        assert_near(response.velocities()[1].angular, [0.0; 3], 1e-10);
        assert_eq!(response.velocities()[0], bodies[0].velocity);
        for impulse in response.impulses() {
            let [x, y, z] = impulse.on_b;
            assert!(x.hypot(y) <= friction * z * (1.0 + 1e-12), "beyond the cone: {impulse:?}");
        }
    }
}

#[test]
fn a_cradle_passes_the_motion_on_to_the_last_sphere() {
    let sphere = sphere(1.0, 6);
    let mass = mass_of(&sphere);
    let stands: Vec<Rows> = (0..5).map(|i| at(2.0 * f64::from(i), 0.0, 0.0)).collect();
    let points: Vec<_> = stands.windows(2).map(|two| manifold((&sphere, &two[0]), (&sphere, &two[1]))).collect();
    let mut pairs: Vec<_> =
        points.iter().enumerate().map(|(i, manifold)| ResponsePair { a: i, b: i + 1, manifold }).collect();
    for moving in 1..=4 {
        let speed = |i: usize| if i < moving { 2.0 } else { 0.0 };
        let mut bodies: Vec<_> =
            stands.iter().enumerate().map(|(i, stand)| body(mass, *stand, [speed(i), 0.0, 0.0])).collect();
        bodies.iter_mut().for_each(|body| body.restitution = 1.0);
        for _ in 0..2 {
            let response = solved_to_the_end(&bodies, &pairs);
            for (i, velocity) in response.velocities().iter().enumerate() {
                assert_near(velocity.linear, [speed(4 - i), 0.0, 0.0], 1e-11);
            }
            pairs.reverse();
        }
    }
}

#[test]
fn a_rod_hit_at_its_end_turns() {
    let (length, rod_mass, ball_mass) = (2.0, 3.0, 0.5);
    let across = rod_mass * length * length / 12.0;
    let rod = MassProperties {
        mass: rod_mass,
        centre: [0.0; 3],
        inertia: [[0.01, 0.0, 0.0], [0.0, across, 0.0], [0.0, 0.0, across]],
    };
    let ball = MassProperties { mass: ball_mass, centre: [0.0; 3], inertia: DMat3::IDENTITY.to_cols_array_2d() };
    let mut bodies = [body(ball, at(1.0, -0.1, 0.0), [0.0, 4.0, 0.0]), body(rod, IDENTITY, [0.0; 3])];
    bodies[0].restitution = 1.0;
    let points = [ManifoldPoint { position: [1.0, 0.0, 0.0], normal: [0.0, 1.0, 0.0] }];
    let response = solved_to_the_end(&bodies, &[ResponsePair { a: 0, b: 1, manifold: &points }]);
    let give = 1.0 / ball_mass + 1.0 / rod_mass + (length / 2.0).powi(2) / across;
    let impulse = 2.0 * 4.0 / give;
    assert_near(response.impulses()[0].on_b, [0.0, impulse, 0.0], 1e-12);
    let [ball_after, rod_after] = response.velocities() else { panic!("two bodies") };
    assert_near(ball_after.linear, [0.0, 4.0 - impulse / ball_mass, 0.0], 1e-12);
    assert_near(rod_after.linear, [0.0, impulse / rod_mass, 0.0], 1e-12);
    assert_near(rod_after.angular, [0.0, 0.0, impulse * (length / 2.0) / across], 1e-12);
}

#[test]
fn a_ball_bounces_off_a_static_floor_by_its_restitution() {
    let (floor, ball) = (cuboid([4.0, 4.0, 1.0]), octahedron(1.0));
    let stand = at(0.25, 0.5, 2.0);
    let points = manifold((&ball, &stand), (&floor, &IDENTITY));
    let mut bodies = [body(mass_of(&ball), stand, [0.0, 0.0, -2.0]), body(MassProperties::STATIC, IDENTITY, [0.0; 3])];
    for restitution in [0.0, 0.25, 1.0] {
        bodies[0].restitution = restitution;
        let response = solved_to_the_end(&bodies, &[ResponsePair { a: 0, b: 1, manifold: &points }]);
        assert_near(response.velocities()[0].linear, [0.0, 0.0, 2.0 * restitution], 1e-13);
        assert_eq!(response.velocities()[1], bodies[1].velocity);
    }
    bodies[0].velocity.linear = [0.0, 0.0, 1.0];
    let response = solved_to_the_end(&bodies, &[ResponsePair { a: 0, b: 1, manifold: &points }]);
    assert_eq!((response.impulses().len(), response.velocities()[0]), (0, bodies[0].velocity));
}

#[test]
fn a_stack_of_blocks_stays_at_rest_under_gravity() {
    let block = cuboid([0.5; 3]);
    let stands: Vec<Rows> = (0..4).map(|i| at(0.05 * f64::from(i), 0.0, f64::from(i))).collect();
    let points: Vec<_> = stands.windows(2).map(|two| manifold((&block, &two[0]), (&block, &two[1]))).collect();
    let pairs: Vec<_> =
        points.iter().enumerate().map(|(i, manifold)| ResponsePair { a: i, b: i + 1, manifold }).collect();
    let mut bodies: Vec<_> = stands.iter().map(|stand| body(mass_of(&block), *stand, [0.0, 0.0, -0.1])).collect();
    bodies[0] = body(MassProperties::STATIC, stands[0], [0.0; 3]);
    bodies.iter_mut().for_each(|body| body.friction = 0.4);
    let response = solved_to_the_end(&bodies, &pairs);
    for velocity in response.velocities() {
        assert_near(velocity.linear, [0.0; 3], 1e-9);
        assert_near(velocity.angular, [0.0; 3], 1e-9);
    }
}

/// A column of cubes, each a little aside of the one below, all falling at speed 1; the lowest one is static where there is a floor.
fn falling_column(count: i32, restitution: f64, floor: bool) -> (Vec<ResponseBody>, Vec<Vec<ManifoldPoint>>) {
    let block = cuboid([0.5; 3]);
    let stands: Vec<Rows> = (0..count).map(|i| at(0.05 * f64::from(i), 0.0, f64::from(i))).collect();
    let points = stands.windows(2).map(|two| manifold((&block, &two[0]), (&block, &two[1]))).collect();
    let fall = |(i, stand): (usize, &Rows)| {
        let linear = [0.0, 0.0, if i == 0 { 0.0 } else { -1.0 }];
        let mass = if floor && i == 0 { MassProperties::STATIC } else { mass_of(&block) };
        ResponseBody { restitution, ..body(mass, *stand, linear) }
    };
    (stands.iter().enumerate().map(fall).collect(), points)
}

fn column_pairs(points: &[Vec<ManifoldPoint>]) -> Vec<ResponsePair<'_>> {
    points.iter().enumerate().map(|(i, manifold)| ResponsePair { a: i, b: i + 1, manifold }).collect()
}

#[test]
fn a_column_of_blocks_that_bounce_a_little_ends_within_the_cap_and_keeps_its_momentum() {
    for (count, restitution, floor) in
        [(6, 0.5, true), (5, 0.5, false), (21, 0.5, true), (21, 0.1, false), (21, 0.9, true)]
    {
        let (bodies, points) = falling_column(count, restitution, floor);
        let response = solved_to_the_end(&bodies, &column_pairs(&points));
        let (_, _, energy, size) = conserved(&bodies, &before(&bodies));
        let (linear, angular, energy_after, size_after) = conserved(&bodies, response.velocities());
        assert!(energy_after <= energy, "{energy} grows to {energy_after}");
        // With a floor, what the column has lost is what the floor's contacts have given.
        let mut given = (DVec3::ZERO, DVec3::ZERO);
        for impulse in response.impulses().iter().filter(|impulse| floor && impulse.pair == 0) {
            given.0 += DVec3::from(impulse.on_b);
            given.1 += DVec3::from(impulse.point).cross(DVec3::from(impulse.on_b));
        }
        let (linear_before, angular_before, ..) = conserved(&bodies, &before(&bodies));
        let tolerance = 1e-12 * size.max(size_after);
        assert!((linear - linear_before).distance(given.0) <= tolerance, "{linear_before} and {} to {linear}", given.0);
        assert!((angular - angular_before).distance(given.1) <= tolerance, "{angular_before} to {angular}");
    }
}

#[test]
fn impacts_that_go_on_after_the_cap_are_told() {
    let (mut bodies, points) = falling_column(21, 0.01, true);
    bodies[20].restitution = 1.0;
    let response = solved(&bodies, &column_pairs(&points));
    assert!(response.was_capped());
}

/// Two bodies by number, and where they touch.
type Touching = (usize, usize, Vec<ManifoldPoint>);

/// Bodies of any mass and turn, and contacts at any places between them.
fn heap() -> impl Strategy<Value = (Vec<ResponseBody>, Vec<Touching>)> {
    let any_body = (rotation(), direction(), direction(), direction(), 0.1..10.0, 0..3usize).prop_map(
        |(turn, stand, linear, angular, density, kind)| {
            let solid = [cuboid([0.5, 0.7, 0.9]), tetrahedron(0.8), octahedron(1.0)];
            let mass = MassProperties::of_closed_mesh(&solid[kind], density).expect("closed");
            let velocity = Velocity { linear, angular };
            ResponseBody { mass, restitution: 0.0, friction: 0.0, rows: rows(&turn, stand), velocity }
        },
    );
    let any_point = (direction(), direction()).prop_map(|(position, normal)| ManifoldPoint {
        position,
        normal: (DVec3::from(normal) + DVec3::Z * 1e-3).normalize().to_array(),
    });
    let any_pair = (0..4usize, 1..4usize, prop::collection::vec(any_point, 1..5))
        .prop_map(|(a, on, points)| (a, (a + on) % 4, points));
    (prop::collection::vec(any_body, 4), prop::collection::vec(any_pair, 1..6))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn momentum_is_conserved_and_energy_never_grows(
        (mut bodies, pairs) in heap(), restitution in 0.0..=1.0, friction in prop_oneof![Just(0.0), 0.0..1.5],
    ) {
        bodies.iter_mut().for_each(|body| (body.restitution, body.friction) = (restitution, friction));
        let pairs: Vec<_> = pairs.iter().map(|(a, b, manifold)| ResponsePair { a: *a, b: *b, manifold }).collect();
        let response = solved(&bodies, &pairs);
        let (linear, angular, energy, size) = conserved(&bodies, &before(&bodies));
        let (linear_after, angular_after, energy_after, size_after) = conserved(&bodies, response.velocities());
        let tolerance = 1e-12 * size.max(size_after);
        prop_assert!(linear.distance(linear_after) <= tolerance, "{} {}", linear, linear_after);
        prop_assert!(angular.distance(angular_after) <= tolerance, "{} {}", angular, angular_after);
        prop_assert!(energy_after <= energy * (1.0 + 1e-11), "{} {}", energy, energy_after);
    }

    #[test]
    fn nothing_approaches_any_more((mut bodies, pairs) in heap(), restitution in 0.0..=1.0) {
        bodies.iter_mut().for_each(|body| body.restitution = restitution);
        bodies[0].mass = MassProperties::STATIC;
        let pairs: Vec<_> = pairs.iter().map(|(a, b, manifold)| ResponsePair { a: *a, b: *b, manifold }).collect();
        let response = solved(&bodies, &pairs);
        // Contacts that jam converge slowly; most cases do not.
        prop_assume!(!response.was_capped());
        for pair in &pairs {
            for point in pair.manifold {
                let at = |body: usize| {
                    let (velocity, (_, centre, _)) = (response.velocities()[body], placed_mass(&bodies[body]));
                    let arm = DVec3::from(point.position) - centre;
                    DVec3::from(velocity.linear) + DVec3::from(velocity.angular).cross(arm)
                };
                let apart = DVec3::from(point.normal).dot(at(pair.b) - at(pair.a));
                prop_assert!(apart >= -1e-8, "approaches at {}", apart);
            }
        }
    }
}

#[test]
fn mass_properties_of_a_box_are_the_textbook_ones_wherever_it_stands() {
    let half: [f64; 3] = [0.5, 1.0, 1.5];
    let shift = [3.0, -2.0, 7.0];
    let solid = cuboid(half);
    let moved = solid.vertices().iter().map(|vertex| [0, 1, 2].map(|axis| vertex[axis] + shift[axis])).collect();
    for inside_out in [false, true] {
        let faces = solid.triangles().iter().map(|&[p, q, r]| if inside_out { [p, r, q] } else { [p, q, r] });
        let object = build(PolygonMesh::from_polygons(Vec::clone(&moved), faces), None);
        let found = MassProperties::of_closed_mesh(&object, 2.0).expect("a box is closed");
        let mass = 2.0 * 8.0 * half[0] * half[1] * half[2];
        assert!((found.mass - mass).abs() < 1e-12 * mass);
        assert_near(found.centre, shift, 1e-13);
        for axis in 0..3 {
            let (u, v) = (half[(axis + 1) % 3], half[(axis + 2) % 3]);
            let mut row = [0.0; 3];
            row[axis] = mass * (u * u + v * v) / 3.0;
            assert_near(found.inertia[axis], row, 1e-11);
        }
    }
}

#[test]
fn a_fine_sphere_has_nearly_the_mass_and_inertia_of_a_ball() {
    let found = mass_of(&sphere(2.0, 40));
    let mass = 4.0 / 3.0 * std::f64::consts::PI * 8.0;
    assert!((found.mass / mass - 1.0).abs() < 0.01, "{found:?}");
    for axis in 0..3 {
        assert!((found.inertia[axis][axis] / (0.4 * mass * 4.0) - 1.0).abs() < 0.02, "{found:?}");
    }
}

#[test]
fn a_mesh_closes_where_positions_are_equal() {
    // Every triangle has corners of its own, one of them at −0.
    let solid = cuboid([0.5; 3]);
    let raised = |vertex: u32| solid.vertices()[vertex as usize].map(|x| if x < 0.0 { 0.0 } else { x });
    let vertices: Vec<[f64; 3]> = solid.triangles().iter().flatten().map(|&vertex| raised(vertex)).collect();
    let mut signed = vertices.clone();
    signed[0] = signed[0].map(|x| if x == 0.0 { -0.0 } else { x });
    let faces: Vec<[u32; 3]> = (0..12).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    let object = build(PolygonMesh::from_polygons(signed, &faces), None);
    assert!((mass_of(&object).mass - 0.125).abs() < 1e-15);
    let open = build(PolygonMesh::from_polygons(vertices, &faces[1..]), None);
    assert_eq!(MassProperties::of_closed_mesh(&open, 1.0), Err(ResponseError::OpenMesh { edges: 3 }));
}

#[test]
fn open_empty_and_flat_meshes_have_no_density() {
    let flat = PolygonMesh::from_polygons(vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.5]], [[0, 1, 2], [0, 2, 1]]);
    for mesh in [PolygonMesh::default(), flat] {
        assert_eq!(MassProperties::of_closed_mesh(&build(mesh, None), 1.0), Err(ResponseError::NoVolume));
    }
    let solid = cuboid([0.5; 3]);
    let faces = solid.triangles().iter().enumerate().map(|(i, &[p, q, r])| if i == 4 { [p, r, q] } else { [p, q, r] });
    let turned = build(PolygonMesh::from_polygons(solid.vertices().to_vec(), faces), None);
    assert_eq!(MassProperties::of_closed_mesh(&turned, 1.0), Err(ResponseError::InconsistentMesh { edges: 3 }));
    for density in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let error = MassProperties::of_closed_mesh(&solid, density).expect_err("not a density");
        assert!(matches!(error, ResponseError::Density { .. }), "{error}");
    }
    let spot: Arc<Object> = shipped("env", None);
    let found = MassProperties::of_closed_mesh(&spot, 1.0);
    assert!(matches!(found, Err(ResponseError::OpenMesh { .. })), "{found:?}");
}

#[test]
fn bad_bodies_are_refused_by_number_and_value() {
    let good = body(mass_of(&cuboid([0.5; 3])), IDENTITY, [0.0; 3]);
    let refused = |bad: ResponseBody| {
        Response::default().solve(&[good, bad], std::iter::empty::<ResponsePair<'_>>()).expect_err("a bad body")
    };
    for mass in [0.0, -2.0, f64::NEG_INFINITY] {
        let bad = ResponseBody { mass: MassProperties { mass, ..good.mass }, ..good };
        assert_eq!(refused(bad), ResponseError::Mass { body: 1, mass });
    }
    let bad = ResponseBody { mass: MassProperties { mass: f64::NAN, ..good.mass }, ..good };
    assert!(matches!(refused(bad), ResponseError::Mass { body: 1, .. }));
    for restitution in [-0.1, 1.1] {
        assert_eq!(refused(ResponseBody { restitution, ..good }), ResponseError::Restitution { body: 1, restitution });
    }
    assert!(matches!(refused(ResponseBody { restitution: f64::NAN, ..good }), ResponseError::Restitution { .. }));
    assert_eq!(refused(ResponseBody { friction: -0.5, ..good }), ResponseError::Friction { body: 1, friction: -0.5 });
    let spin = Velocity { angular: [f64::INFINITY, 0.0, 0.0], ..Velocity::default() };
    assert_eq!(refused(ResponseBody { velocity: spin, ..good }), ResponseError::NotFinite { body: 1 });
    let lopsided = [[1.0, 0.5, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    for inertia in [[[0.0; 3]; 3], lopsided, [[f64::NAN; 3]; 3], [[-1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0]]]
    {
        let bad = ResponseBody { mass: MassProperties { inertia, ..good.mass }, ..good };
        assert_eq!(refused(bad), ResponseError::Inertia { body: 1 });
    }
    let message = refused(ResponseBody { friction: -0.5, ..good }).to_string();
    assert!(message.contains("body 1") && message.contains("-0.5"), "{message}");
}
