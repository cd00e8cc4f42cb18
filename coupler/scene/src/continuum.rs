//! The continuum's part of a scene: grid, walls, materials, groups of points.

use std::collections::BTreeMap;

use interface::config::{ConfigFault, GroupConfig, GroupPair, MaterialConfig, MpmConfig};

use super::chains::chains;
use super::forcing;
use super::problems::Problems;
use super::written::{MaterialWritten, MpmWritten, PointsWritten};

/// The continuum's configuration, unless something was refused. The skin is set later.
pub(super) fn continuum(
    problems: &mut Problems,
    written: &MpmWritten,
    gravity: [f64; 2],
    constants: &BTreeMap<String, f64>,
    group_pairs: &[GroupPair],
) -> Option<MpmConfig> {
    if written.points.is_empty() || written.material.is_empty() {
        let help =
            "a continuum needs a material and a group of points; without one leave `[mpm]` out";
        problems.refuse_key("mpm", "`[mpm]` has no points or no material", help);
        return None;
    }
    let materials = written.material.iter().enumerate();
    let configured =
        materials.map(|(i, written)| material(problems, &format!("mpm.material.{i}"), written));
    let configured = configured.collect();
    let materials = written.material.iter().map(|m| m.material.name.as_str());
    let indices = materials.clone().zip(0..).collect();
    problems.names("mpm.material", "materials", materials);
    let groups = written.points.iter().map(|g| g.name.as_str());
    problems.names("mpm.points", "groups of points", groups);
    let groups = written.points.iter().enumerate();
    let groups: Vec<GroupConfig> = groups
        .map(|(i, points)| {
            let path = format!("mpm.points.{i}");
            group(problems, &path, points, (written, &indices, constants))
        })
        .collect();
    let forcing = forcing::forcing(problems, written, constants);
    let chains = chains(problems, written, &groups);
    let mut config = MpmConfig {
        scheme: written.scheme.clone(),
        gravity,
        materials: configured,
        groups,
        forcing,
        constants: constants.clone(),
        group_pairs: group_pairs.iter().map(|pair| pair.between).collect(),
        chains,
        skin: 0.0,
        probes: written.probe.clone(),
        threads: 1,
    };
    problems.config_faults(config.faults());
    if problems.any() {
        return None;
    }
    let cell = written.scheme.cell;
    for (i, group) in config.groups.iter_mut().enumerate() {
        radius(problems, &format!("mpm.points.{i}"), group, cell);
    }
    Some(config)
}

fn material(problems: &mut Problems, path: &str, written: &MaterialWritten) -> MaterialConfig {
    let mut material = written.material.clone();
    // If both moduli are above 0, Poisson's ratio lies within its limits, -1 and 1/2.
    let model = material.model.key();
    let (bulk, shear) = material.model.moduli();
    let poisson = (3.0 * bulk - 2.0 * shear) / (2.0 * (3.0 * bulk + shear));
    // The rounding of K = E/3, G = E/2 is far below this.
    if bulk > 0.0 && shear > 0.0 && poisson < -1e-6 {
        problems.warn(format!(
            "`{path}.model.{model}` has a negative Poisson's ratio ({poisson:.4}): are K and G exchanged?"
        ));
    }
    // Faults of the numbers are reported when all numbers are known.
    if let Some(test) = written
        .friction_test
        .filter(|_| material.model.faults().is_empty())
    {
        match material.model.measured(test) {
            Ok(model) => material.model = model,
            Err(fault) => problems.config_faults(vec![ConfigFault {
                key: format!("{path}.{}", fault.key),
                ..fault
            }]),
        }
    }
    material
}

fn group(
    problems: &mut Problems,
    path: &str,
    written: &PointsWritten,
    (mpm, materials, constants): (&MpmWritten, &BTreeMap<&str, usize>, &BTreeMap<String, f64>),
) -> GroupConfig {
    let material = materials.get(written.material.as_str()).copied();
    if material.is_none() {
        problems.refuse_unknown(
            &format!("{path}.material"),
            &format!("no material \"{}\"", written.material),
            [&written.material, "materials of this scene"],
            mpm.material.iter().map(|m| m.material.name.as_str()),
        );
    }
    let (velocity, fields) = forcing::initial(problems, path, written, constants);
    GroupConfig {
        name: written.name.clone(),
        material: material.unwrap_or(0),
        fill: written.fill.clone(),
        spacing: written.spacing,
        lattice: written.lattice,
        velocity,
        fields,
        contact_radius: written.contact_radius,
        keeps_spin: written.keeps_spin,
    }
}

/// Warns if the scene's contact radius is out of the range of Jiang 2020 eq. 45, and fills it in if the scene has none. The
/// default lies outside too, but it is not warned of: the range is for a radius that the scene chooses.
fn radius(problems: &mut Problems, path: &str, group: &mut GroupConfig, cell: f64) {
    let default = group.default_contact_radius(cell);
    let radius = *group.contact_radius.get_or_insert(default);
    let (low, slack) = (2.0 * default, 1.0 + 1e-9);
    let outside = radius * slack < low || radius > cell * slack;
    if outside && radius != default {
        problems.warn(format!(
            "`{path}.contact_radius` = {radius} m lies outside {low:.4e} to {cell} m (point distance \
             to cell, Jiang 2020 eq. 45)"
        ));
    }
}
