//! A configuration is read back unchanged, and nothing in it may be missing or unknown.

use interface::config::surfaces::ContactPair;
use interface::config::{
    BodyConfig, BodyInertia, BodyShape, ContactForceScheme, ContactLaw, CriticalState, DemConfig,
    Fill, Forcing, Frictional, GridContact, GroupConfig, GroupPair, Hold, Inertial, InitialFields,
    Interface, Lattice, Leaving, MaterialConfig, MaterialModel, Motion, MpmConfig, OverlapMeasure,
    Plane, Probe, ShapeFunction, Spacing, Stage, StressUpdate, Traction, Transfer, Wall, Walls,
};
use proptest::prelude::*;
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::plain::{plain_bodies, plain_continuum};

fn text(value: &impl Serialize) -> String {
    serde_json::to_string(value).expect("written")
}

/// As JSON and back.
fn again<T: Serialize + DeserializeOwned>(value: &T) -> T {
    let json = text(value);
    serde_json::from_str(&json).unwrap_or_else(|error| panic!("{error}: {json}"))
}

/// A sum with -0.0 may have another sign than one with 0.0.
#[test]
fn a_negative_zero_stays_one() {
    let mut bodies = plain_bodies();
    bodies.gravity = [0.0, -0.0];
    bodies.bodies[0].velocity = [-0.0, 0.0];
    bodies.bodies[0].spin = -0.0;
    let bodies = again(&bodies);
    assert!(bodies.gravity[1].is_sign_negative() && bodies.gravity[0].is_sign_positive());
    let ball = &bodies.bodies[0];
    assert!(ball.velocity[0].is_sign_negative() && ball.spin.is_sign_negative());
}

#[test]
fn what_is_unknown_or_missing_is_refused_by_its_name() {
    fn error<T: DeserializeOwned>(config: &impl Serialize, change: (&str, &str)) -> String {
        let changed = text(config).replace(change.0, change.1);
        let read = serde_json::from_str::<T>(&changed).err();
        read.expect("refused").to_string()
    }
    let newer = error::<MpmConfig>(&plain_continuum(), ("\"skin\"", "\"phase\":2,\"skin\""));
    assert!(newer.contains("unknown field `phase`"), "{newer}");
    let without = error::<MpmConfig>(&plain_continuum(), (",\"threads\":1", ""));
    assert!(without.contains("missing field `threads`"), "{without}");
    let without = error::<DemConfig>(&plain_bodies(), ("\"position\":[0.0,0.0],", ""));
    assert!(without.contains("missing field `position`"), "{without}");
}

/// Numbers that JSON carries, among them the defaults.
fn number() -> impl Strategy<Value = f64> {
    prop_oneof![
        Just(0.0),
        Just(-0.0),
        Just(1.0),
        any::<f64>().prop_filter("finite", |x| x.is_finite())
    ]
}

fn vector() -> impl Strategy<Value = [f64; 2]> {
    [number(), number()]
}

fn law() -> impl Strategy<Value = ContactLaw> {
    (
        0..4,
        [
            number(),
            number(),
            number(),
            number(),
            number(),
            number(),
            number(),
        ],
    )
        .prop_map(|(kind, n)| {
            let [
                normal_stiffness,
                tangential_stiffness,
                friction,
                damping_ratio,
                damped_mass,
                adhesion,
                last,
            ] = n;
            match kind {
                0 => ContactLaw::Linear {
                    normal_stiffness,
                    tangential_stiffness,
                    friction,
                    damping_ratio,
                    damped_mass,
                },
                1 => ContactLaw::Granular {
                    normal_stiffness,
                    tangential_stiffness,
                    friction,
                    damping_ratio,
                    damped_mass,
                    adhesion,
                    rolling_friction: last,
                },
                2 => ContactLaw::HertzMindlin {
                    hertz_constant: normal_stiffness,
                    poisson_ratio: last,
                    friction,
                    restitution: damping_ratio,
                    adhesion,
                },
                _ => ContactLaw::Area {
                    area_stiffness: normal_stiffness,
                    tangential_stiffness,
                    friction,
                },
            }
        })
}

