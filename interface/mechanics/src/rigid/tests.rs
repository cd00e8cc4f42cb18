//! Contact with points, kick and ledger of this crate, compared with closed forms.

use crate::rigid::{Body, PointContact, Ways};
use interface::Vec2;
use interface::config::{BodyConfig, BodyInertia, BodyShape, ContactLaw, Motion};
use interface::forces::{Contact, Forces, Load};
use interface::ledger::{Totals, measure};
use interface::message::wire::ImpState;
use interface::step::Step;

const MASS: f64 = 1.5;
const RADIUS: f64 = 0.02;
const POINT: f64 = 0.01;

fn config(shape: BodyShape, motion: Motion) -> BodyConfig {
    BodyConfig {
        name: "body".into(),
        shape,
        sphero_radius: RADIUS,
        inertia: BodyInertia::Mass(MASS),
        position: [0.1, 0.2],
        motion,
        ..BodyConfig::default()
    }
}

fn springs(tangential_stiffness: f64, friction: f64) -> PointContact {
    let law = ContactLaw::Linear {
        normal_stiffness: 6e4,
        tangential_stiffness,
        friction,
        damping_ratio: 0.0,
        damped_mass: 0.0,
    };
    PointContact::new(&law).unwrap()
}

fn step(dt_before: f64, dt: f64) -> Step {
    Step {
        index: 1,
        time: 0.0,
        dt_before,
        dt,
        measure: true,
    }
}

/// A point on the right of the disc, pressed in by `overlap` (m).
fn at(overlap: f64) -> Vec2 {
    Vec2::new(0.1 + RADIUS + POINT - overlap, 0.2)
}

/// The loads of a disc and the forces on one point on its right, of this contact with it.
fn forces(disc: &Body, contact: &Contact) -> Forces {
    let mut forces = Forces::default();
    let point = ImpState {
        position: at(1e-3).into(),
        ..ImpState::default()
    };
    forces.clear(&[point], [Load::none(&disc.state(), disc.entry.yielding)]);
    forces.add(contact);
    forces
}

#[test]
fn a_point_is_pushed_by_k_xi_and_the_body_back_by_the_same() {
    let disc = Body::new(0, &config(BodyShape::Disc, Motion::Free)).unwrap();
    let law = springs(0.0, 0.0);
    let press = |overlap| law.press(&disc, POINT, at(overlap), &Ways::default(), &mut 0.0);
    let (contact, _) = press(1e-3).expect("within reach");
    let force = contact.force;
    assert!((force - Vec2::new(60.0, 0.0)).norm() < 1e-10, "{force}");
    let pressed = forces(&disc, &contact);
    let load = pressed.on_bodies()[0];
    assert_eq!(load.force, -force);
    assert!(load.torque.abs() < 1e-12 && load.contacts == 1);
    // L-2 of a central contact: k/m; energy k xi^2/2.
    let rate = load.rate;
    assert!((rate - 6e4 / MASS).abs() < 1e-9 * rate, "{rate}");
    assert!((pressed.stored - 0.03).abs() < 1e-13);
    // F-6: in reach and not yet pressed, then out of reach.
    let (near, _) = press(-0.4 * POINT).expect("within reach");
    let near = forces(&disc, &near);
    assert_eq!(near.on_points()[0].force, [0.0; 2]);
    assert!(near.on_bodies()[0].rate > 0.0 && near.on_bodies()[0].contacts == 0);
    assert_eq!(press(-0.6 * POINT), None);
}

/// What a solver leaves out, the driver takes for the worst: any normal, and a linear spring.
#[test]
fn a_contact_without_its_normal_is_bounded_for_any() {
    let disc = Body::new(0, &config(BodyShape::Disc, Motion::Free)).unwrap();
    let law = springs(0.0, 0.0);
    let pressed = law.press(&disc, POINT, at(1e-3), &Ways::default(), &mut 0.0);
    let (contact, _) = pressed.unwrap();
    let plain = Contact {
        normal: None,
        stored: None,
        ..contact
    };
    let [known, plain] = [contact, plain].map(|contact| forces(&disc, &contact));
    assert!(plain.on_bodies()[0].rate > 1.5 * known.on_bodies()[0].rate);
    assert!((plain.stored - known.stored).abs() < 1e-15);
}

#[test]
fn friction_is_a_spring_up_to_mu_f_n_and_what_slides_is_lost() {
    let disc = Body::new(0, &config(BodyShape::Disc, Motion::Fixed)).unwrap();
    let (law, mut spring) = (springs(2e4, 0.5), 0.0);
    let mut press = |slid| {
        let moved = Vec2::new(0.0, slid);
        let ways = Ways {
            moved,
            ..Ways::default()
        };
        let pressed = law.press(&disc, POINT, at(1e-3), &ways, &mut spring);
        let (contact, loss) = pressed.unwrap();
        (contact.force.y, loss, spring)
    };
    let (force, loss, _) = press(1e-4);
    assert!((force + 2.0).abs() < 1e-10 && loss.abs() < 1e-15);
    // mu F_n = 30 N/m at 1.5 mm of spring; 2 mm further 0.6 mm slip under a force that rises from 2 to 30 N/m.
    let (force, loss, spring) = press(2e-3);
    assert!((force + 30.0).abs() < 1e-10 && (spring - 1.5e-3).abs() < 1e-15);
    assert!((loss - 0.5 * (2.0 + 30.0) * 0.6e-3).abs() < 1e-14, "{loss}");
}

