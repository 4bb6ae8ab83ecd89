//! From the shape of a scene file to a scene: names resolved, and what does not fit named.

use std::collections::{HashMap, HashSet};
use std::path::Path;

use collided_kernel::PolygonMesh;
use collided_protocol::control::Interest;
use collided_protocol::report::Level;
use collided_protocol::step::Rows;
use collided_protocol::{Effect, Effects};

use super::document::{self, Document};
use super::error::Invalid;
use super::values::{self, Entries, Number, Table};
use super::{Body, Object, Pose, Rule, SceneFile, Source};

/// Effects that scene files know and this version does not compute.
const LATER_EFFECTS: [&str; 5] = ["contacts", "distance", "penetration", "time_of_contact", "response"];

pub(super) fn scene(document: Document, folder: &Path) -> Result<SceneFile, Invalid> {
    accuracy(&document.accuracy)?;
    let objects = objects(document.objects, folder)?;
    let bodies = bodies(document.bodies, &objects)?;
    let places: HashMap<&str, usize> =
        bodies.iter().enumerate().map(|(place, body)| (body.name.as_str(), place)).collect();
    let scene_effects = match &document.effects {
        Some(names) => effects("effects", names)?,
        None => Effect::Interference.into(),
    };
    let interest = interest(document.interest, &places)?;
    let steps = document.steps.into_iter().enumerate();
    let steps = steps.map(|(index, step)| poses(index, step, &places)).collect::<Result<_, _>>()?;
    Ok(SceneFile { objects, bodies, effects: scene_effects, interest, steps })
}

fn accuracy(accuracy: &document::Accuracy) -> Result<(), Invalid> {
    let remedy = "leave it out: this version computes polygons only, the exact answer";
    if let Some(level) = accuracy.level.as_deref().filter(|&level| level != Level::Polygons.name()) {
        let problem = format!("level \"{level}\" is not one that this version can stop at");
        return Err(Invalid::new("accuracy", problem, remedy));
    }
    let later = [
        ("order", &accuracy.order),
        ("distance_tolerance", &accuracy.distance_tolerance),
        ("time_tolerance", &accuracy.time_tolerance),
        ("iterations", &accuracy.iterations),
        ("budget_us", &accuracy.budget_us),
    ];
    match later.iter().find(|(_, value)| value.is_some()) {
        None => Ok(()),
        Some((name, _)) => Err(Invalid::new("accuracy", format!("\"{name}\" has no use in this version"), remedy)),
    }
}

fn objects(entries: Entries<document::Object>, folder: &Path) -> Result<Vec<Object>, Invalid> {
    entries
        .0
        .into_iter()
        .map(|(name, object)| {
            let place = format!("object \"{name}\"");
            let source = match (object.mesh, object.vertices, object.polygons) {
                (Some(mesh), None, None) => Source::File(folder.join(mesh)),
                (None, Some(vertices), Some(polygons)) => Source::Inline(mesh(&place, vertices, polygons)?),
                _ => {
                    return Err(Invalid::new(
                        place,
                        "its polygons are not given, or given twice",
                        "give either \"mesh\", the path of a mesh file, or both \"vertices\" and \"polygons\"",
                    ));
                }
            };
            Ok(Object { name, source, order: object.order })
        })
        .collect()
}

fn mesh(place: &str, vertices: Table, polygons: Vec<Vec<i64>>) -> Result<PolygonMesh, Invalid> {
    let vertices = vertices.iter().enumerate().map(|(vertex, coordinates)| {
        fixed::<3>(coordinates).ok_or_else(|| {
            let problem = format!("vertex {vertex} has {} coordinates", coordinates.len());
            Invalid::new(place, problem, "give each vertex three: [x, y, z]")
        })
    });
    let vertices: Vec<[f64; 3]> = vertices.collect::<Result<_, _>>()?;
    let corner = |polygon: usize, (corner, index): (usize, i64)| {
        u32::try_from(index).map_err(|_| {
            let problem = format!(
                "corner {corner} of polygon {polygon} names vertex {index}, but there are {} vertices",
                vertices.len()
            );
            Invalid::new(place, problem, "number vertices from 0")
        })
    };
    let polygons = polygons.into_iter().enumerate().map(|(polygon, corners)| {
        corners.into_iter().enumerate().map(|indexed| corner(polygon, indexed)).collect::<Result<Vec<u32>, _>>()
    });
    let polygons: Vec<Vec<u32>> = polygons.collect::<Result<_, _>>()?;
    Ok(PolygonMesh::from_polygons(vertices, polygons))
}

/// `N` numbers; `None` when there are more or fewer.
fn fixed<const N: usize>(numbers: &[Number]) -> Option<[f64; N]> {
    Some(<&[Number; N]>::try_from(numbers).ok()?.map(|number| number.0))
}

