//! What both sides are asked in the same way.

use interface::control::PROTOCOL;

use crate::bench::Bench;
use crate::verdict::{Judgement, broken, require};

/// S-2: Hello comes first, of the party of its channels.
pub fn hello(bench: &Bench) -> Judgement {
    let hello = bench.session()?.hello()?;
    let party = bench.subject.party;
    require(hello.party == party, party, hello.party)?;
    Ok(format!("`{}`", hello.identity))
}

/// V-1: the major version.
pub fn version(bench: &Bench) -> Judgement {
    let (major, minor) = bench.session()?.hello()?.protocol;
    require(major == PROTOCOL.0, PROTOCOL.0, major)?;
    Ok(format!("{major}.{minor}"))
}

/// O-1: the process that was started is the one that joins.
pub fn pid(bench: &Bench) -> Judgement {
    let mut session = bench.session()?;
    let said = session.hello()?.pid;
    match session.pid() {
        Some(pid) if pid == said => Ok(format!("pid {pid}")),
        pid => Err(broken(format_args!("pid {pid:?}"), said)),
    }
}
