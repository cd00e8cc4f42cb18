//! Physics by random cases: configurations within what a solver takes, motions of points that reach every regime of contact,
//! and every answer beside an oracle that is written from PROTOCOL.md and docs/physics.md ([`oracle`]). A case that differs is
//! made as small as it can be ([`shrink`]) and told in a sentence.

pub mod admit;
pub mod case;
pub mod compare;
mod generate;
pub mod law;
pub mod oracle;
pub mod run;
mod shrink;

use std::fmt::{self, Display, Write as _};
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use interface::config::capability::Capabilities;

use crate::bench::{Bench, Subject};
use crate::clause::Clause;
use crate::options::Options;
use crate::trace::Trace;
use crate::verdict::{Evidence, Unmet, Verdict, Why};
use case::{Along, Case};
use compare::{CLAUSES, Compared, Difference, Number};
use run::{Outcome, run};

/// So many cases are refused before a solver is taken for one that refuses all.
const REFUSED: u64 = 20;
/// The clauses of motions and forces.
const MECHANICS: [&str; 6] = ["J-1", "T-1", "F-8", "F-7", "F-5", "F-6"];

/// A case in which a solver differs from the oracle, as small as it could be made.
#[derive(Debug)]
pub struct Failure {
    /// Its seed.
    pub seed: u64,
    /// The small case.
    pub case: Case,
    /// What differs in it.
    pub difference: Difference,
}

/// What random cases have shown.
#[derive(Debug, Default)]
pub struct Campaign {
    /// Cases that were run.
    pub cases: u64,
    /// Those that the solver refused, with the last key.
    pub refused: (u64, Option<String>),
    /// What was compared, by clause.
    pub compared: [Compared; CLAUSES.len()],
    /// The failure of the least seed.
    pub failure: Option<Failure>,
}

impl Campaign {
    /// What is said of a clause where nothing failed.
    pub fn verdict(&self, clause: &Clause, takes: &Capabilities) -> Verdict {
        let k = CLAUSES.iter().position(|id| *id == clause.id);
        let Compared { count, largest } = k.map_or(Compared::default(), |k| self.compared[k]);
        let lacks = clause.lacks(takes);
        if !lacks.is_empty() {
            return Unmet::Lacking(lacks).into();
        }
        match (&self.refused.1, count) {
            (Some(refusal), 0) => Verdict::NotApplicable {
                reason: format!("refuses {refusal}"),
                why: Why::Refused,
            },
            (None, 0) => Unmet::Lacking(vec!["what shows it".into()]).into(),
            _ => Verdict::Pass {
                measured: format!(
                    "{count} numbers in {} random cases, within {largest:.0e} of the tolerance",
                    self.cases - self.refused.0
                ),
            },
        }
    }
}

/// Runs random cases until one breaks one of the clauses that are asked for.
pub fn campaign(
    subject: &Subject,
    options: &Options,
    takes: &Capabilities,
    asked: &[&str],
) -> Campaign {
    let start = Instant::now();
    let plan = options.random;
    let (next, first_failing) = (AtomicU64::new(0), AtomicU64::new(u64::MAX));
    let found = Mutex::new((Campaign::default(), None::<(u64, Case, Difference)>));
    let bench = || Bench::new(subject.clone(), options, takes, Trace::default());
    let worker = || {
        loop {
            let k = next.fetch_add(1, Ordering::Relaxed);
            if k >= plan.cases
                || start.elapsed() >= plan.time
                || k > first_failing.load(Ordering::Relaxed)
            {
                return;
            }
            let seed = plan.seed + k;
            let Some(case) = of_seed(seed, takes) else {
                continue;
            };
            let mut compared = [Compared::default(); CLAUSES.len()];
            let outcome = run(&bench(), &case, asked, &mut compared);
            let mut found = found.lock().expect("no panic holds it");
            let campaign = &mut found.0;
            campaign.cases += 1;
            if campaign.refused.0 >= REFUSED && campaign.refused.0 + 1 == campaign.cases {
                // It takes nothing.
                first_failing.store(0, Ordering::Relaxed);
            }
            for (sum, one) in campaign.compared.iter_mut().zip(compared) {
                sum.count += one.count;
                sum.largest = sum.largest.max(one.largest);
            }
            match outcome {
                Outcome::Same => {}
                Outcome::Refused(refusal) => {
                    campaign.refused = (campaign.refused.0 + 1, Some(refusal.to_string()));
                }
                Outcome::Differs(difference) => {
                    first_failing.fetch_min(k, Ordering::Relaxed);
                    if found.1.as_ref().is_none_or(|(least, ..)| seed < *least) {
                        found.1 = Some((seed, case, difference));
                    }
                }
            }
        }
    };
    std::thread::scope(|scope| {
        for _ in 0..options.jobs.max(1) {
            scope.spawn(worker);
        }
    });
    let (mut campaign, failing) = found.into_inner().expect("no panic holds it");
    campaign.failure = failing.map(|(seed, case, difference)| {
        let (case, difference) = smallest(bench, asked, plan.shrink, case, difference);
        Failure {
            seed,
            case,
            difference,
        }
    });
    campaign
}

