//! The page: everything that is known of the runs, in the template.

use std::path::Path;
use std::time::Duration;

use askama::Template;
use coupler::record::Summary;
use coupler::record::log::Line;
use coupler::record::summary::Status;
use coupler::run::resources::Bytes;
use coupler::scene::plan::{self, LeftOut};
use serde::Serialize;

use crate::chart::{Charts, charts};
use crate::motion::{Motion, load};
use crate::record::Record;
use crate::so_far;
use crate::verdict;
use crate::words::{count, duration, moment, size_of};

/// The script, in the order in which its parts need one another.
const SCRIPT: &str = concat!(
    include_str!("../templates/units.js"),
    include_str!("../templates/colour.js"),
    include_str!("../templates/motion.js"),
    include_str!("../templates/player.js"),
    include_str!("../templates/chart.js"),
    include_str!("../templates/page.js"),
    include_str!("../templates/live.js"),
);
const STYLE: &str = include_str!("../templates/page.css");
/// Lines of a log that are shown from its begin, and from its end.
const LOG: [usize; 2] = [100, 400];
/// Bytes of a scene that are shown.
const SCENE: usize = 200_000;
/// Largest page in bytes.
const LARGEST: usize = 5_000_000;
/// Share of the room of a motion that its times and outlines may take, and of rounding.
const RESERVE: f64 = 0.04;

/// The data of a run for the script.
#[derive(Debug, Serialize)]
struct OfRun<'a> {
    label: &'a str,
    motion: Option<&'a Motion>,
    charts: &'a Charts,
}

#[derive(Debug, Template)]
#[template(path = "page.html")]
struct Page<'a> {
    title: String,
    about: &'a str,
    /// When the page of a run that goes on loads itself again.
    again: Option<Duration>,
    data: String,
    many: bool,
    has_motion: bool,
    has_history: bool,
    runs: Vec<Run<'a>>,
    figures: Vec<Figure>,
    checks: Vec<verdict::Row>,
    version: &'a str,
    sources: String,
}

/// A key figure of each run.
#[derive(Debug)]
struct Figure {
    name: &'static str,
    values: Vec<String>,
}

/// A run as the template shows it.
#[derive(Debug)]
struct Run<'a> {
    label: &'a str,
    record: &'a Record,
    charts: &'a Charts,
    motion: Option<&'a Motion>,
    /// Why there is no motion; empty if there is one.
    fault: &'a str,
    status: String,
    /// `good`, `bad` or `open`.
    tone: &'static str,
    reason: Option<&'a str>,
    last_words: Vec<String>,
}

#[derive(Debug)]
struct Part {
    name: &'static str,
    compute: String,
    exchange: String,
    wait: String,
    cpu: String,
    /// Class and width in percent.
    shares: [(&'static str, String); 3],
}

impl Run<'_> {
    fn failed(&self) -> bool {
        self.tone == "bad"
    }

    /// The lines of the log that are shown, of its begin and of its end, and how many between them are not, if any.
    fn log(&self) -> ([&[Line]; 2], Option<String>) {
        let (log, [first, last]) = (&self.record.log, LOG);
        let end = log.len().saturating_sub(last);
        let begin = first.min(end);
        let cut = (begin < end).then(|| count((end - begin) as u64));
        ([&log[..begin], &log[end..]], cut)
    }

    fn mark(&self) -> &'static str {
        match self.tone {
            "good" => "✓",
            "bad" => "✗",
            _ => "…",
        }
    }
}

/// The page of these runs; of a run that goes on, it loads itself `again` after this time ([`crate::live`]).
pub fn page(records: &[Record], again: Option<Duration>) -> String {
    let labels = labels(records);
    let charts: Vec<Charts> = records.iter().map(charts).collect();
    let none: Vec<_> = records.iter().map(|_| Err(String::new())).collect();
    // The space for motions is known when everything else is there.
    let rest = render(records, &labels, &charts, &none, again).len();
    let room = LARGEST.saturating_sub(rest) as f64 * (1.0 - RESERVE) / records.len().max(1) as f64;
    let motions = records.iter().map(|record| motion(record, room as usize));
    render(
        records,
        &labels,
        &charts,
        &motions.collect::<Vec<_>>(),
        again,
    )
}

