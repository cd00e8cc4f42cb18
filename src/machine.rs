//! What a run is started by, and on what: a line of its log, for whoever reads its report.

use std::fs;

/// Says it in the log, not on standard error.
pub fn log() {
    let words: Vec<String> = std::env::args().collect();
    let command = shlex::try_join(words.iter().map(String::as_str)).unwrap_or_default();
    let cores = std::thread::available_parallelism().map_or(0, std::num::NonZero::get);
    tracing::debug!(
        command,
        version = env!("CARGO_PKG_VERSION"),
        processor = of_proc("/proc/cpuinfo", "model name"),
        cores,
        memory = of_proc("/proc/meminfo", "MemTotal"),
        system = system(),
        "begins"
    );
}

/// The value of the first line of this name; empty where there is none.
fn of_proc(file: &str, name: &str) -> String {
    let text = fs::read_to_string(file).unwrap_or_default();
    let mut lines = text.lines().filter_map(|line| line.split_once(':'));
    let found = lines.find(|(key, _)| key.trim() == name);
    found.map_or(String::new(), |(_, value)| value.trim().to_owned())
}

/// Name and release of the kernel.
fn system() -> String {
    let part = |name: &str| {
        let text = fs::read_to_string(format!("/proc/sys/kernel/{name}"));
        text.unwrap_or_default().trim().to_owned()
    };
    format!("{} {}", part("ostype"), part("osrelease"))
}
