//! The dial and the budget: coarser answers are never wrong, finer ones only ever prove what was left possible, and bounds hold.

use std::collections::BTreeMap;
use std::sync::Arc;

use collided_kernel::PolygonMesh;
use collided_kernel::affine::IDENTITY;
use collided_kernel::effects::distance::{DistanceSettings, Memory, distance};
use collided_kernel::{
    Accuracy, BodyId, Budget, Effects, Level, NoClock, Object, OpenBound, Report, Scene, Transforms, Verdict,
};
use collided_protocol::step::Rows;
use collided_tests::hardcases::unit_cube;
use collided_tests::kernel_pair::pools;
use collided_tests::{crowd, meshes, transforms};
use proptest::prelude::*;

/// What a report says of its pairs, by their bodies.
#[derive(Debug, Clone, PartialEq)]
struct Answer {
    pairs: BTreeMap<(u32, u32), (Verdict, Level, bool)>,
    bounds: BTreeMap<(u32, u32), OpenBound>,
    complete: bool,
}

impl Answer {
    fn of(report: &Report<'_>) -> Answer {
        let names = |place: usize| (report.pairs()[place].a.0, report.pairs()[place].b.0);
        let pairs =
            report.pairs().iter().map(|pair| ((pair.a.0, pair.b.0), (pair.verdict, pair.level, pair.unfinished)));
        let bounds = report.bounds().iter().map(|&(place, bound)| (names(place as usize), bound)).collect();
        Answer { pairs: pairs.collect(), bounds, complete: report.is_complete() }
    }

    /// A pair that is not listed is clear, if all that matter were found.
    fn verdict(&self, pair: (u32, u32)) -> Verdict {
        let unlisted = if self.complete { Verdict::Clear } else { Verdict::Possible };
        self.pairs.get(&pair).map_or(unlisted, |pair| pair.0)
    }
}

/// Every answer that is proven in `coarse` is that of `exact`.
fn assert_never_wrong(coarse: &Answer, exact: &Answer, bodies: u32, what: &str) {
    for pair in (0..bodies).flat_map(|b| (0..b).map(move |a| (a, b))) {
        let (coarse, exact) = (coarse.verdict(pair), exact.verdict(pair));
        assert!(coarse == Verdict::Possible || coarse == exact, "{what}, pair {pair:?}: {coarse:?}, truly {exact:?}");
    }
}

/// What `coarse` has proven is proven in `fine` too.
fn assert_only_more_is_proven(coarse: &Answer, fine: &Answer, bodies: u32, what: &str) {
    assert_never_wrong(coarse, fine, bodies, what);
    assert!(fine.complete || !coarse.complete, "{what}: pairs were found with less");
}

/// Levels and orders, the coarsest first.
fn dial(order: u32) -> Vec<Accuracy> {
    let at = |level: Level, order: Option<u32>| Accuracy { level, order, ..Accuracy::default() };
    let voxels = (0..=order).map(|order| at(Level::Voxels, Some(order)));
    let mut dial = vec![at(Level::GlobalBoxes, None), at(Level::Containers, None)];
    dial.extend(voxels);
    dial.extend([at(Level::Voxels, None), at(Level::Polygons, None)]);
    dial
}

fn scene(objects: &[Arc<Object>], accuracy: Accuracy, budget: Budget) -> Scene {
    let mut scene = Scene::new(Effects::INTERFERENCE);
    for object in objects {
        scene.add_body(Arc::clone(object), None);
    }
    scene.set_accuracy(accuracy);
    scene.set_budget(budget);
    scene
}

fn answer(scene: &mut Scene, placed: &[Rows]) -> (Answer, u64) {
    let report = scene.step(Transforms::Dense(placed), &NoClock).expect("the transforms are finite");
    let counts = report.counts();
    (Answer::of(&report), counts.voxels_visited + counts.exact_tests)
}

/// The bounds of open pairs against the exact distance: `apart_at_most` is no less.
fn assert_bounds_hold(found: &Answer, objects: &[Arc<Object>], placed: &[Rows], what: &str) {
    let mut memory = Memory::default();
    for (&(a, b), bound) in &found.bounds {
        let (first, second) = (a as usize, b as usize);
        let (a, b) = ((&*objects[first], &placed[first]), (&*objects[second], &placed[second]));
        let least = distance(a, b, DistanceSettings::default(), &mut memory).expect("they have polygons");
        assert!(least.lower <= bound.apart_at_most, "{what}: {} apart, not {}", least.lower, bound.apart_at_most);
    }
}

