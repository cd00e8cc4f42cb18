//! A solver as a program: the common code of the solver crates' binaries and the subcommands of `tandem`, and functions
//! to start such a program and to end it.

use std::io;
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::process::{Child, Command, ExitCode, ExitStatus, Stdio};
use std::sync::Arc;

use rustix::process::{Pid, Signal, kill_process_group};

use crate::hosted::Host;
use crate::message::control::Party;
use crate::processor;
use crate::session::{self, SessionError};
use crate::solver::{DemSolver, MpmSolver};
use crate::transport::domain::Domain;

/// Exit status if the session has failed; the coupler reports why.
const FAILED: u8 = 3;

/// Joins the run that the arguments name (`--join RUN`) as the continuum.
pub fn serve_mpm(solver: impl MpmSolver + 'static) -> ExitCode {
    serve(Host::Mpm(Box::new(solver)))
}

/// Joins the run that the arguments name (`--join RUN`) as the bodies.
pub fn serve_dem(solver: impl DemSolver + 'static) -> ExitCode {
    serve(Host::Dem(Box::new(solver)))
}

/// Joins the run `id` with `serve`, as a process does. Its exit status shows whether the session was closed in order.
pub fn join(id: &str, serve: impl FnOnce(&Domain) -> Result<(), SessionError>) -> ExitCode {
    if let Err(error) = leave_interrupts_to_the_coupler() {
        tracing::warn!("the handling of Ctrl-C could not be changed: {error}");
    }
    let domain = match Domain::join(id) {
        Ok(domain) => domain,
        Err(error) => {
            eprintln!("error: {error}");
            return ExitCode::from(FAILED);
        }
    };
    match serve(&domain) {
        Ok(()) => ExitCode::SUCCESS,
        // The coupler has received the error and reports it to the user.
        Err(error) => {
            tracing::debug!("{error}");
            ExitCode::from(FAILED)
        }
    }
}

/// Clause X-5. Ctrl-C at the terminal does not reach another process group, but `kill -INT` and some queues do.
fn leave_interrupts_to_the_coupler() -> io::Result<()> {
    signal_hook::flag::register(signal_hook::consts::SIGINT, Arc::default()).map(|_| ())
}

fn serve(solver: Host) -> ExitCode {
    processor::assert_checked();
    let words = std::env::args_os().skip(1);
    let words: Vec<String> = words.map(|w| w.to_string_lossy().into_owned()).collect();
    if let ["--join", id] = words.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        join(id, |domain| session::serve(domain, solver))
    } else {
        eprintln!("error: a solver is started by `tandem run`, or by hand with `--join RUN`");
        ExitCode::from(2)
    }
}

/// Environment variable of a solver that names the party as which it is started (O-1).
const STARTED_AS: &str = "TANDEM_PARTY";

/// The party as which the coupler started this process, if it says so (O-1).
pub fn started_as() -> Option<Party> {
    let name = std::env::var(STARTED_AS).ok()?;
    let solvers = [Party::Mpm, Party::Dem];
    solvers.into_iter().find(|party| party.name() == name)
}

/// Starts `command --join RUN` as the solver `party` (O-1): with closed standard input and in its own process group, so
/// that Ctrl-C at the terminal reaches only the coupler.
///
/// # Errors
/// Why it cannot be started.
pub fn start(
    command: &[String],
    party: Party,
    domain: &Domain,
    stderr: Stdio,
) -> io::Result<Child> {
    let [program, arguments @ ..] = command else {
        return Err(io::Error::new(
            io::ErrorKind::InvalidInput,
            "the command is empty",
        ));
    };
    let child = Command::new(program)
        .args(arguments)
        .args(["--join", domain.id()])
        .env(STARTED_AS, party.name())
        .stdin(Stdio::null())
        .stderr(stderr)
        .process_group(0)
        .spawn()?;
    domain.note_process(party, child.id());
    Ok(child)
}

/// Kills a solver and every process that it has started, which are in its process group.
pub fn kill(child: &mut Child) {
    let group = i32::try_from(child.id()).ok().and_then(Pid::from_raw);
    let ended = group.map(|group| kill_process_group(group, Signal::KILL));
    if !matches!(ended, Some(Ok(()))) {
        let _ = child.kill();
    }
}

/// How a process ended, in words.
pub fn describe(status: ExitStatus) -> String {
    match (status.code(), status.signal()) {
        (Some(code), _) => format!("ended with exit status {code}"),
        (None, Some(signal)) => format!("was killed by signal {signal}"),
        (None, None) => "ended".to_string(),
    }
}
