//! What the coupler does not take from a solver, and what others may do with a run. That sessions have the same bits over every
//! transport and for every window is for the scenes to show (`tests/hashes.rs`).

use std::sync::mpsc;
use std::time::{Duration, Instant};

use crate::toys::{Course, HalfPlane, Points};
use interface::hosted::Host;
use interface::message::Channel;
use interface::message::control::Party;
use interface::session::together::Together;
use interface::session::{Session, SessionError, drive, serve};
use interface::solver::Readiness;
use interface::step::Clock;
use interface::transport::domain::OwnedDomain;
use interface::transport::iceoryx::{self, SEND_TIMEOUT};

const BOTH: [Party; 2] = [Party::Mpm, Party::Dem];

/// Runs a test with a deadline, so that a test that hangs fails.
fn watched(test: impl FnOnce() + Send + 'static) {
    let (done, wait) = mpsc::channel();
    let worker = std::thread::spawn(move || {
        test();
        let _ = done.send(());
    });
    match wait.recv_timeout(Duration::from_mins(1)) {
        Err(mpsc::RecvTimeoutError::Timeout) => panic!("the session hangs"),
        _ => worker
            .join()
            .unwrap_or_else(|e| std::panic::resume_unwind(e)),
    }
}

/// What the coupler says of a session with these points.
fn session(course: &mut Course, points: Points) -> Result<(), SessionError> {
    session_with(course, points, HalfPlane::default())
}

fn session_with(course: &mut Course, points: Points, wall: HalfPlane) -> Result<(), SessionError> {
    let hosts = [Host::Mpm(Box::new(points)), Host::Dem(Box::new(wall))];
    let [coupler, ..] = Together::of(course, hosts).run();
    coupler
}

/// Plastic strain is checked if the solver reports it.
#[test]
fn a_plastic_strain_that_cannot_be_ends_the_session() {
    for (strain, phrase) in [
        (f64::NAN, Some("point 0 is NaN")),
        (f64::INFINITY, Some("point 0 is inf")),
        (-0.5, Some("point 0 is -0.5")),
        (0.25, None),
    ] {
        let points = Points {
            plastic_strain: Some(strain),
            ..Points::default()
        };
        let mut course = Course::new(10, 8);
        let ended = session(&mut course, points);
        let Some(phrase) = phrase else {
            ended.unwrap();
            assert!(course.finals.iter().all(|p| p.plastic_strain == 0.25));
            continue;
        };
        let error = ended.unwrap_err().to_string();
        assert!(error.contains("D-1") && error.contains(phrase), "{error}");
    }
}

/// A thread that all parties share does not run while a solver sleeps, as beside other programs: what a solver reports as CPU
/// time is not the time of its turns.
#[test]
fn time_in_which_a_shared_thread_did_not_run_is_not_cpu_time() {
    let sleeps_for = Duration::from_millis(2);
    let wall = HalfPlane {
        sleeps_for,
        ..HalfPlane::default()
    };
    let mut course = Course::new(50, 10);
    session_with(&mut course, Points::default(), wall).unwrap();
    // The last turn is measured after its report.
    let [wall, cpu] = [course.bodies.compute_ns, course.bodies.cpu_ns].map(Duration::from_nanos);
    assert!(wall >= 40 * sleeps_for, "{wall:?}");
    assert!(cpu < wall / 2, "{cpu:?} of {wall:?}");
}

/// A solver refuses and exits while the coupler waits for the other one. Its refusal is still reported.
#[test]
fn a_refusal_is_heard_though_the_other_solver_never_comes() {
    watched(|| {
        let domain = OwnedDomain::create().unwrap();
        let names = domain.domain();
        let _created = iceoryx::create(names, &BOTH, false).unwrap();
        let ends = iceoryx::join(names, Party::Coupler, &BOTH, SEND_TIMEOUT).unwrap();
        let mut supervisor = Course::new(10, 1);
        std::thread::scope(|scope| {
            let solver = scope.spawn(move || {
                let points = Points {
                    refuse: true,
                    ..Points::default()
                };
                serve(names, Host::Mpm(Box::new(points)))
            });
            let wall = HalfPlane {
                // The other one takes long to configure; the refusal does not wait for it.
                configures_for: Duration::from_secs(3),
                ..HalfPlane::default()
            };
            let other = scope.spawn(move || serve(names, Host::Dem(Box::new(wall))));
            let begin = Instant::now();
            let session = Session::coupler(&BOTH, &mut supervisor, ends);
            let _open = session.ends();
            let error = drive(session).unwrap_err();
            assert!(begin.elapsed() < Duration::from_secs(2));
            assert!(
                matches!(&error, SessionError::Refused { refusal, .. } if refusal.key == "mpm.cell"),
                "{error}"
            );
            domain.release();
            assert!(solver.join().unwrap().is_err());
            assert!(other.join().unwrap().is_err());
        });
    });
}

/// D18: such numbers were accepted, and the coupler computed numbers from them that were not finite.
#[test]
fn a_ready_with_numbers_that_cannot_be_ends_the_session() {
    type Spoil = fn(&mut Readiness);
    let rows: [(Spoil, &str); 4] = [
        (|ready| ready.mass_min = f64::NAN, "mass_min = NaN"),
        (
            |ready| ready.courant_time = f64::INFINITY,
            "courant_time = inf",
        ),
        (|ready| ready.stiffness_max = -1.0, "stiffness_max = -1"),
        (
            |ready| ready.items = u64::MAX,
            "items = 18446744073709551615",
        ),
    ];
    for (spoil, phrase) in rows {
        let mut ready = Readiness::default();
        spoil(&mut ready);
        let points = Points {
            says: Some(ready),
            ..Points::default()
        };
        let error = session(&mut Course::new(10, 8), points);
        let error = error.unwrap_err().to_string();
        assert!(error.contains("S-6") && error.contains(phrase), "{error}");
    }
}

/// The number of a step in its epoch overflowed: a panic, or times of another epoch.
#[test]
fn a_grant_of_more_steps_than_a_run_has_ends_the_session() {
    let mut course = Course::new(10, 1);
    course.clock = Clock::within_epoch(0, 0.0, u64::MAX, 0.0, 1e-4);
    let error = session(&mut course, Points::default());
    let error = error.unwrap_err().to_string();
    assert!(error.contains("G-3"), "{error}");
}

/// D13: every user could write to a segment of every run, and so keep solvers from joining it.
#[test]
fn nothing_of_a_run_is_open_to_other_users() {
    use std::os::unix::fs::PermissionsExt;
    let owned = OwnedDomain::create().unwrap();
    let domain = owned.domain();
    let _created = iceoryx::create(domain, &BOTH, false).unwrap();
    let mut ends = BOTH.map(|party| iceoryx::join(domain, party, &[], SEND_TIMEOUT).unwrap());
    for (end, party) in ends.iter_mut().zip(BOTH) {
        end.open(&Channel::before_ready(party, true)).unwrap();
    }
    let _coupler = iceoryx::join(domain, Party::Coupler, &BOTH, SEND_TIMEOUT).unwrap();
    let mut seen = 0;
    for entry in std::fs::read_dir("/dev/shm").unwrap().flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        if name.starts_with(&format!("tandem_{}_", domain.id())) {
            let mode = entry.metadata().unwrap().permissions().mode();
            assert_eq!(mode & 0o077, 0, "{name}: {mode:o}");
            seen += 1;
        }
    }
    assert!(seen > 10, "{seen} segments");
    let mode = domain.directory().metadata().unwrap().permissions().mode();
    assert_eq!(mode & 0o777, 0o700);
}
