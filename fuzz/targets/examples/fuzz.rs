//! Runs a target on changed seeds for a time, in all cores, and keeps the inputs that it cannot take.
//!
//! `cargo run --release -p fuzzing --example fuzz -- scene --seconds 60`

use std::collections::BTreeMap;
use std::io::Write as _;
use std::panic::catch_unwind;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

use clap::Parser;
use fuzzing::change::Changer;
use fuzzing::{TARGETS, Target, target};

/// Runs a target on changed seeds.
#[derive(Parser)]
struct Options {
    /// Which, or `all`; without one they are listed.
    target: Option<String>,
    /// For how long, each.
    #[arg(long, default_value_t = 60.0)]
    seconds: f64,
    /// Threads.
    #[arg(long, default_value_t = 1)]
    threads: u64,
    /// What the changes are drawn from.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// An input to be run by itself, instead of changed seeds.
    #[arg(long)]
    input: Option<PathBuf>,
    /// Writes the seeds to this directory, for `cargo fuzz`, and runs nothing.
    #[arg(long)]
    export: Option<PathBuf>,
    /// Where inputs that fail are kept.
    #[arg(long, default_value = "fuzz/artifacts")]
    keep: PathBuf,
}

/// Longest that one input may take.
const PATIENCE: Duration = Duration::from_secs(10);

/// What a thread is doing.
#[derive(Default)]
struct Doing {
    /// Milliseconds since the start at which the input was begun; 0: none is under way.
    since: AtomicU64,
    input: Mutex<Vec<u8>>,
}

/// What was found, by what it says.
type Found = Arc<Mutex<BTreeMap<String, u64>>>;

thread_local! {
    /// What the last panic of this thread said, also one that was caught.
    static SAID: std::cell::RefCell<Option<String>> = const { std::cell::RefCell::new(None) };
}

fn main() -> ExitCode {
    let options = Options::parse();
    std::panic::set_hook(Box::new(|info| {
        let at = info.location().map(ToString::to_string).unwrap_or_default();
        let words = info.payload_as_str().unwrap_or("no words");
        let said = format!("panic at {at}: {words}");
        // Nobody else tells those of the driver itself.
        if thread::current().name() == Some("main") {
            eprintln!("{said}");
        }
        SAID.set(Some(said));
    }));
    let wanted = options.target.as_deref().unwrap_or_default();
    let chosen: Vec<Target> = if wanted == "all" {
        TARGETS.to_vec()
    } else {
        target(wanted).into_iter().collect()
    };
    if chosen.is_empty() {
        let names = TARGETS.map(|target| target.name).join(", ");
        eprintln!("targets: {names}, all");
        return ExitCode::from(2);
    }
    let mut sound = true;
    for target in chosen {
        sound &= match (&options.input, &options.export) {
            (Some(path), _) => alone(target, path),
            (None, Some(folder)) => export(target, folder),
            (None, None) => hunt(target, &options),
        };
    }
    if sound {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}

fn alone(target: Target, path: &Path) -> bool {
    let input = std::fs::read(path).expect("the input");
    let started = Instant::now();
    let wrong = judge(target, &input);
    let took = started.elapsed().as_secs_f64();
    println!(
        "{}: {} in {took:.3} s",
        target.name,
        wrong.as_deref().unwrap_or("sound")
    );
    wrong.is_none()
}

fn export(target: Target, folder: &Path) -> bool {
    for seed in seeds(target) {
        keep_input(folder, target, &seed);
    }
    true
}

fn hunt(target: Target, options: &Options) -> bool {
    let seeds = Arc::new(seeds(target));
    let found = Found::default();
    let start = Instant::now();
    let end = start + Duration::from_secs_f64(options.seconds);
    let runs: Vec<(Arc<Doing>, thread::JoinHandle<u64>)> = (0..options.threads)
        .map(|thread| {
            let doing = Arc::new(Doing::default());
            let (own, seeds, found) = (doing.clone(), seeds.clone(), found.clone());
            let seed = options.seed.wrapping_mul(1000).wrapping_add(thread);
            let keep = options.keep.clone();
            let work = move || work(target, seed, (start, end), &seeds, &own, &found, &keep);
            (doing, thread::spawn(work))
        })
        .collect();
    while runs.iter().any(|(_, thread)| !thread.is_finished()) {
        thread::sleep(Duration::from_millis(50));
        let now = start.elapsed().as_millis() as u64;
        for (doing, _) in &runs {
            let since = doing.since.load(Ordering::Acquire);
            if since > 0 && now.saturating_sub(since) > PATIENCE.as_millis() as u64 {
                let input = doing.input.lock().expect("an input").clone();
                let path = keep_input(&options.keep, target, &input);
                println!("{}: hangs, input in {}", target.name, path.display());
                // A thread cannot be ended from outside.
                std::process::exit(1);
            }
        }
    }
    let done: u64 = runs
        .into_iter()
        .map(|(_, t)| t.join().expect("a worker"))
        .sum();
    let seconds = start.elapsed().as_secs_f64();
    let found = found.lock().expect("what was found");
    let rate = done as f64 / seconds;
    println!(
        "{}: {done} executions in {seconds:.1} s ({rate:.0} a second), {} found",
        target.name,
        found.len()
    );
    for (what, count) in &*found {
        println!("  {count} x {what}");
    }
    found.is_empty()
}

/// Inputs to begin with: those of the target, and those that are kept in the tree.
fn seeds(target: Target) -> Vec<Vec<u8>> {
    let mut seeds = (target.seeds)();
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../corpus")
        .join(target.name);
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        seeds.extend(std::fs::read(entry.path()));
    }
    seeds
}

fn work(
    target: Target,
    seed: u64,
    (start, end): (Instant, Instant),
    seeds: &[Vec<u8>],
    doing: &Doing,
    found: &Found,
    keep: &Path,
) -> u64 {
    let mut changer = Changer::new(seed);
    let mut done = 0;
    while Instant::now() < end {
        let mut input = changer.one(seeds).clone();
        (target.change)(&mut changer, &mut input, seeds);
        doing.input.lock().expect("an input").clone_from(&input);
        let since = (start.elapsed().as_millis() as u64).max(1);
        doing.since.store(since, Ordering::Release);
        let wrong = judge(target, &input);
        doing.since.store(0, Ordering::Release);
        done += 1;
        if let Some(what) = wrong {
            let mut found = found.lock().expect("what was found");
            let count = found.entry(what.clone()).or_default();
            *count += 1;
            if *count == 1 {
                let path = keep_input(keep, target, &input);
                println!("{}: {what}; input in {}", target.name, path.display());
            }
        }
    }
    done
}

/// What is wrong with what the target does of this input.
fn judge(target: Target, input: &[u8]) -> Option<String> {
    SAID.set(None);
    let came = catch_unwind(|| target.too_much(input));
    if let Some(said) = SAID.take() {
        return Some(said);
    }
    let Ok(too_much) = came else {
        return Some("a panic without words".into());
    };
    too_much.map(|bytes| {
        // To the power of two, so that like ones are counted together.
        format!(
            "more than {} MiB of memory at a time",
            bytes.next_power_of_two() >> 21
        )
    })
}

fn keep_input(folder: &Path, target: Target, input: &[u8]) -> PathBuf {
    let folder = folder.join(target.name);
    let sum = input.iter().fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| {
        (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3)
    });
    let path = folder.join(format!("{sum:016x}"));
    let kept = std::fs::create_dir_all(&folder)
        .and_then(|()| std::fs::File::create(&path))
        .and_then(|mut file| file.write_all(input));
    kept.expect("room for an input that fails");
    path
}
