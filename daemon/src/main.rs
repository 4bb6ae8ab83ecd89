//! The `collided` program; see [`collided::program`].

fn main() -> std::process::ExitCode {
    collided::program::run()
}
