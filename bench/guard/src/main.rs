//! Notices when Tandem becomes slower.
//!
//!     bench/guard/run                  compares; fails and names the jobs that are more than 8 % slower than before
//!     bench/guard/run --retake         writes the ratios of now to ratios.csv
//!     bench/guard/run --runs 50        compares 50 times and counts the alarms, each of which is false
//!     bench/guard/run discs exchange   these jobs only
//!
//! Each job runs beside a yardstick: plain code of the same kind, which no change of Tandem touches. They take turns every
//! few milliseconds in one thread, so what slows the machine down slows both down. What is compared is the ratio of their CPU
//! times: the median over all turns. Each measurement has a process of its own (`--once JOB`), and a thread of its own: at another
//! address of its stack the empty exchange takes up to 2.5 times as long. Work in the other thread of a core changes ratios by a
//! fifth, so all threads of the processor measure at once, on a quiet machine too. A job that seems slower is measured again, up
//! to five times, and the least counts: a busy machine passes, slow code stays. The ratio depends on the processor, so `ratios.csv` has a row for each model, and the ratios
//! of a model without rows are only shown. A change that is worth its price commits the new ratios, with the reason in its message.

mod grain_box;
mod jobs;
mod yardsticks;

use std::error::Error;
use std::process::{Command, ExitCode, Stdio};

use rustix::time::{ClockId, clock_gettime};
use serde::{Deserialize, Serialize};

use jobs::{JOBS, Job};

/// The ratios of before.
const FILE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/ratios.csv");
/// A job may take this many times what it took.
const SLOWER: f64 = 1.08;
/// How often a job that seems slower is measured before it counts as slower.
const ATTEMPTS: usize = 5;
/// How often a job is measured for a new ratio, of which the median is written.
const RETAKES: usize = 5;

/// A ratio of before.
#[derive(Debug, Serialize, Deserialize)]
struct Row {
    processor: String,
    job: String,
    ratio: f64,
}

fn main() -> ExitCode {
    let mut arguments = std::env::args().skip(1);
    let (mut retake, mut once, mut runs, mut chosen) = (false, false, 1, Vec::new());
    while let Some(argument) = arguments.next() {
        match &*argument {
            "--retake" => retake = true,
            "--once" => once = true,
            "--runs" => match arguments.next().and_then(|n| n.parse().ok()) {
                Some(n) => runs = n,
                None => return wrong("--runs takes a number"),
            },
            name => match JOBS.iter().find(|job| job.name == name) {
                Some(job) => chosen.push(job),
                None => return wrong(&format!("no job `{name}`")),
            },
        }
    }
    if chosen.is_empty() {
        chosen = JOBS.iter().collect();
    }
    if once {
        for job in chosen {
            // The stack of a thread begins at a page, that of the process anywhere.
            let Ok(ratio) = std::thread::spawn(|| measure(job)).join() else {
                return wrong("the job panicked");
            };
            println!("{ratio}");
        }
        return ExitCode::SUCCESS;
    }
    let done = if retake {
        take(&chosen).map(|()| 0)
    } else {
        compare(&chosen, runs)
    };
    match done {
        Ok(0) => ExitCode::SUCCESS,
        Ok(_) => ExitCode::FAILURE,
        Err(error) => wrong(&format!("{FILE}: {error}")),
    }
}

fn wrong(text: &str) -> ExitCode {
    eprintln!("guard: {text}");
    ExitCode::from(2)
}

