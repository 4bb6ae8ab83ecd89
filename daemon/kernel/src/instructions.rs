//! Vector instructions: the widest that the processor has, chosen at run time.
//!
//! Work that is [dispatched](dispatch) is compiled once for each set of them, from the same portable code. Only the number of lanes in a
//! register differs: products and sums are not contracted, so every result is the same to the bit.

/// What is compiled once for each set of instructions. [`run`](Self::run), and what it calls, must be `#[inline(always)]`: what is not
/// inlined is compiled for every processor.
pub(crate) trait Work {
    type Output;

    /// The work itself; on its own, the twin for every processor.
    fn run(self) -> Self::Output;
}

/// Does the work with the widest vector instructions that the processor has.
#[inline]
pub(crate) fn dispatch<W: Work>(work: W) -> W::Output {
    struct Dispatched<W>(W);
    impl<W: Work> pulp::WithSimd for Dispatched<W> {
        type Output = W::Output;

        #[inline(always)]
        fn with_simd<S: pulp::Simd>(self, _: S) -> W::Output {
            self.0.run()
        }
    }
    #[cfg(test)]
    if tests::is_portable() {
        return work.run();
    }
    pulp::Arch::new().dispatch(Dispatched(work))
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;
    use std::f64::consts::FRAC_PI_6;
    use std::sync::Arc;

    use crate::{Effects, NoClock, Object, PolygonMesh, Rows, Scene, Transforms};

    thread_local! {
        static PORTABLE: Cell<bool> = const { Cell::new(false) };
    }

    /// Whether this thread does without instructions that not every processor has.
    pub fn is_portable() -> bool {
        PORTABLE.get()
    }

    /// A sphere with a rough surface.
    fn stone(seed: u32) -> Arc<Object> {
        const RINGS: u32 = 12;
        let point = |i: u32, j: u32| {
            let rough = 1.0 + 0.1 * f64::from((7 * i + 5 * (j % RINGS) + seed) % 11) / 11.0;
            let (polar, turn) = (f64::from(i) * FRAC_PI_6 / 2.0, f64::from(j % RINGS) * FRAC_PI_6);
            [rough * polar.sin() * turn.cos(), rough * polar.sin() * turn.sin(), rough * polar.cos()]
        };
        let vertices = (0..=RINGS).flat_map(|i| (0..RINGS).map(move |j| point(i, j))).collect();
        let corner = |i: u32, j: u32| i * RINGS + j % RINGS;
        let quads = (0..RINGS).flat_map(|i| (0..RINGS).map(move |j| (i, j)));
        let quads = quads.map(|(i, j)| [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)]);
        let mesh = PolygonMesh::from_polygons(vertices, quads);
        Arc::new(Object::build(mesh, Some(12), &()).expect("a good mesh"))
    }

    /// Counts and results of steps in which two stones pass through each other.
    fn passage(portable: bool) -> String {
        PORTABLE.set(portable);
        let mut scene = Scene::new(Effects::POLYGON_PAIRS);
        scene.add_body(stone(0), None);
        scene.add_body(stone(3), None);
        let mut found = String::new();
        for step in 0..40 {
            let (sine, cosine) = (0.1 * f64::from(step)).sin_cos();
            let aside = 0.1 * f64::from(step) - 2.0;
            let turned: Rows =
                [[cosine, -sine, 0.0, aside], [sine, cosine, 0.0, 0.3], [0.0, 0.0, 1.0, 0.5 * f64::from(step % 7)]];
            let report = scene.step(Transforms::Dense(&[crate::affine::IDENTITY, turned]), &NoClock).expect("good");
            found += &format!("{:?} {:?}\n", report.counts(), report.pairs());
            report.pairs().iter().for_each(|pair| found += &format!("{:?}\n", report.polygon_pairs(pair)));
        }
        PORTABLE.set(false);
        found
    }

    #[test]
    fn the_instructions_of_this_processor_find_what_any_finds() {
        let found = passage(false);
        assert!(found.matches("Interfering").count() > 10, "{found}");
        assert_eq!(found, passage(true));
    }
}
