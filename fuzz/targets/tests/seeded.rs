//! A few thousand changed seeds for each target: no panic, no hang, no more memory than there is reason for. Much more of
//! it: `cargo run --release -p fuzzing --example fuzz`.

use std::cell::RefCell;
use std::panic::catch_unwind;
use std::path::Path;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::{Duration, Instant};

use fuzzing::change::Changer;
use fuzzing::{Target, target};

/// Longest that one input may take, on a machine that does other things.
const PATIENCE: Duration = Duration::from_secs(30);

thread_local! {
    /// What the last panic of this thread said, also one that the program has caught.
    static SAID: RefCell<Option<String>> = const { RefCell::new(None) };
}

/// Runs a target on its seeds, on what is kept in the tree, and on changed ones for `seconds`.
#[track_caller]
fn holds(name: &str, seconds: f64) {
    let target = target(name).expect("a target of this name");
    let (tell, told) = channel();
    let worker = std::thread::spawn(move || {
        std::panic::set_hook(Box::new(|info| {
            SAID.set(Some(info.to_string()));
            // A test has a name, and nobody else tells why it fails.
            if std::thread::current().name().is_some() {
                eprintln!("{info}");
            }
        }));
        let folder = Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("../corpus")
            .join(target.name);
        let kept = std::fs::read_dir(folder).into_iter().flatten().flatten();
        let mut seeds: Vec<Vec<u8>> = kept.map(|e| std::fs::read(e.path()).unwrap()).collect();
        seeds.extend((target.seeds)());
        let mut changer = Changer::new(15);
        let mut done = 0;
        let end = Instant::now() + Duration::from_secs_f64(seconds);
        while done < seeds.len() || Instant::now() < end {
            let mut input = seeds.get(done).cloned().unwrap_or_else(|| {
                let mut input = changer.one(&seeds).clone();
                (target.change)(&mut changer, &mut input, &seeds);
                input
            });
            input.truncate(1 << 20);
            done += 1;
            tell.send(Ok(input.clone())).expect("somebody listens");
            if let Some(wrong) = wrong(target, &input) {
                tell.send(Err(wrong)).expect("somebody listens");
                return;
            }
        }
    });
    let mut last = Vec::new();
    let mut done = 0;
    loop {
        match told.recv_timeout(PATIENCE) {
            Ok(Ok(input)) => (last, done) = (input, done + 1),
            Ok(Err(wrong)) => panic!("{name}: {wrong}\n{}", String::from_utf8_lossy(&last)),
            Err(RecvTimeoutError::Disconnected) => break,
            Err(RecvTimeoutError::Timeout) => {
                panic!("{name}: hangs\n{}", String::from_utf8_lossy(&last))
            }
        }
    }
    worker.join().expect("the worker itself does not panic");
    assert!(done > 10, "{name}: only {done} inputs in {seconds} s");
}

fn wrong(target: Target, input: &[u8]) -> Option<String> {
    SAID.set(None);
    let came = catch_unwind(|| target.too_much(input));
    if let Some(said) = SAID.take() {
        return Some(said);
    }
    let most = came.ok().flatten()?;
    Some(format!(
        "{most} bytes at a time for an input of {}",
        input.len()
    ))
}

#[test]
fn scenes() {
    holds("scene", 3.0);
}

#[test]
fn sessions() {
    holds("session", 3.0);
}

#[test]
fn recordings() {
    holds("recording", 2.0);
}

#[test]
fn checkpoints() {
    holds("checkpoint", 2.0);
}

#[test]
fn resumed_runs() {
    holds("resume", 3.0);
}

#[test]
fn vtk_files() {
    holds("frames", 2.0);
}

#[test]
fn pages() {
    holds("page", 3.0);
}
