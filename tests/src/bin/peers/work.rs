//! The kinds of work, each answered by all libraries in turns.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use collided_kernel::{Effects, Object, Report, Transforms};
use collided_protocol::step::Rows;
use collided_tests::derived_meshes::{in_triangles, subdivided};
use collided_tests::{meshes, npy};
use parry3d_f64::math::Pose;
use parry3d_f64::shape::TriMesh;
use rayon::{ThreadPool, ThreadPoolBuilder};
use serde_json::{Value, json};

use crate::parry::Parts;
use crate::turns::{Contender, Limits, Record, in_turns, timed};
use crate::{AnyError, Question, ours, parry};

pub const OURS: &str = "ours";
const STOCK: &str = "parry stock";
const DUAL: &str = "parry dual";

/// A mesh as each library holds it; the same triangles, numbered alike.
pub struct Model {
    object: Arc<Object>,
    mesh: TriMesh,
}

impl Model {
    pub fn read(path: &Path) -> Model {
        let triangles = in_triangles(&meshes::read(path)).mesh;
        Model { mesh: Parts::of(&triangles).build(), object: meshes::build(triangles, None) }
    }
}

/// Poses as each library takes them. Conversion is not timed.
pub struct Poses {
    rows: Vec<[Rows; 2]>,
    /// Of A, of B, and of B in A.
    parry: Vec<[Pose; 3]>,
}

impl Poses {
    pub fn new(rows: Vec<[Rows; 2]>) -> Poses {
        let convert = |[a, b]: &[Rows; 2]| {
            let [a, b] = [a, b].map(parry::pose);
            [a, b, a.inv_mul(&b)]
        };
        Poses { parry: rows.iter().map(convert).collect(), rows }
    }

    pub fn count(&self) -> usize {
        self.rows.len()
    }
}

pub fn pair(
    question: Question,
    paths: [&PathBuf; 2],
    poses: &Path,
    count: Option<usize>,
    limits: &Limits,
) -> Result<(), AnyError> {
    let models = paths.map(|path| Model::read(path));
    let rows = npy::read_pose_pairs(poses)?;
    let run = || {
        let classes = classes(&models, &rows);
        let wanted = |class: f64| match question {
            Question::Boolean | Question::Smooth => true,
            Question::PolygonPairs => class == 2.0,
            Question::Distance => class < 2.0,
        };
        let selected = (0..rows.len()).filter(|&pose| wanted(classes[pose]));
        let selected: Vec<usize> = selected.take(count.unwrap_or(usize::MAX)).collect();
        let poses = Poses::new(selected.iter().map(|&pose| rows[pose]).collect());
        let records = in_turns(contenders(question, &models, &poses), poses.count(), limits);
        let classes: Vec<f64> = selected.iter().map(|&pose| classes[pose]).collect();
        print(&records, json!({ "poses": selected, "classes": classes }));
    };
    on_one_thread(run);
    Ok(())
}

/// What each pose is, by ours.
fn classes([a, b]: &[Model; 2], rows: &[[Rows; 2]]) -> Vec<f64> {
    let mut pair = ours::Pair::new([&a.object, &b.object], Effects::INTERFERENCE);
    rows.iter().map(|rows| pair.step(Transforms::Dense(rows), ours::class).1).collect()
}

fn contenders<'a>(question: Question, models: &'a [Model; 2], poses: &'a Poses) -> Vec<Contender<'a>> {
    let [a, b] = models;
    let dual = |at: &'a [Pose; 3]| parry::dual(&at[2], &a.mesh, &b.mesh);
    let ours = |effects, answer| our_answers(models, poses, effects, answer, question != Question::Smooth);
    match question {
        Question::Boolean | Question::Smooth => std::iter::once(ours(Effects::INTERFERENCE, ours::interfering))
            .chain(parrys_booleans(models, poses))
            .collect(),
        Question::PolygonPairs => {
            let mut pairs = Vec::new();
            vec![
                ours(Effects::POLYGON_PAIRS, ours::polygon_pairs),
                Contender::new(DUAL, move |pose| {
                    pairs.clear();
                    timed(|| {
                        pairs.extend(dual(&poses.parry[pose]));
                        pairs.len() as f64
                    })
                }),
            ]
        }
        Question::Distance => vec![
            ours(Effects::DISTANCE, ours::distance),
            Contender::new(STOCK, move |pose| {
                let [at_a, at_b, _] = &poses.parry[pose];
                timed(|| parry::distance(at_a, &a.mesh, at_b, &b.mesh))
            }),
        ],
    }
}

/// Parry's ways to ask whether two meshes interfere.
pub fn parrys_booleans<'a>([a, b]: &'a [Model; 2], poses: &'a Poses) -> Vec<Contender<'a>> {
    vec![
        Contender::new(STOCK, move |pose| {
            let [at_a, at_b, _] = &poses.parry[pose];
            timed(|| f64::from(parry::stock(at_a, &a.mesh, at_b, &b.mesh)))
        }),
        Contender::new(DUAL, move |pose| {
            timed(|| f64::from(parry::dual(&poses.parry[pose][2], &a.mesh, &b.mesh).next().is_some()))
        }),
    ]
}

