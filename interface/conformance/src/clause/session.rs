//! What both sides are asked in the same way.

use interface::control::{Notice, Order, PROTOCOL};
use serde::Serialize;
use serde_json::Value;

use crate::bench::{Bench, HASH, Session, configure};
use crate::verdict::{Judgement, Unmet, broken, require};

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

/// S-6: the hash that came with a configuration.
pub fn hash(bench: &Bench, config: &impl Serialize) -> Judgement {
    let mut session = bench.session()?;
    session.hello()?;
    let ready = session.ready(&configure(config))?;
    require(ready.scene_hash == HASH, HASH, &ready.scene_hash)?;
    Ok(ready.scene_hash)
}

/// S-7: what is open at Hello, and at Ready for a configuration.
pub fn opened(bench: &Bench, config: &impl Serialize) -> Judgement {
    let mut session = bench.session()?;
    session.hello()?;
    let of_line = |name: &&str| {
        let line = ["orders", "notices", "grants", "reports", "coupler"];
        line.iter().any(|part| name.contains(part))
    };
    let unopened = session.stage.unopened();
    let missing: Vec<&str> = unopened.into_iter().filter(of_line).collect();
    let got = format_args!("closed: {missing:?}");
    require(missing.is_empty(), "its line open at Hello", got)?;
    session.ready(&configure(config))?;
    let missing = session.stage.unopened();
    let got = format_args!("closed: {missing:?}");
    require(missing.is_empty(), "all open at Ready", got)?;
    Ok("all open".into())
}

/// Waits for Failed or Refused in answer to what cannot be taken.
pub fn rejection(session: &mut Session) -> Judgement {
    match session.notice()? {
        Notice::Failed(failure) => Ok(failure.message),
        Notice::Refused(refusal) => Ok(refusal.to_string()),
        other => Err(broken("Failed or Refused", format_args!("{other:?}"))),
    }
}

/// S-4: the first order is another one than Configure.
pub fn no_configuration(bench: &Bench) -> Judgement {
    let mut session = bench.session()?;
    session.hello()?;
    session.order(&Order::Drain)?;
    rejection(&mut session)
}

/// Hands over a configuration after `spoil`.
pub fn spoilt<'b>(
    bench: &'b Bench,
    config: &impl Serialize,
    spoil: impl FnOnce(&mut Value),
) -> Result<Session<'b>, Unmet> {
    let mut session = bench.session()?;
    session.hello()?;
    let mut config = serde_json::to_value(config).expect("a configuration is JSON");
    spoil(&mut config);
    session.order(&Order::Configure(configure(&config)))?;
    Ok(session)
}

/// J-1: a field that there is not.
pub fn unknown_field(bench: &Bench, config: &impl Serialize) -> Judgement {
    rejection(&mut spoilt(bench, config, |config| {
        config["buoyancy"] = 1.0.into();
    })?)
}
