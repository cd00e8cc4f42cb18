//! Where log events go: `log.jsonl` in the run directory, and standard error as text or JSON.

use std::io::IsTerminal;
use std::sync::{Arc, OnceLock};

use coupler::record::background::LogFile;
use tracing::Level;
use tracing_subscriber::filter::Targets;
use tracing_subscriber::fmt::layer;
use tracing_subscriber::layer::SubscriberExt;
use tracing_subscriber::util::SubscriberInitExt;
use tracing_subscriber::{Layer, registry};

use crate::cli::LogFormat;
use crate::terminal::screen;

/// iceoryx2 warns about connections that are being closed in order; only its errors are news.
fn ours(level: Level) -> Targets {
    let crates = [
        "tandem",
        "coupler",
        "study",
        "interface",
        "mpm_proc",
        "dem_proc",
    ];
    crates
        .into_iter()
        .fold(Targets::new().with_default(Level::ERROR), |t, name| {
            t.with_target(name, level)
        })
}

/// The log of the run of this process.
static LOG: OnceLock<LogFile> = OnceLock::new();

/// Waits until every line of the log so far is in its file.
pub fn sync() {
    if let Some(log) = LOG.get() {
        log.sync();
    }
}

/// Logs a run.
pub fn of_run(log: &LogFile, format: LogFormat) {
    let _ = LOG.set(log.clone());
    let to_file = layer()
        .json()
        .with_writer(Arc::new(log.clone()))
        .with_filter(ours(Level::DEBUG));
    let stderr = layer()
        .with_writer(Arc::new(screen().clone()))
        .with_ansi(std::io::stderr().is_terminal());
    let to_stderr = match format {
        LogFormat::Json => stderr.json().with_filter(ours(Level::INFO)).boxed(),
        LogFormat::Text => stderr
            .compact()
            .without_time()
            .with_level(false)
            .with_target(false)
            .with_filter(ours(Level::INFO))
            .boxed(),
    };
    registry().with(to_file).with(to_stderr).init();
}

/// Logs a study: what its runs do, to standard error.
pub fn of_study() {
    let stderr = layer()
        .with_writer(std::io::stderr)
        .with_ansi(false)
        .compact()
        .without_time()
        .with_level(false)
        .with_target(false);
    registry()
        .with(stderr.with_filter(ours(Level::INFO)))
        .init();
}

/// Logs a solver process: errors only, to standard error. What matters it says to the coupler.
pub fn of_solver() {
    registry()
        .with(
            layer()
                .with_writer(std::io::stderr)
                .with_filter(ours(Level::ERROR)),
        )
        .init();
}
