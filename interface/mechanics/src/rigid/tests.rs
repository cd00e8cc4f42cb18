//! Contact with points, kick and ledger of this crate, compared with closed forms.

use crate::rigid::{Body, PointContact, Ways};
use interface::Vec2;
use interface::config::{BodyConfig, BodyInertia, BodyShape, ContactLaw, Motion};
use interface::forces::{Contact, Forces, Load};
use interface::message::wire::ImpState;

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
    let law = ContactLaw::linear(6e4, tangential_stiffness, friction, 0.0);
    PointContact::new(&law).unwrap()
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
