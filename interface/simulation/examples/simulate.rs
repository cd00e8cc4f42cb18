//! Runs scenarios from seeds and prints violations.
//!
//! `cargo run --release -p simulation --example simulate -- --seeds 1000000`; one of them again, told step by step:
//! `--from SEED --seeds 1`.

use std::collections::BTreeMap;
use std::process::ExitCode;
use std::time::Instant;

use clap::Parser;
use simulation::scenario::{Outcome, Scenario, shrink};

/// Plays sessions with faults in virtual time.
#[derive(Parser)]
struct Options {
    /// How many scenarios.
    #[arg(long, default_value_t = 100_000)]
    seeds: u64,
    /// Seed of the first one; the others follow it.
    #[arg(long, default_value_t = 0)]
    from: u64,
    /// Goes on after a scenario that breaks something, until so many have.
    #[arg(long, default_value_t = 1)]
    failures: u64,
}

fn main() -> ExitCode {
    let options = Options::parse();
    let start = Instant::now();
    let (mut faults, mut outcomes): (BTreeMap<&str, u64>, BTreeMap<String, u64>) =
        Default::default();
    let (mut events, mut failures) = (0, 0);
    for seed in options.from..options.from + options.seeds {
        let scenario = Scenario::new(seed);
        match scenario.judge() {
            Ok((outcome, played)) => {
                for (fault, _) in &played.struck {
                    *faults.entry(fault.kind.name()).or_default() += 1;
                }
                let of = match outcome {
                    Outcome::Whole if played.struck.is_empty() => "whole, nothing struck",
                    Outcome::Whole => "whole, though something struck",
                    Outcome::Blamed => "the culprit named",
                    Outcome::Resumed => "the culprit named, resumed to the same bits",
                };
                *outcomes.entry(of.into()).or_default() += 1;
                events += played.events;
            }
            Err(what) => {
                failures += 1;
                println!("seed {seed}: {what}");
                let (small, why) = shrink(scenario, what);
                println!("  smallest: {why}\n  {small:#?}");
                if failures >= options.failures {
                    break;
                }
            }
        }
    }
    let seconds = start.elapsed().as_secs_f64();
    let played: u64 = outcomes.values().sum::<u64>() + failures;
    println!(
        "{played} scenarios in {seconds:.1} s ({:.0} a second), {events} events",
        played as f64 / seconds
    );
    for (name, count) in &faults {
        println!("  {count:>9}  {name}");
    }
    for (name, count) in &outcomes {
        println!("  {count:>9}  {name}");
    }
    println!("{failures} broke something");
    if failures == 0 {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}
