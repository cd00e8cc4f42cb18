//! Sessions between toy solvers, over every transport.

mod toys;

use std::sync::mpsc;
use std::time::{Duration, Instant};

use interface::control::{Configure, Party};
use interface::session::{SessionError, coupler, dem, mpm};
use interface::step::Clock;
use interface::wire::{Grant, PointState, Report, flags};
use interface::{OneProcess, SharedMemory, Transport};
use toys::{HalfPlane, Points};

type Led = Result<(Vec<PointState>, Vec<(Report, Report)>), SessionError>;

struct Outcome {
    coupler: Led,
    points: Result<(), SessionError>,
    wall: Result<(), SessionError>,
}

/// A test that hangs is a failure, not a night of waiting.
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

fn on_every_transport(test: fn(bool)) {
    watched(move || test(false));
    watched(move || test(true));
}

/// Runs `steps` steps of 0.1 ms in windows of `window`, measuring the first step of each.
fn run(shared: bool, points: Points, wall: HalfPlane, steps: u64, window: u64) -> Outcome {
    if shared {
        run_over::<SharedMemory>(points, wall, steps, window)
    } else {
        run_over::<OneProcess>(points, wall, steps, window)
    }
}

fn run_over<S: Transport + 'static>(
    mut points: Points,
    mut wall: HalfPlane,
    steps: u64,
    window: u64,
) -> Outcome {
    let mut session = coupler::Session::<S>::open(&[Party::Mpm, Party::Dem]).unwrap();
    let (for_points, for_wall) = (session.domain().clone(), session.domain().clone());
    std::thread::scope(|scope| {
        let points = scope.spawn(move || mpm::run::<S, _>(&for_points, &mut points, false));
        let wall = scope.spawn(move || dem::run::<S, _>(&for_wall, &mut wall, false));
        let coupler = lead(&mut session, steps, window);
        if let Err(e) = &coupler {
            session.abort(&e.to_string());
        }
        Outcome {
            coupler,
            points: points.join().unwrap(),
            wall: wall.join().unwrap(),
        }
    })
}

fn lead<S: Transport + 'static>(session: &mut coupler::Session<S>, steps: u64, window: u64) -> Led {
    let alarm = &mut || Ok(());
    let configs = [
        (
            Party::Mpm,
            serde_json::to_string(&toys::mpm_config()).unwrap(),
        ),
        (
            Party::Dem,
            serde_json::to_string(&toys::dem_config()).unwrap(),
        ),
    ];
    for (party, config) in configs {
        session.hello(party, alarm)?;
        let configure = Configure {
            scene_hash: "hash".into(),
            config,
            coupled: true,
            deadline: 2.0,
        };
        session.configure(party, &configure)?;
        session.ready(party, "hash", alarm)?;
    }
    let mut clock = Clock::new(0.0);
    clock.begin_epoch(1e-4);
    let mut reports = Vec::new();
    let mut epoch = 0;
    while clock.index() < steps {
        let (epoch_start, steps_in_epoch, dt_before_epoch) = clock.epoch();
        let grant = Grant {
            epoch,
            first: clock.index(),
            steps: window.min(steps - clock.index()),
            flags: flags::MEASURE,
            epoch_start,
            steps_in_epoch,
            dt_before_epoch,
            dt: clock.dt(),
            budget_omega_sq: 1e6,
            budget_speed: 10.0,
            budget_damping: 0.0,
        };
        session.grant(Party::Mpm, &grant)?;
        session.grant(Party::Dem, &grant)?;
        let mpm = session.report(Party::Mpm, &grant, alarm)?;
        let dem = session.report(Party::Dem, &grant, alarm)?;
        assert_eq!(mpm.next, dem.next, "both stop at the same boundary");
        session.groups(grant.first, &mut Vec::new())?;
        session.bodies(grant.first, &mut Vec::new())?;
        clock.advance_by(mpm.next - grant.first);
        if mpm.halted + dem.halted > 0 {
            epoch += 1;
            let dt = clock.dt();
            clock.begin_epoch(dt);
        }
        reports.push((mpm, dem));
    }
    Ok((session.drain(alarm)?, reports))
}

#[test]
fn points_bounce_off_the_wall_with_the_same_bits_for_every_window() {
    on_every_transport(|shared| {
        let mut finals = Vec::new();
        for window in [1, 8, 64] {
            let outcome = run(
                shared,
                Points::default(),
                HalfPlane::default(),
                3000,
                window,
            );
            outcome.points.unwrap();
            outcome.wall.unwrap();
            let (points, reports) = outcome.coupler.unwrap();
            // Leapfrog returns a linear bounce's speed to O((omega dt)^2); omega dt is 0.01.
            assert!(
                points.iter().all(|p| (p.velocity[0] - 1.0).abs() < 1e-3),
                "{points:?}"
            );
            let energy = |(m, d): &(Report, Report)| m.ledger.kinetic + d.ledger.contact;
            let drift = reports
                .iter()
                .map(|r| (energy(r) - 1.0).abs())
                .fold(0.0, f64::max);
            assert!(drift < 1e-4, "energy drift {drift}");
            assert!(reports.last().unwrap().0.rebuilds > 5);
            finals.push(points);
        }
        assert_eq!(finals[0], finals[1]);
        assert_eq!(finals[0], finals[2]);
    });
}

