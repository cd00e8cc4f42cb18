//! Every clause of PROTOCOL.md, a row each: how binding it is, what it says in a line, whom it binds, who checks it.
//!
//! The prose is PROTOCOL.md's. Its table of section 13 is made of these rows (`tests/clauses.rs`), the kit's cases refer
//! to their ids, and so do the errors of the built-in parties.

use std::fmt::Write;

/// How binding a clause is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Level {
    /// *Shall*.
    Must,
    /// *Should*.
    Should,
}

/// Who is bound by a clause, or checks it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Who {
    /// The coupler.
    Coupler,
    /// The continuum; of checks, on receipt by the driver that every continuum in Rust has.
    Mpm,
    /// The bodies, likewise.
    Dem,
    /// iceoryx2, when a channel is opened.
    Transport,
    /// The conformance kit, from outside.
    Kit,
}

/// A clause.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Clause {
    /// As in PROTOCOL.md: `F-7`.
    pub id: &'static str,
    /// How binding it is.
    pub level: Level,
    /// What it says, in a line.
    pub text: &'static str,
    /// Whom it binds.
    pub binds: &'static [Who],
    /// Who checks it; nobody: it is kept by reading.
    pub checked_by: &'static [Who],
}

use Level::{Must, Should};
use Who::{Coupler, Dem, Kit, Mpm, Transport};

const SOLVERS: &[Who] = &[Mpm, Dem];
const ALL: &[Who] = &[Coupler, Mpm, Dem];
const COUPLER: &[Who] = &[Coupler];
const MPM: &[Who] = &[Mpm];
const DEM: &[Who] = &[Dem];

const fn row(
    id: &'static str,
    level: Level,
    binds: &'static [Who],
    text: &'static str,
    checked_by: &'static [Who],
) -> Clause {
    Clause {
        id,
        level,
        text,
        binds,
        checked_by,
    }
}

