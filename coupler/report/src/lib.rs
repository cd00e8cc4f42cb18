//! `tandem report`: a run, or several beside one another, as one page for a browser. The page has all that it needs in itself.
//!
//! | room | what is in it |
//! | --- | --- |
//! | [`record`], [`so_far`] | what a run has left in its directory, read as far as it can be |
//! | [`motion`], [`field`] | its frames, and what colours can say of them |
//! | [`thin`], [`pack`] | as much of that as a page has room for, in few bytes |
//! | [`chart`], [`verdict`], [`words`] | curves, checks and numbers as people read them |
//! | [`page`] | all of it in the template; `templates/` has it, the script and the style |
//! | [`live`] | the page of a run that goes on |
//!
//! This crate reads what a run has left and knows the coupler for the words of its files. It computes no physics.
#![forbid(unsafe_code)]
#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

pub mod chart;
mod error;
pub mod field;
pub mod live;
pub mod motion;
pub mod pack;
pub mod page;
pub mod record;
mod so_far;
pub mod thin;
pub mod verdict;
pub mod words;

use std::path::{Path, PathBuf};

use coupler::record::{fail, rundir::REPORT};
use interface::files;

use record::Record;

pub use error::ReportError;

/// A page that was written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Written {
    /// Where it is.
    pub path: PathBuf,
    /// Its size in bytes.
    pub bytes: u64,
}

/// Makes the page of these runs, at least one, and writes it to `out`, or into the first run's directory. A reader sees the
/// old page or the new one, never half of either.
///
/// # Errors
/// [`ReportError`]; nothing is written then.
pub fn write(runs: &[PathBuf], out: Option<&Path>) -> Result<Written, ReportError> {
    let records: Vec<Record> = runs
        .iter()
        .map(|run| Record::read(run))
        .collect::<Result<_, _>>()?;
    let html = page::page(&records, None);
    let path = out.map_or_else(|| runs[0].join(REPORT), Path::to_path_buf);
    let written = match out {
        Some(out) => files::write_named(out, &html),
        None => files::replace(&runs[0], REPORT, html.as_bytes(), false),
    };
    written.map_err(fail("write", &path))?;
    Ok(Written {
        bytes: html.len() as u64,
        path,
    })
}
