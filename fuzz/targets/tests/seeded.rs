//! Changed seeds for each target: no panic, no hang, no more memory than there is reason for. A few seconds of each, or what
//! the environment says (`fuzz/README.md`): `FUZZ_SECONDS`, `FUZZ_SEED`, `FUZZ_INPUT` (a file that is run by itself) and
//! `FUZZ_EXPORT` (a folder that the seeds are written to, for `cargo fuzz`).

use std::cell::RefCell;
use std::env;
use std::fs;
use std::panic::catch_unwind;
use std::path::{Path, PathBuf};
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

/// Runs a target on its seeds, on what is kept in the tree, and on changed ones for `seconds`. An input that fails is kept.
#[track_caller]
fn holds(name: &str, seconds: f64) {
    let target = target(name).expect("a target of this name");
    let fuzz = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    if let Ok(path) = env::var("FUZZ_INPUT") {
        let input = fs::read(&path).expect("the input");
        assert_eq!(wrong(target, &input), None, "{name}: {path}");
        return;
    }
    let kept = fs::read_dir(fuzz.join("corpus").join(name));
    let kept = kept.into_iter().flatten().flatten();
    let mut seeds: Vec<Vec<u8>> = kept.map(|e| fs::read(e.path()).unwrap()).collect();
    seeds.extend((target.seeds)());
    if let Ok(folder) = env::var("FUZZ_EXPORT") {
        for seed in seeds {
            keep(&Path::new(&folder).join(name), &seed);
        }
        return;
    }
    let seconds = number("FUZZ_SECONDS").unwrap_or(seconds);
    let (tell, told) = channel();
    let worker = std::thread::spawn(move || {
        std::panic::set_hook(Box::new(|info| {
            SAID.set(Some(info.to_string()));
            // A test has a name, and nobody else tells why it fails.
            if std::thread::current().name().is_some() {
                eprintln!("{info}");
            }
        }));
        let mut changer = Changer::new(number("FUZZ_SEED").unwrap_or(15.0) as u64);
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
    let failed = loop {
        match told.recv_timeout(PATIENCE) {
            Ok(Ok(input)) => (last, done) = (input, done + 1),
            Ok(Err(wrong)) => break Some(wrong),
            Err(RecvTimeoutError::Disconnected) => break None,
            Err(RecvTimeoutError::Timeout) => break Some("it hangs".into()),
        }
    };
    if let Some(wrong) = failed {
        let path = keep(&fuzz.join("artifacts").join(name), &last);
        panic!("{name}: {wrong}; FUZZ_INPUT={}", path.display());
    }
    worker.join().expect("the worker itself does not panic");
    println!("{name}: {done} inputs in {seconds} s");
    assert!(done > 10, "{name}: only {done} inputs in {seconds} s");
}

fn number(name: &str) -> Option<f64> {
    let text = env::var(name).ok()?;
    Some(text.parse().expect("a number"))
}

fn keep(folder: &Path, input: &[u8]) -> PathBuf {
    let path = folder.join(&blake3::hash(input).to_hex()[..16]);
    let kept = fs::create_dir_all(folder).and_then(|()| fs::write(&path, input));
    kept.expect("room for an input");
    path
}

/// What is wrong with what the target does of this input.
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
fn vtk_files() {
    holds("frames", 2.0);
}
