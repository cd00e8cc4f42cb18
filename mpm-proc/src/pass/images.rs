//! Nodes that are images of others: their masses, momenta and forces go to the originals, and the velocities come back
//! ([`crate::state::images`]).

use crate::kernel::tiles::NODES;
use crate::state::images::Images;
use crate::state::nodes::{MappedTile, NodeTile, WallContribution};

/// Nodes of a tile whose momenta become velocities.
pub trait Momenta {
    /// Momenta in N s/m, then velocities in m/s; and what walls give to the points.
    fn vectors(&mut self) -> (&mut [[f64; 2]; NODES], &mut WallContribution);
}

impl Momenta for NodeTile {
    fn vectors(&mut self) -> (&mut [[f64; 2]; NODES], &mut WallContribution) {
        (&mut self.before, &mut self.wall)
    }
}

impl Momenta for MappedTile {
    fn vectors(&mut self) -> (&mut [[f64; 2]; NODES], &mut WallContribution) {
        (&mut self.velocity, &mut self.wall)
    }
}

/// Moves masses and momenta to the originals.
pub fn gather_momentum(images: &mut Images, tiles: &mut [NodeTile]) {
    for image in &mut images.0 {
        let (tile, n) = image.at.split();
        image.mass = core::mem::take(&mut tiles[tile].mass[n]);
        let (tile, n) = image.of.split();
        tiles[tile].mass[n] += image.mass;
    }
    gather_vectors(images, tiles);
}

/// Moves momenta to the originals.
pub fn gather_vectors(images: &mut Images, tiles: &mut [impl Momenta]) {
    for image in &mut images.0 {
        let (tile, n) = image.at.split();
        image.momentum = core::mem::take(&mut tiles[tile].vectors().0[n]);
        let (tile, n) = image.of.split();
        let to = &mut tiles[tile].vectors().0[n];
        let free = image.free_momentum();
        for a in 0..2 {
            to[a] += image.sign[a] * free[a];
        }
    }
}

/// Gives the images the velocities before the kick, and the masses of their originals, because velocities are divided
/// by these.
pub fn spread_before(images: &Images, tiles: &mut [NodeTile], pic_fraction: f64) {
    for image in &images.0 {
        let (tile, n) = image.of.split();
        let per_mass = tiles[tile].per_mass[n];
        let (tile, n) = image.at.split();
        tiles[tile].per_mass[n] = per_mass;
    }
    spread_vectors(images, tiles, pic_fraction);
}

/// Gives the images the velocities that follow from the momenta, and counts the impulse of the wall there, of which
/// points feel the share `share`.
pub fn spread_vectors(images: &Images, tiles: &mut [impl Momenta], share: f64) {
    for image in &images.0 {
        let (tile, n) = image.of.split();
        let (velocity, wall) = tiles[tile].vectors();
        let (v, free) = (velocity[n], image.free_momentum());
        let own = [0, 1].map(|a| share * (image.sign[a] * image.mass * v[a] - free[a]));
        image.count(own, wall);
        let (tile, n) = image.at.split();
        tiles[tile].vectors().0[n] = image.velocity(v);
    }
}

/// Moves forces (in [`NodeTile::after`]) to the originals.
pub fn gather_force(images: &mut Images, tiles: &mut [NodeTile], gravity: [f64; 2]) {
    for image in &mut images.0 {
        let (tile, n) = image.at.split();
        let force = core::mem::take(&mut tiles[tile].after[n]);
        let weight = gravity.map(|g| image.mass * g);
        image.force = [force[0] + weight[0], force[1] + weight[1]];
        let (tile, n) = image.of.split();
        for a in 0..2 {
            // Gravity on the original includes the mass of the image, so that part is subtracted here.
            let turned = if image.sign[a] < 0.0 {
                -image.force[a] - weight[a]
            } else {
                force[a]
            };
            tiles[tile].after[n][a] += turned;
        }
    }
}

/// Gives the images the velocities after the kick, and counts the impulse of the wall there.
pub fn spread_after(images: &Images, tiles: &mut [NodeTile], kick: f64) {
    for image in &images.0 {
        let (tile, n) = image.of.split();
        let original = &mut tiles[tile];
        let v = original.after[n];
        let own = [0, 1].map(|a| {
            let gain = image.mass * (v[a] - original.before[n][a]);
            image.sign[a] * gain - kick * image.force[a]
        });
        image.count(own, &mut original.wall);
        let (tile, n) = image.at.split();
        tiles[tile].after[n] = image.velocity(v);
    }
}

/// Gives the images the velocities of their originals after contact.
pub fn follow(images: &Images, tiles: &mut [NodeTile]) {
    for image in &images.0 {
        let (tile, n) = image.of.split();
        let velocity = image.velocity(tiles[tile].after[n]);
        let (tile, n) = image.at.split();
        tiles[tile].after[n] = velocity;
    }
}

/// Adds two sums over the points around each image to those of its original.
pub fn gather_sums(images: &Images, sums: &mut [[[f64; 2]; NODES]]) {
    for image in &images.0 {
        let [(tile, n), (of, m)] = [image.at.split(), image.of.split()];
        let own = sums[tile][n];
        for a in 0..2 {
            sums[of][m][a] += own[a];
        }
    }
}

/// Gives the images what follows at their originals from these sums.
pub fn spread_values(images: &Images, values: &mut [[[f64; 2]; NODES]]) {
    for image in &images.0 {
        let [(tile, n), (of, m)] = [image.at.split(), image.of.split()];
        values[tile][n] = values[of][m];
    }
}
