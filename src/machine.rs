//! The machine of a run: what the log says of it, for whoever reads its report, and whether its processors are enough.

#![allow(clippy::disallowed_methods, reason = "/proc")]

use std::fs;
use std::time::Duration;

use coupler::scene::Scene;
use interface::transport::wait::nap;

use crate::cli::HowArgs;

/// Says it in the log, not on standard error.
pub fn log() {
    let words = std::env::args_os().map(|word| word.to_string_lossy().into_owned());
    let words: Vec<String> = words.collect();
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

/// Says that fewer processors are free than the solvers have threads, and what that costs (docs/decisions/0006-waiting.md);
/// `None` if there are enough. The coupler is not counted: it sleeps while the solvers compute.
pub fn shortage(scene: &Scene, how: &HowArgs) -> Option<String> {
    let solvers = if how.in_process {
        1
    } else {
        usize::from(scene.mpm.is_some()) + usize::from(scene.dem.is_some())
    };
    let threads = solvers * usize::from(how.threads);
    let allowed = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let (others, online) = load();
    let free = free(allowed, others, online);
    let in_process = if solvers > 1 {
        "; `--in-process` runs both solvers on one processor"
    } else {
        ""
    };
    (free < threads).then(|| {
        format!(
            "the threads of the solvers ({threads}) outnumber the free processors ({free} of {allowed}): beside two busy programs on two \
             processors runs take 1.6 to 1.8 times as long, beside four 2.5 to 3.1 times{in_process}"
        )
    })
}

/// Of the processors that this process may use, how many nobody uses: others run on those it may not use first.
fn free(allowed: usize, others: usize, online: usize) -> usize {
    let elsewhere = online.saturating_sub(allowed);
    allowed.saturating_sub(others.saturating_sub(elsewhere))
}

/// How many other threads want a processor at present, and how many processors the machine has. Of a few looks the one with
/// the least load counts, so that what is over at once does not.
fn load() -> (usize, usize) {
    const LOOKS: usize = 4;
    const APART: Duration = Duration::from_millis(2);
    let (mut least, mut online) = (usize::MAX, 0);
    for look in 0..LOOKS {
        if look > 0 {
            nap(APART);
        }
        let text = fs::read_to_string("/proc/stat").unwrap_or_default();
        least = least.min(running(&text).saturating_sub(1));
        online = processors(&text);
        if least == 0 {
            break;
        }
    }
    (least, online)
}

/// The number of threads that run or could run, from the text of `/proc/stat`; this one is among them.
fn running(stat: &str) -> usize {
    let mut lines = stat.lines();
    let found = lines.find_map(|line| line.strip_prefix("procs_running "));
    found
        .and_then(|number| number.trim().parse().ok())
        .unwrap_or(1)
}

/// The number of processors that are online, from the same text.
fn processors(stat: &str) -> usize {
    let is_one = |line: &&str| {
        let digits = line.strip_prefix("cpu");
        digits.is_some_and(|rest| rest.starts_with(|c: char| c.is_ascii_digit()))
    };
    stat.lines().filter(is_one).count()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn others_are_counted_where_they_can_be() {
        assert_eq!(free(2, 0, 2), 2);
        assert_eq!(free(2, 1, 2), 1);
        assert_eq!(free(2, 5, 2), 0);
        // On a processor that this process may not use.
        assert_eq!(free(1, 1, 2), 1);
        assert_eq!(free(1, 2, 2), 0);
    }

    #[test]
    fn the_load_is_read_from_the_system() {
        let text = "cpu  1 2\ncpu0 1 1\ncpu1 0 1\nprocs_running 3\nprocs_blocked 0\n";
        assert_eq!((running(text), processors(text)), (3, 2));
        assert_eq!(running(""), 1);
        assert!(load().1 >= 1);
    }
}
