//! Random motions of every kind: no static contact before the bracket, none in what is proven free, and one at its end.

use std::sync::Arc;

use collided_kernel::effects::time_of_contact::{Memory, TimeOfContact, TimeSettings, time_of_contact};
use collided_kernel::motion::Motion;
use collided_kernel::{Effects, Object, Rows};
use collided_tests::kernel_pair::KernelPair;
use collided_tests::{ccd, hardcases, meshes, transforms};
use glam::DVec3;
use proptest::array::uniform3;
use proptest::prelude::*;

const TOLERANCE: f64 = 1e-6;
const SCANS: u32 = 200;

/// A body that moves past the origin, from one side to another.
fn motion(object: Arc<Object>) -> impl Strategy<Value = Motion> {
    let place = || (transforms::linear(), uniform3(-2.5..2.5));
    let turn = (transforms::direction(), uniform3(-1.0..1.0), -12.0..12.0, uniform3(-4.0..4.0));
    (place(), place(), turn, 0..5u8).prop_map(move |(from, to, (axis, centre, angle, translate), kind)| {
        let from = transforms::placed(&object, &from.0, from.1);
        match kind {
            0 => Motion::Still(from),
            1 | 2 => Motion::Linear { from, to: transforms::placed(&object, &to.0, to.1) },
            _ => Motion::Rigid { from, axis, centre, angle, translate },
        }
    })
}

/// A cube (twelve triangles) or a mesh of some hundred.
fn objects(cube_first: bool) -> [Arc<Object>; 2] {
    let cube = Arc::new(ccd::object(&hardcases::unit_cube(), None));
    let rob = meshes::shipped("rob", None);
    if cube_first { [cube, rob] } else { [rob.clone(), rob] }
}

fn pairs() -> impl Strategy<Value = ([Arc<Object>; 2], [Motion; 2])> {
    any::<bool>().prop_map(objects).prop_flat_map(|[a, b]| {
        let motions = [motion(a.clone()).boxed(), motion(b.clone()).boxed()];
        motions.prop_map(move |motions| ([a.clone(), b.clone()], motions))
    })
}

/// Whether the body is a plane, a line or a point, nearly or exactly.
fn is_flat(rows: &Rows) -> bool {
    let [x, y, z] = rows.map(|[x, y, z, _]| DVec3::new(x, y, z));
    let (volume, size) = (x.dot(y.cross(z)).abs(), x.length().max(y.length()).max(z.length()));
    volume <= 1e-6 * size.powi(3)
}

/// Whether a body is flat at this time, or at the start or the end. Of such bodies the search may come to its cap before it has told
/// what they meet from what they pass.
fn any_flat(motions: &[Motion; 2], t: f64) -> bool {
    motions.iter().any(|motion| [0.0, t, 1.0].iter().any(|&t| is_flat(&motion.at(t))))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 256, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn brackets_agree_with_a_scan_of_static_tests(([a, b], motions) in pairs()) {
        prop_assume!(motions.iter().all(|motion| motion.check().is_ok()));
        let settings = TimeSettings { tolerance: TOLERANCE, ..TimeSettings::default() };
        let found = time_of_contact((&a, &motions[0]), (&b, &motions[1]), settings, &mut Memory::default());
        let mut pair = KernelPair::new(&a, &b, Effects::INTERFERENCE);
        let mut touch = |t: f64| pair.step(motions[0].at(t), motions[1].at(t)).expect("finite").interfering;
        let free_until = match found {
            TimeOfContact::Free => 1.0,
            TimeOfContact::Contact { lo, hi } => {
                prop_assert!(lo <= hi && hi - lo <= TOLERANCE);
                // Meshes that meet overlap for a while, at one of several times soon after. What is flattened may pass in an instant,
                // which no rounded position shows.
                let mut soon = (0..8).map(|step| (hi + f64::from(step) * TOLERANCE).min(1.0));
                let flattened = motions.iter().any(|motion| is_flat(&motion.at(hi)));
                prop_assert!(flattened || soon.any(&mut touch), "no contact soon after {}", hi);
                lo
            }
            TimeOfContact::Possible { lo, .. } => {
                prop_assert!(any_flat(&motions, lo), "{:?}", found);
                lo
            }
        };
        for scan in 0..SCANS {
            let t = free_until * (f64::from(scan) / f64::from(SCANS)) - 1e-9;
            prop_assert!(t < 0.0 || !touch(t), "a contact at {} before {}", t, free_until);
        }
    }

    #[test]
    fn the_order_of_bodies_and_matrices_moves_the_bracket_by_no_more_than_its_width(([a, b], motions) in pairs()) {
        prop_assume!(motions.iter().all(|motion| motion.check().is_ok()));
        let settings = TimeSettings { tolerance: TOLERANCE, ..TimeSettings::default() };
        let memory = &mut Memory::default();
        let one = time_of_contact((&a, &motions[0]), (&b, &motions[1]), settings, memory);
        let other = time_of_contact((&b, &motions[1]), (&a, &motions[0]), settings, memory);
        match (one, other) {
            (TimeOfContact::Free, TimeOfContact::Free) => {}
            (TimeOfContact::Contact { lo, hi }, TimeOfContact::Contact { lo: other_lo, hi: other_hi }) => {
                prop_assert!(lo <= other_hi && other_lo <= hi, "{:?} {:?}", one, other);
            }
            (TimeOfContact::Possible { lo, .. }, _) | (_, TimeOfContact::Possible { lo, .. }) => {
                prop_assert!(any_flat(&motions, lo), "{:?} {:?}", one, other);
            }
            _ => return Err(TestCaseError::fail(format!("{one:?} {other:?}"))),
        }
    }
}
