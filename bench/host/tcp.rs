//! What a step of two solvers would cost over TCP: the states of N points one way, their forces back, as
//! `interface/src/message/wire.rs` has them, with `TCP_NODELAY`, on the loopback interface. No part of Tandem.
//!
//!     rustc -O --edition 2024 -o /tmp/tcp bench/host/tcp.rs && /tmp/tcp
//!
//! Prints, for each N, the median and the 90th percentile of the wall time of a step in microseconds.

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::thread;
use std::time::{Duration, Instant};

/// Bytes of the header of a message, of a point's state and of its force.
const HEADER: usize = 48;
const STATE: usize = 32;
const FORCE: usize = 24;
/// Longest measurement of one size.
const TIME: Duration = Duration::from_secs(3);
/// Most steps of one size.
const STEPS: usize = 20_000;

fn main() {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = listener.local_addr().expect("an address");
    for points in [1, 10, 100, 1_000, 10_000, 100_000] {
        let (states, forces) = (HEADER + STATE * points, HEADER + FORCE * points);
        thread::scope(|scope| {
            scope.spawn(|| {
                bodies(
                    TcpStream::connect(address).expect("a connection"),
                    states,
                    forces,
                )
            });
            let (stream, _) = listener.accept().expect("a connection");
            let mut took = continuum(stream, states, forces);
            took.sort_by(f64::total_cmp);
            let at = |share: f64| took[((took.len() - 1) as f64 * share) as usize];
            println!(
                "{points:>7} points {:>9.1} us {:>9.1} us, {} steps",
                at(0.5),
                at(0.9),
                took.len()
            );
        });
    }
}

/// Sends states and waits for forces.
fn continuum(mut stream: TcpStream, states: usize, forces: usize) -> Vec<f64> {
    stream.set_nodelay(true).expect("an option");
    let (sent, mut got) = (vec![1; states], vec![0; forces]);
    let (began, mut took) = (Instant::now(), Vec::new());
    while took.len() < STEPS && began.elapsed() < TIME {
        let step = Instant::now();
        stream.write_all(&sent).expect("the other side lives");
        stream.read_exact(&mut got).expect("the other side lives");
        took.push(step.elapsed().as_secs_f64() * 1e6);
    }
    took
}

/// Waits for states and sends forces, until nobody is there.
fn bodies(mut stream: TcpStream, states: usize, forces: usize) {
    stream.set_nodelay(true).expect("an option");
    let (mut got, sent) = (vec![0; states], vec![1; forces]);
    while stream.read_exact(&mut got).is_ok() {
        if stream.write_all(&sent).is_err() {
            break;
        }
    }
}
