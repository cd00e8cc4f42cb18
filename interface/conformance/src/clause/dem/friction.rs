//! Section 7, the law `linear` beyond its spring: friction, its history, and the dashpot. Each on every ground that the
//! solver takes.

use interface::config::{ContactLaw, DemConfig, Motion};
use interface::message::control::Order;
use interface::message::wire::{BodyState, ImpForce, ImpState};
use interface::transport::raw::{Message, Payload};

use super::scene::{
    Contact, Ground, MASS, OVERLAP, RADIUS, SPHERO, STIFFNESS, damped, disc, frictional, scene,
};
use crate::bench::{Answer, Bench, BodiesRun, Points, WindowReport};
use crate::clause::Clause;
use crate::mutant::{Flaw, change};
use crate::verdict::{Judgement, Unmet, near, require};

/// Clauses that these rest on: the force itself, of its own step, on a body that stays.
const ROOTS: &[&str] = &["F-7a", "F-7d", "J-1b"];
/// Those that rest on friction.
const FRICTION: &[&str] = &["F-7a", "F-7d", "J-1b", "F-7k", "F-7l"];
const RUBS: &[&str] = &["feature:friction"];
const DAMPS: &[&str] = &["feature:damping"];

pub const CLAUSES: &[Clause] = &[
    Clause::must(
        "F-7k",
        "friction opposes sliding and is mu F_n at most",
        coulomb,
    )
    .after(ROOTS)
    .needs(RUBS)
    .mutant("doubles friction", || change::law(|_, _, mu, _| *mu *= 2.0))
    .mutant("reverses friction", || {
        rubbing(|points| {
            let [normal, along] = points.contact.parts(points.force.force);
            points.force.force = points.contact.force(normal, -along);
        })
    }),
    Clause::must(
        "F-7l",
        "below that, friction is the force of the tangential spring",
        spring,
    )
    .after(&["F-7a", "F-7d", "J-1b", "F-7k"])
    .needs(RUBS)
    .mutant("has a stiffer tangential spring", || {
        change::law(|_, k_t, _, _| *k_t *= 1.1)
    }),
    Clause::must(
        "F-7s",
        "friction follows displacements, not the velocity that a point reports",
        noisy_slide,
    )
    .after(FRICTION)
    .needs(RUBS)
    .mutant(
        "computes sliding from the velocity that a point reports",
        || {
            let mut extra = 0.0;
            rubbing(move |points| {
                extra = if points.force.force == [0.0; 2] {
                    0.0
                } else {
                    extra + points.unseen[1]
                };
                let [normal, along] = points.contact.parts(points.force.force);
                points.force.force = points.contact.force(normal, along - TANGENTIAL * extra);
            })
        },
    ),
    Clause::must(
        "F-7m",
        "with mu = 0 there is no tangential force, apart from rounding",
        frictionless,
    )
    .after(ROOTS)
    .mutant("has friction although mu is 0", || {
        change::law(|_, k_t, mu, _| {
            if *k_t > 0.0 && *mu == 0.0 {
                *mu = 0.1;
            }
        })
    }),
    Clause::must(
        "F-7n",
        "a contact that has opened has no tangential spring",
        forgotten,
    )
    .after(FRICTION)
    .needs(RUBS)
    .mutant("remembers the spring of a contact that has opened", || {
        let (mut friction, mut opened) = (0.0, false);
        rubbing(move |points| {
            let [normal, along] = points.contact.parts(points.force.force);
            if points.force.force == [0.0; 2] {
                opened = true;
            } else if opened {
                points.force.force = points.contact.force(normal, along + friction);
            } else {
                friction = along;
            }
        })
    }),
    Clause::must(
        "I-10a",
        "the tangential spring survives a new set with other slots",
        carried_over,
    )
    .after(&["F-7a", "F-7d", "J-1b", "F-7k", "F-7l", "I-9a"])
    .needs(RUBS)
    .mutant("forgets all springs at a new set", || {
        Flaw::forces(|header, forces| {
            if header.set > 1 {
                forces.iter_mut().for_each(|force| force.force[0] = 0.0);
            }
        })
    })
    .mutant("keeps springs by slot", || {
        let (mut set, mut before) = (0, Vec::new());
        Flaw::forces(move |header, forces| {
            if header.set > 1 && header.set != set {
                for (force, before) in forces.iter_mut().zip(&before) {
                    force.force[0] = *before;
                }
            }
            set = header.set;
            before = forces.iter().map(|force| force.force[0]).collect();
        })
    }),
    Clause::must("F-7o", "the dashpot adds -c u_N", dashpot)
        .after(&["F-7a", "F-7d", "J-1b"])
        .needs(DAMPS)
        .mutant("damps half as much", || {
            change::law(|_, _, _, zeta| *zeta *= 0.5)
        }),
    Clause::must(
        "F-7r",
        "the dashpot follows displacements, not the velocity that a point reports",
        |bench| falls(bench, 0.05),
    )
    .after(&["F-7o"])
    .needs(DAMPS)
    .mutant("damps the velocity that a point reports", || {
        sliding(damped(0.1), |points| {
            let [normal, along] = points.contact.parts(points.force.force);
            let normal = normal - damping() * points.unseen[0] / DT;
            points.force.force = points.contact.force(normal, along);
        })
    }),
    Clause::must("F-7p", "the dashpot never pulls", no_pull)
        .after(&["F-8a", "F-7a", "F-7o"])
        .needs(DAMPS)
        .mutant("pulls points that leave fast", || {
            change::answers(|states, forces| {
                if states.iter().any(|state| state.velocity[1] > 5.0) {
                    forces.iter_mut().for_each(|force| force.force[1] -= 1.0);
                }
            })
        }),
];

