//! Who does the work that can be shared.

/// Runs what can be shared between threads. The default is the current rayon pool.
///
/// A process that serves several scenes within one budget of threads implements this to let them take turns: what is shared
/// comes in short pieces.
pub trait Workforce: Sync {
    /// How many threads a shared job may run on.
    fn threads(&self) -> usize {
        rayon::current_num_threads()
    }

    /// Runs a job inside a rayon pool of [`threads`](Self::threads) threads, and returns when it is done.
    fn share(&self, job: &mut (dyn FnMut() + Send)) {
        job();
    }
}

impl Workforce for () {}

/// The calling thread, and no other.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Alone;

impl Workforce for Alone {
    fn threads(&self) -> usize {
        1
    }
}
