//! The `collided` program, built where cargo builds it for the tests of this package.

fn main() -> std::process::ExitCode {
    collided::program::run()
}