/// What depends on the ledger and on motion too.
pub const TURNING: &[Clause] = &[
    Clause::must(
        "R-3g",
        "friction's torque has its arm to the contact point",
        arm,
    )
    .after(&["F-7a", "F-7d", "J-1b", "F-7k", "F-7l", "R-3d", "T-4a"])
    .needs(&["feature:friction", "motion:free"])
    .mutant("measures torque with an arm to the point's centre", || {
        on_free_disc(|force, disc| disc.point_torque += RADIUS * force.force[0])
    })
    .mutant("reverses the torque of friction", || {
        on_free_disc(|_, disc| disc.point_torque *= -1.0)
    }),
    Clause::must("F-7q", "friction turns a body by that torque", turned)
        .after(&[
            "F-7a", "F-7d", "J-1b", "F-7j", "F-7k", "F-7l", "R-3d", "T-1a", "T-4a", "R-3g",
        ])
        .needs(&["feature:friction", "motion:free"])
        .mutant("turns bodies with an arm to the point's centre", || {
            on_free_disc(|_, disc| disc.spin *= 1.0 + RADIUS / SPHERO)
        }),
];

const MU: f64 = 0.5;
/// Tangential stiffness in N/m.
const TANGENTIAL: f64 = 2e4;
/// Sliding in a step, in m.
const SLIDE: f64 = 1e-4;
const DT: f64 = 1e-3;

/// What a mutant sees of the one point that slides on one fixed body.
struct Sliding<'a> {
    contact: Contact,
    force: &'a mut ImpForce,
    /// What the point's velocity says that it moves in a step, less what it has moved, along normal and ground, in m.
    unseen: [f64; 2],
}

/// The configuration of a message, if it is one.
fn configuration(message: &Message) -> Option<DemConfig> {
    match message.as_order() {
        Ok(Order::Configure(configure)) => serde_json::from_str(&configure.config).ok(),
        _ => None,
    }
}

/// Changes the force on the only point where it slides on a ground of this law.
fn sliding(law: ContactLaw, mut change: impl FnMut(Sliding) + 'static) -> Flaw {
    let grounds = [Ground::Floor, Ground::Hill];
    let mut ground = None;
    let (mut now, mut last): (Option<ImpState>, Option<ImpState>) = (None, None);
    Flaw::each(move |message| {
        if let Some(config) = configuration(message) {
            let body = config
                .bodies
                .first()
                .filter(|_| config.point_contact == law);
            ground = body.and_then(|body| grounds.into_iter().find(|g| g.body() == *body));
        }
        match (&mut message.payload, ground) {
            (Payload::States(states), _) if states.len() == 1 => {
                (last, now) = (now, states.first().copied());
            }
            (Payload::Forces(forces), Some(ground)) if forces.len() == 1 => {
                let Some(now) = now else { return };
                let contact = ground.under(now.position);
                let unseen = last.map_or([0.0; 2], |last| {
                    [0, 1].map(|i| DT * now.velocity[i] - (now.position[i] - last.position[i]))
                });
                // If it reports its own motion, only rounding is left.
                let unseen = contact
                    .parts(unseen)
                    .map(|x| if x.abs() > 1e-9 { x } else { 0.0 });
                change(Sliding {
                    contact,
                    force: &mut forces[0],
                    unseen,
                });
            }
            _ => {}
        }
    })
}

