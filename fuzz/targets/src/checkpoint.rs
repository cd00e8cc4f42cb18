//! Checkpoints with the right hash, and the saved states in them, as `tandem resume` takes them.

use coupler::record::rundir::RunDir;
use coupler::run::Resumed;
use coupler::run::checkpoint::file::solver_states;
use interface::message::control::Party;
use interface::session::solver_part;
use interface::solver::{DemSolver, MpmSolver};
use interface::step::Step;

use crate::change::Changer;
use crate::run::{LEFT, directory, options};
use crate::target::Target;

/// The file of a checkpoint. An input begins with its form: even: the file without its hash; odd: four parts, each behind
/// its length as u32, which are packed as a checkpoint has them.
pub const TARGET: Target = Target {
    name: "checkpoint",
    run: |input| drop(solver_states(&sealed(input))),
    seeds,
    change: |changer, input, seeds| changer.bytes(input, seeds),
    // Room for lists whose length is a lie: serde makes 1 MiB for each at most. A byte of a block becomes at most 255; what
    // the target packs itself is there beside it.
    base: 4 << 20,
    per_byte: 1024,
};

/// A run that goes on from such a checkpoint; of the same form.
pub const RESUME: Target = Target {
    name: "resume",
    run: resume,
    // And the solvers of the small run.
    base: 16 << 20,
    ..TARGET
};

/// The state of the continuum.
pub const MPM: Target = Target {
    name: "mpm_state",
    run: mpm,
    seeds: || vec![state(Party::Mpm)],
    change: change_within,
    base: 4 << 20,
    per_byte: 256,
};

/// The state of the bodies.
pub const DEM: Target = Target {
    name: "dem_state",
    run: dem,
    seeds: || vec![state(Party::Dem)],
    change: |changer, input, seeds| changer.bytes(input, seeds),
    ..MPM
};

/// Changes what a continuum's state is behind its form, and keeps the lengths right: a state of another form is refused
/// before it is looked at. Three times in four.
fn change_within(changer: &mut Changer, input: &mut Vec<u8>, seeds: &[Vec<u8>]) {
    let number = |at: usize| {
        let bytes = input.get(at..at.checked_add(8)?)?;
        Some(u64::from_le_bytes(bytes.try_into().ok()?) as usize)
    };
    // The name of the format, the form, the state: each behind its length.
    let form = number(0).and_then(|name| name.checked_add(8));
    let state = form.and_then(|at| number(at)?.checked_add(at + 8));
    match state.filter(|at| at.saturating_add(8) < input.len()) {
        Some(at) if changer.below(4) > 0 => {
            let mut state = input.split_off(at + 8);
            changer.bytes(&mut state, &[]);
            input.truncate(at);
            input.extend((state.len() as u64).to_le_bytes());
            input.extend(state);
        }
        _ => changer.bytes(input, seeds),
    }
}

const MAGIC: &[u8] = b"tandem checkpoint 1\n";

fn sealed(input: &[u8]) -> Vec<u8> {
    let Some((form, rest)) = input.split_first() else {
        return Vec::new();
    };
    let mut file = MAGIC.to_vec();
    if form % 2 == 0 {
        file.extend(rest);
    } else {
        let mut rest = rest;
        for part in 0..4 {
            let (length, more) = rest.split_at(rest.len().min(4));
            let length = length.try_into().map_or(0, u32::from_le_bytes) as usize;
            let (bytes, more) = more.split_at(more.len().min(length));
            rest = more;
            if part > 0 {
                let packed = lz4_flex::block::compress_prepend_size(bytes);
                file.extend(1_u64.to_le_bytes());
                file.extend((packed.len() as u64).to_le_bytes());
                file.extend(packed);
            } else {
                file.extend((bytes.len() as u64).to_le_bytes());
                file.extend(bytes);
            }
        }
    }
    let hash = blake3::hash(&file);
    file.extend(hash.as_bytes());
    file
}

fn seeds() -> Vec<Vec<u8>> {
    let file = &LEFT.checkpoint;
    let body = &file[MAGIC.len()..file.len() - 32];
    let as_it_is = [&[0], body].concat();
    let take = |rest: &mut &[u8], length: usize| {
        let (taken, left) = rest.split_at(length);
        *rest = left;
        taken.to_vec()
    };
    let number = |rest: &mut &[u8]| {
        let bytes = take(rest, 8);
        u64::from_le_bytes(bytes.try_into().expect("8 bytes")) as usize
    };
    let rest = &mut &*body;
    let length = number(rest);
    let mut parts = vec![take(rest, length)];
    while !rest.is_empty() {
        assert_eq!(
            number(rest),
            1,
            "the states of the small run are one block each"
        );
        let length = number(rest);
        let packed = take(rest, length);
        parts.push(lz4_flex::block::decompress_size_prepended(&packed).expect("a block"));
    }
    let mut open = vec![1];
    for part in parts {
        open.extend((part.len() as u32).to_le_bytes());
        open.extend(part);
    }
    vec![as_it_is, open]
}

