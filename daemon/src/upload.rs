//! A mesh from a client's memory, part by part through shared memory.

use collided_client::transport::{self, Service, UploadService, UploadSubscriber};
use collided_kernel::PolygonMesh;
use collided_protocol::control::{
    Target, UPLOAD_CORNER_COUNTS, UPLOAD_CORNERS, UPLOAD_VERTICES, UploadHeader, UploadSize,
};
use collided_protocol::limits::{MAX_MESH_ELEMENTS, MAX_UPLOAD_PART_WORDS};
use collided_protocol::names::upload_service;
use collided_protocol::step::Word;
use collided_protocol::{ErrorCode, PROTOCOL_VERSION, WireError};
use iceoryx2::prelude::Node;

/// Coordinates of a vertex.
const AXES: usize = 3;

/// An upload under way.
pub struct Upload {
    /// Where the object goes.
    pub target: Target,
    parts: MeshParts,
    subscriber: UploadSubscriber,
    _service: UploadService,
}

/// What has come of a mesh whose size was announced.
#[derive(Debug)]
pub struct MeshParts {
    size: UploadSize,
    coordinates: Vec<f64>,
    corner_counts: Vec<u32>,
    corners: Vec<u32>,
}

impl Upload {
    /// Creates the service of upload `number`.
    ///
    /// # Errors
    /// `LimitExceeded` for a mesh that is too large, `Internal` when iceoryx2 refuses.
    pub fn begin(node: &Node<Service>, number: u32, target: Target, size: UploadSize) -> Result<Upload, WireError> {
        let parts = MeshParts::new(&target.object, size)?;
        let service = create_service(node, number).map_err(internal)?;
        let subscriber = service.subscriber_builder().create().map_err(internal)?;
        Ok(Upload { target, parts, subscriber, _service: service })
    }

    /// Takes the part that was published.
    ///
    /// # Errors
    /// `BadMessage` when there is none; those of [`MeshParts::take`].
    pub fn take_part(&mut self) -> Result<(), WireError> {
        let Some(part) = self.subscriber.receive().map_err(internal)? else {
            return Err(bad_part("no part was published", "publish one before each request to take it"));
        };
        // The client can still write what it has published: the header is copied, and the length asked for once.
        let header: UploadHeader = *part.user_header();
        self.parts.take(&header, part.payload())
    }

    /// The mesh, when all of it has come.
    ///
    /// # Errors
    /// `BadMessage` when parts are missing.
    pub fn finish(self) -> Result<(Target, PolygonMesh), WireError> {
        Ok((self.target, self.parts.finish()?))
    }
}

impl MeshParts {
    /// Nothing yet of a mesh of `size`, for the object of that name.
    ///
    /// # Errors
    /// `LimitExceeded` for a mesh that is too large.
    pub fn new(object: &str, size: UploadSize) -> Result<MeshParts, WireError> {
        check_size(object, &size)?;
        let (coordinates, corner_counts, corners) = Default::default();
        Ok(MeshParts { size, coordinates, corner_counts, corners })
    }

    /// Takes a part as it stands in shared memory. Each word is read once, for the client can still write it.
    ///
    /// # Errors
    /// `BadMessage` when it is of another protocol or an unknown kind, out of turn, or has a number that does not fit;
    /// `LimitExceeded` when it is larger than announced. Nothing of the part was taken then.
    pub fn take(&mut self, header: &UploadHeader, words: &[Word]) -> Result<(), WireError> {
        self.check(header, words.len())?;
        match header.kind {
            UPLOAD_VERTICES => self.coordinates.extend(words.iter().map(|&word| f64::from_bits(word))),
            UPLOAD_CORNER_COUNTS => extend(&mut self.corner_counts, words, "corner count")?,
            _ => extend(&mut self.corners, words, "vertex index")?,
        }
        Ok(())
    }

