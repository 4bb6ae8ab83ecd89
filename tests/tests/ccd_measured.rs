//! Motions of real meshes on which other libraries were measured to be late, early, or to see nothing.

use collided_kernel::effects::time_of_contact::Memory;
use collided_tests::ccd::{self, Measured};
use collided_tests::meshes;

#[test]
fn brackets_agree_with_an_exact_scan() {
    let file = ccd::directory().join("measured_ccd_env_rob.json");
    let measured = Measured::read(&file).expect("the data are here and well formed");
    let [a, b] = measured.meshes.map(|name| meshes::shipped(&name, None));
    let mut memory = Memory::default();
    for case in &measured.cases {
        let [still, turning] = case.motions();
        for tolerance in [1e-3, 1e-6, 1e-9] {
            let found = ccd::time_of((&a, &still), (&b, &turning), tolerance, &mut memory);
            assert_eq!(case.fault(found, tolerance), None, "motion {}: {found:?}", case.motion_index);
        }
    }
    assert_eq!(measured.cases.len(), 7);
}