fn shape() -> impl Strategy<Value = BodyShape> {
    let points = || prop::collection::vec(vector(), 1..4);
    prop_oneof![
        Just(BodyShape::Disc),
        [vector(), vector()].prop_map(|ends| BodyShape::Segment { ends }),
        points().prop_map(|vertices| BodyShape::Polygon { vertices }),
        vector().prop_map(|[width, height]| BodyShape::Rectangle { width, height }),
        (points(), prop::collection::vec(number(), 0..3))
            .prop_map(|(centers, radii)| BodyShape::Cluster { centers, radii }),
    ]
}

fn motion() -> impl Strategy<Value = Motion> {
    prop_oneof![
        Just(Motion::Free),
        Just(Motion::Fixed),
        Just(Motion::Driven),
        any::<[bool; 3]>().prop_map(|[hold_x, hold_y, hold_angle]| Motion::Guided {
            hold_x,
            hold_y,
            hold_angle,
        }),
        (vector(), vector(), prop::option::of(number())).prop_map(
            |(force, [torque, ramp], until)| {
                Motion::Pushed {
                    force,
                    torque,
                    ramp,
                    until,
                }
            }
        ),
    ]
}

fn any_body() -> impl Strategy<Value = BodyConfig> {
    let inertia = prop_oneof![
        number().prop_map(BodyInertia::Density),
        number().prop_map(BodyInertia::Mass),
    ];
    let numbers = (number(), vector(), number(), vector(), number());
    let surface = prop_oneof![Just(String::new()), Just("steel".to_owned())];
    (shape(), inertia, numbers, motion(), surface).prop_map(
        |(shape, inertia, (sphero_radius, position, angle, velocity, spin), motion, surface)| {
            BodyConfig {
                name: "body".into(),
                shape,
                sphero_radius,
                inertia,
                position,
                angle,
                velocity,
                spin,
                motion,
                surface,
            }
        },
    )
}

fn interface() -> impl Strategy<Value = Interface> {
    prop::sample::select(vec![Interface::Points, Interface::Segments])
}

fn any_bodies() -> impl Strategy<Value = DemConfig> {
    let overlap = prop::sample::select(vec![
        OverlapMeasure::EachEdge,
        OverlapMeasure::NearestEdge,
        OverlapMeasure::Area,
    ]);
    let pair = law().prop_map(|law| ContactPair {
        between: ["a".into(), "b".into()],
        law,
    });
    let of_groups = law().prop_map(|law| GroupPair {
        between: [0, 1],
        law,
    });
    let laws = (
        prop_oneof![Just(ContactLaw::default()), law()],
        prop::option::of(law()),
        prop::collection::vec(pair, 0..3),
        prop::collection::vec(of_groups, 0..2),
    );
    let bodies = prop::collection::vec(any_body(), 0..3);
    (
        vector(),
        bodies,
        laws,
        overlap,
        interface(),
        (number(), 1_usize..3, prop::option::of(number())),
    )
        .prop_map(
            |(
                gravity,
                bodies,
                (point_contact, body_contact, contact_pairs, group_pairs),
                overlap,
                interface,
                (skin, threads, contact_resolution),
            )| {
                DemConfig {
                    contact_resolution,
                    gravity,
                    bodies,
                    point_contact,
                    body_contact,
                    overlap,
                    point_surfaces: contact_pairs.iter().map(|_| "sand".to_owned()).collect(),
                    contact_pairs,
                    group_pairs,
                    interface,
                    skin,
                    threads,
                }
            },
        )
}

fn wall() -> impl Strategy<Value = Wall> {
    prop_oneof![
        Just(Wall::Open),
        Just(Wall::Fixed),
        Just(Wall::Slip),
        Just(Wall::Tangential),
        Just(Wall::Periodic),
        number().prop_map(|coefficient| Wall::Friction { coefficient }),
        number().prop_map(|speed| Wall::Driven { speed }),
    ]
}