/// All of them, in the order of PROTOCOL.md's sections.
#[rustfmt::skip] // A row is a line, as in the table that is made of it.
pub const CLAUSES: &[Clause] = &[
    row("O-1", Must, SOLVERS, "A run has an id; a solver is started as COMMAND --join ID, and the process that is started lives until the end", &[Coupler, Kit]),
    row("O-2", Must, COUPLER, "The run's directory is T/tandem-ID, mode 0700", &[]),
    row("O-3", Must, ALL, "iceoryx2 is configured in code: prefix, root path, no cleaning, no signal handling", &[]),
    row("O-4", Must, ALL, "The coupler holds a lock for as long as it lives; who can take it looks at a dead run, and releases it at once", &[Coupler, Mpm, Dem]),
    row("O-5", Must, ALL, "The coupler creates every channel and bell; a solver creates none", &[]),
    row("O-6", Must, ALL, "The coupler removes the run's files; a solver removes nothing", &[Kit]),
    row("O-7", Must, COUPLER, "The process ids of the parties are in the run's directory", &[]),
    row("C-1", Must, ALL, "Quality of service of every channel; a solver asks for these numbers as the least", &[Transport, Kit]),
    row("C-2", Must, ALL, "Type names, sizes and alignments of records and header", &[Transport]),
    row("C-3", Must, ALL, "Channels have the hash of the layout lines as an attribute, which a solver requires", &[Transport]),
    row("C-4", Must, ALL, "StepHeader.count is the number of records", &[Mpm, Dem, Kit]),
    row("C-5", Must, ALL, "A receiver copies a payload before it checks it", &[]),
    row("C-6", Must, SOLVERS, "Notices fit the segment that their publisher begins with", &[]),
    row("C-7", Must, ALL, "A sender does not wait for room for ever", &[Coupler, Mpm, Dem]),
    row("B-1", Must, ALL, "A bell has one notifier and one listener", &[Transport]),
    row("B-2", Should, ALL, "A sender rings after what another one waits for", &[Kit]),
    row("B-3", Must, ALL, "A receiver finds a message though no bell rang", &[Kit]),
    row("B-4", Must, SOLVERS, "A solver that polls looks for 50 us after its last message before it sleeps", &[Kit]),
    row("S-1", Must, ALL, "A control message decodes, with all its bytes", &[Coupler, Mpm, Dem, Kit]),
    row("S-2", Must, SOLVERS, "Notices come in order: Hello, Ready or Refused, Bye; Failed is the last", &[Coupler, Kit]),
    row("S-3", Must, COUPLER, "Orders come in order: Configure, Drain, Close; Abort at any time", &[Mpm, Dem, Kit]),
    row("S-4", Must, COUPLER, "The first order is Configure, or Abort", &[Mpm, Dem, Kit]),
    row("S-5", Must, COUPLER, "The configuration parses: no unknown field, none missing but those with a default", &[Mpm, Dem, Kit]),
    row("S-6", Must, SOLVERS, "Ready repeats the scene hash, and its numbers are finite and not negative", &[Coupler, Kit]),
    row("S-7", Must, SOLVERS, "A solver opens its line before Hello and all channels before Ready", &[Kit]),
    row("S-8", Must, SOLVERS, "A solver refuses what it does not take, by its key, and nothing outlasts it before Ready", &[Kit]),
    row("S-9", Must, SOLVERS, "Abort ends the session, without another message", &[Kit]),
    row("S-10", Must, SOLVERS, "A solver that cannot go on says Failed with step, fault and message, then ends", &[Kit]),
    row("S-11", Must, ALL, "Every wait has a deadline and names who, what and which step", &[Coupler, Mpm, Dem, Kit]),
    row("S-12", Must, ALL, "Who waits looks whether the others live", &[Coupler, Mpm, Dem, Kit]),
    row("M-1", Must, ALL, "A message is at most 256 MiB; a length that does not fit is refused", &[Coupler, Mpm, Dem, Kit]),
    row("W-1", Must, ALL, "Numbers of records are finite, and not negative where they cannot be", &[Coupler, Mpm, Dem]),
    row("W-2", Must, ALL, "Reserved and unused fields are 0 and not looked at", &[Kit]),
    row("T-1", Must, SOLVERS, "Bodies and points move by exactly this leapfrog with the step that is granted", &[Kit]),
    row("T-2", Must, SOLVERS, "The first kick is half a step", &[Kit]),
    row("T-3", Must, SOLVERS, "The opening step moves nothing and leaves no trace", &[Kit]),
    row("T-4", Must, SOLVERS, "The closing step brings velocities to the time of positions", &[Kit]),
    row("T-5", Must, SOLVERS, "Quantities of velocities are centred", &[Kit]),
    row("T-6", Must, SOLVERS, "Results do not depend on window, time of day or earlier runs; they should not on threads", &[Kit]),
    row("G-1", Must, COUPLER, "A grant message holds one Grant", &[Mpm, Dem, Kit]),
    row("G-2", Must, COUPLER, "Its numbers are finite", &[Mpm, Dem, Kit]),
    row("G-3", Must, COUPLER, "It begins with the solver's next step and has at least one", &[Mpm, Dem, Kit]),
    row("G-4", Must, COUPLER, "All solvers get the same grant but for the budgets", &[]),
    row("G-5", Must, COUPLER, "The next grant comes when all reports have come", &[]),
    row("G-6", Must, COUPLER, "Epochs count from 1; within one the step stays", &[]),
    row("G-7", Must, COUPLER, "dt is 0 in opening and closing steps only", &[]),
    row("G-8", Must, COUPLER, "Only an epoch's first grant measures, and only one that measures has a frame", &[]),
    row("G-9", Must, SOLVERS, "Each message of a step is sent once, also without records", &[Kit]),
    row("G-10", Should, SOLVERS, "A side answers at once, without a nap", &[Kit]),
    row("H-1", Must, MPM, "mpm stops before a step that its limits do not allow, and says HALT_BEFORE", &[Kit]),
    row("H-2", Must, DEM, "dem says HALT_AFTER where its limits are not allowed; both stop after that step", &[Kit]),
    row("H-3", Must, MPM, "If both apply, HALT_AFTER holds", &[Kit]),
    row("H-4", Must, SOLVERS, "An uncoupled side halts by itself", &[Kit]),
    row("H-5", Must, SOLVERS, "A halt changes no result but by the step that is then chosen", &[Kit]),
    row("R-1", Must, SOLVERS, "One report for each grant, of its epoch, up to its end or to a halt", &[Coupler, Kit]),
    row("R-2", Must, SOLVERS, "Its numbers are finite", &[Coupler, Kit]),
    row("R-3", Must, SOLVERS, "A side measures when it is asked, and only then: a record a group or body, of the measured step", &[Coupler, Kit]),
    row("R-4", Must, SOLVERS, "Both sides report the same next step", &[Coupler]),
    row("R-5", Must, MPM, "With FRAME all points are sent before the report, as they are before the window", &[Coupler, Kit]),
    row("R-6", Must, DEM, "With FRAME a dem that has `contacts` sends the contacts of its bodies before the report: who, where, force", &[Coupler, Kit]),
    row("E-1", Must, DEM, "dem answers WANT_ENVELOPES with all outlines at t_n, then waits on", &[Kit]),
    row("E-2", Must, DEM, "Envelopes are of the step that asked, as many as announced", &[Mpm, Kit]),
    row("E-3", Must, DEM, "Their numbers are finite", &[Mpm, Kit]),
    row("E-4", Must, DEM, "Outlines in order of the bodies, one reach each; no part of a body is outside", &[Kit]),
    row("I-1", Must, MPM, "States are of the step and epoch that dem is at", &[Dem, Kit]),
    row("I-2", Must, MPM, "A set comes before the states that announce it: count, generation, ids rising, radius and mass above 0", &[Dem, Kit]),
    row("I-3", Must, MPM, "States have generation and number of the set, and finite numbers", &[Dem, Kit]),
    row("I-4", Must, MPM, "No states follow HALT_BEFORE", &[]),
    row("I-5", Must, MPM, "No states follow WANT_ENVELOPES before the envelopes", &[]),
    row("I-6", Must, MPM, "mpm chooses the set anew before points or bodies have used up the skin", &[Kit]),
    row("I-7", Must, MPM, "The set is all points within reach, radius and skin, and all inside", &[Kit]),
    row("I-8", Must, MPM, "Generations rise by 1 with each set", &[Kit]),
    row("I-9", Must, SOLVERS, "Record i of states and forces is record i of the set", &[Kit]),
    row("I-10", Must, DEM, "Contact history belongs to point id and body and survives a new set", &[Kit]),
    row("F-1", Must, MPM, "mpm uses the forces of a step in it, once", &[Mpm, Kit]),
    row("F-2", Must, DEM, "Forces are of the step and epoch that mpm is at", &[Mpm, Kit]),
    row("F-3", Must, DEM, "They have generation and number of the set", &[Mpm, Kit]),
    row("F-4", Must, DEM, "Their numbers and the travel are finite", &[Mpm, Kit]),
    row("F-5", Must, DEM, "Stiffness is not negative, and above 0 where the force is not zero", &[Mpm, Kit]),
    row("F-6", Must, DEM, "Stiffness is the sum of those of the bodies within reach", &[Kit]),
    row("F-7", Must, DEM, "The force is that on the point, of this step's positions; bodies take it negated", &[Kit]),
    row("F-8", Must, DEM, "No contact, no force", &[Kit]),
    row("F-9", Must, DEM, "travel bounds how far any surface will have gone", &[Kit]),
    row("L-1", Must, SOLVERS, "Limits are finite and not negative", &[Mpm, Dem, Coupler, Kit]),
    row("L-2", Must, SOLVERS, "Limits are upper bounds for the next step", &[Kit]),
    row("L-3", Must, ALL, "When a grant allows limits", &[Kit]),
    row("L-4", Must, SOLVERS, "A side applies L-3 to its own limits after every step", &[Kit]),
    row("L-5", Must, SOLVERS, "After the last step of a window no side halts", &[Kit]),
    row("L-6", Must, COUPLER, "The coupler lengthens the step by at most 10 % from one step to the next", &[]),
    row("N-1", Must, SOLVERS, "Energy and momentum less impulse of both sides are conserved: a side books what it does", &[Kit]),
    row("D-1", Must, MPM, "On Drain mpm sends all points before Bye", &[Coupler, Kit]),
    row("D-2", Must, SOLVERS, "After Bye a solver lives until Close", &[Kit]),
    row("J-1", Must, SOLVERS, "A solver uses every field, or refuses the value; it should refuse unknown fields", &[Kit]),
    row("J-2", Must, ALL, "A field that has its default is not sent; a receiver takes the default", &[Mpm, Dem]),
    row("K-1", Must, SOLVERS, "Hello names capabilities: verbs of the session, and members of families that the solver takes", &[Kit]),
    row("K-2", Must, COUPLER, "A scene that needs what a solver lacks is refused before Configure, with the scene's line and key", &[Coupler]),
    row("K-3", Must, SOLVERS, "With CHECKPOINT a side sends its state before the window's first step, in pieces, the last with the hash of all", &[Coupler]),
    row("K-4", Must, SOLVERS, "With Configure.restore a side takes its state in pieces, says Ready after it, and goes on to the same bits", &[Coupler]),
    row("V-1", Must, SOLVERS, "A solver of another major version is refused after Hello", &[Coupler, Kit]),
    row("V-2", Must, ALL, "A solver of another minor version is accepted", &[Coupler]),
    row("V-3", Must, SOLVERS, "A solver learns of a mismatch by C-3, S-1, S-5 or an Abort", &[]),
    row("V-4", Must, ALL, "All parties use the same minor version of iceoryx2", &[Transport]),
    row("X-1", Must, ALL, "Who finds a clause broken ends the session and names who, clause, step and numbers", &[Kit]),
    row("X-2", Must, SOLVERS, "Exit status of a solver: 0 after Close, 3 after a failure, 2 when it was not told to join", &[Kit]),
    row("X-3", Must, SOLVERS, "A solver that waits notices within a nap that its coupler is gone", &[Kit]),
    row("X-4", Must, COUPLER, "The exit status of tandem run", &[]),
    row("X-5", Must, SOLVERS, "A solver does not end by itself on Ctrl-C", &[Kit]),
    row("X-6", Should, SOLVERS, "A solver's memory does not grow with the number of steps", &[Kit]),
];

