//! The state before the next step as bytes, and back.
//!
//! A new solver of the same configuration that restores the state continues to the same bits as one that was never
//! stopped. So everything that the next step reads before writing it is saved, in its present order: sums over points
//! depend on that order, and points are sorted only after they have moved far enough.
//!
//! Each part of the solver has a `state` that is saved whole: a field that stands in it is saved, any other is of the
//! configuration, follows from the state, or is of one step, which writes it before reading it.
//!
//! The bytes are marked with the parts of the configuration that give the numbers their meaning. A configuration with the
//! same parts continues from the state with its own gravity, walls, loads and parameters of materials: so a run branches
//! off another one. Of points that are given one by one only the number is compared. Whether bytes are damaged is decided
//! by the hash of the file in which they stand; here only what does not decode is refused.

use interface::config::{Fill, GroupConfig, MaterialConfig, MpmConfig, Scheme};
use interface::saved::ConfigurationMark;

pub use interface::saved::refusal;

/// Name of the format; the number rises with every change of what is saved.
pub const FORMAT: &str = "tandem-mpm 14";

/// What the numbers of a state of `config` depend on.
pub fn mark(config: &MpmConfig) -> ConfigurationMark {
    let MpmConfig {
        scheme,
        gravity: _, // it may change from here on
        materials,
        groups,
        forcing: _, // as gravity; of the loads of single points only what they remember, which each cloud checks
        constants: _,
        group_pairs: _, // the bodies' side checks that they are the same
        chains,
        skin,
        probes: _,  // they report of points and keep nothing
        threads: _, // the bits are the same for any number of them
    } = config;
    let Scheme {
        cell,
        domain,
        shape,
        transfer,
        stress_update,
        plane,
        walls,
        contact_force: _, // as gravity
        grid_contact,
        layers,
        leaving: _,
        interface,
    } = scheme;
    let mut mark = ConfigurationMark::default();
    mark.add("mpm.domain", domain);
    mark.add("mpm.cell", cell);
    mark.add("mpm.shape", shape);
    mark.add("mpm.transfer", transfer);
    mark.add("mpm.stress_update", stress_update);
    mark.add("mpm.plane", plane);
    let periodic = walls.periodic();
    mark.add("mpm.walls.periodic", &periodic);
    for (i, material) in materials.iter().enumerate() {
        mark_material(&mut mark, i, material);
    }
    for (g, group) in groups.iter().enumerate() {
        mark_group(&mut mark, g, group);
    }
    mark.add("mpm.grid_contact", &grid_contact.is_some());
    mark.add("mpm.layers", layers);
    mark.add("mpm.interface", interface);
    // The first positions of markers do not matter; their number and weights do.
    for (c, chain) in chains.iter().enumerate() {
        let what = (chain.group, chain.markers.len(), chain.closed, chain.floor);
        mark.add(format!("mpm.chain.{c}"), &what);
    }
    mark.add("mpm.skin", skin);
    mark
}

/// The state of a point depends on its model. The parameters of the model may change from here on.
fn mark_material(mark: &mut ConfigurationMark, i: usize, material: &MaterialConfig) {
    let MaterialConfig {
        name: _,
        density,
        model,
    } = material;
    mark.add(format!("mpm.material.{i}.density"), density);
    mark.add(format!("mpm.material.{i}.model"), &model.key());
}

fn mark_group(mark: &mut ConfigurationMark, g: usize, group: &GroupConfig) {
    let GroupConfig {
        name,
        material,
        fill,
        spacing,
        lattice,
        velocity: _, // of the start
        fields: _,   // likewise
        contact_radius,
        keeps_spin,
    } = group;
    mark.add(format!("mpm.points.{g}.name"), name);
    mark.add(format!("mpm.points.{g}.material"), material);
    match fill {
        // As long as the state itself.
        Fill::Points { positions } => {
            mark.add(format!("mpm.points.{g}.fill.points"), &positions.len());
        }
        region => mark.add(format!("mpm.points.{g}.fill"), region),
    }
    mark.add(format!("mpm.points.{g}.spacing"), spacing);
    mark.add(format!("mpm.points.{g}.lattice"), lattice);
    mark.add(format!("mpm.points.{g}.contact_radius"), contact_radius);
    mark.add(format!("mpm.points.{g}.keeps_spin"), keeps_spin);
}