    fn check(&self, header: &UploadHeader, words: usize) -> Result<(), WireError> {
        let (so_far, announced) = match header.kind {
            UPLOAD_VERTICES => (self.coordinates.len(), self.size.vertices as usize * AXES),
            UPLOAD_CORNER_COUNTS => (self.corner_counts.len(), self.size.polygons as usize),
            UPLOAD_CORNERS => (self.corners.len(), self.size.corners as usize),
            kind => return Err(bad_part(&format!("kind {kind} is not known"), "use the kinds of the protocol")),
        };
        let (protocol, first) = (header.protocol, header.first_word);
        if protocol != PROTOCOL_VERSION {
            return Err(bad_part(&format!("it is of protocol {protocol}"), "use the version agreed upon"));
        }
        if first != so_far as u64 {
            let fault = format!("it begins at word {first} of kind {}, not at {so_far}", header.kind);
            return Err(bad_part(&fault, "send the parts of a kind in order"));
        }
        if words > MAX_UPLOAD_PART_WORDS || words > announced - so_far {
            let message = format!(
                "the part of {words} words at word {first} of kind {} goes beyond the {announced} announced, \
                 or the limit of {MAX_UPLOAD_PART_WORDS} a part",
                header.kind
            );
            return Err(WireError::new(
                ErrorCode::LimitExceeded,
                message,
                "announce the whole mesh, and send smaller parts",
            ));
        }
        Ok(())
    }

    /// The mesh, when all of it has come.
    ///
    /// # Errors
    /// `BadMessage` when parts are missing.
    pub fn finish(self) -> Result<PolygonMesh, WireError> {
        let found = [self.coordinates.len(), self.corner_counts.len(), self.corners.len()];
        let (vertices, polygons, corners) = (self.size.vertices, self.size.polygons, self.size.corners);
        let announced = [vertices as usize * AXES, polygons as usize, corners as usize];
        if found != announced {
            let fault = format!("{found:?} words of coordinates, corner counts and corners came of {announced:?}");
            return Err(bad_part(&fault, "send all parts before the end of the upload"));
        }
        let vertices = self.coordinates.as_chunks::<AXES>().0.to_vec();
        Ok(PolygonMesh { vertices, corner_counts: self.corner_counts, corners: self.corners })
    }
}

fn create_service(node: &Node<Service>, number: u32) -> Result<UploadService, collided_client::TransportError> {
    node.service_builder(&transport::service_name(&upload_service(number))?)
        .publish_subscribe::<[Word]>()
        .user_header::<UploadHeader>()
        .max_publishers(1)
        .max_subscribers(1)
        .max_nodes(2)
        .subscriber_max_buffer_size(1)
        .subscriber_max_borrowed_samples(1)
        .history_size(0)
        .enable_safe_overflow(false)
        .create()
        .map_err(transport::failed("create an upload's service"))
}

fn check_size(object: &str, size: &UploadSize) -> Result<(), WireError> {
    for (what, count) in [("vertices", size.vertices), ("polygons", size.polygons), ("corners", size.corners)] {
        if count > MAX_MESH_ELEMENTS {
            return Err(WireError::new(
                ErrorCode::LimitExceeded,
                format!("object {object:?} has {count} {what}, more than the limit of {MAX_MESH_ELEMENTS}"),
                "split the mesh into several objects",
            ));
        }
    }
    Ok(())
}

/// Appends all of the words, or none.
fn extend(values: &mut Vec<u32>, words: &[Word], what: &str) -> Result<(), WireError> {
    let before = values.len();
    for &word in words {
        let Ok(value) = u32::try_from(word) else {
            let fault = format!("{what} number {} is {word}, more than 32 bits", values.len());
            values.truncate(before);
            return Err(bad_part(&fault, "send numbers below 2^32, one to a word"));
        };
        values.push(value);
    }
    Ok(())
}

fn bad_part(fault: &str, remedy: &str) -> WireError {
    WireError::new(ErrorCode::BadMessage, format!("a part of the upload cannot be used: {fault}"), remedy)
}

fn internal(error: impl std::fmt::Display) -> WireError {
    WireError::new(ErrorCode::Internal, format!("the upload failed: {error}"), "try again; look at the daemon's log")
}
