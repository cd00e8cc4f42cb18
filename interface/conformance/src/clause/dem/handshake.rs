//! Sections 2 and 3: the session until the solver is ready.

use interface::control::{Notice, Order};
use interface::stage::{Message, Payload};
use interface::wire::StepHeader;
use serde_json::{Value, json};

use super::scene::one_disc;
use crate::bench::{Bench, Session, configure};
use crate::clause::Clause;
use crate::clause::session::{self, rejection};
use crate::verdict::{Judgement, Unmet, broken, require};

pub const CLAUSES: &[Clause] = &[
    Clause::must(
        "S-2a",
        "says Hello first, as the party of its channels",
        session::hello,
    )
    .covers(&["C01"]),
    Clause::must("V-1a", "speaks this major version", session::version).covers(&["C01"]),
    Clause::must(
        "O-1a",
        "the process that was started says Hello",
        session::pid,
    )
    .of_processes(),
    Clause::must("S-6a", "Ready repeats the scene hash", hash).covers(&["C03"]),
    Clause::must(
        "S-7a",
        "opens its line before Hello, all channels before Ready",
        opened,
    ),
    Clause::must(
        "S-2b",
        "says Hello, Ready and Bye, once each, and nothing else",
        notices,
    ),
    Clause::must("S-1a", "refuses an order with a byte too many", overlong).covers(&["C04"]),
    Clause::must(
        "M-1a",
        "refuses an absurd length, does not believe it",
        absurd,
    )
    .covers(&["C04"]),
    Clause::must(
        "S-4a",
        "refuses a first order other than Configure",
        session::no_configuration,
    ),
    Clause::must("S-3a", "refuses a second Configure", second_configure).covers(&["C28"]),
    Clause::should(
        "J-1a",
        "refuses a field that it does not know",
        unknown_field,
    ),
    Clause::must(
        "S-5a",
        "refuses a configuration with a field missing",
        missing_field,
    ),
    Clause::must("S-5b", "refuses a field of the wrong type", wrong_type),
    Clause::must(
        "S-8a",
        "says Refused, with the key, to a value it cannot honour",
        refused,
    )
    .covers(&["C36"]),
];

fn hash(bench: &Bench) -> Judgement {
    session::hash(bench, &one_disc())
}

fn opened(bench: &Bench) -> Judgement {
    session::opened(bench, &one_disc())
}

fn notices(bench: &Bench) -> Judgement {
    let mut play = bench.play(&one_disc())?;
    play.step(0.0, &[])?;
    if let Some(notice) = play.unexpected(interface::stage::Kind::Notice, GRACE)? {
        return Err(broken(
            "no notice",
            format_args!("{:?}", notice.as_notice()),
        ));
    }
    play.session.close()?;
    if let Some(notice) = play.unexpected(interface::stage::Kind::Notice, GRACE)? {
        return Err(broken(
            "nothing after Bye",
            format_args!("{:?}", notice.as_notice()),
        ));
    }
    Ok("Hello, Ready, Bye".into())
}

/// How long the kit listens for what should not be said.
const GRACE: std::time::Duration = std::time::Duration::from_millis(10);

/// Sends bytes as the first order.
fn first_order(bench: &Bench, spoil: impl FnOnce(&mut Vec<u8>)) -> Judgement {
    let mut session = bench.session()?;
    session.hello()?;
    let right = Message::order(&Order::Configure(configure(&one_disc())));
    let Payload::Order(mut bytes) = right.payload else {
        unreachable!("an order is one");
    };
    spoil(&mut bytes);
    session.send(&Message::new(StepHeader::default(), Payload::Order(bytes)))?;
    rejection(&mut session)
}

fn overlong(bench: &Bench) -> Judgement {
    first_order(bench, |bytes| bytes.push(0))
}

fn absurd(bench: &Bench) -> Judgement {
    // The length of the hash, behind the variant's four bytes.
    first_order(bench, |bytes| {
        bytes[4..12].copy_from_slice(&u64::MAX.to_le_bytes());
    })
}

fn second_configure(bench: &Bench) -> Judgement {
    let mut play = bench.play(&one_disc())?;
    play.step(0.0, &[])?;
    play.session
        .order(&Order::Configure(configure(&one_disc())))?;
    Ok(play.session.failure()?.message)
}

/// Hands over the configuration of a disc after `spoil`.
fn spoilt(bench: &Bench, spoil: impl FnOnce(&mut Value)) -> Result<Session<'_>, Unmet> {
    session::spoilt(bench, &one_disc(), spoil)
}

fn unknown_field(bench: &Bench) -> Judgement {
    session::unknown_field(bench, &one_disc())
}

fn missing_field(bench: &Bench) -> Judgement {
    rejection(&mut spoilt(bench, |config| {
        config.as_object_mut().map(|fields| fields.remove("skin"));
    })?)
}

fn wrong_type(bench: &Bench) -> Judgement {
    rejection(&mut spoilt(bench, |config| {
        config["skin"] = json!("thick");
    })?)
}

fn refused(bench: &Bench) -> Judgement {
    let mut session = spoilt(bench, |config| config["threads"] = json!(0))?;
    match session.notice()? {
        Notice::Refused(refusal) => {
            let named = refusal.key.contains("threads") && !refusal.message.is_empty();
            require(named, "the key `threads` and a message", &refusal)?;
            Ok(refusal.to_string())
        }
        other => Err(broken("Refused", format_args!("{other:?}"))),
    }
}
