//! Steps that no client of this release would send, written into shared memory by hand: a typed error, and the scene goes on.

use collided_client::transport::{
    self, EventService, Listener, Notifier, StepClient, StepResponse, StepService, failed,
};
use collided_client::{Client, Effect, ErrorCode, IDENTITY, Reply, Request, TransportError};
use collided_protocol::control::BodySpec;
use collided_protocol::limits::{MAX_BATCH_TRANSFORMS, MAX_BODIES};
use collided_protocol::names::{reply_service, step_service, wake_service};
use collided_protocol::report::{NOT_LOOKED_AT, ReportHeader, SECTION_CANDIDATES, STATUS_OK, Verdict};
use collided_protocol::step::{MOTION_LINEAR, STEP_BATCH, STEP_DENSE, STEP_SPARSE, StepHeader, Word};
use collided_protocol::{PROTOCOL_VERSION, WireError};
use collided_tests::daemon_process::{DaemonProcess, await_some};
use collided_tests::small_meshes::TRIANGLE;
use iceoryx2::prelude::{AllocationStrategy, Node};

/// A scene of two bodies, and its ports as a client in another language would open them.
struct RawScene {
    client: Client,
    requests: StepClient,
    wake: Notifier,
    _reply: Listener,
    _node: Node<transport::Service>,
}

fn open_steps(node: &Node<transport::Service>, scene: u32) -> Result<StepService, TransportError> {
    node.service_builder(&transport::service_name(&step_service(scene))?)
        .request_response::<[Word], [Word]>()
        .request_user_header::<StepHeader>()
        .response_user_header::<ReportHeader>()
        .open()
        .map_err(failed("open the steps"))
}

fn open_event(node: &Node<transport::Service>, name: &str) -> Result<EventService, TransportError> {
    node.service_builder(&transport::service_name(name)?).event().open().map_err(failed("open an event"))
}

impl RawScene {
    fn create(daemon: &DaemonProcess) -> RawScene {
        let client = daemon.client();
        client.database("parts").upload("tri", &TRIANGLE).unwrap();
        let effects = Effect::Interference.into();
        let reply = client.request(&Request::CreateScene { name: "raw".to_owned(), effects }).unwrap();
        let Reply::SceneCreated { scene } = reply else { panic!("{reply:?}") };
        let body = |name: &str| BodySpec {
            name: name.to_owned(),
            database: "parts".to_owned(),
            object: "tri".to_owned(),
            group: None,
        };
        client.request(&Request::AddBodies { scene, bodies: vec![body("base"), body("arm")] }).unwrap();
        let node = transport::create_node(daemon.rendezvous()).unwrap();
        let requests = open_steps(&node, scene).unwrap();
        let requests = requests.client_builder().allocation_strategy(AllocationStrategy::PowerOfTwo).create().unwrap();
        let wake = open_event(&node, &wake_service(scene)).unwrap().notifier_builder().create().unwrap();
        let reply = open_event(&node, &reply_service(scene)).unwrap().listener_builder().create().unwrap();
        RawScene { client, requests, wake, _reply: reply, _node: node }
    }

    fn step(&self, header: StepHeader, words: &[Word]) -> StepResponse {
        let request = self.requests.loan_slice_uninit(words.len()).unwrap();
        let mut request = request.write_from_slice(words);
        *request.user_header_mut() = header;
        let pending = request.send().unwrap();
        self.wake.notify().unwrap();
        await_some("the daemon answers", || pending.receive().unwrap())
    }

    /// The error that answers a step.
    #[track_caller]
    fn refused(&self, header: StepHeader, words: &[Word]) -> WireError {
        let response = self.step(header, words);
        let answer = *response.user_header();
        assert_eq!(answer.sequence, header.sequence);
        assert_ne!(answer.status, STATUS_OK, "the step is refused");
        let json = &bytemuck::cast_slice(response.payload())[..answer.error_bytes as usize];
        let error: WireError = serde_json::from_slice(json).expect("the error is JSON");
        assert_eq!(answer.status, error.code as u32);
        error
    }
}

/// A dense step of two transforms, with no fault.
fn header() -> StepHeader {
    StepHeader {
        protocol: PROTOCOL_VERSION,
        kind: STEP_DENSE,
        sequence: 7,
        transform_count: 2,
        candidate_count: 1,
        motion: MOTION_LINEAR,
        ..Default::default()
    }
}

/// The transforms of a dense step of two bodies.
fn dense() -> Vec<Word> {
    bytemuck::cast_slice(&[IDENTITY, IDENTITY]).to_vec()
}

/// A sparse step of two transforms.
fn sparse(ids: [u32; 2]) -> Vec<Word> {
    [vec![bytemuck::cast(ids)], dense()].concat()
}

