//! Sections 2 and 3: the session until the solver is ready.

use std::time::Duration;

use interface::message::control::{Order, PROTOCOL, Party};
use interface::message::{Kind, Message};
use serde_json::{Value, json};

use super::run::{names, order};
use crate::bench::{Bench, HASH, Run, Session};
use crate::clause::{Clause, clauses};
use crate::flaw::Flaw;
use crate::verdict::{Judgement, Unmet, broken, require};
use interface::config::capability::{FAMILIES, VERBS};

pub const CLAUSES: &[Clause] = clauses! {
    Must "S-2a" "says Hello first, as the party of its channels" by hello;
    Must "V-1a" "speaks this major version" by version;
    Must "O-1a" "the process that was started says Hello" by pid, of_processes: true;
    Must "K-1a" "every capability is a verb or a member of a known family" by capabilities;
    Must "S-6a" "Ready repeats the scene hash, with numbers that can be" by hash;
    Must "S-7a" "opens its control channels before Hello, all channels before Ready" by opened;
    Must "S-2b" "says Hello, Ready and Bye, once each, and nothing else" by notices;
    Must "S-1a" "refuses an order with a byte too many" rejects Flaw::orders(|bytes| bytes.push(0));
    // The length of the hash, behind the variant's four bytes.
    Must "M-1a" "refuses an impossible length" rejects Flaw::orders(|bytes| bytes[4..12].fill(0xff));
    Must "S-4a" "refuses a first order other than Configure"
        rejects Flaw::passing(|_| vec![Message::order(&Order::Drain)]);
    Must "S-3a" "refuses a second Configure" by |bench| out_of_turn(bench, &Order::Configure(order(bench)));
    Must "S-3b" "refuses Close before Drain" by |bench| out_of_turn(bench, &Order::Close);
    Should "J-1a" "refuses a field that it does not know" rejects with("buoyancy", json!(1.0));
    Must "S-5a" "refuses a configuration with a field missing"
        rejects Flaw::json(|config| { config.remove("skin"); });
    Must "S-5b" "refuses a field of the wrong type" rejects with("skin", json!("thick"));
    Must "S-8a" "answers an impossible value with Refused and its key" by impossible;
};

/// A configuration with this value.
fn with(key: &'static str, value: Value) -> Flaw {
    Flaw::json(move |config| {
        config.insert(key.into(), value.clone());
    })
}

fn impossible(bench: &Bench) -> Judgement {
    let key = match bench.subject.party {
        Party::Mpm => "cell",
        _ => "threads",
    };
    names(bench, key, with(key, json!(0)))
}

fn hello(bench: &Bench) -> Judgement {
    let hello = bench.session()?.hello()?;
    let party = bench.subject.party;
    require(hello.party == party, party, hello.party)?;
    Ok(format!("`{}`", hello.identity))
}

fn version(bench: &Bench) -> Judgement {
    let (major, minor) = bench.session()?.hello()?.protocol;
    require(major == PROTOCOL.0, PROTOCOL.0, major)?;
    Ok(format!("{major}.{minor}"))
}

fn pid(bench: &Bench) -> Judgement {
    let mut session = bench.session()?;
    let sent = session.hello()?.pid;
    match session.solver.pid() {
        Some(pid) if pid == sent => Ok(format!("pid {pid}")),
        pid => Err(broken(format_args!("pid {pid:?}"), sent)),
    }
}

fn capabilities(bench: &Bench) -> Judgement {
    let named = bench.session()?.hello()?.capabilities.0;
    let known = |name: &&String| match name.split_once(':') {
        Some((family, member)) => FAMILIES.contains(&family) && !member.is_empty(),
        None => VERBS.contains(&name.as_str()),
    };
    let unknown = named.iter().find(|name| !known(name));
    let got = format_args!("{unknown:?}");
    require(unknown.is_none(), "verbs and `family:member`", got)?;
    Ok(format!("{} capabilities", named.len()))
}

fn hash(bench: &Bench) -> Judgement {
    let mut session = bench.greeted()?;
    let ready = session.ready(&order(bench))?;
    require(ready.scene_hash == HASH, HASH, &ready.scene_hash)?;
    if let Some(wrong) = ready.readiness.impossible_value() {
        return Err(broken("numbers that a solver can have", wrong));
    }
    Ok(ready.scene_hash)
}

fn opened(bench: &Bench) -> Judgement {
    let mut session = bench.greeted()?;
    let of_line = |name: &&str| {
        let line = ["orders", "notices", "grants", "reports", "coupler"];
        line.iter().any(|part| name.contains(part))
    };
    closed(&session, of_line, "its line open at Hello")?;
    session.ready(&order(bench))?;
    // Clauses about a capability apply to solvers that have it.
    let asked = |name: &&str| match name.rsplit('/').next() {
        Some("saved" | "restore") => bench.takes("save"),
        Some("contacts") => bench.takes("contacts"),
        _ => true,
    };
    closed(&session, asked, "all open at Ready")?;
    Ok("all open".into())
}

/// None of these channels may be closed.
fn closed(session: &Session, of: impl Fn(&&str) -> bool, expected: &str) -> Result<(), Unmet> {
    let unopened = session.solver.unopened();
    let missing: Vec<&str> = unopened.into_iter().filter(of).collect();
    require(
        missing.is_empty(),
        expected,
        format_args!("closed: {missing:?}"),
    )
}

fn notices(bench: &Bench) -> Judgement {
    let mut run = Run::begun(bench)?;
    // How long the kit waits for messages that must not come.
    let grace = Duration::from_millis(10);
    for close in [true, false] {
        let more = run.session.unexpected(Kind::Notice, grace)?;
        let got = format_args!("{:?}", more.as_ref().map(Message::as_notice));
        require(more.is_none(), "no notice", got)?;
        if close {
            run.session.close()?;
        }
    }
    Ok("Hello, Ready, Bye".into())
}

fn out_of_turn(bench: &Bench, order: &Order) -> Judgement {
    let mut run = Run::begun(bench)?;
    run.session.order(order)?;
    Ok(run.session.failure()?.message)
}
