//! The kernel's exact triangle test against the oracle, and against itself where the answer must not change.
//!
//! `cargo run --release -p collided-tests --bin oracle_run` does the first of these for as long as one likes.

use collided_tests::kernel_pair::triangles;
use collided_tests::oracle::{self, Triangle};
use collided_tests::triangle_pairs::{Pair, any_pair, grid_pair, scaled};
use proptest::prelude::*;

fn check((a, b): Pair) -> Result<(), TestCaseError> {
    prop_assert_eq!(triangles(&a, &b), oracle::triangles(&a, &b));
    Ok(())
}

fn turned(t: Triangle, order: [usize; 3]) -> Triangle {
    order.map(|corner| t[corner])
}

fn mapped((a, b): Pair, map: impl Fn([f64; 3]) -> [f64; 3]) -> Pair {
    (a.map(&map), b.map(&map))
}

fn corner_order() -> impl Strategy<Value = [usize; 3]> {
    Just([0, 1, 2]).prop_shuffle()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 40_000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_pair_as_the_oracle(pair in any_pair()) {
        check(pair)?;
    }

    #[test]
    fn small_grids_as_the_oracle(pair in grid_pair(0, 3)) {
        check(pair)?;
    }

    #[test]
    fn the_first_named_does_not_matter((a, b) in any_pair()) {
        prop_assert_eq!(triangles(&a, &b), triangles(&b, &a));
    }

    #[test]
    fn the_order_of_the_corners_does_not_matter((a, b) in any_pair(), i in corner_order(), j in corner_order()) {
        prop_assert_eq!(triangles(&a, &b), triangles(&turned(a, i), &turned(b, j)));
    }

    #[test]
    fn a_mirror_and_exchanged_axes_do_not_matter((a, b) in any_pair(), axes in corner_order(), flip in 0..3usize) {
        let (c, d) = mapped((a, b), |mut point| {
            point[flip] = -point[flip];
            axes.map(|axis| point[axis])
        });
        prop_assert_eq!(triangles(&a, &b), triangles(&c, &d));
    }

    #[test]
    fn a_power_of_two_does_not_matter((a, b) in any_pair(), exponent in -2000..2000i32) {
        let (c, d) = mapped((a, b), |point| point.map(|x| scaled(x, exponent)));
        let exact = mapped((c, d), |point| point.map(|x| scaled(x, -exponent))) == (a, b);
        if exact {
            prop_assert_eq!(triangles(&a, &b), triangles(&c, &d));
        }
    }
}