/// The clause with an id, or of which `id` is a case: `F-7a` is one of `F-7`.
pub fn of(id: &str) -> Option<&'static Clause> {
    let id = id.trim_end_matches(|letter: char| letter.is_ascii_lowercase());
    CLAUSES.iter().find(|clause| clause.id == id)
}

impl Level {
    /// Its name.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Must => "MUST",
            Self::Should => "SHOULD",
        }
    }
}

impl Who {
    /// Its name.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Coupler => "coupler",
            Self::Mpm => "mpm",
            Self::Dem => "dem",
            Self::Transport => "iceoryx2",
            Self::Kit => "kit",
        }
    }
}

/// The table of PROTOCOL.md's section 13.
pub fn table() -> String {
    let names = |all: &[Who]| -> String {
        let names: Vec<_> = all.iter().map(|who| who.name()).collect();
        names.join(", ")
    };
    let mut text =
        String::from("| clause | | binds | checked by | |\n| --- | --- | --- | --- | --- |\n");
    for clause in CLAUSES {
        let (binds, checked_by) = (names(clause.binds), names(clause.checked_by));
        let (id, level, says) = (clause.id, clause.level.name(), clause.text);
        let _ = writeln!(text, "| {id} | {level} | {binds} | {checked_by} | {says} |");
    }
    text
}