/// The same where there is friction.
fn rubbing(change: impl FnMut(Sliding) + 'static) -> Flaw {
    sliding(frictional(TANGENTIAL, MU), change)
}

/// Changes what is measured of the only body, a free disc that a point has rubbed, given that point's last force.
fn on_free_disc(change: fn(&ImpForce, &mut BodyState)) -> Flaw {
    let (mut rubbed, mut last) = (false, ImpForce::default());
    Flaw::each(move |message| {
        if let Some(config) = configuration(message) {
            let law = config.point_contact == frictional(TANGENTIAL, MU);
            let free = config.bodies.len() == 1 && config.bodies[0].motion == Motion::Free;
            rubbed = law && free;
        }
        match &mut message.payload {
            Payload::Forces(forces) if forces.len() == 1 => last = forces[0],
            Payload::Bodies(bodies) => {
                if let (true, [body]) = (rubbed, &mut bodies[..]) {
                    change(&last, body);
                }
            }
            _ => {}
        }
    })
}

/// A point that slides on a ground.
struct Slider<'b> {
    play: BodiesRun<'b>,
    ground: Ground,
    way: f64,
}

impl<'b> Slider<'b> {
    /// One that has just been set on the ground.
    fn landed(bench: &'b Bench, ground: Ground, law: ContactLaw) -> Result<Self, Unmet> {
        let play = bench.run_bodies(&scene(vec![ground.body()], law))?;
        let mut slider = Self {
            play,
            ground,
            way: 0.0,
        };
        let at = slider.ground.at(0.0, SLIDE, OVERLAP);
        slider
            .play
            .set(&Points::new().with(at.position, [0.0; 2], RADIUS, 0.5).set);
        slider.step(0.0, OVERLAP, 0.0)?;
        Ok(slider)
    }

    /// Goes on by `steps` of [`SLIDE`]; forces along the normal and along the ground, where its velocity is `speed`.
    fn step(&mut self, steps: f64, overlap: f64, speed: f64) -> Result<[f64; 2], Unmet> {
        self.way += steps * SLIDE;
        let at = self.ground.at(self.way, SLIDE, overlap);
        let velocity = at.along.map(|x| speed * x);
        let points = Points::new().with(at.position, velocity, RADIUS, 0.5);
        let (answer, _) = self.play.step(DT, &points.states)?;
        Ok(at.parts(answer.forces[0].force))
    }

    /// Slides by a step in each of these directions; the force along the ground at the end.
    fn slide(&mut self, directions: &[f64]) -> Result<f64, Unmet> {
        let mut force = [0.0; 2];
        for direction in directions {
            force = self.step(*direction, OVERLAP, direction * SLIDE / DT)?;
        }
        Ok(force[1])
    }

    fn near(&self, what: &str, got: f64, want: f64) -> Result<(), Unmet> {
        near(what, got, want, 1e-9).map_err(|e| e.at(self.play.next() - 1))
    }
}

/// Judges a slider on each ground that the solver takes.
fn on_each(bench: &Bench, law: ContactLaw, judge: impl Fn(Slider) -> Judgement) -> Judgement {
    let mut said = String::new();
    for ground in Ground::of(bench) {
        said = judge(Slider::landed(bench, ground, law)?)?;
    }
    Ok(said)
}

fn coulomb(bench: &Bench) -> Judgement {
    let cap = MU * STIFFNESS * OVERLAP;
    on_each(bench, frictional(TANGENTIAL, MU), |mut slider| {
        for direction in [1.0, -1.0] {
            for _ in 0..40 {
                let force = slider.slide(&[direction])?.abs();
                let within = force <= cap * (1.0 + 1e-9);
                require(within, format_args!("at most {cap} N/m"), force)
                    .map_err(|e| e.at(slider.play.next() - 1))?;
            }
            let force = slider.slide(&[direction])?;
            slider.near("friction", force, -direction * cap)?;
        }
        Ok(format!("{cap} N/m both ways"))
    })
}

