//! Motions of real meshes on which other libraries were measured to be late, early, or to see nothing.

use std::fs;

use collided_kernel::effects::time_of_contact::{Memory, TimeOfContact};
use collided_kernel::motion::Motion;
use collided_protocol::step::Rows;
use collided_tests::{ccd, meshes};
use serde::Deserialize;

#[derive(Deserialize)]
struct Measured {
    meshes: [String; 2],
    cases: Vec<Case>,
}

#[derive(Deserialize)]
struct Case {
    motion_index: usize,
    #[serde(rename = "A")]
    a: Rows,
    #[serde(rename = "B_start")]
    b_start: Rows,
    #[serde(rename = "B_end")]
    b_end: Rows,
    /// Found by an exact scan: contact 1e-6 later, none 1e-6 before.
    toi_ref: f64,
}

const REFERENCE_BOUND: f64 = 1e-6;

#[test]
fn brackets_agree_with_an_exact_scan() {
    let text = fs::read_to_string(ccd::directory().join("measured_ccd_env_rob.json")).expect("the data are here");
    let measured: Measured = serde_json::from_str(&text).expect("the data are well formed");
    let [a, b] = measured.meshes.map(|name| meshes::shipped(&name, None));
    let mut memory = Memory::default();
    for case in &measured.cases {
        let (still, turning) = (Motion::Still(case.a), ccd::turning(case.b_start, case.b_end));
        for tolerance in [1e-3, 1e-6, 1e-9] {
            let TimeOfContact::Contact { lo, hi } = ccd::time_of((&a, &still), (&b, &turning), tolerance, &mut memory)
            else {
                panic!("motion {} ends in a contact", case.motion_index);
            };
            assert!(hi - lo <= tolerance, "motion {}: {lo} {hi}", case.motion_index);
            let agrees = lo <= case.toi_ref + REFERENCE_BOUND && case.toi_ref - REFERENCE_BOUND <= hi;
            assert!(agrees, "motion {}: [{lo}, {hi}] misses {}", case.motion_index, case.toi_ref);
        }
    }
    assert_eq!(measured.cases.len(), 7);
}
