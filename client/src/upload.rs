//! A mesh from this process's memory to the daemon, in parts, through shared memory.

use collided_protocol::PROTOCOL_VERSION;
use collided_protocol::control::{
    Reply, Request, Target, UPLOAD_CORNER_COUNTS, UPLOAD_CORNERS, UPLOAD_VERTICES, UploadHeader, UploadSize,
};
use collided_protocol::limits::MAX_UPLOAD_PART_WORDS;
use collided_protocol::names::upload_service;
use collided_protocol::step::Word;
use iceoryx2::port::publisher::Publisher;
use iceoryx2::prelude::*;

use crate::connect::{Client, unexpected};
use crate::database::Mesh;
use crate::error::Error;
use crate::transport::{self, Service, UploadService, failed};

/// Sends the parts of one upload and has each taken before the next.
struct Sender<'a> {
    client: &'a Client,
    upload: u32,
    publisher: Publisher<Service, [Word], UploadHeader>,
    progress: &'a mut dyn FnMut(&str, u64, u64),
    done: u64,
    total: u64,
}

/// Uploads a mesh and has the object built. Returns the daemon's final reply.
pub(crate) fn upload(
    client: &Client,
    target: Target,
    mesh: &Mesh<'_>,
    progress: &mut dyn FnMut(&str, u64, u64),
) -> Result<Reply, Error> {
    let size = UploadSize {
        vertices: mesh.vertices.len() as u64,
        polygons: mesh.corner_counts.len() as u64,
        corners: mesh.corners.len() as u64,
    };
    let upload = match client.request(&Request::BeginUpload { target, size })? {
        Reply::UploadReady { upload } => upload,
        other => return Err(unexpected(&other)),
    };
    send(client, upload, mesh, progress)
        .and_then(|()| client.request_with_progress(&Request::FinishUpload { upload }, progress))
        .inspect_err(|_| {
            // Refused when the daemon has ended the upload itself; either way it is over.
            let _ = client.request(&Request::CancelUpload { upload });
        })
}

fn send(client: &Client, upload: u32, mesh: &Mesh<'_>, progress: &mut dyn FnMut(&str, u64, u64)) -> Result<(), Error> {
    let vertices: &[f64] = mesh.vertices.as_flattened();
    let counts = [vertices.len(), mesh.corner_counts.len(), mesh.corners.len()];
    let longest = counts.into_iter().max().unwrap_or(0).clamp(1, MAX_UPLOAD_PART_WORDS);
    transport::check_shared_memory(longest as u64 * size_of::<Word>() as u64)
        .map_err(|short| Error::OutOfSharedMemory { needed: short.needed, free: short.free })?;
    let publisher = open(client, upload)?
        .publisher_builder()
        .initial_max_slice_len(longest)
        .max_loaned_samples(1)
        .backpressure_strategy(BackpressureStrategy::DiscardData)
        .create()
        .map_err(failed("open the upload"))?;
    let total = counts.into_iter().sum::<usize>() as u64;
    let mut sender = Sender { client, upload, publisher, progress, done: 0, total };
    sender.send_kind(UPLOAD_VERTICES, vertices.len(), |index| vertices[index].to_bits())?;
    sender.send_kind(UPLOAD_CORNER_COUNTS, counts[1], |index| Word::from(mesh.corner_counts[index]))?;
    sender.send_kind(UPLOAD_CORNERS, counts[2], |index| Word::from(mesh.corners[index]))
}

fn open(client: &Client, upload: u32) -> Result<UploadService, Error> {
    let service = client
        .node()
        .service_builder(&transport::service_name(&upload_service(upload))?)
        .publish_subscribe::<[Word]>()
        .user_header::<UploadHeader>()
        .open()
        .map_err(failed("open the upload"))?;
    Ok(service)
}

impl Sender<'_> {
    fn send_kind(&mut self, kind: u32, count: usize, word: impl Fn(usize) -> Word) -> Result<(), Error> {
        for first in (0..count).step_by(MAX_UPLOAD_PART_WORDS) {
            let length = MAX_UPLOAD_PART_WORDS.min(count - first);
            self.send_part(kind, first, length, &word)?;
            self.done += length as u64;
            (self.progress)("upload", self.done, self.total);
        }
        Ok(())
    }

    fn send_part(&self, kind: u32, first: usize, length: usize, word: &impl Fn(usize) -> Word) -> Result<(), Error> {
        let sample = self.publisher.loan_slice_uninit(length).map_err(failed("loan memory for an upload"))?;
        let mut sample = sample.write_from_fn(|index| word(first + index));
        *sample.user_header_mut() = UploadHeader { protocol: PROTOCOL_VERSION, kind, first_word: first as u64 };
        sample.send().map_err(failed("send a part of an upload"))?;
        self.client.expect_done(&Request::TakeUploadPart { upload: self.upload })
    }
}
