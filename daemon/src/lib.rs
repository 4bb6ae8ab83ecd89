//! The `collided` daemon and the commands of the `collided` program.
//!
//! The daemon, in reading order: [`serve`] starts and ends it; [`rendezvous`] makes it found; [`control`] answers the unix
//! socket, a thread a connection, and [`bad_request`] what it cannot read; [`database`] holds the objects, [`object_loading`]
//! builds them, [`upload`] brings them in from a client's memory; [`scene`] holds bodies, [`scene_thread`] answers steps, on another
//! [`processor`] than its client waits on; [`step_payload`] reads them, and [`report_writer`] writes the reports; [`budget`] lets them
//! take turns on the threads; [`kernel_errors`] puts the kernel's errors into words for the wire; [`cleaner`] clears up after dead clients.
//! The program is [`program`], its commands [`command`], [`check`], [`demo`] and [`accuracy`].

pub mod bad_request;
pub mod budget;
pub mod cleaner;
pub mod control;
pub mod database;
pub mod kernel_errors;
pub mod names;
pub mod object_loading;
pub mod processor;
pub mod rendezvous;
pub mod report_writer;
pub mod scene;
pub mod scene_thread;
pub mod serve;
pub mod settings;
pub mod settings_of_effects;
pub mod state;
pub mod step_payload;
pub mod upload;

pub mod accuracy;
pub mod check;
pub mod command;
pub mod demo;
pub mod load_bar;
pub mod mesh_file;
pub mod own_process;
pub mod private_daemon;
pub mod program;
pub mod scene_file;
