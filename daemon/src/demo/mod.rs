//! `collided demo`: a private daemon process, two client processes with a scene of real meshes each, and a picture.

mod camera;
pub mod client;
mod columns;
mod event;
mod live;
mod picture;
mod pose;
mod scenes;
mod vector;

use std::error::Error;
use std::io::{BufRead, BufReader, Write};
use std::path::PathBuf;
use std::process::{ChildStdout, ExitCode, Stdio};
use std::sync::mpsc::{self, Receiver, Sender};
use std::thread;

use crate::own_process::{INTERRUPTED, Interrupt, OwnProcess};
use crate::private_daemon::PrivateDaemon;
use event::{Best, Event, Step};
use live::Live;
use scenes::{SCENES, Scene};

/// Shows the whole thing: a private daemon, two client processes, real meshes. Needs no configuration.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Steps of each scene, 60 a second.
    #[arg(long, value_name = "N", default_value_t = 300, value_parser = clap::value_parser!(u64).range(1..))]
    steps: u64,
    /// Where the picture goes.
    #[arg(long, value_name = "FILE", default_value = "collided-demo.svg")]
    picture: PathBuf,
}

/// What a client process told, all in all.
#[derive(Default)]
struct Story {
    steps: Vec<Step>,
    best: Option<Best>,
}

/// Runs the command.
///
/// # Errors
/// When a process cannot be started or ends early, or the picture cannot be written.
pub fn run(args: Args) -> Result<ExitCode, Box<dyn Error>> {
    let interrupt = Interrupt::install()?;
    let outcome = play(&args, &interrupt);
    if interrupt.is_raised() {
        return Ok(ExitCode::from(INTERRUPTED));
    }
    let stories = outcome?;
    let mut out = std::io::stdout();
    print_summary(&mut out, &stories)?;
    draw(&args, &stories)?;
    writeln!(out, "\nthe picture with the interfering polygons in red: {}", args.picture.display())?;
    Ok(ExitCode::SUCCESS)
}

/// Runs daemon and clients to their end.
fn play(args: &Args, interrupt: &Interrupt) -> Result<Vec<Story>, Box<dyn Error>> {
    // An interrupt ends the clients alone: the daemon that outlives them can clear up after them.
    let mut daemon = PrivateDaemon::start(None)?;
    // A daemon that does not come up says why here, before there are clients that wait for it.
    drop(daemon.connect("collided demo")?);
    let mut out = std::io::stdout();
    writeln!(out, "a daemon process and {} client processes, {} steps each\n", SCENES.len(), args.steps)?;
    let (sender, events) = mpsc::channel();
    let clients = SCENES
        .iter()
        .enumerate()
        .map(|(number, scene)| start_client(number, scene, &daemon, args.steps, sender.clone(), interrupt))
        .collect::<Result<Vec<_>, _>>()?;
    drop(sender);
    let stories = listen(&events, args.steps);
    for (client, scene) in clients.into_iter().zip(&SCENES) {
        let status = client.wait()?;
        if !status.success() {
            return Err(format!(
                "the client of the scene \"{}\" failed, {status}; its reason stands above",
                scene.name
            )
            .into());
        }
    }
    daemon.end()?;
    Ok(stories)
}

fn start_client(
    number: usize,
    scene: &Scene,
    daemon: &PrivateDaemon,
    steps: u64,
    events: Sender<(usize, Event)>,
    interrupt: &Interrupt,
) -> Result<OwnProcess, Box<dyn Error>> {
    let mut command = OwnProcess::command()?;
    let steps = steps.to_string();
    command.args(["demo-client", "--instance", daemon.instance(), "--scene", scene.name, "--steps", &steps]);
    // Should this process be killed, the client ends when it finds nobody reading its events; the daemon ends after that.
    command.stdin(daemon.lifeline()?).stdout(Stdio::piped());
    let mut client = OwnProcess::spawn(&mut command, Some(interrupt))?;
    if let Some(output) = client.child().stdout.take() {
        thread::spawn(move || pass_on(output, number, &events));
    }
    Ok(client)
}

/// Passes on what a client tells, until it ends.
fn pass_on(output: ChildStdout, number: usize, events: &Sender<(usize, Event)>) {
    for line in BufReader::new(output).lines().map_while(Result::ok) {
        let Ok(event) = serde_json::from_str(&line) else { return };
        if events.send((number, event)).is_err() {
            return;
        }
    }
}

/// Shows and collects events until all clients have ended.
fn listen(events: &Receiver<(usize, Event)>, steps: u64) -> Vec<Story> {
    let mut live = Live::new(steps);
    let mut stories: Vec<Story> = SCENES.iter().map(|_| Story::default()).collect();
    for (number, event) in events {
        live.show(number, &event);
        match event {
            Event::Load { .. } => {}
            Event::Step(step) => stories[number].steps.push(step),
            Event::Done(best) => stories[number].best = Some(best),
        }
    }
    stories
}

fn print_summary(out: &mut impl Write, stories: &[Story]) -> std::io::Result<()> {
    writeln!(out, "\n{:<10}{:>13}{}", "medians", "interfering", columns::headings())?;
    for (story, scene) in stories.iter().zip(&SCENES) {
        let interfering = story.steps.iter().filter(|step| step.pairs > 0).count();
        let steps = format!("{interfering}/{}", story.steps.len());
        if let Some(median) = columns::median(&story.steps) {
            writeln!(out, "{:<10}{steps:>13}{}", scene.name, columns::row(&median))?;
        }
    }
    Ok(())
}

fn draw(args: &Args, stories: &[Story]) -> Result<(), Box<dyn Error>> {
    let shots = SCENES.iter().zip(stories).filter_map(|(scene, story)| Some((scene, story.best.as_ref()?)));
    let svg = picture::draw(shots, args.steps)?;
    std::fs::write(&args.picture, svg).map_err(|error| {
        format!("the picture {} cannot be written: {error}; name another file with --picture", args.picture.display())
            .into()
    })
}