fn spring(bench: &Bench) -> Judgement {
    on_each(bench, frictional(TANGENTIAL, MU), |mut slider| {
        for k in 1..10 {
            let force = slider.slide(&[1.0])?;
            slider.near("friction", force, -TANGENTIAL * SLIDE * f64::from(k))?;
        }
        // Slid to the limit of friction and moved back by three steps.
        let force = slider.slide(&[[1.0; 20].as_slice(), &[-1.0; 3]].concat())?;
        let want = -MU * STIFFNESS * OVERLAP + 3.0 * TANGENTIAL * SLIDE;
        slider.near("friction after sliding", force, want)?;
        Ok("k_t times the way, forth and back".into())
    })
}

fn noisy_slide(bench: &Bench) -> Judgement {
    on_each(bench, frictional(TANGENTIAL, MU), |mut slider| {
        for k in 1..6 {
            let force = slider.step(1.0, OVERLAP, -0.5 * SLIDE / DT)?[1];
            slider.near("friction", force, -TANGENTIAL * SLIDE * f64::from(k))?;
        }
        Ok("the same with a velocity that points backwards".into())
    })
}

fn frictionless(bench: &Bench) -> Judgement {
    let mut worst: f64 = 0.0;
    for ground in Ground::of(bench) {
        // The solver may have laws without friction only.
        let mut slider = Slider::landed(bench, ground, frictional(TANGENTIAL, 0.0))?;
        for _ in 0..10 {
            let [normal, along] = slider.step(1.0, OVERLAP, SLIDE / DT)?;
            // The normal is a difference of coordinates over its length, each rounded; so is the kit's own.
            let rounding = 32.0 * f64::EPSILON * normal;
            require(
                along.abs() <= rounding,
                format_args!("0 within {rounding:.1e} N/m"),
                along,
            )
            .map_err(|e| e.at(slider.play.next() - 1))?;
            worst = worst.max(along.abs());
        }
    }
    Ok(format!("up to {worst:.0e} N/m in ten steps"))
}

fn forgotten(bench: &Bench) -> Judgement {
    on_each(bench, frictional(TANGENTIAL, MU), |mut slider| {
        slider.slide(&[1.0; 5])?;
        slider.step(0.0, -OVERLAP, 0.0)?;
        let force = slider.step(0.0, OVERLAP, 0.0)?[1];
        slider.near("friction of the new contact", force, 0.0)?;
        let force = slider.slide(&[1.0])?;
        slider.near("friction after a step", force, -TANGENTIAL * SLIDE)?;
        Ok("0, then from the beginning".into())
    })
}

/// Points 5 and 9 on hills of their own, which have slid by so many steps, and one that touches nothing before them.
fn two_sliders(steps: [f64; 2], before: bool) -> (Points, [Contact; 2]) {
    let mut points = Points::new();
    if before {
        points = points.with([-0.5, 1.0], [0.0; 2], RADIUS, 0.5);
    }
    let contacts = steps.map(|steps| Ground::Hill.at(steps * SLIDE, SLIDE, OVERLAP));
    for (k, at) in contacts.iter().enumerate() {
        let position = [at.position[0] + k as f64, at.position[1]];
        points = points.with(position, [0.0; 2], RADIUS, 0.5);
    }
    let ids = if before {
        [3, 5, 9].as_slice()
    } else {
        &[5, 9]
    };
    for (info, id) in points.set.iter_mut().zip(ids) {
        info.id = *id;
    }
    (points, contacts)
}

fn carried_over(bench: &Bench) -> Judgement {
    let hills = [0.0, 1.0].map(|x| {
        let mut hill = Ground::Hill.body();
        hill.position[0] = x;
        hill
    });
    let mut play = bench.run_bodies(&scene(hills.to_vec(), frictional(TANGENTIAL, MU)))?;
    play.set(&two_sliders([0.0; 2], false).0.set);
    for k in 0..6 {
        let (points, _) = two_sliders([f64::from(k), f64::from(k.min(2))], false);
        play.step(DT, &points.states)?;
    }
    let slid = [6.0, 2.0];
    let (points, contacts) = two_sliders(slid, true);
    play.set(&points.set);
    let (answer, _) = play.step(DT, &points.states)?;
    for (k, (contact, slid)) in contacts.iter().zip(slid).enumerate() {
        let got = contact.parts(answer.forces[k + 1].force)[1];
        near("friction", got, -TANGENTIAL * slid * SLIDE, 1e-9)?;
    }
    Ok("springs of two points in other slots".into())
}

