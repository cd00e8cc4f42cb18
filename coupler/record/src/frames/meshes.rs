//! Points, bodies and contacts of an instant as VTK's cells.

use interface::message::wire::{BodyState, ContactState};

use super::instant::{Content, Field, Instant};
use super::vtu::{Array, Cell, Mesh};

/// A body at its initial position.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Outlined {
    /// Its name in the scene.
    pub name: String,
    /// Its outlines in m; several for a cluster.
    pub outlines: Vec<Vec<[f64; 2]>>,
    /// Whether forces move it.
    pub is_free: bool,
}

/// An array with the numbers that `numbers` returns for each item.
fn array<T, const N: usize>(name: &str, of: &[T], numbers: impl Fn(&T) -> [f64; N]) -> Array {
    Array::real(name, N, of.iter().flat_map(numbers).collect())
}

/// A vertex for each point. Stress in VTK's order of a symmetric tensor: xx, yy, zz, xy, yz, xz.
pub(super) fn points(instant: &Instant, content: &Content) -> Mesh {
    let points = &instant.points;
    let mut mesh = Mesh {
        points: points.iter().map(|p| p.position).collect(),
        ends: (1..=points.len()).collect(),
        of_points: content.keep([
            (
                None,
                Array::whole("id", points.iter().map(|p| p.id as f64).collect()),
            ),
            (
                None,
                Array::whole("group", points.iter().map(|p| p.group.into()).collect()),
            ),
            (
                Some(Field::Velocity),
                array("velocity", points, |p| [p.velocity[0], p.velocity[1], 0.0]),
            ),
            (
                Some(Field::Stress),
                array("stress", points, |p| {
                    let [xx, yy, zz, xy] = p.stress;
                    [xx, yy, zz, xy, 0.0, 0.0]
                }),
            ),
            (Some(Field::Volume), array("volume", points, |p| [p.volume])),
            (Some(Field::Mass), array("mass", points, |p| [p.mass])),
        ]),
        ..Mesh::default()
    };
    if let Some(of_groups) = &instant.plastic_strain {
        let strain = points
            .iter()
            .map(|p| of_groups[p.group as usize].unwrap_or(p.plastic_strain.into()));
        let strain = Array::real("plastic_strain", 1, strain.collect());
        let asked = content.keep([(Some(Field::PlasticStrain), strain)]);
        mesh.of_points.extend(asked);
    }
    mesh
}

/// A polygon for each outline, moved as its body has moved since the start.
pub(super) fn bodies(
    outlined: &[Outlined],
    start: &[BodyState],
    now: &[BodyState],
    content: &Content,
) -> Mesh {
    let mut mesh = Mesh {
        cell: Cell::Polygon,
        names: outlined.iter().map(|body| body.name.clone()).collect(),
        ..Mesh::default()
    };
    let mut owners: Vec<(usize, &BodyState)> = Vec::new();
    let moved = outlined.iter().zip(start.iter().zip(now)).enumerate();
    for (body, (outlined, (start, now))) in moved {
        let (sin, cos) = (now.angle - start.angle).sin_cos();
        let ([sx, sy], [nx, ny]) = (start.position, now.position);
        for outline in &outlined.outlines {
            mesh.points.extend(outline.iter().map(|[x, y]| {
                let (x, y) = (x - sx, y - sy);
                [nx + cos * x - sin * y, ny + sin * x + cos * y]
            }));
            mesh.ends.push(mesh.points.len());
            owners.push((body, now));
        }
    }
    let numbers = owners.iter().map(|(body, _)| *body as f64);
    mesh.of_cells = content.keep([
        (None, Array::whole("body", numbers.collect())),
        (
            Some(Field::Velocity),
            array("velocity", &owners, |(_, b)| {
                [b.velocity[0], b.velocity[1], 0.0]
            }),
        ),
        (
            Some(Field::Angle),
            array("angle", &owners, |(_, b)| [b.angle]),
        ),
        (Some(Field::Spin), array("spin", &owners, |(_, b)| [b.spin])),
    ]);
    mesh
}

/// A line for each contact, from one centre to the other, so that chains of forces lead through bodies. For a wall, and
/// for any other body that is held or driven, the line ends at the contact point.
pub(super) fn contacts(states: &[ContactState], instant: &Instant, outlined: &[Outlined]) -> Mesh {
    let of_body = |body: u64, contact: &ContactState| {
        let body = body as usize;
        let is_free = outlined.get(body).is_some_and(|outlined| outlined.is_free);
        let state = instant.bodies.get(body).filter(|_| is_free);
        state.map_or(contact.position, |state| state.position)
    };
    // Points come in order of their ids.
    let of_point = |id: u64, contact: &ContactState| {
        let found = instant.points.binary_search_by_key(&id, |p| p.id);
        found.map_or(contact.position, |k| instant.points[k].position)
    };
    let ends = states.iter().map(|contact| {
        let (body, other) = (contact.body, contact.other);
        match contact.with {
            0 => [of_body(body, contact), of_body(other, contact)],
            1 => [of_body(body, contact), of_point(other, contact)],
            _ => [of_point(body, contact), of_point(other, contact)],
        }
    });
    let whole = |name: &str, number: fn(&ContactState) -> u64| {
        Array::whole(name, states.iter().map(|c| number(c) as f64).collect())
    };
    let vector = |name: &str, vector: fn(&ContactState) -> [f64; 2]| {
        array(name, states, |contact| {
            let [x, y] = vector(contact);
            [x, y, 0.0]
        })
    };
    Mesh {
        cell: Cell::Line,
        points: ends.flatten().collect(),
        ends: (1..=states.len()).map(|k| 2 * k).collect(),
        of_cells: vec![
            whole("body", |c| c.body),
            whole("other", |c| c.other),
            whole("with_point", |c| c.with),
            vector("position", |c| c.position),
            vector("force", |c| c.force),
        ],
        ..Mesh::default()
    }
}
