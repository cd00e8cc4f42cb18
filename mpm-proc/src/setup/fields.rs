//! Initial fields and loads of a group, from the expressions of its configuration.

use interface::config::MpmConfig;
use interface::solver::Refusal;
use mechanics::expression::{Expression, Meaning};

use super::region::points_within;
use crate::kernel::lanes::{LANES, ZERO};
use crate::kernel::shape::Shape;
use crate::kernel::transfer::AffineState;
use crate::material::{Constitutive, Stresses};
use crate::state::loads::Loads;
use crate::state::points::Cloud;

/// The compiled expressions of a group.
pub struct Fields<'a> {
    config: &'a MpmConfig,
    group: usize,
    velocity: Option<[Expression; 2]>,
    stress: Option<[Expression; 4]>,
    body_force: Option<[Expression; 2]>,
}

impl<'a> Fields<'a> {
    /// Compiles the expressions of `config` for its group number `group`.
    ///
    /// # Errors
    /// A [`Refusal`] for what is not an expression.
    pub fn new(config: &'a MpmConfig, group: usize) -> Result<Self, Refusal> {
        let key = format!("mpm.points.{group}");
        let fields = &config.groups[group].fields;
        let space = ["x", "y"];
        let (velocity, stress) = (format!("{key}.velocity"), format!("{key}.stress"));
        let force = config.forcing.body_force.as_ref();
        Ok(Self {
            config,
            group,
            velocity: compile_all(config, fields.velocity.as_ref(), &velocity, &space)?,
            stress: compile_all(config, fields.stress.as_ref(), &stress, &space)?,
            body_force: compile_all(config, force, "mpm.body_force", &["x", "y", "t"])?,
        })
    }

    fn key(&self, field: &str) -> String {
        format!("mpm.points.{}.{field}", self.group)
    }

    /// Velocity of each point in m/s.
    ///
    /// # Errors
    /// A [`Refusal`] if a velocity is not finite.
    pub fn velocities(&self, positions: &[[f64; 2]]) -> Result<Vec<[f64; 2]>, Refusal> {
        let uniform = self.config.groups[self.group].velocity;
        let Some(field) = &self.velocity else {
            return Ok(vec![uniform; positions.len()]);
        };
        positions
            .iter()
            .map(|x| {
                let v = [0, 1].map(|a| uniform[a] + field[a].evaluate(x));
                finite(&v, x, &self.key("velocity")).map(|()| v)
            })
            .collect()
    }

    /// Gives the points of an affine transfer the change of the field over one cell, by central difference: a body that
    /// is set spinning has its whole angular momentum from the first step on, and a field that jumps gives a slope no
    /// larger than the jump. Points are not sorted yet.
    pub fn set_slopes<const W: usize, S: Shape<W>, A: AffineState>(
        &self,
        cloud: &mut Cloud<W, S, A>,
        positions: &[[f64; 2]],
    ) {
        let Some(field) = self.velocity.as_ref().filter(|_| A::PRESENT) else {
            return;
        };
        let half = 0.5 * self.config.cell;
        for (motion, positions) in cloud.state.motion.iter_mut().zip(positions.chunks(LANES)) {
            let mut slopes = [[ZERO; 2]; 2];
            for (k, at) in positions.iter().enumerate() {
                for axis in 0..2 {
                    let [mut low, mut high] = [*at; 2];
                    low[axis] -= half;
                    high[axis] += half;
                    for a in 0..2 {
                        let change = field[a].evaluate(&high) - field[a].evaluate(&low);
                        // A field need not exist beyond the body.
                        let slope = if change.is_finite() { change } else { 0.0 };
                        slopes[axis][a].as_mut_array()[k] = slope;
                    }
                }
            }
            motion.affine = A::from_slopes(slopes);
        }
    }

    /// Gives each point its initial stress. Elastic energy of a rate form then begins with that of small strain,
    /// `p^2 / 2K + s:s / 4G`: the ledger's zero is the unstressed state.
    ///
    /// # Errors
    /// A [`Refusal`] where it is not finite, or the model cannot have it.
    pub fn prestress(
        &self,
        model: &dyn Constitutive,
        stresses: &mut Stresses,
        positions: &[[f64; 2]],
    ) -> Result<(), Refusal> {
        let Some(field) = &self.stress else {
            return Ok(());
        };
        for (lane, x) in positions.iter().enumerate() {
            let stress = [0, 1, 2, 3].map(|i| field[i].evaluate(x));
            finite(&stress, x, &self.key("stress"))?;
            let refuse = |why| {
                let name = &self.config.groups[self.group].name;
                let place = format!("of group '{name}' at ({}, {}) m", x[0], x[1]);
                Refusal::new(
                    self.key("stress"),
                    format!("is {stress:?} Pa {place}; {why}"),
                )
            };
            stresses.set(lane, &model.under(stress).map_err(refuse)?);
        }
        Ok(())
    }

    /// Body force and tractions.
    ///
    /// # Errors
    /// A [`Refusal`] for a traction on no point, or one that is not finite.
    pub fn loads(&self, positions: &[[f64; 2]]) -> Result<Option<Box<Loads>>, Refusal> {
        let mut dead = Vec::new();
        for (i, traction) in self.config.forcing.tractions.iter().enumerate() {
            if traction.points != self.config.groups[self.group].name {
                continue;
            }
            let (key, within) = (format!("mpm.traction.{i}"), traction.within);
            let loaded = points_within(self.config, self.group, positions, within, &key)?;
            dead.resize(positions.len(), [0.0; 2]);
            for &local in &loaded {
                for a in 0..2 {
                    dead[local as usize][a] += traction.force[a] / loaded.len() as f64;
                }
            }
        }
        Ok(Loads::new(self.body_force.clone(), positions, &dead))
    }
}

fn finite(values: &[f64], x: &[f64; 2], key: &str) -> Result<(), Refusal> {
    if values.iter().all(|v| v.is_finite()) {
        return Ok(());
    }
    Err(Refusal::new(
        key,
        format!(
            "is {values:?} at ({}, {}) m; it must be finite at every point",
            x[0], x[1]
        ),
    ))
}

fn compile_all<const N: usize>(
    config: &MpmConfig,
    sources: Option<&[String; N]>,
    key: &str,
    names: &[&str],
) -> Result<Option<[Expression; N]>, Refusal> {
    let mut parts = Vec::new();
    for (i, source) in sources.into_iter().flatten().enumerate() {
        parts.push(compile(config, source, &format!("{key}.{i}"), names)?);
    }
    Ok(parts.try_into().ok())
}

fn compile(
    config: &MpmConfig,
    source: &str,
    key: &str,
    names: &[&str],
) -> Result<Expression, Refusal> {
    let meaning = |name: &str| {
        let slot = names.iter().position(|n| *n == name).map(Meaning::Slot);
        slot.or_else(|| config.constants.get(name).map(|&c| Meaning::Number(c)))
    };
    Expression::compile(source, &meaning).map_err(|e| {
        let known: Vec<&str> = names
            .iter()
            .copied()
            .chain(config.constants.keys().map(String::as_str))
            .collect();
        Refusal::new(
            key,
            format!(
                "`{source}`: {}; known names: {}",
                e.message,
                known.join(", ")
            ),
        )
    })
}