/// The case of a seed, as far as it can be run.
pub fn of_seed(seed: u64, takes: &Capabilities) -> Option<Case> {
    let case = generate::case(seed, takes);
    let steps = admit::steps(&case);
    (steps > 0).then(|| admit::cut(&case, steps))
}

/// Leaves out of a failing case what can be left out, while it breaks the same clause.
fn smallest(
    bench: impl Fn() -> Bench,
    asked: &[&str],
    time: Duration,
    mut case: Case,
    mut difference: Difference,
) -> (Case, Difference) {
    let start = Instant::now();
    let fails = |case: &Case, asked: &[&str]| {
        if admit::steps(case) < case.steps() || case.steps() == 0 {
            return None;
        }
        match run(
            &bench(),
            case,
            asked,
            &mut [Compared::default(); CLAUSES.len()],
        ) {
            Outcome::Differs(other) => Some(other),
            _ => None,
        }
    };
    // Measured in every step, the first difference is nearest to its cause: wrong motions and forces make everything else
    // wrong, and not the other way round.
    let measured = admit::measured_in_every_step(&case);
    let causes: Vec<&str> = MECHANICS
        .into_iter()
        .filter(|id| asked.contains(id))
        .collect();
    let found = [
        (&measured, &causes[..]),
        (&case, &causes),
        (&measured, asked),
    ]
    .into_iter()
    .find_map(|(case, asked)| Some((case.clone(), asked.to_vec(), fails(case, asked)?)));
    let asked = if let Some((of_cause, causes, cause)) = found {
        (case, difference) = (of_cause, cause);
        causes
    } else {
        asked.to_vec()
    };
    let (mut next, mut tried) = (0, 0);
    while start.elapsed() < time {
        let mut smaller = shrink::smaller(&case, difference.step);
        if tried >= smaller.len() {
            break;
        }
        let smaller = smaller.swap_remove(next % smaller.len());
        if let Some(other) =
            fails(&smaller, &asked).filter(|other| other.clause == difference.clause)
        {
            (case, difference, tried) = (smaller, other, 0);
        } else {
            (next, tried) = (next + 1, tried + 1);
        }
    }
    (case, difference)
}

impl Failure {
    /// What the clause asks for, what the solver said, and the case.
    pub fn evidence(&self) -> Evidence {
        let Difference {
            clause,
            step,
            what,
            expected,
            got,
        } = &self.difference;
        let mut story: Vec<String> = self.to_string().lines().map(str::to_owned).collect();
        story.push(format!(
            "again: --only {clause} --seed {} --cases 1",
            self.seed
        ));
        Evidence {
            step: Some(u64::from(*step)),
            expected: format!("{what}: {expected}"),
            got: got.clone(),
            story,
        }
    }
}

impl Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let step = self.difference.step;
        let case = &self.case;
        let many = |n: usize, one: &str, more: &str| {
            if n == 1 {
                format!("1 {one}")
            } else {
                format!("{n} {more}")
            }
        };
        let points = many(case.points.len(), "point", "points");
        let bodies = many(case.config.bodies.len(), "body", "bodies");
        writeln!(
            f,
            "in {points}, {bodies}, {}:",
            many(case.steps() as usize, "step", "steps")
        )?;
        for (b, body) in case.config.bodies.iter().enumerate() {
            writeln!(f, "body {b}: {}", of_body(body))?;
        }
        for point in &case.points {
            let along = match point.along {
                Along::Body(b) => format!("body {b}"),
                Along::Point(k) => format!("point {}", case.points[k].id),
                Along::Axis => "the x axis".to_owned(),
            };
            let overlap = Number(point.overlap.at(step) / point.radius);
            let way = point.way.at(step) - point.way.at(step.saturating_sub(1));
            writeln!(
                f,
                "point {}: at {along} with an overlap of {overlap} r_p, slides by {} r_p in the step, r_p = {} m",
                point.id,
                Number(way / point.radius),
                Number(point.radius)
            )?;
        }
        let law =
            |law: &interface::config::ContactLaw| serde_json::to_string(law).unwrap_or_default();
        write!(f, "contact: {}", law(&case.config.point_contact))?;
        if let Some(between) = &case.config.body_contact {
            write!(f, "\nbody_contact: {}", law(between))?;
        }
        Ok(())
    }
}

/// A body in words.
fn of_body(body: &interface::config::BodyConfig) -> String {
    let shape = serde_json::to_value(&body.shape).ok();
    let shape = shape.and_then(|value| match value {
        serde_json::Value::String(name) => Some(name),
        serde_json::Value::Object(map) => map.keys().next().cloned(),
        _ => None,
    });
    let motion = serde_json::to_value(body.motion).ok();
    let motion = motion.and_then(|value| match value {
        serde_json::Value::String(name) => Some(name),
        serde_json::Value::Object(map) => map.keys().next().cloned(),
        _ => None,
    });
    let mut words = format!(
        "{}, {}, sphero-radius {} m",
        shape.unwrap_or_default(),
        motion.unwrap_or_default(),
        Number(body.sphero_radius)
    );
    if body.spin != 0.0 {
        let _ = write!(words, ", spin {} rad/s", Number(body.spin));
    }
    if body.velocity != [0.0; 2] {
        let _ = write!(words, ", velocity {} m/s", compare::Vector(body.velocity));
    }
    words
}
