//! What `tandem plot` draws: its command line.

use std::path::{Path, PathBuf};

use clap::Args;
use clap::builder::{StringValueParser, TypedValueParser};
use mechanics::expression::{Expression, Meaning};

use crate::StudyError;

/// Something with a name in the legend.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Labelled {
    /// The name, if it was given one.
    pub label: Option<String>,
    /// The thing.
    pub what: String,
}

impl From<&str> for Labelled {
    /// Reads `LABEL=WHAT` or `WHAT`.
    fn from(argument: &str) -> Self {
        let (label, what) = match argument.split_once('=') {
            Some((label, what)) => (Some(label.trim().to_owned()), what),
            None => (None, argument),
        };
        Self {
            label,
            what: what.trim().to_owned(),
        }
    }
}

impl Labelled {
    /// A path that is there, which may hold a `=` as that of a run with `--set` does, or `LABEL=PATH`.
    fn path(argument: &str) -> Self {
        if Path::new(argument).exists() {
            let what = argument.to_owned();
            return Self { label: None, what };
        }
        argument.into()
    }

    pub(crate) fn name(&self) -> &str {
        self.label.as_deref().unwrap_or(&self.what)
    }
}

/// Which frames.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Which {
    /// All that the run has.
    All,
    /// That of this time in s.
    At(f64),
}

pub(crate) fn which(text: &str) -> Result<Which, String> {
    match text.trim() {
        "all" => Ok(Which::All),
        time => time
            .parse()
            .map(Which::At)
            .map_err(|e| format!("{time}: {e}; expected times in s or `all`")),
    }
}

/// What is drawn.
#[expect(
    clippy::struct_excessive_bools,
    reason = "each is an option of its own"
)]
#[derive(Debug, Args)]
pub struct PlotOptions {
    /// Run directories, whose history.csv or frames are read, and CSV files; each may have a label for the legend.
    #[arg(required = true, value_name = "[LABEL=]DATA", value_parser = StringValueParser::new().map(|text| Labelled::path(&text)))]
    pub data: Vec<Labelled>,
    /// Figure to write; with frames also a film (.gif).
    #[arg(long, alias = "output", value_name = "FILE.svg|.png")]
    pub out: PathBuf,
    /// Expression of columns; may be repeated.
    #[arg(
        long,
        required_unless_present = "frames",
        value_name = "[LABEL=]EXPRESSION",
        allow_hyphen_values = true
    )]
    pub y: Vec<Labelled>,
    /// Draw pictures of the frames at these times in s, or of all frames.
    #[arg(long, value_name = "TIME,...|all", value_delimiter = ',', value_parser = which, conflicts_with = "y")]
    pub frames: Vec<Which>,
    /// Quantity that colours the points: an expression of `x y vx vy speed stress_xx stress_yy stress_zz stress_xy
    /// pressure shear volume mass density group id`, and of `plastic_strain` if a material of the run keeps it. Points
    /// without a number are grey.
    #[arg(
        long,
        value_name = "[LABEL=]EXPRESSION",
        default_value = "speed",
        visible_alias = "color",
        requires = "frames",
        allow_hyphen_values = true
    )]
    pub colour: Labelled,
    /// Values of the first and the last colour; by default the smallest and the largest value of the points.
    #[arg(long, value_name = "LOW,HIGH", value_parser = numbers::<2>, requires = "frames", allow_hyphen_values = true)]
    pub clim: Option<[f64; 2]>,
    /// Also draw contact forces, as lines from centre to centre whose width is proportional to the force.
    #[arg(long, requires = "frames")]
    pub forces: bool,
    /// Pictures per second of a film.
    #[arg(long, value_name = "N", default_value_t = 10.0, requires = "frames")]
    pub rate: f64,
    /// Pictures in a row; more make each smaller. By default 2, and 1 of a single picture or a film.
    #[arg(long, value_name = "N", requires = "frames")]
    pub columns: Option<usize>,
    /// Expression of columns for the horizontal axis.
    #[arg(
        long,
        value_name = "EXPRESSION",
        default_value = "time",
        allow_hyphen_values = true
    )]
    pub x: String,
    /// Expected curve, as an expression of `x`; drawn dashed; may be repeated.
    #[arg(long, value_name = "[LABEL=]EXPRESSION", allow_hyphen_values = true)]
    pub expected: Vec<Labelled>,
    /// Column whose values distinguish curves: one curve for each value.
    #[arg(long, value_name = "COLUMN")]
    pub by: Option<String>,
    /// Draw the slope of y over x instead, as a difference quotient over this width.
    #[arg(long, value_name = "WIDTH")]
    pub slope: Option<f64>,
    /// First and last x of the axis, in m with frames; either may be left out: `,0.5`.
    #[arg(long, value_name = "LEFT,RIGHT", value_parser = ends, allow_hyphen_values = true)]
    pub xlim: Option<Ends>,
    /// First and last y of the axis, in the same way.
    #[arg(long, value_name = "BOTTOM,TOP", value_parser = ends, allow_hyphen_values = true)]
    pub ylim: Option<Ends>,
    /// A logarithmic x axis.
    #[arg(long, conflicts_with = "frames")]
    pub xlog: bool,
    /// A logarithmic y axis.
    #[arg(long, conflicts_with = "frames")]
    pub ylog: bool,
    /// Dots instead of lines.
    #[arg(long)]
    pub dots: bool,
    /// Title; of curves the name of the file by default.
    #[arg(long)]
    pub title: Option<String>,
    /// Label of the x axis; the expression and its unit by default.
    #[arg(long, value_name = "TEXT", conflicts_with = "frames")]
    pub xlabel: Option<String>,
    /// Label of the y axis; the expression and its unit by default.
    #[arg(long, value_name = "TEXT", conflicts_with = "frames")]
    pub ylabel: Option<String>,
}

/// The first and the last number of an axis, if they are given.
pub(crate) type Ends = [Option<f64>; 2];

fn ends(text: &str) -> Result<Ends, String> {
    let (low, high) = text
        .split_once(',')
        .ok_or("expected LOW,HIGH, of which one may be left out")?;
    let end = |text: &str| match text.trim() {
        "" => Ok(None),
        number => number
            .parse()
            .map(Some)
            .map_err(|e| format!("{number}: {e}")),
    };
    match [end(low)?, end(high)?] {
        [Some(low), Some(high)] if low >= high => Err("LOW is not below HIGH".to_owned()),
        ends => Ok(ends),
    }
}

/// Reads numbers with commas between them.
pub(crate) fn numbers<const N: usize>(text: &str) -> Result<[f64; N], String> {
    let all: Result<Vec<f64>, _> = text.split(',').map(|n| n.trim().parse()).collect();
    let all = all.map_err(|e| format!("{e}"))?;
    let count = all.len();
    all.try_into()
        .map_err(|_| format!("{count} numbers, expected {N} with commas between them"))
}

/// An expression of names that mean something; `help` says which.
pub(crate) fn compile(
    text: &str,
    meaning: &dyn Fn(&str) -> Option<Meaning>,
    help: &str,
) -> Result<Expression, StudyError> {
    Expression::compile(text, meaning)
        .map_err(|error| StudyError::usage(format!("`{text}`: {}", error.message), help))
}

impl PlotOptions {
    /// First and last x and y, where they are given.
    pub(crate) fn limits(&self) -> [Ends; 2] {
        [self.xlim, self.ylim].map(Option::unwrap_or_default)
    }
}
