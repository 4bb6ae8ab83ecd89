//! From the shape of a scene file to a scene: names resolved, and what does not fit named.

mod dynamics;
mod steps;

use std::collections::{HashMap, HashSet};
use std::path::Path;

use collided_kernel::PolygonMesh;
use collided_protocol::control::{Accuracy, Interest};
use collided_protocol::report::Level;
use collided_protocol::{Effect, Effects};

use super::document::{self, Document};
use super::error::Invalid;
use super::values::{Entries, Number, Table};
use super::{Body, Object, Rule, SceneFile, Source, Step};

pub(super) fn scene(document: Document, folder: &Path) -> Result<SceneFile, Invalid> {
    let scene_accuracy = accuracy("accuracy", &document.accuracy)?;
    let objects = objects(document.objects, folder)?;
    let dynamics = dynamics::of_bodies(&document.bodies)?;
    let first_velocities = dynamics::first_velocities(&document.bodies)?;
    let bodies = bodies(document.bodies, &objects)?;
    let places: HashMap<&str, usize> =
        bodies.iter().enumerate().map(|(place, body)| (body.name.as_str(), place)).collect();
    let scene_effects = match &document.effects {
        Some(names) => effects("effects", names)?,
        None => Effect::Interference.into(),
    };
    let interest = interest(document.interest, &places)?;
    let steps = document.steps.into_iter().enumerate();
    let mut steps = steps.map(|(index, step)| steps::step(index, step, &places)).collect::<Result<Vec<Step>, _>>()?;
    if let Some(first) = steps.first_mut() {
        let named = |body: usize| first.velocities.iter().any(|&(other, _)| other == body);
        let unnamed: Vec<_> = first_velocities.into_iter().filter(|&(body, _)| !named(body)).collect();
        first.velocities.extend(unnamed);
    }
    Ok(SceneFile { objects, bodies, effects: scene_effects, interest, accuracy: scene_accuracy, dynamics, steps })
}

fn accuracy(place: &str, given: &document::Accuracy) -> Result<Accuracy, Invalid> {
    let numbers = [
        ("distance_tolerance", given.distance_tolerance),
        ("distance_up_to", given.distance_up_to),
        ("time_tolerance", given.time_tolerance),
        ("budget_us", given.budget_us),
    ];
    // JSON on the control channel has no other numbers; what range these must be in is the daemon's to say.
    if let Some((name, Some(value))) = numbers.iter().find(|(_, value)| value.is_some_and(|value| !value.0.is_finite()))
    {
        return Err(Invalid::new(place, format!("\"{name}\" is {}", value.0), "give a finite number"));
    }
    let level = given.level.as_deref().map(|name| level(place, name)).transpose()?;
    let [distance_tolerance, distance_up_to, time_tolerance, budget_us] =
        numbers.map(|(_, value)| value.map(|value| value.0));
    let (order, iterations) = (given.order, given.iterations);
    Ok(Accuracy { level, order, distance_tolerance, distance_up_to, time_tolerance, iterations, budget_us })
}

fn level(place: &str, name: &str) -> Result<Level, Invalid> {
    Level::ALL.into_iter().find(|level| level.name() == name).ok_or_else(|| {
        let known = Level::ALL.map(|level| format!("\"{}\"", level.name())).join(", ");
        Invalid::new(place, format!("there is no level \"{name}\""), format!("choose from {known}"))
    })
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
                let known: Vec<_> = Effect::ALL.iter().map(|effect| format!("\"{}\"", effect.name())).collect();
                let problem = format!("there is no effect \"{name}\"");
                Invalid::new(place, problem, format!("choose from {}", known.join(", ")))
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
                (false, None) if rule.accuracy.is_some() => Interest::Default,
                _ => {
                    return Err(Invalid::new(
                        place,
                        "the rule says nothing, or two things",
                        "give either \"effects\" or \"accuracy\", or both, or \"ignore\": true",
                    ));
                }
            };
            let accuracy = rule.accuracy.map(|given| accuracy(&place, &given)).transpose()?;
            Ok(Rule { a, b, interest, accuracy })
        })
        .collect()
}

fn body(place: &str, name: &str, places: &HashMap<&str, usize>) -> Result<usize, Invalid> {
    places
        .get(name)
        .copied()
        .ok_or_else(|| Invalid::new(place, format!("there is no body \"{name}\""), "define it under \"bodies\""))
}