/// The motion of a run, or why there is none.
fn motion(record: &Record, room: usize) -> Result<Motion, String> {
    let none = "This run has kept no frames, so there is no motion to show. Give the scene `output.report = true` or \
                `output.frames`, or run it with `--report`.";
    match load(&record.path, room) {
        Ok(Some(loaded)) if !loaded.frames.is_empty() => {
            let mut motion = loaded.into_motion(room);
            let domain = record.scene.as_ref().and_then(|scene| scene.mpm.as_ref());
            motion.domain = domain.map(|mpm| {
                let [[left, bottom], [right, top]] = mpm.domain;
                [left, bottom, right, top]
            });
            Ok(motion)
        }
        Ok(Some(loaded)) => Err(loaded.faults.join(" ")),
        Ok(None) => Err(none.to_owned()),
        Err(error) => Err(format!("The frames cannot be read: {error}.")),
    }
}

fn render(
    records: &[Record],
    labels: &[String],
    charts: &[Charts],
    motions: &[Result<Motion, String>],
    again: Option<Duration>,
) -> String {
    let of_runs = labels.iter().zip(motions).zip(charts);
    let data = of_runs.map(|((label, motion), charts)| OfRun {
        label,
        motion: motion.as_ref().ok(),
        charts,
    });
    let data = in_script(&data.collect::<Vec<_>>());
    let has_motion = motions.iter().any(Result::is_ok);
    let all = records.iter().zip(labels).zip(charts.iter().zip(motions));
    let runs: Vec<Run> = all
        .map(|((record, label), (charts, motion))| {
            let mut run = run(record, label, charts, motion);
            if again.is_some() {
                run.status = under_way(record);
            }
            run
        })
        .collect();
    let mut checks: Vec<verdict::Row> = records
        .iter()
        .zip(labels)
        .flat_map(|(record, label)| verdict::rows(record, label))
        .collect();
    checks.sort_by_key(|check| check.result != "fail");
    let names: Vec<String> = records.iter().map(name).collect();
    let one = names.windows(2).all(|pair| pair[0] == pair[1]);
    let title = match names.as_slice() {
        [name] => name.clone(),
        [name, ..] if one => format!("{name}, {} runs", names.len()),
        _ => format!("{} runs", names.len()),
    };
    let about = match (records, one) {
        ([first, ..], true) => first.scene.as_ref().map_or("", |scene| &scene.about),
        _ => "",
    };
    let page = Page {
        title,
        about,
        again,
        data,
        many: records.len() > 1,
        has_motion,
        has_history: charts.iter().any(|charts| !charts.history.is_empty()),
        figures: figures(records),
        checks,
        version: env!("CARGO_PKG_VERSION"),
        sources: records
            .iter()
            .map(|record| record.path.display().to_string())
            .collect::<Vec<_>>()
            .join(", "),
        runs,
    };
    page.render().expect("memory takes what is written")
}

/// JSON that may stand in a script element: no `<` in it can end the element.
fn in_script(data: &impl Serialize) -> String {
    let json = serde_json::to_string(data).expect("all keys are strings");
    json.replace('<', "\\u003c")
}

/// Distinct names of the runs: the last part of the path, or all of it.
fn labels(records: &[Record]) -> Vec<String> {
    let last = |path: &Path| {
        let whole = path.canonicalize().unwrap_or_else(|_| path.to_path_buf());
        let name = whole.file_name().map(|n| n.to_string_lossy().into_owned());
        name.unwrap_or_else(|| path.display().to_string())
    };
    let short: Vec<String> = records.iter().map(|record| last(&record.path)).collect();
    let apart = |label: &String| short.iter().filter(|other| *other == label).count() == 1;
    let all = short.iter().zip(records);
    all.map(|(label, record)| {
        if apart(label) {
            label.clone()
        } else {
            record.path.display().to_string()
        }
    })
    .collect()
}

fn name(record: &Record) -> String {
    let of_summary = record.summary.as_ref().map(|summary| summary.scene.clone());
    of_summary
        .filter(|name| !name.is_empty())
        .or_else(|| Some(record.scene.as_ref()?.name.clone()))
        .unwrap_or_else(|| "A run".to_owned())
}

fn run<'a>(
    record: &'a Record,
    label: &'a str,
    charts: &'a Charts,
    motion: &'a Result<Motion, String>,
) -> Run<'a> {
    let (status, tone) = status(record);
    let reason = record.summary.as_ref().and_then(|s| s.reason.as_deref());
    Run {
        label,
        record,
        charts,
        motion: motion.as_ref().ok(),
        fault: motion.as_ref().err().map_or("", String::as_str),
        status,
        tone,
        last_words: if reason.is_some() || tone == "bad" {
            last_words(record, reason)
        } else {
            Vec::new()
        },
        reason,
    }
}