/// Compares each job `runs` times with its ratio of before. Returns the number of alarms.
fn compare(jobs: &[&Job], runs: usize) -> Result<usize, Box<dyn Error>> {
    let (rows, processor) = (rows()?, processor());
    let mut alarms = 0;
    for run in 1..=runs {
        for job in jobs {
            let here = |row: &&Row| row.processor == processor && row.job == job.name;
            let Some(before) = rows.iter().find(here).map(|row| row.ratio) else {
                println!(
                    "{:12} {:7.3}   no ratio for {processor}",
                    job.name,
                    measured(job)?
                );
                continue;
            };
            let (mut ratio, mut attempts) = (f64::INFINITY, 0);
            while attempts < ATTEMPTS && ratio > SLOWER * before {
                ratio = ratio.min(measured(job)?);
                attempts += 1;
            }
            let slower = ratio > SLOWER * before;
            alarms += usize::from(slower);
            println!(
                "{:12} {ratio:7.3}, before {before:7.3}: {:+5.1} %, measured {attempts} times{}",
                job.name,
                100.0 * (ratio / before - 1.0),
                match ratio / before {
                    change if change > SLOWER => "   SLOWER",
                    change if change < 1.0 / SLOWER => "   faster: --retake, so that it stays so",
                    _ => "",
                }
            );
        }
        if runs > 1 {
            println!("run {run}: {alarms} alarms so far");
        }
    }
    if alarms > 0 {
        println!(
            "Slower than {FILE} allows. If the change is worth it: bench/guard/run --retake, and say why in the commit."
        );
    }
    Ok(alarms)
}

/// Writes the ratios of now for this processor.
fn take(jobs: &[&Job]) -> Result<(), Box<dyn Error>> {
    let (mut rows, processor) = (rows()?, processor());
    for job in jobs {
        let ratios: Result<_, _> = (0..RETAKES).map(|_| measured(job)).collect();
        let ratio = median(ratios?);
        println!("{:12} {ratio:7.3}", job.name);
        rows.retain(|row| row.processor != processor || row.job != job.name);
        rows.push(Row {
            processor: processor.clone(),
            job: job.name.to_owned(),
            ratio: (1e4 * ratio).round() / 1e4,
        });
    }
    rows.sort_by(|a, b| (&a.processor, &a.job).cmp(&(&b.processor, &b.job)));
    let mut file = csv::Writer::from_path(FILE)?;
    rows.iter().try_for_each(|row| file.serialize(row))?;
    Ok(file.flush()?)
}

fn rows() -> Result<Vec<Row>, csv::Error> {
    csv::Reader::from_path(FILE)?.deserialize().collect()
}

/// The processor, as Linux names it, with its family and model: clouds call many of them "AMD EPYC".
fn processor() -> String {
    let text = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let of = |key: &str| {
        let mut fields = text.lines().filter_map(|line| line.split_once(':'));
        let found = fields.find(|(name, _)| name.trim() == key);
        found.map_or("unknown", |(_, value)| value.trim())
    };
    let [name, family, model] = ["model name", "cpu family", "model"].map(of);
    format!("{name}, family {family}, model {model}")
}

/// [`measure`] in processes of their own, one for each thread of the processor and all at once: the least.
fn measured(job: &Job) -> Result<f64, Box<dyn Error>> {
    let program = std::env::current_exe()?;
    let all = std::thread::available_parallelism()?.get();
    let measure = |_| {
        let mut guard = Command::new(&program);
        guard.args(["--once", job.name]).stdout(Stdio::piped());
        guard.spawn()
    };
    let guards = (0..all).map(measure).collect::<Result<Vec<_>, _>>()?;
    let mut least = f64::INFINITY;
    for guard in guards {
        let ratio = String::from_utf8(guard.wait_with_output()?.stdout)?;
        least = least.min(ratio.trim().parse()?);
    }
    Ok(least)
}

/// CPU time of a job in units of its yardstick, from a fresh start.
fn measure(job: &Job) -> f64 {
    let (mut work, mut yardstick) = (job.start)();
    // The first slices fill caches and tables.
    work();
    let mut before = cost(&mut yardstick);
    let ratios = (0..job.turns).map(|_| {
        let own = cost(&mut work);
        let after = cost(&mut yardstick);
        let mean = 0.5 * (before + after);
        before = after;
        own / mean
    });
    median(ratios.collect())
}

/// CPU time of a slice in s. It counts all threads: a coupled run has others for its files.
fn cost(slice: &mut dyn FnMut()) -> f64 {
    let now = || {
        let t = clock_gettime(ClockId::ProcessCPUTime);
        t.tv_sec as f64 + 1e-9 * t.tv_nsec as f64
    };
    let start = now();
    slice();
    now() - start
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}
