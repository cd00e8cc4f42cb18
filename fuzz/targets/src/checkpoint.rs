//! Checkpoints with the right hash, and the saved states in them, as `tandem resume` takes them.

use coupler::record::rundir::RunDir;
use coupler::run::Resumed;
use coupler::run::checkpoint::file::solver_states;

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

/// A run that goes on from such a checkpoint; of the same form. Only the coupler's part of it is changed: of the states of
/// solvers the hash of the file alone says whether they are what was saved.
pub const RESUME: Target = Target {
    name: "resume",
    run: resume,
    seeds: || seeds().split_off(1),
    change: change_first_part,
    // And the solvers of the small run.
    base: 16 << 20,
    ..TARGET
};

/// Changes the first of four parts, and keeps its length right.
fn change_first_part(changer: &mut Changer, input: &mut Vec<u8>, _seeds: &[Vec<u8>]) {
    let length = input.get(1..5).and_then(|bytes| bytes.try_into().ok());
    let end = length.map(|bytes| 5 + u32::from_le_bytes(bytes) as usize);
    let Some(end) = end.filter(|end| input[0] % 2 == 1 && *end <= input.len()) else {
        return;
    };
    let rest = input.split_off(end);
    let mut part = input.split_off(5);
    changer.bytes(&mut part, &[]);
    input.truncate(1);
    input.extend((part.len() as u32).to_le_bytes());
    input.extend(part);
    input.extend(rest);
}

const MAGIC: &[u8] = b"tandem checkpoint 2\n";

fn sealed(input: &[u8]) -> Vec<u8> {
    let Some((form, rest)) = input.split_first() else {
        return Vec::new();
    };
    let mut file = MAGIC.to_vec();
    if form % 2 == 0 {
        file.extend(rest);
    } else {
        let (mut rest, mut about, mut states) = (rest, Vec::new(), Vec::new());
        for part in 0..4 {
            let (length, more) = rest.split_at(rest.len().min(4));
            let length = length.try_into().map_or(0, u32::from_le_bytes) as usize;
            let (bytes, more) = more.split_at(more.len().min(length));
            rest = more;
            if part > 0 {
                let packed = lz4_flex::block::compress_prepend_size(bytes);
                states.extend(1_u64.to_le_bytes());
                states.extend((packed.len() as u64).to_le_bytes());
                states.extend(packed);
            } else {
                about.extend(bytes);
            }
        }
        // The length of the states stands in it.
        if let Ok(mut told) = serde_json::from_slice::<serde_json::Map<_, _>>(&about) {
            told.insert("bytes".into(), states.len().into());
            about = serde_json::to_vec(&told).expect("a map of texts");
        }
        file.extend((about.len() as u64).to_le_bytes());
        file.extend(about);
        file.extend(states);
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
    let resumed = Resumed::find(&LEFT.scene, &run, false).ok()?;
    let finished = resumed.run(&LEFT.scene, &options(false, true), &run);
    finished.summary.reason
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
}