fn forcing() -> impl Strategy<Value = Forcing> {
    let formulas = prop::option::of(Just(["x*t".to_owned(), "0".to_owned()]));
    let traction = [vector(), vector(), vector()].prop_map(|[lower, upper, force]| Traction {
        points: "points".into(),
        within: [lower, upper],
        force,
    });
    let stage = (number(), number(), prop::option::of(number())).prop_map(
        |(from, damping, pic_fraction)| Stage {
            from,
            damping,
            pic_fraction,
        },
    );
    let lists = (
        prop::collection::vec(traction, 0..2),
        prop::collection::vec(stage, 0..3),
    );
    (formulas, lists).prop_map(|(body_force, (tractions, stages))| Forcing {
        holds: tractions.iter().map(held).collect(),
        body_force,
        tractions,
        stages,
    })
}

/// A hold in the place of a load.
fn held(load: &Traction) -> Hold {
    Hold {
        name: "support".into(),
        points: load.points.clone(),
        within: load.within,
        hold_x: load.force[0] > 0.0,
        hold_y: load.force[1] > 0.0,
    }
}

/// A probe in the place of a load.
fn probed(load: &Traction) -> Probe {
    Probe {
        name: "middle".into(),
        points: load.points.clone(),
        within: load.within,
    }
}

fn group() -> impl Strategy<Value = GroupConfig> {
    let points = || prop::collection::vec(vector(), 1..3);
    let fill = prop_oneof![
        (vector(), number()).prop_map(|(center, radius)| Fill::Disc { center, radius }),
        (vector(), number(), number()).prop_map(|(center, radius, inner)| Fill::Ring {
            center,
            radius,
            inner
        }),
        [vector(), vector()].prop_map(|[lower, upper]| Fill::Rectangle { lower, upper }),
        points().prop_map(|vertices| Fill::Polygon { vertices }),
        points().prop_map(|positions| Fill::Points { positions }),
    ];
    let spacing = prop_oneof![
        (1_u32..50).prop_map(Spacing::PerCell),
        number().prop_map(Spacing::Distance),
        any::<[u32; 2]>().prop_map(Spacing::Counts),
    ];
    let stress = ["1", "x", "0", "y"].map(str::to_owned);
    let fields = (
        prop::option::of(Just(["x".to_owned(), "y".to_owned()])),
        prop::option::of(Just(stress)),
    );
    let fields = fields.prop_map(|(velocity, stress)| InitialFields { velocity, stress });
    let lattice = prop::sample::select(vec![Lattice::Grid, Lattice::Outline]);
    let rest = (
        vector(),
        fields,
        prop::option::of(number()),
        any::<bool>(),
        lattice,
    );
    (0_usize..3, fill, spacing, rest).prop_map(
        |(material, fill, spacing, (velocity, fields, contact_radius, rigid, lattice))| {
            GroupConfig {
                name: "points".into(),
                material,
                fill,
                spacing,
                velocity,
                fields,
                contact_radius,
                rigid,
                keeps_spin: !rigid,
                lattice,
            }
        },
    )
}

fn model() -> impl Strategy<Value = MaterialModel> {
    (
        0..10_usize,
        [number(), number(), number(), number(), number(), number()],
    )
        .prop_map(|(kind, n)| {
            let [
                bulk_modulus,
                shear_modulus,
                friction_angle,
                dilation_angle,
                cohesion,
                tension,
            ] = n;
            let frictional = Frictional {
                bulk_modulus,
                shear_modulus,
                friction_angle,
                dilation_angle,
                cohesion,
                tensile_strength: tension,
                critical_state: [
                    None,
                    Some(CriticalState::ShearStrain(cohesion)),
                    Some(CriticalState::Volume(tension)),
                ][kind % 3],
                separates: kind % 2 == 0,
            };
            match kind {
                0 => MaterialModel::LinearElastic {
                    bulk_modulus,
                    shear_modulus,
                },
                1 | 6 | 7 => MaterialModel::DruckerPrager(frictional),
                2 => MaterialModel::MohrCoulomb(frictional),
                3 => MaterialModel::NeoHookean {
                    bulk_modulus,
                    shear_modulus,
                },
                4 => MaterialModel::Fluid {
                    bulk_modulus,
                    exponent: cohesion,
                    viscosity: tension,
                },
                5 => MaterialModel::Hypoelastic {
                    bulk_modulus,
                    shear_modulus,
                },
                8 => MaterialModel::MuI(Inertial {
                    bulk_modulus,
                    shear_modulus,
                    static_friction: friction_angle,
                    limit_friction: dilation_angle,
                    inertial_number: cohesion,
                    grain_diameter: tension,
                    grain_density: tension,
                    volume_rate: cohesion,
                }),
                _ => MaterialModel::VonMises {
                    bulk_modulus,
                    shear_modulus,
                    yield_stress: cohesion,
                    hardening_modulus: tension,
                },
            }
        })
}

