//! The motions of `ccd.json` through the kernel: none missed, none invented, every bracket right and as narrow as
//! asked.

use std::time::{Duration, Instant};

use collided_kernel::effects::time_of_contact::{Memory, TimeOfContact, TimeSettings, time_of_contact};
use collided_tests::ccd::{self, Case};

/// Rotations that stay open, because rounding hides whether the two touch at one instant or pass by: a tip on the
/// circle that a plate is tangent to; a corner that goes exactly through the border of a plate.
const GRAZING: [&str; 2] = ["rot-graze-tip", "rot-screw-hit"];

/// At the start one is inside the other, surfaces apart: the effect is about surfaces, `containment` tells the rest.
const INSIDE_AT_THE_START: &str = "in-contained";

/// Positions are at most 1e7 here and closing speeds at least 1, but where coordinates are large, speeds are too.
const POSITION_BOUND_OVER_SPEED: f64 = 1e-13;

/// Near a tangent the time answers to the square root of the position.
const GRAZING_BOUND: f64 = 1e-6;

const TOLERANCES: [f64; 3] = [1e-3, 1e-6, 1e-9];

fn fault(case: &Case, found: TimeOfContact, tolerance: f64) -> Option<String> {
    let grazing = GRAZING.contains(&case.id.as_str());
    let bound = if grazing { GRAZING_BOUND } else { POSITION_BOUND_OVER_SPEED };
    let holds = |lo: f64, hi: f64, toc: f64| lo <= toc + bound && toc - bound <= hi && lo <= hi;
    let right = match (case.expected.toc, found) {
        (None, TimeOfContact::Free) => true,
        (Some(toc), TimeOfContact::Contact { lo, hi }) => {
            holds(lo, hi, toc) && hi - lo <= tolerance && (toc > 0.0 || hi == 0.0)
        }
        (Some(toc), TimeOfContact::Possible { lo, hi, distance }) => grazing && holds(lo, hi, toc) && distance < 1e-12,
        _ => false,
    };
    (!right).then(|| format!("{} at {tolerance:e}: {found:?}, but the truth is {:?}", case.id, case.expected.toc))
}

fn run(case: &Case, order: Option<u32>, swapped: bool, tolerance: f64, memory: &mut Memory) -> TimeOfContact {
    let [a, b] = [&case.a, &case.b].map(|mesh| ccd::object(mesh, order));
    let (first, second) = ((&a, &case.motion_a.motion()), (&b, &case.motion_b.motion()));
    if swapped {
        ccd::time_of(second, first, tolerance, memory)
    } else {
        ccd::time_of(first, second, tolerance, memory)
    }
}

#[test]
fn the_whole_table() {
    let mut memory = Memory::default();
    let cases = ccd::cases();
    let (mut faults, mut slowest) = (Vec::new(), (Duration::ZERO, String::new()));
    for case in cases.iter().filter(|case| case.id != INSIDE_AT_THE_START) {
        for tolerance in TOLERANCES {
            for (order, swapped) in [(None, false), (None, true), (Some(0), false), (Some(7), false), (Some(12), true)]
            {
                let start = Instant::now();
                let found = run(case, order, swapped, tolerance, &mut memory);
                slowest = slowest.max((start.elapsed(), format!("{} at {tolerance:e}, order {order:?}", case.id)));
                faults.extend(fault(case, found, tolerance));
            }
        }
    }
    println!("slowest: {} in {:.1?}", slowest.1, slowest.0);
    assert!(faults.is_empty(), "{} faults:\n{}", faults.len(), faults.join("\n"));
    let contacts = cases.iter().filter(|case| case.expected.toc.is_some()).count();
    assert_eq!((cases.len(), contacts), (80, 62));
}

#[test]
fn a_miss_by_a_millionth_is_proven_at_every_tolerance() {
    let cases = ccd::cases();
    let case = cases.iter().find(|case| case.id == "rot-graze-miss").expect("the case is in the table");
    for tolerance in TOLERANCES {
        assert_eq!(run(case, None, false, tolerance, &mut Memory::default()), TimeOfContact::Free);
    }
}

#[test]
fn inside_without_touching_is_no_contact_of_surfaces_until_they_meet() {
    let cases = ccd::cases();
    let case = cases.iter().find(|case| case.id == INSIDE_AT_THE_START).expect("the case is in the table");
    match run(case, None, false, 1e-6, &mut Memory::default()) {
        TimeOfContact::Contact { lo, .. } => assert!(lo > 0.0),
        other => panic!("the inner one leaves through the surface of the outer one: {other:?}"),
    }
}

#[test]
fn work_that_is_used_up_leaves_a_bracket_that_holds() {
    let mut memory = Memory::default();
    for case in ccd::cases().iter().filter(|case| case.id != INSIDE_AT_THE_START) {
        let [a, b] = [&case.a, &case.b].map(|mesh| ccd::object(mesh, None));
        let motions = [case.motion_a.motion(), case.motion_b.motion()];
        for iterations in [0, 10, 100, 300, 1000, 3000] {
            let settings = TimeSettings { tolerance: 1e-9, iterations };
            let found = time_of_contact((&a, &motions[0]), (&b, &motions[1]), settings, &mut memory);
            let holds = match (case.expected.toc, found) {
                (Some(toc), TimeOfContact::Contact { lo, hi } | TimeOfContact::Possible { lo, hi, .. }) => {
                    lo <= toc + GRAZING_BOUND && toc - GRAZING_BOUND <= hi
                }
                (toc, TimeOfContact::Free) => toc.is_none(),
                (None, found) => matches!(found, TimeOfContact::Possible { .. }),
            };
            assert!(holds, "{} with {iterations} iterations: {found:?}", case.id);
            assert!(iterations > 0 || matches!(found, TimeOfContact::Possible { lo: 0.0, hi: 1.0, .. }));
        }
    }
}