/// How a run ended, in words, and whether that is good.
fn status(record: &Record) -> (String, &'static str) {
    let (words, tone) = ended(record);
    let (Some(scene), Some(summary)) = (&record.scene, &record.summary) else {
        return (words, tone);
    };
    let Some(remark) = scene.expect.remark(summary.status) else {
        return (words, tone);
    };
    let met = scene.expect.is_met(summary.status) == Some(true);
    let tone = if met { "open" } else { "bad" };
    (format!("{words} This is {remark}"), tone)
}

fn ended(record: &Record) -> (String, &'static str) {
    let Some(summary) = &record.summary else {
        return (
            "This run has not come to its end: it is under way, or it was killed.".to_owned(),
            "open",
        );
    };
    let failing = summary.checks.iter().filter(|check| !check.pass).count();
    let all = summary.checks.len();
    match summary.status {
        Status::Done if all == 0 => ("Done. The scene has no checks.".to_owned(), "good"),
        Status::Done if all == 1 => ("Done, and its check passes.".to_owned(), "good"),
        Status::Done => (format!("Done, and all {all} checks pass."), "good"),
        Status::CheckFailed if failing == 0 => (
            "Done, but the computation created energy.".to_owned(),
            "bad",
        ),
        Status::CheckFailed => (format!("Done, but {failing} of {all} checks fail."), "bad"),
        Status::Failed => ("Failed before its end.".to_owned(), "bad"),
        Status::Unstable => ("Stopped: the state became unstable.".to_owned(), "bad"),
        Status::Interrupted => ("Interrupted before its end.".to_owned(), "open"),
        Status::Killed => ("Killed before its end.".to_owned(), "open"),
    }
}

/// How far a run has come that goes on.
fn under_way(record: &Record) -> String {
    let time = so_far::time(record);
    let end = record.scene.as_ref().map(|scene| scene.time.end);
    match (time, end) {
        (Some(time), Some(end)) => {
            let (time, all) = (moment(time), moment(end));
            format!("Under way: {time} of {all} are simulated.")
        }
        _ => "Under way.".to_owned(),
    }
}

/// The last warnings and errors, but for what is the reason itself.
fn last_words(record: &Record, reason: Option<&str>) -> Vec<String> {
    let mut words: Vec<String> = record
        .log
        .iter()
        .rev()
        .filter(|line| line.is_loud())
        .map(Line::text)
        .filter(|text| !text.is_empty() && Some(text.as_str()) != reason)
        .take(3)
        .collect();
    words.reverse();
    words
}

fn figures(records: &[Record]) -> Vec<Figure> {
    type SoFar<'a> = &'a dyn Fn(&Record) -> Option<String>;
    let known = |name, value: &dyn Fn(&Summary) -> String, so_far: SoFar| Figure {
        name,
        values: records
            .iter()
            .map(|record| match &record.summary {
                Some(summary) => value(summary),
                None => so_far(record).unwrap_or_else(|| "–".to_owned()),
            })
            .collect(),
    };
    let of = |name, value: &dyn Fn(&Summary) -> String| known(name, value, &|_| None);
    let share = |x: f64| {
        let none = || "–".to_owned();
        Some(x).filter(|x| x.is_finite()).map_or_else(none, size_of)
    };
    let mut figures = vec![
        Figure {
            name: "Checks that pass",
            values: records.iter().map(verdict::passing).collect(),
        },
        known("Simulated time", &|s| moment(s.time), &|record| {
            so_far::time(record).map(moment)
        }),
        of("Run time", &|s| duration(s.spent.wall_s)),
        known("Steps", &|s| count(s.steps), &|record| {
            so_far::steps(record).map(count)
        }),
        of("Shortest step", &|s| {
            s.dt_min.map_or("–".to_owned(), moment)
        }),
        of("Longest step", &|s| s.dt_max.map_or("–".to_owned(), moment)),
        known("Material points", &|s| count(s.points), &|record| {
            so_far::items(record, "mpm").map(count)
        }),
        known("Bodies", &|s| count(s.bodies), &|record| {
            so_far::items(record, "dem").map(count)
        }),
        of("Momentum error, relative", &|s| share(s.momentum_error)),
        of("Angular momentum error, relative", &|s| {
            s.angular_momentum_error.map_or("–".to_owned(), share)
        }),
        of("Energy created, relative", &|s| {
            share(s.energy.residual_max)
        }),
        of("Energy taken by the transfer, relative", &|s| {
            share(s.energy.transfer)
        }),
    ];
    if records.len() > 1 {
        let hash = |s: &Summary| {
            let hash = s.state_hash.as_deref().unwrap_or("–");
            hash.chars().take(12).collect()
        };
        figures.insert(0, of("Scene", &|s| s.scene.clone()));
        figures.push(of("State hash, first digits", &hash));
    }
    figures
}

