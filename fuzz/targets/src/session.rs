//! Messages of a session that are not what they should be, taken by the three parties of a session, with the built-in solvers behind them.
//!
//! An input begins with the party and says what becomes of the messages that it received in the small run: an edit is a
//! few bytes. What a party is told follows the recording, however it answers; so an edit reaches the middle of a session.

use std::collections::VecDeque;

use arbitrary::Unstructured;
use interface::config::{MpmConfig, from_json};
use interface::message::control::{Configure, Order, Party};
use interface::message::wire::{Budget, Grant, StepHeader, bytes_of, flags, records_of};
use interface::message::{Channel, Kind, Payload};
use interface::session::{Clocked, Next, Part, Session, Solvers, Stop, Supervisor, Turn};
use interface::solver::{DemSolver, MpmSolver};
use interface::transport::Transport;
use interface::transport::direct::Direct;
use interface::transport::raw::Message;

use crate::change::Changer;
use crate::run::LEFT;
use crate::target::Target;

/// Sessions.
pub const TARGET: Target = Target {
    name: "session",
    run,
    seeds: || (0..6).map(|party| vec![party]).collect(),
    change,
    // The built-in solvers on the small scene, and its messages.
    base: 16 << 20,
    per_byte: 1 << 20,
};

/// Turns after which a session is left: a grant may be of as many steps as its number can say.
const TURNS: u32 = 4000;
/// Most edits.
const EDITS: usize = 16;

/// Edits are eight bytes; a few of them change at a time.
fn change(changer: &mut Changer, input: &mut Vec<u8>, seeds: &[Vec<u8>]) {
    if changer.below(4) == 0 {
        return changer.bytes(input, seeds);
    }
    input.truncate(1);
    for _ in 0..=changer.below(3) {
        input.extend((0..8).map(|_| changer.0.u8(..)));
    }
}

/// A message on its way.
type Sent = (Channel, StepHeader, Vec<u8>);

/// What a party received in the small run.
fn received(party: Party) -> Vec<Sent> {
    let received = LEFT.messages.iter().filter(|(at, _)| at.to() == party);
    let sent = received.map(|(channel, m)| (*channel, m.header, bytes(&m.payload)));
    sent.collect()
}

fn run(input: &[u8]) {
    let mut input = Unstructured::new(input);
    let Ok(choice) = input.arbitrary::<u8>() else {
        return;
    };
    let party = [Party::Mpm, Party::Dem, Party::Coupler][usize::from(choice % 3)];
    let mut messages = received(party);
    if choice % 6 >= 3 {
        restore(party, &mut messages);
    }
    for _ in 0..EDITS {
        if input.is_empty() || edit(&mut input, &mut messages).is_err() {
            break;
        }
    }
    let mut ends = channels(messages);
    match party {
        Party::Mpm => {
            let mut solver = mpm_proc::Mpm::default();
            let _ = play(Session::mpm(&mut solver, &mut ends, Clocked::Shared));
        }
        Party::Dem => {
            let mut solver = dem_proc::Sdem::default();
            let _ = play(Session::dem(&mut solver, &mut ends, Clocked::Shared));
        }
        Party::Coupler => {
            let mut lead = Lead::new();
            let solvers = [Party::Mpm, Party::Dem];
            let _ = play(Session::coupler(&solvers, &mut lead, &mut ends));
        }
    }
}

/// The session as one that goes on from a state, which stands behind Configure; of the coupler: nothing.
fn restore(party: Party, messages: &mut Vec<Sent>) {
    let configure = Channel::of(party, Kind::Order);
    let Some(at) = messages
        .iter()
        .position(|(channel, ..)| *channel == configure)
    else {
        return;
    };
    let order = Message {
        header: messages[at].1,
        payload: Payload::Order(messages[at].2.clone()),
    };
    let Ok(Order::Configure(told)) = order.as_order() else {
        return;
    };
    let config = told.config.clone();
    let order = Message::order(&Order::Configure(Configure {
        restore: true,
        ..told
    }));
    messages[at] = (configure, order.header, bytes(&order.payload));
    let state = match party {
        Party::Mpm => saved_continuum(&config),
        _ => saved_bodies(&config),
    };
    let state = state.expect("a state as it begins");
    let hash = blake3::hash(&state).as_bytes().to_vec();
    let channel = Channel::of(party, Kind::Restore);
    let pieces = [(state, 0), (hash, flags::LAST)].map(|(piece, flags)| {
        let header = StepHeader {
            count: piece.len() as u64,
            flags,
            ..StepHeader::default()
        };
        (channel, header, piece)
    });
    let behind = at + 1;
    messages.splice(behind..behind, pieces);
}