/// The surface of the point lies 9.5 mm to the left of its centre: there a turn moves it down, and friction turns it.
#[test]
fn a_point_that_turns_rubs_as_one_that_slides_and_is_turned_back() {
    let disc = Body::new(0, &config(BodyShape::Disc, Motion::Fixed)).unwrap();
    let (law, arm) = (springs(2e4, 0.5), POINT - 0.5e-3);
    let ways = Ways {
        spun: 1e-4 / arm,
        ..Ways::default()
    };
    let (contact, _) = law.press(&disc, POINT, at(1e-3), &ways, &mut 0.0).unwrap();
    assert!((contact.force.y - 2.0).abs() < 1e-10, "{contact:?}");
    let force = forces(&disc, &contact).on_points()[0];
    assert!((force.couple + 2.0 * arm).abs() < 1e-12, "{force:?}");
    assert_eq!(force.tangential, 2e4);
    let smooth = springs(0.0, 0.0);
    let (contact, _) = smooth
        .press(&disc, POINT, at(1e-3), &ways, &mut 0.0)
        .unwrap();
    let force = forces(&disc, &contact).on_points()[0];
    assert_eq!((force.couple, force.tangential), (0.0, 0.0));
}

#[test]
fn the_kick_is_half_of_both_steps_and_the_ledger_balances_over_it() {
    let gravity = Vec2::new(0.0, -9.81);
    let mut disc = Body::new(0, &config(BodyShape::Disc, Motion::Free)).unwrap();
    let law = springs(0.0, 0.0);
    let pressed = law.press(&disc, POINT, at(1e-3), &Ways::default(), &mut 0.0);
    let pressed = forces(&disc, &pressed.unwrap().0);
    let step = step(1e-3, 3e-3);
    disc.kick(&step, &pressed.on_bodies()[0], gravity).unwrap();
    let expected = [-60.0 / MASS * 2e-3, -9.81 * 2e-3];
    for (got, want) in disc.entry.velocity.iter().zip(expected) {
        assert!((got - want).abs() < 1e-12);
    }
    let mut totals = Totals::default();
    totals.add(&disc.entry, gravity, disc.push(&step), step.kick());
    let entries = std::iter::once(disc.entry);
    let both = [&Totals::default(), &totals];
    let ledger = measure(&step, gravity, pressed.stored, both, entries).ledger;
    for i in 0..2 {
        let kept = ledger.momentum[i] - ledger.applied_impulse[i] - ledger.contact_impulse[i];
        assert!(kept.abs() < 1e-15, "{ledger:?}");
    }
    // T-5: a quarter of the time of the kick lies before t_n, so a quarter of what the velocity gained.
    let speed = 0.25 * expected[0].hypot(expected[1]).powi(2);
    assert!(
        (ledger.kinetic - 0.5 * MASS * speed).abs() < 1e-12,
        "{ledger:?}"
    );
    disc.drift(step.dt);
    let gone = Vec2::from(disc.entry.velocity).norm() * 3e-3;
    assert!((disc.travelled() - gone).abs() < 1e-15);
}

#[test]
fn what_holds_a_body_takes_up_what_points_do_to_it() {
    let mut disc = Body::new(0, &config(BodyShape::Disc, Motion::Fixed)).unwrap();
    let law = springs(0.0, 0.0);
    let pressed = law.press(&disc, POINT, at(1e-3), &Ways::default(), &mut 0.0);
    let pressed = forces(&disc, &pressed.unwrap().0);
    let (step, gravity) = (step(1e-3, 1e-3), Vec2::new(0.0, -9.81));
    disc.kick(&step, &pressed.on_bodies()[0], gravity).unwrap();
    assert_eq!(disc.entry.velocity, [0.0; 2]);
    let mut totals = Totals::default();
    totals.add(&disc.entry, gravity, disc.push(&step), step.kick());
    let [applied, contact] = [totals.applied_impulse, totals.contact_impulse].map(|i| i.value());
    assert!((applied[0] - 60.0 * 1e-3).abs() < 1e-12 && applied[1] == 0.0);
    assert_eq!(contact, applied.map(|x| -x));
}

#[test]
fn what_is_no_convex_body_is_refused_by_its_key() {
    let refusal = |shape| {
        let refused = Body::new(3, &config(shape, Motion::Free)).unwrap_err();
        refused.key
    };
    let notch = vec![[0.0, 0.0], [0.2, 0.0], [0.04, 0.04], [0.0, 0.2]];
    assert_eq!(
        refusal(BodyShape::Polygon { vertices: notch }),
        "dem.body.3.shape"
    );
    let cluster = BodyShape::Cluster {
        centers: vec![[0.0, 0.0]],
        radii: Vec::new(),
    };
    assert_eq!(refusal(cluster), "dem.body.3.shape");
}