#[test]
fn steps_that_do_not_keep_to_the_protocol_are_refused_and_the_scene_goes_on() {
    let daemon = DaemonProcess::start();
    let scene = RawScene::create(&daemon);
    let good = header();
    let of_sparse = StepHeader { kind: STEP_SPARSE, ..good };
    let too_many = StepHeader { transform_count: MAX_BODIES + 1, ..good };
    let cases = [
        (StepHeader { protocol: 99, ..good }, dense(), ErrorCode::ProtocolMismatch, "99"),
        (StepHeader { kind: 3, ..good }, dense(), ErrorCode::BadStep, "kind 3"),
        (StepHeader { candidate_count: 0, ..good }, dense(), ErrorCode::BadStep, "0 candidate poses"),
        (StepHeader { candidate_count: 5, ..good }, dense(), ErrorCode::BadStep, "5 candidate poses"),
        (StepHeader { motion: 3, ..good }, dense(), ErrorCode::BadStep, "motion kind 3"),
        (StepHeader { transform_count: 1, ..good }, dense(), ErrorCode::BadStep, "0 velocities take 12"),
        (StepHeader { transform_count: 0, ..good }, dense(), ErrorCode::BadStep, "24 words"),
        (StepHeader { transform_count: MAX_BODIES, ..good }, dense(), ErrorCode::BadStep, "24 words"),
        (too_many, dense(), ErrorCode::LimitExceeded, "1048577"),
        (StepHeader { transform_count: u32::MAX, ..good }, dense(), ErrorCode::LimitExceeded, "4294967295"),
        (good, Vec::new(), ErrorCode::BadStep, "0 words"),
        (of_sparse, dense(), ErrorCode::BadStep, "24 words"),
        (of_sparse, sparse([1, 1]), ErrorCode::BadStep, "\"arm\""),
        (of_sparse, sparse([0, 2]), ErrorCode::UnknownBody, "body 2"),
        (of_sparse, sparse([u32::MAX, 0]), ErrorCode::UnknownBody, "4294967295"),
    ];
    for (header, words, code, part) in cases {
        let error = scene.refused(header, &words);
        assert_eq!(error.code, code, "{header:?}: {error}");
        assert!(error.to_string().contains(part), "{header:?}: {error} does not say {part:?}");
    }
    for (header, words) in [(good, dense()), (of_sparse, sparse([1, 0]))] {
        let response = scene.step(header, &words);
        assert_eq!(response.user_header().status, STATUS_OK);
        assert_eq!(response.user_header().sections[0].count, 1, "the two bodies interfere");
    }
    assert_eq!(scene.client.status().unwrap().scenes.len(), 1);
}

#[test]
fn batches_that_do_not_keep_to_the_protocol_are_refused_and_the_scene_goes_on() {
    let daemon = DaemonProcess::start();
    let scene = RawScene::create(&daemon);
    // Two candidates for the second body.
    let good = StepHeader { kind: STEP_BATCH, transform_count: 1, candidate_count: 2, ..header() };
    let batch = |id: u32| [vec![Word::from(id)], dense()].concat();
    let many = StepHeader { candidate_count: MAX_BATCH_TRANSFORMS as u32 + 1, ..good };
    let bad_entry = |mut words: Vec<Word>| {
        words[1 + 12 + 5] = f64::INFINITY.to_bits();
        words
    };
    let cases = [
        (StepHeader { transform_count: 0, ..good }, batch(1), ErrorCode::BadStep, "names no body"),
        (
            StepHeader { candidate_count: 3, ..good },
            batch(1),
            ErrorCode::BadStep,
            "3 candidates of 1 transforms take 37",
        ),
        (StepHeader { candidate_count: 0, ..good }, batch(1), ErrorCode::BadStep, "25 words"),
        (StepHeader { rigid_count: 1, ..good }, batch(1), ErrorCode::BadStep, "1 rigid motions"),
        (StepHeader { velocity_count: 1, ..good }, batch(1), ErrorCode::BadStep, "1 velocities"),
        (StepHeader { motion: 1, ..good }, batch(1), ErrorCode::BadStep, "motion kind 1"),
        (StepHeader { stop_at: 4, ..good }, batch(1), ErrorCode::BadStep, "verdict 4"),
        (many, batch(1), ErrorCode::LimitExceeded, "1048577 candidates"),
        (StepHeader { candidate_count: u32::MAX, ..good }, batch(1), ErrorCode::LimitExceeded, "4294967295"),
        (good, batch(2), ErrorCode::UnknownBody, "body 2"),
        (good, bad_entry(batch(1)), ErrorCode::NonFiniteTransform, "candidate 1: the transform of body \"arm\""),
    ];
    for (header, words, code, part) in cases {
        let error = scene.refused(header, &words);
        assert_eq!(error.code, code, "{header:?}: {error}");
        assert!(error.to_string().contains(part), "{header:?}: {error} does not say {part:?}");
    }
    let stops = StepHeader { stop_at: 1 + Verdict::Interfering as u32, ..good };
    for (header, codes) in [(good, [1, 1]), (stops, [1, NOT_LOOKED_AT])] {
        let response = scene.step(header, &batch(1));
        let section = response.user_header().sections[SECTION_CANDIDATES];
        assert_eq!((response.user_header().status, section.first_word, section.count), (STATUS_OK, 0, 2));
        assert_eq!(response.payload(), [Word::from_ne_bytes([codes[0], codes[1], 0, 0, 0, 0, 0, 0])]);
    }
}

#[test]
fn a_step_without_a_wake_up_is_answered_with_the_next_one() {
    let daemon = DaemonProcess::start();
    let scene = RawScene::create(&daemon);
    let send = || {
        let mut request = scene.requests.loan_slice_uninit(24).unwrap().write_from_slice(&dense());
        *request.user_header_mut() = header();
        request.send().unwrap()
    };
    let (first, second) = (send(), send());
    scene.wake.notify().unwrap();
    for pending in [first, second] {
        let response = await_some("the daemon answers", || pending.receive().unwrap());
        assert_eq!(response.user_header().status, STATUS_OK);
    }
}

#[test]
fn wake_ups_without_a_step_are_nothing_to_answer() {
    let daemon = DaemonProcess::start();
    let scene = RawScene::create(&daemon);
    for _ in 0..1000 {
        scene.wake.notify().unwrap();
    }
    assert_eq!(scene.step(header(), &dense()).user_header().step, 0);
}