fn bodies(bodies: Vec<document::Body>, objects: &[Object]) -> Result<Vec<Body>, Invalid> {
    let places: HashMap<&str, usize> =
        objects.iter().enumerate().map(|(place, object)| (object.name.as_str(), place)).collect();
    let mut names = HashSet::new();
    bodies
        .into_iter()
        .map(|body| {
            let place = format!("body \"{}\"", body.name);
            if !names.insert(body.name.clone()) {
                return Err(Invalid::new(
                    place,
                    "there are two bodies of this name",
                    "give each body a name of its own",
                ));
            }
            match places.get(body.object.as_str()) {
                Some(&object) => Ok(Body { name: body.name, object, group: body.group }),
                None => {
                    let problem = format!("there is no object \"{}\"", body.object);
                    Err(Invalid::new(place, problem, "define it under \"objects\""))
                }
            }
        })
        .collect()
}

fn effects(place: &str, names: &[String]) -> Result<Effects, Invalid> {
    names
        .iter()
        .map(|name| {
            Effect::named(name).ok_or_else(|| {
                let problem = match LATER_EFFECTS.contains(&name.as_str()) {
                    true => format!("the effect \"{name}\" is not computed by this version"),
                    false => format!("there is no effect \"{name}\""),
                };
                let known: Vec<_> = Effect::ALL.iter().map(|effect| format!("\"{}\"", effect.name())).collect();
                Invalid::new(place, problem, format!("this version computes {}", known.join(", ")))
            })
        })
        .collect()
}

fn interest(rules: Vec<document::Rule>, places: &HashMap<&str, usize>) -> Result<Vec<Rule>, Invalid> {
    let mut seen = HashSet::new();
    rules
        .into_iter()
        .enumerate()
        .map(|(index, rule)| {
            let place = format!("interest {index}, pair [\"{}\", \"{}\"]", rule.pair[0], rule.pair[1]);
            let [a, b] = rule.pair.each_ref().map(|name| body(&place, name, places));
            let (a, b) = (a?, b?);
            if a == b {
                return Err(Invalid::new(place, "a body with itself is no pair", "name two bodies"));
            }
            if !seen.insert((a.min(b), a.max(b))) {
                return Err(Invalid::new(place, "the pair has a rule already", "keep one rule for each pair"));
            }
            let interest = match (rule.ignore, rule.effects) {
                (true, None) => Interest::Ignore,
                (false, Some(names)) => Interest::Effects(effects(&place, &names)?),
                _ => {
                    return Err(Invalid::new(
                        place,
                        "the rule says nothing, or two things",
                        "give either \"effects\" or \"ignore\": true",
                    ));
                }
            };
            Ok(Rule { a, b, interest })
        })
        .collect()
}

fn body(place: &str, name: &str, places: &HashMap<&str, usize>) -> Result<usize, Invalid> {
    places
        .get(name)
        .copied()
        .ok_or_else(|| Invalid::new(place, format!("there is no body \"{name}\""), "define it under \"bodies\""))
}

fn poses(index: usize, step: values::Step, places: &HashMap<&str, usize>) -> Result<Vec<Pose>, Invalid> {
    let place = format!("step {index}");
    if step.motion.is_some_and(|motion| !motion.0.is_empty()) {
        return Err(Invalid::new(
            place,
            "\"motion\" is not computed by this version",
            "give the transform at the end of the step under \"poses\"",
        ));
    }
    if step.delta_time.is_some_and(|time| !(time.0.is_finite() && time.0 >= 0.0)) {
        return Err(Invalid::new(place, "\"delta_time\" is negative or not finite", "give the length of the step"));
    }
    let transforms = match step.poses {
        None => step.transforms,
        Some(poses) if step.transforms.is_empty() => poses.0,
        Some(_) => {
            let problem = format!("the transform of \"{}\" stands beside \"poses\"", step.transforms[0].0);
            return Err(Invalid::new(place, problem, "write all transforms of the step under \"poses\""));
        }
    };
    transforms
        .into_iter()
        .map(|(name, table)| {
            let body = body(&place, &name, places)?;
            Ok(Pose { body, rows: rows(&format!("{place}, body \"{name}\""), &table)? })
        })
        .collect()
}

fn rows(place: &str, table: &Table) -> Result<Rows, Invalid> {
    let remedy = "give 3 rows of 4 numbers (rotation, scale, shear | translation)";
    let wrong = |problem: String| Invalid::new(place, problem, remedy);
    let [a, b, c] = table.as_slice() else {
        return Err(wrong(format!("the transform has {} rows", table.len())));
    };
    let row = |number: usize, row: &Vec<Number>| {
        fixed::<4>(row).ok_or_else(|| wrong(format!("row {number} of the transform has {} numbers", row.len())))
    };
    Ok([row(0, a)?, row(1, b)?, row(2, c)?])
}