fn parts(record: &Record) -> Vec<Part> {
    let Some(summary) = &record.summary else {
        return Vec::new();
    };
    let words = [
        ("mpm", "Continuum (MPM)"),
        ("dem", "Bodies (DEM)"),
        ("coupler", "Coupler"),
    ];
    let spent = &summary.spent;
    let whole = spent
        .wall_by_part
        .values()
        .map(|p| p.compute + p.exchange + p.wait)
        .fold(spent.wall_s, f64::max);
    let known = words.into_iter().filter_map(|(key, name)| {
        let parts = spent.wall_by_part.get(key)?;
        let share = |time: f64| format!("{:.2}", 100.0 * time / whole.max(f64::MIN_POSITIVE));
        let cpu = spent.cpu_s.get(key).copied();
        Some(Part {
            name,
            compute: duration(parts.compute),
            exchange: duration(parts.exchange),
            wait: duration(parts.wait),
            cpu: cpu.map_or("–".to_owned(), duration),
            shares: [
                ("compute", share(parts.compute)),
                ("exchange", share(parts.exchange)),
                ("wait", share(parts.wait)),
            ],
        })
    });
    known.collect()
}

fn log_title(log: &[Line]) -> String {
    let of = |level: &str| log.iter().filter(|line| line.level == level).count();
    let counted = |n: usize, word: &str| match n {
        1 => format!("1 {word}"),
        n => format!("{} {word}s", count(n as u64)),
    };
    let mut words = vec![counted(log.len(), "line")];
    for (level, word) in [("ERROR", "error"), ("WARN", "warning")] {
        if of(level) > 0 {
            words.push(counted(of(level), word));
        }
    }
    words.join(", ")
}

fn left_out(record: &Record) -> Vec<LeftOut> {
    let scene = record.scene.as_ref();
    scene.map_or(Vec::new(), plan::left_out)
}

/// The text of the scene, and what is left out of it.
fn scene(record: &Record) -> (&str, Option<String>) {
    let Some(text) = &record.scene_text else {
        return (
            "",
            Some("There is no scene.toml in the run directory.".to_owned()),
        );
    };
    if text.len() <= SCENE {
        return (text, None);
    }
    let end = (0..=SCENE).rev().find(|&end| text.is_char_boundary(end));
    let note = format!(
        "The first {} of {} are shown; scene.toml has all of it.",
        Bytes(SCENE as u64),
        Bytes(text.len() as u64)
    );
    (&text[..end.unwrap_or(0)], Some(note))
}

/// Where and how it was run, by names: from the log, which says it since there are reports.
fn details(record: &Record) -> Vec<(&'static str, String)> {
    let mut details = Vec::new();
    let mut add = |name, value: Option<String>| {
        let value = value.filter(|value| !value.is_empty());
        details.extend(value.map(|value| (name, value)));
    };
    let begun = record.log.iter().filter(|line| line.message() == "begins");
    let mut of_log: Vec<&Line> = begun.collect();
    let resumed = of_log.len().saturating_sub(1);
    of_log.reverse();
    let last = of_log.first();
    let value = |name: &str| last.and_then(|line| line.value(name));
    add("Command", value("command"));
    add("Tandem", value("version"));
    add("Processor", value("processor"));
    add("Cores", value("cores"));
    let kilobytes = value("memory").and_then(|text| text.split(' ').next()?.parse::<u64>().ok());
    add("Memory", kilobytes.map(|kb| Bytes(1024 * kb).to_string()));
    add("System", value("system"));
    if resumed > 0 {
        add(
            "Resumed",
            Some(format!("{resumed} times; what stands above is of the last")),
        );
    }
    for line in record.log.iter().filter(|line| line.message() == "joined") {
        let name = match line.value("party").as_deref() {
            Some("mpm") => "Continuum solver",
            Some("dem") => "Solver of the bodies",
            _ => continue,
        };
        if of_log.len() <= 1 {
            add(name, line.value("identity"));
        }
    }
    add(
        "Begun",
        record.log.first().map(|line| line.timestamp.clone()),
    );
    let end = record.log.last().filter(|line| line.message() == "ends");
    add("Ended", end.map(|line| line.timestamp.clone()));
    if let Some(summary) = &record.summary {
        add("State hash", summary.state_hash.clone());
        add("Scene hash", Some(summary.scene_hash.clone()));
        add("Grants of steps", Some(count(summary.grants)));
        add("Intervals of equal steps", Some(count(summary.epochs)));
        add("Most points near bodies", Some(count(summary.imps_max)));
    }
    add("Run directory", Some(record.path.display().to_string()));
    details
}
