//! The scenes of the demonstration: shipped meshes, and where each body is at each step.

use collided_kernel::PolygonMesh;
use collided_protocol::step::Rows;

use super::camera::Camera;
use super::pose::{Key, Pose, along, circling};
use crate::mesh_file::{self, Format, Malformed};

/// A scene.
pub struct Scene {
    /// Names it in tables and on the command line of its client.
    pub name: &'static str,
    /// What is to be seen.
    pub caption: &'static str,
    /// The bodies.
    pub bodies: &'static [Body],
    /// Where the picture is taken from.
    pub camera: Camera,
    /// What of the world is in the picture; the rest is cut away.
    pub visible: fn([f64; 3]) -> bool,
}

/// A body of a scene.
pub struct Body {
    /// Its name.
    pub name: &'static str,
    /// Its object.
    pub mesh: Mesh,
    /// Its colour in the picture: red, green and blue.
    pub colour: [u8; 3],
    /// Where it is, from the begin (0) to the end (1) of the demonstration.
    pub pose: fn(f64) -> Rows,
}

/// A mesh shipped with the program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mesh {
    /// A cow, by Keenan Crane.
    Spot,
    /// A small version of the Stanford bunny, by Camilo Talero.
    Bunny,
    /// A room with a window, a table and chairs, from FCL.
    Env,
    /// A piano, from FCL.
    Rob,
}

impl Mesh {
    /// Its name as an object.
    pub fn name(self) -> &'static str {
        match self {
            Mesh::Spot => "spot",
            Mesh::Bunny => "low_poly_bunny",
            Mesh::Env => "env",
            Mesh::Rob => "rob",
        }
    }

    /// Its polygons.
    ///
    /// # Errors
    /// None, unless the program was built with a file that is no mesh.
    pub fn polygons(self) -> Result<PolygonMesh, Malformed> {
        let bytes: &[u8] = match self {
            Mesh::Spot => include_bytes!("../../meshes/spot.obj"),
            Mesh::Bunny => include_bytes!("../../meshes/low_poly_bunny.obj"),
            Mesh::Env => include_bytes!("../../meshes/env.obj"),
            Mesh::Rob => include_bytes!("../../meshes/rob.obj"),
        };
        mesh_file::parse(bytes, Format::Obj, &mut |_, _| {})
    }
}

impl Scene {
    /// The transforms of all bodies at step `step` of `steps`.
    pub fn transforms(&self, step: u64, steps: u64) -> impl Iterator<Item = Rows> {
        let time = step as f64 / steps.max(1) as f64;
        self.bodies.iter().map(move |body| (body.pose)(time))
    }

    /// The scene of this name.
    pub fn named(name: &str) -> Option<&'static Scene> {
        SCENES.iter().find(|scene| scene.name == name)
    }
}

/// The scenes, each run by a client process of its own.
pub static SCENES: [Scene; 2] = [PASTURE, ROOM];

const BUNNY_SCALE: f64 = 0.2;

const PASTURE: Scene = Scene {
    name: "pasture",
    caption: "Bunnies run round a cow, and through it",
    bodies: &[
        Body {
            name: "cow",
            mesh: Mesh::Spot,
            colour: [222, 222, 226],
            pose: |time| circling(0.0, 0.0, 0.05 * time).rows(),
        },
        Body {
            name: "bunny 1",
            mesh: Mesh::Bunny,
            colour: [110, 160, 220],
            pose: |time| circling(0.62, -0.62, 0.1 + time).scaled(BUNNY_SCALE).rows(),
        },
        Body {
            name: "bunny 2",
            mesh: Mesh::Bunny,
            colour: [112, 190, 140],
            pose: |time| circling(0.45, -0.1, 0.55 - 1.4 * time).scaled(BUNNY_SCALE).rows(),
        },
        Body {
            name: "bunny 3",
            mesh: Mesh::Bunny,
            colour: [232, 200, 110],
            pose: |time| circling(0.66, 0.25, 0.75 + time).scaled(BUNNY_SCALE).rows(),
        },
        Body {
            name: "bunny 4",
            mesh: Mesh::Bunny,
            colour: [170, 136, 214],
            pose: |time| circling(0.95, -0.6, 0.7 - time).scaled(BUNNY_SCALE).rows(),
        },
    ],
    camera: Camera { eye: [2.5, 1.3, 2.6], target: [0.0, -0.02, 0.1], up: [0.0, 1.0, 0.0], zoom: 2.9 },
    visible: |_| true,
};

/// Through the window, over the table and among the chairs.
const ROB_PATH: [Key; 6] = [
    Key { time: 0.0, pose: Pose { position: [2300.0, -300.0, 1500.0], turn: [0.0, 0.0, 0.0], scale: 1.0 } },
    Key { time: 0.25, pose: Pose { position: [1000.0, 0.0, 1480.0], turn: [0.1, 0.0, 0.6], scale: 1.0 } },
    Key { time: 0.45, pose: Pose { position: [-600.0, 300.0, 1500.0], turn: [0.4, 0.3, 1.4], scale: 1.0 } },
    Key { time: 0.65, pose: Pose { position: [-1500.0, 1300.0, 1000.0], turn: [0.5, 0.2, 2.0], scale: 1.0 } },
    Key { time: 0.85, pose: Pose { position: [-1900.0, 800.0, 620.0], turn: [0.2, 0.1, 2.6], scale: 1.0 } },
    Key { time: 1.0, pose: Pose { position: [-1500.0, -1200.0, 900.0], turn: [0.0, 0.0, 3.2], scale: 1.0 } },
];

const ROOM: Scene = Scene {
    name: "room",
    caption: "A piano is moved through a window into a room",
    bodies: &[
        Body {
            name: "room",
            mesh: Mesh::Env,
            colour: [214, 216, 218],
            pose: |_| Pose { position: [0.0; 3], turn: [0.0; 3], scale: 1.0 }.rows(),
        },
        Body { name: "piano", mesh: Mesh::Rob, colour: [70, 120, 190], pose: |time| along(&ROB_PATH, time).rows() },
    ],
    camera: Camera { eye: [-6300.0, -7400.0, 5600.0], target: [-700.0, 150.0, 850.0], up: [0.0, 0.0, 1.0], zoom: 2.75 },
    // Without the two walls on this side, to look inside.
    visible: |[x, y, _]| x > -2980.0 && y > -2980.0,
};