fn our_answers<'a>(
    [a, b]: &[Model; 2],
    poses: &'a Poses,
    effects: Effects,
    answer: fn(&Report<'_>) -> f64,
    forget: bool,
) -> Contender<'a> {
    let mut pair = ours::Pair::new([&a.object, &b.object], effects);
    Contender::new(OURS, move |pose| {
        if forget {
            pair.forget();
        }
        pair.step(Transforms::Dense(&poses.rows[pose]), answer)
    })
}

pub fn time_of_contact(paths: [&PathBuf; 2], motions: &Path, rigid: bool, limits: &Limits) -> Result<(), AnyError> {
    let [a, b] = paths.map(|path| Model::read(path));
    let motions = npy::read_motion_pairs(motions)?;
    let poses: Vec<[Pose; 3]> = motions.iter().map(|[a, b]| [&a[0], &b[0], &b[1]].map(parry::pose)).collect();
    let run = || {
        let mut pair = ours::Pair::new([&a.object, &b.object], Effects::NONE);
        let contenders = vec![
            Contender::new(OURS, |motion| pair.time_of_contact(&motions[motion], rigid)),
            Contender::new(STOCK, |motion| {
                let [at_a, from, to] = &poses[motion];
                timed(|| parry::time_of_contact(at_a, &a.mesh, [from, to], &b.mesh, rigid))
            }),
        ];
        print(&in_turns(contenders, motions.len(), limits), json!({}));
    };
    on_one_thread(run);
    Ok(())
}

/// The first step only places the bodies; it is not in the record.
pub fn crowd(mesh: &Path, steps: &Path, threads: usize, limits: &Limits) -> Result<(), AnyError> {
    let Model { object, mesh } = Model::read(mesh);
    let steps = npy::read_steps(steps)?;
    let [first, ..] = &steps[..] else { return Err("there are no steps".into()) };
    let moved: Vec<Vec<u32>> = steps.windows(2).map(|pair| changed(&pair[0], &pair[1])).collect();
    let sparse = |step: usize| moved[step].iter().map(|&body| steps[step + 1][body as usize]).collect::<Vec<Rows>>();
    let run = || {
        let (mut ours, mut theirs) = (ours::Crowd::new(&object, first), parry::Crowd::new(&mesh, first));
        let contenders = vec![
            Contender::new(OURS, |step| {
                if step == 0 {
                    ours = ours::Crowd::new(&object, first);
                }
                let new = sparse(step);
                timed(|| ours.step(&steps[step + 1], &moved[step], &new))
            }),
            Contender::new(DUAL, |step| {
                if step == 0 {
                    theirs = parry::Crowd::new(&mesh, first);
                }
                timed(|| theirs.step(&steps[step + 1], &moved[step], threads) as f64)
            }),
        ];
        in_turns(contenders, moved.len(), limits)
    };
    print(&pool(threads).install(run), json!({ "bodies": first.len() }));
    Ok(())
}

fn changed(before: &[Rows], after: &[Rows]) -> Vec<u32> {
    (0..after.len() as u32).filter(|&body| before[body as usize] != after[body as usize]).collect()
}

/// Answers are bytes held: for ours after a step that needed all that is built when first needed.
pub fn build(path: &Path, subdivide: u32, threads: usize, limits: &Limits) -> Result<(), AnyError> {
    let triangles = subdivided(&meshes::read(path), subdivide);
    let ours = |_| {
        let mesh = triangles.clone();
        let (us, object) = timed(|| meshes::build(mesh, None));
        (us, in_use(object))
    };
    let theirs = |_| {
        let parts = Parts::of(&triangles);
        let (us, mesh) = timed(|| parts.build());
        (us, mesh.heap_memory_size() as f64)
    };
    let run = || in_turns(vec![Contender::new(OURS, ours), Contender::new(STOCK, theirs)], 1, limits);
    let records = pool(threads).install(run);
    print(&records, json!({ "triangles": triangles.polygon_count() }));
    Ok(())
}

/// Bytes held by an object that has been asked for a distance.
fn in_use(object: Arc<Object>) -> f64 {
    let size = meshes::longest_side(&object);
    let [here, there] = [0.0, 1.01 * size].map(|x| [[1.0, 0.0, 0.0, x], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]]);
    ours::Pair::new([&object, &object], Effects::DISTANCE).step(Transforms::Dense(&[here, there]), ours::distance);
    object.memory_bytes() as f64
}

/// Runs it on one thread of its own.
pub fn on_one_thread<T: Send>(run: impl FnOnce() -> T + Send) -> T {
    pool(1).install(run)
}

fn pool(threads: usize) -> ThreadPool {
    ThreadPoolBuilder::new().num_threads(threads).build().expect("threads can be started")
}

pub fn print(records: &[Record], mut about: Value) {
    about["libraries"] = json!(records);
    println!("{about}");
}