fn saved_continuum(config: &str) -> Option<Vec<u8>> {
    let mut solver = mpm_proc::Mpm::default();
    solver
        .configure(&from_json::<MpmConfig>(config).ok()?)
        .ok()?;
    solver.save().ok()
}

fn saved_bodies(config: &str) -> Option<Vec<u8>> {
    let mut solver = dem_proc::Sdem::default();
    solver.configure(&serde_json::from_str(config).ok()?).ok()?;
    solver.save().ok()
}

fn bytes(payload: &Payload) -> Vec<u8> {
    payload.records().bytes().to_vec()
}

/// Numbers at the edges of something, as bits.
const EDGES: [u64; 16] = [
    0,
    1,
    2,
    1 << 32,
    1 << 62,
    i64::MAX as u64,
    u64::MAX - 1,
    u64::MAX,
    0x7ff0_0000_0000_0000, // infinity
    0x7ff8_0000_0000_0000, // NaN
    0x8000_0000_0000_0000, // -0
    0x7fef_ffff_ffff_ffff, // the largest number
    0xffef_ffff_ffff_ffff, // the lowest
    0x3ff0_0000_0000_0000, // 1
    0xbff0_0000_0000_0000, // -1
    0x7e37_e43c_8800_759c, // 1e300
];

/// Does one edit.
fn edit(input: &mut Unstructured<'_>, messages: &mut Vec<Sent>) -> arbitrary::Result<()> {
    let what = input.arbitrary::<u8>()?;
    let [at, place, value] = [(); 3].map(|()| input.arbitrary::<u16>().unwrap_or_default());
    if messages.is_empty() {
        return Ok(());
    }
    let at = usize::from(at) % messages.len();
    let place = usize::from(place);
    let edge = if value < 0x8000 {
        EDGES[usize::from(value) % EDGES.len()]
    } else {
        u64::from(value & 0x7fff)
    };
    let (channel, header, payload) = &mut messages[at];
    let size = size_of_val(header);
    let record = channel.kind.record_size();
    match what % 10 {
        0 => drop(messages.remove(at)),
        1 => {
            let again = messages[at].clone();
            messages.insert(at, again);
        }
        2 => {
            let other = place % messages.len();
            messages.swap(at, other);
        }
        // Of the same kind, so that it is looked at.
        3 => {
            let kind = channel.kind;
            let others: Vec<usize> = (0..messages.len())
                .filter(|&i| messages[i].0.kind == kind)
                .collect();
            messages[at] = messages[others[place % others.len()]].clone();
        }
        4 => {
            let mut bytes = bytes_of(&[*header]).to_vec();
            let begin = place * 8 % size;
            bytes[begin..begin + 8].copy_from_slice(&edge.to_le_bytes());
            if let Some(&[changed]) = records_of(&bytes).as_deref() {
                *header = changed;
            }
        }
        5 | 6 => {
            let words = payload.len() / 8;
            if words > 0 {
                let begin = place % words * 8;
                payload[begin..begin + 8].copy_from_slice(&edge.to_le_bytes());
            }
        }
        7 => {
            let keep = place % (payload.len() / record + 1) * record;
            payload.truncate(keep);
            set_count(header, value, keep / record);
        }
        8 => {
            let twice = payload.clone();
            payload.extend(twice);
            let count = payload.len() / record;
            set_count(header, value, count);
        }
        _ => {
            if !payload.is_empty() {
                let place = place % payload.len();
                payload[place] = value as u8;
            }
        }
    }
    Ok(())
}

/// The right count, three times in four.
fn set_count(header: &mut StepHeader, value: u16, count: usize) {
    if !value.is_multiple_of(4) {
        header.count = count as u64;
    }
}