fn crowd_scene(count: usize, side: f64) -> (Vec<Arc<Object>>, Vec<Vec<Rows>>) {
    let shapes = [meshes::shipped("rob", Some(12)), meshes::shipped("low_poly_bunny", Some(13))];
    let objects: Vec<_> = (0..count).map(|body| Arc::clone(&shapes[body % 2])).collect();
    let steps = crowd::moving_within(side, count, 3, 5);
    let fitted = |(object, rows): (&Arc<Object>, &Rows)| {
        let linear = rows.map(|[x, y, z, _]| [x, y, z]);
        transforms::placed(object, &linear, rows.map(|row| row[3]))
    };
    let steps = steps.iter().map(|rows| objects.iter().zip(rows).map(fitted).collect()).collect();
    (objects, steps)
}

#[test]
fn each_step_of_the_dial_proves_more_and_nothing_wrong() {
    let (objects, steps) = crowd_scene(24, 2.2);
    let bodies = objects.len() as u32;
    for placed in &steps {
        let (exact, _) = answer(&mut scene(&objects, Accuracy::default(), Budget::Unlimited), placed);
        assert!(exact.bounds.is_empty(), "nothing is open at full accuracy");
        let mut coarser: Option<Answer> = None;
        let mut open = Vec::new();
        for accuracy in dial(13) {
            let what = format!("{:?} {:?}", accuracy.level, accuracy.order);
            let (found, _) = answer(&mut scene(&objects, accuracy, Budget::Unlimited), placed);
            assert_never_wrong(&found, &exact, bodies, &what);
            assert_bounds_hold(&found, &objects, placed, &what);
            let asked = found.pairs.values().all(|&(verdict, level, unfinished)| {
                !unfinished && (level == accuracy.level || verdict != Verdict::Possible)
            });
            assert!(asked, "{what}: a pair is refined as far as asked");
            coarser.iter().for_each(|coarser| assert_only_more_is_proven(coarser, &found, bodies, &what));
            open.push(found.bounds.len());
            coarser = Some(found);
        }
        assert!(
            open[0] > open[1] && open[1] > open[5] && open[5] > open[11],
            "finer levels leave fewer open: {open:?}"
        );
    }
}

#[test]
fn coarser_levels_do_less_work() {
    let (objects, steps) = crowd_scene(24, 2.2);
    let at = |level: Level, order: Option<u32>| Accuracy { level, order, ..Accuracy::default() };
    let ascending = [
        at(Level::GlobalBoxes, None),
        at(Level::Voxels, Some(3)),
        at(Level::Voxels, Some(6)),
        at(Level::Voxels, Some(9)),
        at(Level::Polygons, None),
    ];
    let work = ascending.map(|accuracy| answer(&mut scene(&objects, accuracy, Budget::Unlimited), &steps[0]).1);
    assert!(work.is_sorted_by(|less, more| less < more), "{work:?}");
}

#[test]
fn threads_and_names_change_nothing_at_any_level() {
    let (objects, steps) = crowd_scene(24, 2.2);
    for accuracy in dial(13) {
        let [one, two] =
            pools().map(|pool| pool.install(|| answer(&mut scene(&objects, accuracy, Budget::Unlimited), &steps[1]).0));
        assert_eq!(one, two, "{accuracy:?}");
    }
}

#[test]
fn more_work_only_proves_more_and_enough_gives_the_report_of_no_budget() {
    let (objects, steps) = crowd_scene(24, 2.2);
    let bodies = objects.len() as u32;
    let [pool, _] = pools();
    pool.install(|| {
        for (placed, asked) in steps.iter().zip([Level::Polygons, Level::Voxels, Level::Polygons]) {
            let accuracy = Accuracy { level: asked, ..Accuracy::default() };
            let (full, _) = answer(&mut scene(&objects, accuracy, Budget::Unlimited), placed);
            let (exact, _) = answer(&mut scene(&objects, Accuracy::default(), Budget::Unlimited), placed);
            let mut less: Option<Answer> = None;
            let (mut work, mut decided) = (0, Vec::new());
            loop {
                let what = format!("{work} units");
                let (found, _) = answer(&mut scene(&objects, accuracy, Budget::Work(work)), placed);
                assert_never_wrong(&found, &exact, bodies, &what);
                assert_bounds_hold(&found, &objects, placed, &what);
                less.iter().for_each(|less| assert_only_more_is_proven(less, &found, bodies, &what));
                let proven = (0..bodies).flat_map(|b| (0..b).map(move |a| (a, b)));
                decided.push(proven.filter(|&pair| found.verdict(pair) != Verdict::Possible).count());
                if found == full {
                    break;
                }
                less = Some(found);
                work = 1 + work * 5 / 4;
                assert!(work < 1 << 30, "some budget is enough");
            }
            decided.dedup();
            assert!(decided.len() > 8, "budgets between nothing and enough decide some pairs: {decided:?}");
        }
    });
}