/// Choices of the continuum as a whole.
fn scheme() -> impl Strategy<Value = MpmConfig> {
    let shape = prop::sample::select(vec![
        ShapeFunction::Linear,
        ShapeFunction::Ugimp,
        ShapeFunction::QuadraticBspline,
        ShapeFunction::CubicBspline,
    ]);
    let transfer = prop_oneof![
        Just(Transfer::Pic),
        Just(Transfer::Flip),
        Just(Transfer::Apic),
        number().prop_map(|pic_fraction| Transfer::Blend { pic_fraction }),
        (1_u32..9).prop_map(|order| Transfer::Xpic { order }),
        number().prop_map(|pic_rate| Transfer::FlipPic { pic_rate }),
        number().prop_map(|pic_rate| Transfer::Aflip { pic_rate }),
        (1_u32..9, number()).prop_map(|(order, pic_rate)| Transfer::FlipXpic { order, pic_rate }),
    ];
    let updates = [
        StressUpdate::Usf,
        StressUpdate::Usl,
        StressUpdate::Musl,
        StressUpdate::Usavg,
    ];
    let update = prop::sample::select(updates.to_vec());
    let forces = [
        ContactForceScheme::Point,
        ContactForceScheme::NearestNodes,
        ContactForceScheme::Traction,
    ];
    let contact_force = prop::sample::select(forces.to_vec());
    let twofold = any::<[bool; 3]>();
    (shape, transfer, update, contact_force, twofold, interface()).prop_map(
        |(shape, transfer, stress_update, contact_force, [stress, remove, layers], interface)| {
            MpmConfig {
                shape,
                transfer,
                stress_update,
                contact_force,
                plane: if stress { Plane::Stress } else { Plane::Strain },
                leaving: if remove {
                    Leaving::Remove
                } else {
                    Leaving::Stop
                },
                layers,
                group_pairs: if layers { vec![[0, 1]] } else { Vec::new() },
                interface,
                ..plain_continuum()
            }
        },
    )
}

fn any_continuum() -> impl Strategy<Value = MpmConfig> {
    let material = (number(), model()).prop_map(|(density, model)| MaterialConfig {
        name: "stuff".into(),
        density,
        model,
    });
    let lists = (
        prop::collection::vec(material, 0..3),
        prop::collection::vec(group(), 0..3),
    );
    let numbers = (
        [vector(), vector()],
        number(),
        vector(),
        number(),
        1_usize..3,
    );
    let constants = prop::collection::btree_map("[a-z]{1,3}", number(), 0..3);
    let friction = prop::option::of(number());
    (
        scheme(),
        [wall(), wall(), wall(), wall()],
        lists,
        forcing(),
        numbers,
        constants,
        friction,
    )
        .prop_map(
            |(
                scheme,
                [left, right, bottom, top],
                (materials, groups),
                forcing,
                numbers,
                constants,
                friction,
            )| {
                let (domain, cell, gravity, skin, threads) = numbers;
                MpmConfig {
                    domain,
                    cell,
                    gravity,
                    walls: Walls {
                        left,
                        right,
                        bottom,
                        top,
                    },
                    materials,
                    groups,
                    probes: forcing.tractions.iter().map(probed).collect(),
                    forcing,
                    constants,
                    grid_contact: friction.map(|friction| GridContact { friction }),
                    skin,
                    threads,
                    ..scheme
                }
            },
        )
}

proptest! {
    #[test]
    fn a_continuum_reads_back_as_it_was(config in any_continuum()) {
        prop_assert_eq!(again(&config), config);
    }

    #[test]
    fn bodies_read_back_as_they_were(config in any_bodies()) {
        prop_assert_eq!(again(&config), config);
    }
}
