//! What the times were measured on.

use std::fs;

/// Lines of (what, value) about this machine and program.
pub fn describe() -> Vec<(&'static str, String)> {
    let build = if cfg!(debug_assertions) { "with debug assertions: times mean little" } else { "release" };
    vec![
        ("processor", processor().unwrap_or_else(|| std::env::consts::ARCH.to_owned())),
        ("logical processors", std::thread::available_parallelism().map_or(0, usize::from).to_string()),
        ("system", line("/proc/sys/kernel/osrelease").map_or_else(|| "unknown".to_owned(), |os| format!("Linux {os}"))),
        ("load average at the start", line("/proc/loadavg").unwrap_or_else(|| "unknown".to_owned())),
        ("program", format!("collided {}, {build}", env!("CARGO_PKG_VERSION"))),
    ]
}

/// The first line of a file, if it can be read.
fn line(path: &str) -> Option<String> {
    Some(fs::read_to_string(path).ok()?.lines().next()?.trim().to_owned())
}

fn processor() -> Option<String> {
    let text = fs::read_to_string("/proc/cpuinfo").ok()?;
    let model = text.lines().find(|line| line.starts_with("model name"))?;
    Some(model.split_once(':')?.1.trim().to_owned())
}