#[test]
fn an_empty_budget_says_that_every_pair_is_open() {
    let (objects, steps) = crowd_scene(6, 1.0);
    let (found, _) = answer(&mut scene(&objects, Accuracy::default(), Budget::Work(0)), &steps[0]);
    assert!(!found.complete && found.pairs.is_empty());
    // The bodies have moved nevertheless: the next step knows where they are.
    let mut later = scene(&objects, Accuracy::default(), Budget::Work(0));
    answer(&mut later, &steps[0]);
    later.set_budget(Budget::Unlimited);
    let none = later.step(Transforms::Sparse { bodies: &[], rows: &[] }, &NoClock).map(|report| Answer::of(&report));
    let (expected, _) = answer(&mut scene(&objects, Accuracy::default(), Budget::Unlimited), &steps[0]);
    assert_eq!(none.expect("an empty step"), expected);
}

#[test]
fn what_was_left_open_is_decided_by_later_steps_without_a_motion() {
    let (objects, steps) = crowd_scene(24, 2.2);
    let [pool, _] = pools();
    pool.install(|| {
        let (exact, _) = answer(&mut scene(&objects, Accuracy::default(), Budget::Unlimited), &steps[0]);
        let mut patient = scene(&objects, Accuracy::default(), Budget::Work(12_000));
        let mut found = answer(&mut patient, &steps[0]).0;
        assert!(!found.bounds.is_empty(), "one step is not enough");
        for _ in 0..100 {
            found = answer(&mut patient, &steps[0]).0;
        }
        assert_eq!(found, exact);
    });
}

#[test]
fn what_is_unfinished_is_said_and_not_half_told() {
    let (objects, steps) = crowd_scene(24, 2.2);
    let effects = [Effects::POLYGON_PAIRS, Effects::CONTACTS, Effects::DISTANCE, Effects::CONTAINMENT];
    let effects = effects.into_iter().fold(Effects::NONE, Effects::union);
    let new = |budget: Budget| {
        let mut scene = scene(&objects, Accuracy::default(), budget);
        scene.set_effects(effects);
        scene
    };
    let [pool, _] = pools();
    pool.install(|| {
        let mut full = new(Budget::Unlimited);
        let full = full.step(Transforms::Dense(&steps[0]), &NoClock).expect("finite");
        let mut unfinished = 0;
        for work in (0..19).map(|doubled| 1 << doubled) {
            let mut short = new(Budget::Work(work));
            let short = short.step(Transforms::Dense(&steps[0]), &NoClock).expect("finite");
            for (place, pair) in (0..).zip(short.pairs()) {
                let same = full.pairs().iter().position(|other| (other.a, other.b) == (pair.a, pair.b));
                let Some(same) = same else {
                    assert_eq!(pair.verdict, Verdict::Possible, "a clear pair may be left open, at {work}");
                    continue;
                };
                if pair.unfinished {
                    unfinished += 1;
                    continue;
                }
                let whole = &full.pairs()[same];
                assert_eq!((pair.verdict, pair.relation), (whole.verdict, whole.relation), "at {work}");
                assert_eq!(short.polygon_pairs(pair), full.polygon_pairs(whole), "at {work}");
                let distance = |report: &Report<'_>, place: u32| {
                    report.distances().iter().find(|&&(of, _)| of == place).map(|&(_, distance)| distance)
                };
                assert_eq!(distance(&short, place), distance(&full, same as u32), "at {work}");
            }
        }
        assert!(unfinished > 20, "{unfinished} pairs were left unfinished");
    });
}

#[test]
fn what_may_be_inside_is_not_clear_for_want_of_time() {
    let cube = unit_cube();
    let cube = PolygonMesh::from_polygons(cube.vertices.to_vec(), cube.triangles);
    let cube = meshes::build(cube, Some(2));
    let inner = [[0.25, 0.0, 0.0, 0.4], [0.0, 0.25, 0.0, 0.4], [0.0, 0.0, 0.25, 0.4]];
    let [pool, _] = pools();
    let verdicts: Vec<Verdict> = (0..2000)
        .step_by(10)
        .map(|work| {
            pool.install(|| {
                let mut scene = scene(&[Arc::clone(&cube), Arc::clone(&cube)], Accuracy::default(), Budget::Work(work));
                scene.set_effects(Effects::CONTAINMENT);
                answer(&mut scene, &[IDENTITY, inner]).0.verdict((0, 1))
            })
        })
        .collect();
    assert!(
        !verdicts.contains(&Verdict::Clear) && verdicts.is_sorted_by_key(|&verdict| verdict == Verdict::Interfering)
    );
    assert_eq!((verdicts[0], verdicts[199]), (Verdict::Possible, Verdict::Interfering));
}

