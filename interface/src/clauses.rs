//! One row for each clause of PROTOCOL.md: how binding it is, what it says, whom it binds, and who checks it.
//!
//! PROTOCOL.md has the full text. Its table of section 13 is generated from these rows (`tests/clauses.rs`). The cases
//! of the kit and the errors of the built-in parties refer to the ids.

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
    /// The continuum. As a checker: the driver of every continuum in Rust, when it receives a message.
    Mpm,
    /// The bodies, in the same sense.
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
    /// Who checks it; empty for a clause that no program checks.
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

/// All clauses, in the order of the sections of PROTOCOL.md.
#[rustfmt::skip] // One row is one line, as in the table that is generated.
pub const CLAUSES: &[Clause] = &[
    row("O-1", Must, SOLVERS, "A run has an id. A solver is started as COMMAND --join ID, and the process that is started lives until the session ends", &[Coupler, Kit]),
    row("O-2", Must, COUPLER, "The run's directory is T/tandem-ID, mode 0700", &[]),
    row("O-3", Must, ALL, "iceoryx2 is configured in code: prefix, root path, no cleaning, no signal handling", &[]),
    row("O-4", Must, ALL, "The coupler holds a lock for as long as it lives. A party that can take the lock knows that the coupler is gone, and releases it at once", &[Coupler, Mpm, Dem]),
    row("O-5", Must, ALL, "The coupler creates every channel and the file `wakes`; a solver creates none", &[]),
    row("O-6", Must, ALL, "The coupler removes the run's files; a solver removes nothing", &[Kit]),
    row("O-7", Must, COUPLER, "The process ids of the parties are in the run's directory", &[]),
    row("O-8", Should, SOLVERS, "A solver locks a file of its own in the run's directory before it makes anything in shared memory, until it has closed its ports", &[Kit]),
    row("C-1", Must, ALL, "Quality of service of every channel; a solver asks for these numbers as minimum values", &[Transport, Kit]),
    row("C-2", Must, ALL, "Type names, sizes and alignments of records and header", &[Transport]),
    row("C-3", Must, ALL, "Every channel carries the hash of the layout lines as an attribute, and a solver requires that attribute", &[Transport]),
    row("C-4", Must, ALL, "StepHeader.count is the number of records", &[Mpm, Dem, Kit]),
    row("C-5", Must, ALL, "A receiver copies a payload before it checks the payload", &[]),
    row("C-6", Must, SOLVERS, "Notices fit the first segment of their publisher", &[]),
    row("C-7", Must, ALL, "A sender does not wait for ever for room in a channel", &[Coupler, Mpm, Dem]),
    row("B-1", Must, ALL, "A counter in `wakes` has one party that counts and one that blocks on it", &[]),
    row("B-2", Should, ALL, "A sender wakes the receiver after each message that it waits for", &[Kit]),
    row("B-3", Must, ALL, "A receiver finds a message even if nobody woke it", &[Kit]),
    row("S-1", Must, ALL, "A control message decodes and uses all its bytes", &[Coupler, Mpm, Dem, Kit]),
    row("S-2", Must, SOLVERS, "Notices come in order: Hello, Ready or Refused, Bye; Failed is the last", &[Coupler, Kit]),
    row("S-3", Must, COUPLER, "Orders come in order: Configure, Drain, Close; Abort at any time", &[Mpm, Dem, Kit]),
    row("S-4", Must, COUPLER, "The first order is Configure, or Abort", &[Mpm, Dem, Kit]),
    row("S-5", Must, COUPLER, "The configuration parses: no field is unknown or missing", &[Mpm, Dem, Kit]),
    row("S-6", Must, SOLVERS, "Ready repeats the scene hash, and its numbers are finite and not negative", &[Coupler, Kit]),
    row("S-7", Must, SOLVERS, "A solver opens its own channels to and from the coupler before Hello, and all other channels before Ready", &[Kit]),
    row("S-8", Must, SOLVERS, "A solver that does not take a configuration refuses it by key, and nothing that it did before Ready outlasts it", &[Kit]),
    row("S-9", Must, SOLVERS, "Abort ends the session; the solver sends no further message", &[Kit]),
    row("S-10", Must, SOLVERS, "A solver that cannot go on sends Failed with step, fault and message, then ends", &[Kit]),
    row("S-11", Must, ALL, "Every wait has a deadline, and its error names who was silent, what was expected and in which step", &[Coupler, Mpm, Dem, Kit]),
    row("S-12", Must, ALL, "A party that waits checks whether the others are alive", &[Coupler, Mpm, Dem, Kit]),
    row("M-1", Must, ALL, "A message is at most 256 MiB; a length that does not fit is refused", &[Coupler, Mpm, Dem, Kit]),
    row("W-1", Must, ALL, "Numbers in records are finite, and not negative where a negative number has no meaning", &[Coupler, Mpm, Dem]),
    row("W-2", Must, ALL, "Reserved and unused fields are 0 and are not read", &[Kit]),
    row("T-1", Must, SOLVERS, "Bodies and points move by exactly this leapfrog, with the step that is granted", &[Kit]),
    row("T-2", Must, SOLVERS, "The first kick is half a step", &[Kit]),
    row("T-3", Must, SOLVERS, "The opening step moves nothing and leaves no trace in the state", &[Kit]),
    row("T-4", Must, SOLVERS, "The closing step brings the velocities to the time of the positions", &[Kit]),
    row("T-5", Must, SOLVERS, "Quantities of velocities are centred in time", &[Kit]),
    row("T-6", Must, SOLVERS, "Results do not depend on the window, the time of day or earlier runs; they should not depend on the number of threads", &[Kit]),
    row("G-1", Must, COUPLER, "A grant message holds one Grant", &[Mpm, Dem, Kit]),
    row("G-2", Must, COUPLER, "The numbers of a grant are finite", &[Mpm, Dem, Kit]),
    row("G-3", Must, COUPLER, "A grant begins with the solver's next step and has at least one step", &[Mpm, Dem, Kit]),
    row("G-4", Must, COUPLER, "All solvers get the same grant, except for the budgets and for CHECKPOINT", &[]),
    row("G-5", Must, COUPLER, "The next grant is sent after all reports have arrived", &[]),
    row("G-6", Must, COUPLER, "Epochs count from 1; the step length is constant within an epoch", &[]),
    row("G-7", Must, COUPLER, "dt is 0 only in opening and closing steps", &[]),
    row("G-8", Must, COUPLER, "Only the first grant of an epoch measures, and only a grant that measures has a frame", &[]),
    row("G-9", Must, SOLVERS, "Each message of a step is sent once, even if it has no records", &[Kit]),
    row("G-10", Should, SOLVERS, "A side answers at once, without sleeping first", &[Kit]),
    row("H-1", Must, MPM, "mpm stops before a step that its limits do not allow, and sends HALT_BEFORE", &[Kit]),
    row("H-2", Must, DEM, "dem sends HALT_AFTER if its limits are not allowed; both sides stop after that step", &[Kit]),
    row("H-3", Must, MPM, "If both halts apply, HALT_AFTER is used", &[Kit]),
    row("H-4", Must, SOLVERS, "An uncoupled side halts by itself", &[Kit]),
    row("H-5", Must, SOLVERS, "A halt changes no result, except through the step length that is chosen next", &[Kit]),
    row("R-1", Must, SOLVERS, "One report for each grant, with the epoch of the grant; it reaches the end of the grant or a halt", &[Coupler, Kit]),
    row("R-2", Must, SOLVERS, "The numbers of a report are finite", &[Coupler, Kit]),
    row("R-3", Must, SOLVERS, "A side measures when it is asked to, and only then: one record for each group or body, of the measured step", &[Coupler, Kit]),
    row("R-4", Must, SOLVERS, "Both sides report the same next step", &[Coupler]),
    row("R-5", Must, MPM, "With FRAME, mpm sends all points before the report, in their state before the window", &[Coupler, Kit]),
    row("R-6", Must, DEM, "With FRAME, a dem with the capability `contacts` sends all contacts before the report: who touch, where, force", &[Coupler, Kit]),
    row("E-1", Must, DEM, "dem answers WANT_ENVELOPES with all outlines at t_n, then waits for the states of the same step", &[Kit]),
    row("E-2", Must, DEM, "Envelopes belong to the step that asked for them, and their number is the announced one", &[Mpm, Kit]),
    row("E-3", Must, DEM, "The numbers of envelopes are finite", &[Mpm, Kit]),
    row("E-4", Must, DEM, "Outlines come in the order of the bodies, with one reach for each body; no part of a body is outside its outline and reach", &[Kit]),
    row("I-1", Must, MPM, "States belong to the step and epoch that dem is at", &[Dem, Kit]),
    row("I-2", Must, MPM, "A set comes before the states that announce it: count, generation, ids rising, radius and mass above 0, links within the set", &[Dem, Kit]),
    row("I-3", Must, MPM, "States have the generation and size of the present set, and finite numbers", &[Dem, Kit]),
    row("I-4", Must, MPM, "No states follow HALT_BEFORE", &[]),
    row("I-5", Must, MPM, "After WANT_ENVELOPES no states follow before the envelopes", &[]),
    row("I-6", Must, MPM, "mpm chooses a new set before the motion of points or bodies has used up the skin", &[Kit]),
    row("I-7", Must, MPM, "The set is all points within reach + radius + skin of an outline, and all points inside one", &[Kit]),
    row("I-8", Must, MPM, "Generations rise by 1 with each set", &[Kit]),
    row("I-9", Must, SOLVERS, "Record i of states and forces is record i of the set", &[Kit]),
    row("I-10", Must, DEM, "Contact history belongs to point id and body, and survives a new set", &[Kit]),
    row("F-1", Must, MPM, "mpm uses the forces of a step in that step, once", &[Mpm, Kit]),
    row("F-2", Must, DEM, "Forces belong to the step and epoch that mpm is at", &[Mpm, Kit]),
    row("F-3", Must, DEM, "Forces have the generation and size of the present set", &[Mpm, Kit]),
    row("F-4", Must, DEM, "Forces and travel are finite", &[Mpm, Kit]),
    row("F-5", Must, DEM, "Stiffness is not negative, and above 0 where the force is not zero", &[Mpm, Kit]),
    row("F-6", Must, DEM, "Stiffness is the sum over the bodies within reach of the point", &[Kit]),
    row("F-7", Must, DEM, "The force is the force on the point, from the positions of this step; bodies take the negative", &[Kit]),
    row("F-8", Must, DEM, "No contact, no force", &[Kit]),
    row("F-9", Must, DEM, "travel is an upper bound of how far any body surface will have moved", &[Kit]),
    row("L-1", Must, SOLVERS, "Limits are finite and not negative", &[Mpm, Dem, Coupler, Kit]),
    row("L-2", Must, SOLVERS, "Limits are upper bounds for the next step", &[Kit]),
    row("L-3", Must, ALL, "The condition under which a grant allows limits", &[Kit]),
    row("L-4", Must, SOLVERS, "A side applies L-3 to its own limits after every step", &[Kit]),
    row("L-5", Must, SOLVERS, "After the last step of a window no side halts", &[Kit]),
    row("L-6", Must, COUPLER, "The coupler lengthens the step by at most 10 % from one step to the next", &[]),
    row("N-1", Must, SOLVERS, "Total energy, and total momentum less impulse, are conserved over both sides: each side books what it does", &[Kit]),
    row("D-1", Must, MPM, "On Drain mpm sends all points before Bye", &[Coupler, Kit]),
    row("D-2", Must, SOLVERS, "After Bye a solver stays alive until Close", &[Kit]),
    row("J-1", Must, SOLVERS, "A solver uses every field or refuses its value; it should refuse unknown fields", &[Kit]),
    row("K-1", Must, SOLVERS, "Hello lists capabilities: optional parts of the session, and the members of each family that the solver takes", &[Kit]),
    row("K-2", Must, COUPLER, "A scene that needs a capability which a solver lacks is refused before Configure, with line and key in the scene", &[Coupler]),
    row("K-3", Must, SOLVERS, "With CHECKPOINT a side sends its state before the first step of the window, in pieces; the last piece has the hash of all others", &[Coupler]),
    row("K-4", Must, SOLVERS, "With Configure.restore a side takes its state in pieces, then sends Ready, and continues to the same bits", &[Coupler]),
    row("V-1", Must, SOLVERS, "A solver of another major version is refused after Hello", &[Coupler, Kit]),
    row("V-2", Must, ALL, "A solver of another minor version is accepted", &[Coupler]),
    row("V-3", Must, SOLVERS, "A solver learns of a version mismatch by C-3, S-1, S-5 or an Abort", &[]),
    row("V-4", Must, ALL, "All parties use the same minor version of iceoryx2", &[Transport]),
    row("X-1", Must, ALL, "A party that finds a broken clause ends the session and names who broke it, clause, step and numbers", &[Kit]),
    row("X-2", Must, SOLVERS, "Exit status of a solver: 0 after Close, 3 after a failure, 2 if it was not started with --join", &[Kit]),
    row("X-3", Must, SOLVERS, "A solver that waits notices within 10 ms that its coupler is gone", &[Kit]),
    row("X-4", Must, COUPLER, "The exit status of tandem run", &[]),
    row("X-5", Must, SOLVERS, "A solver does not end by itself on Ctrl-C", &[Kit]),
    row("X-6", Should, SOLVERS, "A solver's memory does not grow with the number of steps", &[Kit]),
];

/// The clause with the id `id`. `id` may also be a case of a clause: `F-7a` belongs to `F-7`.
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