/// Lets a party take turns; who waits for what does not come is told so. Returns how its session ended.
fn play(mut party: Session<'_>) -> Result<(), String> {
    for _ in 0..TURNS {
        match party.turn() {
            Turn::Went => {}
            Turn::Ended => break,
            Turn::Waits(wait) => {
                if !party.look_up() {
                    party.expire(wait.at_most);
                }
            }
        }
    }
    party.into_verdict().map_err(|error| error.to_string())
}

/// Channels with these messages in them.
fn channels(messages: Vec<Sent>) -> Direct {
    let mut channels = Direct::new();
    for (channel, header, payload) in messages {
        // What is no whole records cannot be in a channel.
        if let Some(payload) = Payload::read(channel.kind, &payload) {
            let sent = channels.send(channel, &header, payload.records());
            sent.expect("nothing is full");
        }
    }
    channels
}

/// Leads as the small run was led: the orders and grants of the recording, whatever is answered.
struct Lead {
    configures: Vec<Part>,
    grants: VecDeque<Next>,
}

impl Lead {
    fn new() -> Self {
        let sent = |party, kind| {
            let channel = Channel::of(party, kind);
            let all = LEFT.messages.iter();
            all.filter_map(move |(at, message)| (*at == channel).then_some(message))
        };
        let part = |party, measured| {
            let mut orders = sent(party, Kind::Order);
            let Some(Ok(Order::Configure(configure))) =
                orders.next().map(interface::message::Message::as_order)
            else {
                unreachable!("the first order of a whole run");
            };
            Part {
                configure,
                measured,
                restore: None,
            }
        };
        let grants = |party| {
            let sent = sent(party, Kind::Grant);
            sent.filter_map(|message| message.payload.of::<Grant>().first().copied())
        };
        let budget = |grant: &Grant| Budget {
            omega_sq: grant.budget_omega_sq,
            speed: grant.budget_speed,
            damping: grant.budget_damping,
        };
        let pairs = grants(Party::Mpm).zip(grants(Party::Dem));
        Self {
            configures: vec![part(Party::Mpm, 1), part(Party::Dem, 2)],
            grants: pairs
                .map(|(a, b)| (a, vec![budget(&a), budget(&b)]))
                .collect(),
        }
    }
}

impl Supervisor for Lead {
    fn configure(&mut self, _: &Solvers) -> Result<Vec<Part>, Stop> {
        Ok(self.configures.clone())
    }

    fn next(&mut self) -> Result<Option<Next>, Stop> {
        Ok(self.grants.pop_front())
    }

    fn collected(&mut self, solvers: &mut Solvers) -> Result<(), Stop> {
        let _ = [Party::Mpm, Party::Dem].map(|party| solvers.take_saved(party));
        Ok(())
    }

    fn drained(&mut self, _: &mut Solvers) -> Result<(), Stop> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Without edits a session follows the recording to its end: otherwise edits would reach nothing.
    #[test]
    fn a_session_without_edits_is_whole() {
        let mut mpm = mpm_proc::Mpm::default();
        let mut ends = channels(received(Party::Mpm));
        play(Session::mpm(&mut mpm, &mut ends, Clocked::Shared)).unwrap();
        let mut dem = dem_proc::Sdem::default();
        let mut ends = channels(received(Party::Dem));
        play(Session::dem(&mut dem, &mut ends, Clocked::Shared)).unwrap();
    }

    /// The number of a step in its epoch overflowed: a panic, or times of another epoch.
    #[test]
    fn a_grant_of_more_steps_than_a_run_has_is_refused() {
        let mut messages = received(Party::Dem);
        let granted = |sent: &&mut Sent| sent.0.kind == Kind::Grant;
        let (_, _, payload) = messages.iter_mut().filter(granted).nth(2).unwrap();
        let mut grants: Vec<Grant> = records_of(payload).unwrap();
        grants[0].steps_in_epoch = u64::MAX;
        *payload = bytes_of(&grants).to_vec();
        let mut dem = dem_proc::Sdem::default();
        let mut ends = channels(messages);
        let said = play(Session::dem(&mut dem, &mut ends, Clocked::Shared)).unwrap_err();
        assert!(said.contains("G-3"), "{said}");
    }
}