/// Goes on from it.
fn resume(input: &[u8]) {
    drop(resumed(input));
}

/// Goes on from it in a copy of the run's directory, and is interrupted at once; the reason that the summary gives.
fn resumed(input: &[u8]) -> Option<String> {
    let bytes = sealed(input);
    solver_states(&bytes).ok()?;
    let dir = directory();
    LEFT.put(dir.path());
    let folder = dir.path().join("checkpoints");
    std::fs::write(folder.join("999999999999.tandem"), bytes).expect("room for a checkpoint");
    let run = RunDir::reopen(dir.path()).ok()?;
    let resumed = Resumed::find(&LEFT.scene, &run).ok()?;
    let finished = resumed.run(&LEFT.scene, &options(false, true), &run);
    finished.summary.reason
}

/// What this party has saved in the checkpoint of the small run, without the session's part at its beginning.
fn state(party: Party) -> Vec<u8> {
    let states = solver_states(&LEFT.checkpoint).expect("a checkpoint");
    let state = states.into_iter().find(|(of, _)| *of == party);
    solver_part(&state.expect("both take part").1).to_vec()
}

/// The next step of a restored solver.
const STEP: Step = Step {
    index: 20,
    time: 0.02,
    dt_before: 1e-4,
    dt: 1e-4,
    measure: true,
};

fn mpm(input: &[u8]) {
    let config = LEFT.scene.mpm.as_ref().expect("a continuum");
    // One of its own: a solver that has refused a state takes no other.
    let mut solver = mpm_proc::Mpm::default();
    solver
        .configure(config)
        .expect("the configuration of the small run");
    if solver.restore(input).is_err() {
        return;
    }
    let imps = solver.imp_states().len();
    let forces = vec![interface::message::wire::ImpForce::default(); imps];
    if solver.step(&STEP, &forces).is_ok() {
        let _ = (
            solver.points(),
            solver.measurement().ledger,
            solver.save().is_ok(),
        );
    }
}

fn dem(input: &[u8]) {
    let config = LEFT.scene.dem.as_ref().expect("bodies");
    let mut solver = dem_proc::Sdem::default();
    solver
        .configure(config)
        .expect("the configuration of the small run");
    if solver.restore(input).is_err() {
        return;
    }
    // With no points near, which a set says.
    let _ = solver.envelopes().len();
    solver.imp_set(&[]);
    if solver.contact(&STEP, &[], &mut []).is_ok() && solver.advance(&STEP).is_ok() {
        let _ = (solver.measurement().ledger, solver.save().is_ok());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Otherwise the targets would not reach what they are about.
    #[test]
    fn both_forms_of_a_seed_are_the_checkpoint_that_they_are_made_of() {
        let whole = solver_states(&LEFT.checkpoint).unwrap();
        for seed in seeds() {
            assert_eq!(solver_states(&sealed(&seed)).unwrap(), whole);
        }
    }

    /// A clock that is not in its epoch was taken, and the run landed on an output at another time.
    #[test]
    fn a_clock_and_counts_that_no_run_has_are_refused() {
        let kept = include_bytes!("../../corpus/resume/clock_beside_its_epoch");
        let reason = resumed(kept).unwrap();
        assert!(reason.contains("its clock is not in its epoch"), "{reason}");
        // More epochs before it than in all: the number of its own wrapped.
        let kept = include_bytes!("../../corpus/resume/more_epochs_before_than_in_all");
        let reason = resumed(kept).unwrap();
        assert!(reason.contains("no run has so many"), "{reason}");
        let whole = resumed(&seeds()[0]).unwrap();
        assert!(whole.contains("interrupted"), "{whole}");
    }

    #[test]
    fn the_states_of_the_small_run_are_taken() {
        let mut mpm = mpm_proc::Mpm::default();
        mpm.configure(LEFT.scene.mpm.as_ref().unwrap()).unwrap();
        mpm.restore(&state(Party::Mpm)).unwrap();
        let mut dem = dem_proc::Sdem::default();
        dem.configure(LEFT.scene.dem.as_ref().unwrap()).unwrap();
        dem.restore(&state(Party::Dem)).unwrap();
    }
}
