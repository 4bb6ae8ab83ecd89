//! The floor of a step: iceoryx2 alone, with a request and a response of a step's shape, headers and all, written and read whole by both
//! sides.
//!
//! The services have the limits that a scene's have. The server is a thread of this process.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;

use bytemuck::NoUninit;
use collided_client::transport::{
    self, EventService, Listener, Notifier, Service, StepClient, StepPending, StepServer, StepService,
};
use collided_protocol::names::Rendezvous;
use collided_protocol::report::ReportHeader;
use collided_protocol::step::{StepHeader, Word};
use collided_protocol::{ICEORYX2_VERSION, PROTOCOL_VERSION};
use iceoryx2::prelude::Node;

use crate::daemon_process::{RuntimeDirectory, shared_files};

/// How each side waits for the other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Waiting {
    /// Looks at shared memory over and over.
    Spinning,
    /// Sleeps until an event wakes it.
    Blocked,
}

/// A client, and a server that answers it.
pub struct Raw {
    client: StepClient,
    bell: Bell,
    stop: Arc<AtomicBool>,
    server: Option<JoinHandle<()>>,
    epoch: Rendezvous,
    _services: (StepService, EventService, EventService),
    _node: Node<Service>,
    _root: RuntimeDirectory,
}

/// Wakes the other side, and is woken by it.
struct Bell {
    waiting: Waiting,
    other: Notifier,
    own: Listener,
}

impl Bell {
    fn ring(&self) {
        if self.waiting == Waiting::Blocked {
            self.other.notify().expect("the other side can be woken");
        }
    }

    fn wait(&self) {
        match self.waiting {
            Waiting::Spinning => std::hint::spin_loop(),
            Waiting::Blocked => drop(self.own.blocking_wait(|_| {}).expect("an event can be waited for")),
        }
    }
}

impl Raw {
    /// Starts the server, which answers each request with so many words.
    ///
    /// # Panics
    /// When iceoryx2 refuses.
    pub fn start(waiting: Waiting, request_words: usize, reply_words: usize) -> Raw {
        let root = RuntimeDirectory::new();
        let epoch = own_epoch(&root);
        let node = transport::create_node(&epoch).expect("an iceoryx2 node");
        let steps = step_service(&node);
        let (wake, reply) = (event_service(&node, "wake"), event_service(&node, "reply"));
        let server = steps.server_builder().initial_max_slice_len(reply_words.max(1)).create().expect("a server");
        let client = steps.client_builder().initial_max_slice_len(request_words).create().expect("a client");
        let bell = |to: &EventService, from: &EventService| Bell {
            waiting,
            other: to.notifier_builder().create().expect("a notifier"),
            own: from.listener_builder().create().expect("a listener"),
        };
        let (bell, servers_bell) = (bell(&wake, &reply), bell(&reply, &wake));
        let stop = Arc::new(AtomicBool::new(false));
        let stopped = Arc::clone(&stop);
        let server = std::thread::spawn(move || answer(&server, &servers_bell, reply_words, &stopped));
        let _services = (steps, wake, reply);
        Raw { client, bell, stop, server: Some(server), epoch, _services, _node: node, _root: root }
    }

    /// Sends the words and reads the answer; returns the sum of its words.
    ///
    /// # Panics
    /// When iceoryx2 refuses.
    pub fn round_trip(&self, words: &[Word]) -> Word {
        let request = self.client.loan_slice_uninit(words.len()).expect("memory for a request");
        let mut request = request.write_from_slice(words);
        *request.user_header_mut() = StepHeader { protocol: PROTOCOL_VERSION, ..StepHeader::default() };
        let pending = request.send().expect("a request can be sent");
        self.bell.ring();
        self.reply(&pending)
    }

    fn reply(&self, pending: &StepPending) -> Word {
        loop {
            if let Some(response) = pending.receive().expect("replies can be received") {
                return sum_with(response.user_header(), response.payload());
            }
            self.bell.wait();
        }
    }
}

impl Drop for Raw {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        self.bell.ring();
        if let Some(server) = self.server.take() {
            server.join().expect("the raw server ends");
        }
        shared_files(&self.epoch).iter().for_each(|file| drop(std::fs::remove_file(file)));
    }
}

fn answer(server: &StepServer, bell: &Bell, reply_words: usize, stopped: &AtomicBool) {
    while !stopped.load(Ordering::Relaxed) {
        match server.receive().expect("requests can be received") {
            Some(active) => {
                let sum = sum_with(active.user_header(), active.payload());
                let reply = active.loan_slice_uninit(reply_words).expect("memory for a reply");
                let mut reply = reply.write_from_fn(|_| sum);
                *reply.user_header_mut() = ReportHeader { sequence: sum, ..ReportHeader::default() };
                reply.send().expect("a reply can be sent");
                bell.ring();
            }
            None => bell.wait(),
        }
    }
}

fn sum_with(header: &impl NoUninit, words: &[Word]) -> Word {
    let header: &[Word] = bytemuck::cast_slice(bytemuck::bytes_of(header));
    header.iter().chain(words).fold(0, |sum: Word, word| sum.wrapping_add(*word))
}

fn step_service(node: &Node<Service>) -> StepService {
    node.service_builder(&transport::service_name("raw").expect("a service name"))
        .request_response::<[Word], [Word]>()
        .request_user_header::<StepHeader>()
        .response_user_header::<ReportHeader>()
        .max_clients(1)
        .max_servers(1)
        .max_nodes(1)
        .max_active_requests_per_client(2)
        .max_loaned_requests(1)
        .max_response_buffer_size(1)
        .enable_safe_overflow_for_requests(false)
        .enable_safe_overflow_for_responses(false)
        .create()
        .expect("a service")
}

fn event_service(node: &Node<Service>, name: &str) -> EventService {
    node.service_builder(&transport::service_name(name).expect("a service name"))
        .event()
        .max_notifiers(1)
        .max_listeners(1)
        .max_nodes(1)
        .event_id_max_value(1)
        .create()
        .expect("an event service")
}

/// Names of its own for iceoryx2's files, as each daemon has them.
fn own_epoch(root: &RuntimeDirectory) -> Rendezvous {
    Rendezvous {
        epoch: "raw".to_owned(),
        pid: std::process::id(),
        protocol_min: PROTOCOL_VERSION,
        protocol_max: PROTOCOL_VERSION,
        iceoryx2: ICEORYX2_VERSION.to_owned(),
        iceoryx2_prefix: format!("raw-{}-", std::process::id()),
        iceoryx2_root: root.path().to_string_lossy().into_owned(),
        version: env!("CARGO_PKG_VERSION").to_owned(),
    }
}