/// A point that has slid over a free disc by a step, seen in a step of `dt` (s) after it.
fn rubbed(bench: &Bench, dt: f64) -> Result<(Answer, WindowReport), Unmet> {
    let config = scene(vec![disc([0.0, -SPHERO])], frictional(TANGENTIAL, MU));
    let mut play = bench.run_bodies(&config)?;
    let at = |steps: f64| {
        let at = Ground::Hill.at(steps * SLIDE, SLIDE, OVERLAP);
        Points::new().with(at.position, [0.0; 2], RADIUS, 0.5)
    };
    play.set(&at(0.0).set);
    // So short that the disc hardly moves; positions determine the sliding.
    play.step(1e-6, &at(0.0).states)?;
    let slid = play.step(dt, &at(1.0).states)?;
    if dt == 0.0 {
        return Ok(slid);
    }
    // Away from it, and a closing step, so that its spin is that of the one push.
    let away = Points::new().with([0.0, 1.0], [0.0; 2], RADIUS, 0.5);
    let (_, after) = play.step(0.0, &away.states)?;
    Ok((slid.0, after))
}

/// The torque of that force on the disc, in N: the arm is a - xi/2.
fn torque_of(answer: &Answer) -> f64 {
    let along = Ground::Hill.at(SLIDE, SLIDE, OVERLAP);
    let friction = along.parts(answer.forces[0].force)[1];
    (SPHERO - 0.5 * OVERLAP) * friction
}

fn arm(bench: &Bench) -> Judgement {
    let (answer, measured) = rubbed(bench, 0.0)?;
    let (want, got) = (torque_of(&answer), measured.bodies(1)?[0].point_torque);
    require(
        want.abs() > 1e-3,
        "friction",
        format_args!("a torque of {want} N"),
    )?;
    // The disc has moved by k_n xi / m dt^2, 4e-11 m, before the point has slid.
    near("torque", got, want, 1e-5 * want.abs())?;
    Ok(format!("{got:.5} N with an arm of a - xi/2"))
}

fn turned(bench: &Bench) -> Judgement {
    let dt = 1e-6;
    let (answer, measured) = rubbed(bench, dt)?;
    let body = measured.bodies(1)?[0];
    let (want, got) = (torque_of(&answer) * dt / body.inertia, body.spin);
    near("spin", got, want, 1e-4 * want.abs())?;
    near("mass", body.mass, MASS, 1e-12 * MASS)?;
    Ok(format!("{got:.4e} rad/s after a step"))
}

/// c of a fixed body and a point of 0.5 kg/m, in N s/m.
fn damping() -> f64 {
    2.0 * 0.1 * (STIFFNESS * 0.5).sqrt()
}

/// A point that moves down into the ground at 0.1 m/s and reports the velocity `told` (m/s).
fn falls(bench: &Bench, told: f64) -> Judgement {
    let speed = 0.1;
    for ground in Ground::of(bench) {
        let mut slider = Slider::landed(bench, ground, damped(0.1))?;
        for k in 1..5 {
            let overlap = OVERLAP + f64::from(k) * speed * DT;
            let at = slider.ground.at(0.0, SLIDE, overlap);
            let points = Points::new().with(at.position, [0.0, told], RADIUS, 0.5);
            let (answer, _) = slider.play.step(DT, &points.states)?;
            let want = STIFFNESS * overlap + damping() * speed;
            near("force", answer.forces[0].force[1], want, 1e-9 * want)
                .map_err(|e| e.at(answer.step.index))?;
        }
    }
    Ok(format!("c = {:.3} N s/m", damping()))
}

fn dashpot(bench: &Bench) -> Judgement {
    falls(bench, -0.1)
}

fn no_pull(bench: &Bench) -> Judgement {
    // So fast that the dashpot would pull five times as hard as the spring pushes.
    let speed = 5.0 * STIFFNESS * OVERLAP / damping();
    for ground in Ground::of(bench) {
        let mut play = bench.run_bodies(&scene(vec![ground.body()], damped(0.1)))?;
        let at = ground.at(0.0, SLIDE, OVERLAP);
        let points = Points::new().with(at.position, [0.0, speed], RADIUS, 0.5);
        play.set(&points.set);
        let got = play.step(1e-6, &points.states)?.0.forces[0].force[1];
        require(got == 0.0, "0", got)?;
    }
    Ok(format!("0 at {speed:.1} m/s"))
}