#[test]
fn a_side_whose_limit_falls_stops_both_at_the_same_boundary() {
    on_every_transport(|shared| {
        let points = Points {
            limit_at: Some((20, 2e6)),
            ..Points::default()
        };
        let (_, reports) = run(shared, points, HalfPlane::default(), 24, 8)
            .coupler
            .unwrap();
        let ends: Vec<(u64, u64)> = reports.iter().map(|(m, _)| (m.next, m.halted)).collect();
        // Step 20 shows the new limit; the budget of this test never follows, so each window is then one step long.
        assert_eq!(ends, [(8, 0), (16, 0), (21, 1), (22, 1), (23, 1), (24, 0)]);

        let wall = HalfPlane {
            fast_at: Some(10),
            ..HalfPlane::default()
        };
        let (_, reports) = run(shared, Points::default(), wall, 13, 8).coupler.unwrap();
        let ends: Vec<u64> = reports.iter().map(|(_, d)| d.next).collect();
        assert_eq!(ends, [8, 11, 12, 13]);
    });
}

#[test]
fn a_failing_solver_is_quoted_and_the_other_is_released() {
    on_every_transport(|shared| {
        let points = Points {
            fail_at: Some(5),
            ..Points::default()
        };
        let start = Instant::now();
        let outcome = run(shared, points, HalfPlane::default(), 100, 8);
        let error = outcome.coupler.unwrap_err().to_string();
        assert_eq!(
            error,
            "the mpm stopped at step 5: velocity of point 0 is not finite"
        );
        assert!(
            matches!(outcome.wall, Err(SessionError::Aborted(_))),
            "{:?}",
            outcome.wall
        );
        assert!(
            start.elapsed() < Duration::from_secs(1),
            "{:?}",
            start.elapsed()
        );
    });
}

#[test]
fn a_number_that_is_not_finite_is_refused_where_it_is_sent() {
    on_every_transport(|shared| {
        let wall = HalfPlane {
            nan_at: Some(7),
            ..HalfPlane::default()
        };
        let error = run(shared, Points::default(), wall, 100, 8)
            .coupler
            .unwrap_err()
            .to_string();
        assert!(
            error.contains("dem") && error.contains("F-4") && error.contains("step 7"),
            "{error}"
        );
    });
}

#[test]
fn silence_ends_at_the_deadline() {
    on_every_transport(|shared| {
        let points = Points {
            pause: Some((3, Duration::from_secs(4))),
            ..Points::default()
        };
        let error = run(shared, points, HalfPlane::default(), 100, 8)
            .coupler
            .unwrap_err()
            .to_string();
        assert!(error.contains("nothing from the mpm"), "{error}");
    });
}

#[test]
fn a_refusal_names_the_key() {
    on_every_transport(|shared| {
        let points = Points {
            refuse: true,
            ..Points::default()
        };
        let error = run(shared, points, HalfPlane::default(), 100, 8)
            .coupler
            .unwrap_err();
        assert!(
            matches!(&error, SessionError::Refused { refusal, .. } if refusal.key == "mpm.cell"),
            "{error}"
        );
    });
}

/// A solver that refuses and goes while the coupler waits for another is still quoted.
#[test]
fn a_refusal_is_heard_though_its_solver_has_gone() {
    watched(|| {
        let mut session =
            coupler::Session::<SharedMemory>::open(&[Party::Mpm, Party::Dem]).unwrap();
        let domain = session.domain().clone();
        std::thread::scope(|scope| {
            let solver = scope.spawn(move || {
                let mut points = Points {
                    refuse: true,
                    ..Points::default()
                };
                mpm::run::<SharedMemory, _>(&domain, &mut points, false)
            });
            session.hello(Party::Mpm, &mut || Ok(())).unwrap();
            let configure = Configure {
                scene_hash: "hash".into(),
                config: serde_json::to_string(&toys::mpm_config()).unwrap(),
                coupled: true,
                deadline: 2.0,
            };
            session.configure(Party::Mpm, &configure).unwrap();
            let begin = Instant::now();
            let vanished = &mut || {
                if begin.elapsed() < Duration::from_millis(300) {
                    return Ok(());
                }
                Err(SessionError::Vanished {
                    who: Party::Mpm,
                    how: "ended with exit status 3".into(),
                    step: 0,
                })
            };
            let error = session.hello(Party::Dem, vanished).unwrap_err();
            assert!(
                matches!(&error, SessionError::Refused { refusal, .. } if refusal.key == "mpm.cell"),
                "{error}"
            );
            session.abort(&error.to_string());
            assert!(solver.join().unwrap().is_err());
        });
    });
}