#[test]
fn a_pair_has_an_accuracy_of_its_own() {
    let object = meshes::shipped("low_poly_bunny", None);
    let objects = [Arc::clone(&object), Arc::clone(&object), object];
    let linear = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let placed = [0.0, 0.1, 0.2].map(|x| transforms::placed(&objects[0], &linear, [x, 0.0, 0.0]));
    let mut scene = scene(&objects, Accuracy::default(), Budget::Unlimited);
    let coarse = Accuracy { level: Level::Containers, ..Accuracy::default() };
    let levels = |scene: &mut Scene| -> Vec<_> {
        answer(scene, &placed).0.pairs.into_iter().map(|(pair, (verdict, level, _))| (pair, verdict, level)).collect()
    };
    let exact = |pair: (u32, u32)| (pair, Verdict::Interfering, Level::Polygons);
    assert_eq!(levels(&mut scene), [exact((0, 1)), exact((0, 2)), exact((1, 2))]);
    scene.set_pair_accuracy(BodyId(2), BodyId(1), Some(coarse)).expect("both are there");
    let open = ((1, 2), Verdict::Possible, Level::Containers);
    assert_eq!(levels(&mut scene), [exact((0, 1)), exact((0, 2)), open]);
    scene.set_pair_accuracy(BodyId(1), BodyId(2), None).expect("both are there");
    assert_eq!(levels(&mut scene), [exact((0, 1)), exact((0, 2)), exact((1, 2))]);
    assert!(scene.set_pair_accuracy(BodyId(1), BodyId(9), Some(coarse)).is_err());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// Maps of every kind, far beyond unit scale and nearly singular.
    #[test]
    fn bounds_and_proofs_hold_under_any_map(
        maps in (transforms::extreme_linear(), transforms::extreme_linear()),
        way in transforms::direction(),
        power in -80..80i32,
    ) {
        let objects = [meshes::shipped("rob", Some(11)), meshes::shipped("low_poly_bunny", Some(14))];
        let scale = 2f64.powi(power);
        let shrunk = |linear: transforms::Linear| linear.map(|row| row.map(|entry| entry * scale));
        let placed = [
            transforms::placed(&objects[0], &shrunk(maps.0), [0.0; 3]),
            transforms::placed(&objects[1], &shrunk(maps.1), way.map(|part| part * scale)),
        ];
        let (exact, _) = answer(&mut scene(&objects, Accuracy::default(), Budget::Unlimited), &placed);
        let mut coarser: Option<Answer> = None;
        for accuracy in dial(14) {
            let what = format!("{accuracy:?}");
            let (found, _) = answer(&mut scene(&objects, accuracy, Budget::Unlimited), &placed);
            assert_never_wrong(&found, &exact, 2, &what);
            assert_bounds_hold(&found, &objects, &placed, &what);
            coarser.iter().for_each(|coarser| assert_only_more_is_proven(coarser, &found, 2, &what));
            coarser = Some(found);
        }
    }

    /// A translation as long as the bound along one of the axes takes the bodies apart: the exact test confirms it.
    #[test]
    fn a_translation_of_the_bound_takes_boxes_apart(map in transforms::linear(), way in transforms::direction()) {
        let objects = [meshes::shipped("rob", None), meshes::shipped("low_poly_bunny", None)];
        let linear = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let placed = [
            transforms::placed(&objects[0], &linear, [0.0; 3]),
            transforms::placed(&objects[1], &map, way.map(|part| 0.5 * part)),
        ];
        let coarse = Accuracy { level: Level::GlobalBoxes, ..Accuracy::default() };
        let (found, _) = answer(&mut scene(&objects, coarse, Budget::Unlimited), &placed);
        for bound in found.bounds.values() {
            let clear = |(axis, sign): (usize, f64)| {
                let mut moved = placed;
                moved[1][axis][3] += sign * bound.deep_at_most * (1.0 + 1e-9);
                answer(&mut scene(&objects, Accuracy::default(), Budget::Unlimited), &moved).0.pairs.is_empty()
            };
            prop_assert!((0..3).flat_map(|axis| [(axis, 1.0), (axis, -1.0)]).any(clear));
        }
    }
}
