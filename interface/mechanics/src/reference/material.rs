//! The laws of a point of the oracle (docs/physics.md section 6), with matrices and their eigenvectors.

use interface::config::MaterialModel;
use interface::config::material::{CriticalState, Frictional, Inertial};
use interface::impulse::at;
use nalgebra::{Matrix2, Matrix3, Rotation3, Vector2, Vector3};

/// A point.
#[derive(Debug, Clone, Copy, Default)]
pub struct RefPoint {
    /// Its group.
    pub group: usize,
    /// Position in m.
    pub x: [f64; 2],
    /// Velocity in m/s.
    pub v: [f64; 2],
    /// `B_p` in m^2/s.
    pub b: [[f64; 2]; 2],
    /// Position at the start in m.
    pub start: [f64; 2],
    /// Position in the step before in m.
    pub was: [f64; 2],
    /// Dead load in N/m.
    pub dead: [f64; 2],
    /// Load in N/m in the last step.
    pub load: [f64; 2],
    /// Along which axes it is held.
    pub held: [bool; 2],
    /// Mean distance in cells along x and y of mass at a node of a wall that points like this one touch.
    pub touching: [f64; 2],
    /// Cauchy stress xx, yy, zz, xy in Pa.
    pub stress: [f64; 4],
    /// Volume over the initial one.
    pub ratio: f64,
    /// Of a fluid, the initial volume over that without stress.
    pub squeezed: f64,
    /// In kg/m.
    pub mass: f64,
    /// Initial volume in m^2.
    pub volume: f64,
    /// How far it has moved by a velocity that is still to be compared with the field of its strains, in m.
    pub unsettled: [f64; 2],
    /// Spin in rad/s of the field that moved it in the last step, if there was friction.
    pub spin: f64,
    /// Bulk modulus in Pa.
    pub bulk: f64,
    /// Shear modulus in Pa.
    pub shear: f64,
    /// The law of its material. Models have Hencky's elasticity unless their text says otherwise.
    pub model: MaterialModel,
    /// Deformation gradient so far, of a material with an elasticity of it.
    pub gradient: Matrix2<f64>,
    /// Whether its thickness follows, so that there is no stress out of plane.
    pub thins: bool,
    /// Whether its nodes get the spin of its group.
    pub turns: bool,
    /// Of von Mises' material the equivalent plastic strain, of sand with a memory the plastic shear strain; else 0.
    pub plastic_strain: f64,
    /// Logarithm of the volume over that at which separated grains touch; 0 where they do.
    pub gap: f64,
    /// Dissipated by plastic flow in J/m.
    pub lost: f64,
    /// Dissipated by viscous stress in J/m.
    pub viscous: f64,
    /// Worked by the stress in J/m.
    pub worked: f64,
}

fn tensor([xx, yy, zz, xy]: [f64; 4]) -> Matrix3<f64> {
    Matrix3::new(xx, xy, 0.0, xy, yy, 0.0, 0.0, 0.0, zz)
}

fn components(m: &Matrix3<f64>) -> [f64; 4] {
    [m[(0, 0)], m[(1, 1)], m[(2, 2)], m[(0, 1)]]
}

/// The mean of the normal components, and the deviator.
fn split(m: &Matrix3<f64>) -> (f64, Matrix3<f64>) {
    let mean = m.trace() / 3.0;
    (mean, m - Matrix3::identity() * mean)
}

/// `sqrt(s:s/2)`.
fn shear(deviator: &Matrix3<f64>) -> f64 {
    (0.5 * deviator.norm_squared()).sqrt()
}

/// A function of a symmetric matrix.
fn function(m: &Matrix3<f64>, of: fn(f64) -> f64) -> Matrix3<f64> {
    let eigen = m.symmetric_eigen();
    let diagonal = Matrix3::from_diagonal(&eigen.eigenvalues.map(of));
    eigen.eigenvectors * diagonal * eigen.eigenvectors.transpose()
}

/// What the gradient of the middle of an interval has done at its end.
fn cayley(l: &Matrix3<f64>) -> Matrix3<f64> {
    let (one, half) = (Matrix3::identity(), l * 0.5);
    (one - half).try_inverse().expect("regular") * (one + half)
}

/// A volume after an interval over that before, where it follows the trace of the gradient.
fn swelling(trace: f64) -> f64 {
    1.0 + trace + 0.5 * trace * trace
}

impl RefPoint {
    /// The same with this Cauchy stress (Pa) at the start.
    pub(super) fn under(&self, stress: [f64; 4]) -> Self {
        let squeezed = match self.model {
            MaterialModel::Fluid {
                exponent: gamma, ..
            } => (1.0 - gamma * stress[0] / self.bulk).powf(-1.0 / gamma),
            _ => 1.0,
        };
        Self {
            stress,
            ratio: 1.0,
            squeezed,
            ..*self
        }
    }

    /// `K - 2 G/3` in Pa.
    fn lame(&self) -> f64 {
        self.bulk - 2.0 / 3.0 * self.shear
    }

    /// Strain out of plane over the sum of those in it, if the thickness follows.
    fn thinning(&self) -> f64 {
        -self.lame() / (self.lame() + 2.0 * self.shear)
    }

    /// Squared speed of its pressure waves before it is strained, in m^2/s^2.
    pub fn wave_sq(&self) -> f64 {
        let stiff = self.lame() + 2.0 * self.shear;
        let free = if self.thins {
            self.lame() * self.thinning()
        } else {
            0.0
        };
        (stiff + free) * self.volume / self.mass
    }

    /// Its angular momentum about the origin in N s.
    pub fn turning(&self) -> f64 {
        self.mass * (at(self.x, self.v)[2] + self.b[1][0] - self.b[0][1])
    }

    fn separates(&self) -> bool {
        match self.model {
            MaterialModel::DruckerPrager(numbers) | MaterialModel::MohrCoulomb(numbers) => {
                numbers.separates
            }
            MaterialModel::MuI(_) => true,
            _ => false,
        }
    }

    /// Small strain of a stress.
    fn elastic_strain(&self, stress: &Matrix3<f64>) -> Matrix3<f64> {
        let (mean, deviator) = split(stress);
        deviator / (2.0 * self.shear) + Matrix3::identity() * (mean / (3.0 * self.bulk))
    }

    /// Stress in Pa of a small strain.
    fn elastic_stress(&self, strain: &Matrix3<f64>) -> Matrix3<f64> {
        Matrix3::identity() * (self.lame() * strain.trace()) + strain * (2.0 * self.shear)
    }

    /// Elastic energy in J/m.
    pub fn stored(&self) -> f64 {
        let (j, ln) = (self.ratio, self.ratio.ln());
        let small = |stress: &Matrix3<f64>| 0.5 * stress.dot(&self.elastic_strain(stress));
        let dense = match self.model {
            MaterialModel::NeoHookean(_) => {
                let trace = self.gradient.norm_squared() + 1.0;
                0.5 * (self.shear * (trace - 3.0 - 2.0 * ln) + self.lame() * ln * ln)
            }
            MaterialModel::Fluid {
                exponent: gamma, ..
            } => {
                // -int p dJ.
                let j = j * self.squeezed;
                let of_power = if gamma == 1.0 {
                    -j.ln()
                } else {
                    (j.powf(1.0 - gamma) - 1.0) / (gamma - 1.0)
                };
                self.bulk / gamma * (of_power + j - 1.0) / self.squeezed
            }
            MaterialModel::Hypoelastic(_) => small(&tensor(self.stress)) * j,
            _ => small(&(tensor(self.stress) * j)),
        };
        self.volume * dense
    }

    /// Strains it by a gradient of the middle of `dt` (s), which is the displacement's, and by a `swelling` of `ln J`, whose work is
    /// viscous. An interval of no length does nothing. Stress works as the nodes feel it, which it pushes before and after the
    /// interval: by the mean of both.
    pub(super) fn strain(&mut self, l: Matrix2<f64>, dt: f64, swelling: f64) {
        if dt == 0.0 {
            return;
        }
        let pressed = |p: &Self| 0.25 * swelling * p.volume * p.ratio * (p.stress[0] + p.stress[1]);
        let works = |p: &Self| {
            let [xx, yy, _, xy] = p.stress;
            0.5 * p.volume * p.ratio * (xx * l.m11 + yy * l.m22 + xy * (l.m12 + l.m21))
        };
        self.viscous -= pressed(self);
        self.worked += works(self);
        let both = l + Matrix2::identity() * (0.5 * swelling);
        let both = Matrix3::new(
            both.m11, both.m12, 0.0, both.m21, both.m22, 0.0, 0.0, 0.0, 0.0,
        );
        let stress = match self.model {
            MaterialModel::NeoHookean(_) => self.neo_hookean(&both),
            MaterialModel::Hypoelastic(_) => self.hypoelastic(&both),
            MaterialModel::Fluid {
                exponent,
                viscosity,
                ..
            } => self.fluid([exponent, viscosity], &both, dt),
            _ => self.hencky(&both, dt),
        };
        self.stress = components(&stress);
        self.viscous -= pressed(self);
        self.worked += works(self);
    }

    fn neo_hookean(&mut self, l: &Matrix3<f64>) -> Matrix3<f64> {
        let f = cayley(l).fixed_view::<2, 2>(0, 0) * self.gradient;
        self.gradient = f;
        self.ratio = f.determinant();
        let b = f * f.transpose();
        let strain = tensor([b.m11 - 1.0, b.m22 - 1.0, 0.0, b.m12]);
        let round = Matrix3::identity() * (self.lame() * self.ratio.ln());
        (strain * self.shear + round) / self.ratio
    }

    /// The stress turned by the spin, and Hooke's law of the strain, which is that of the middle of the interval.
    fn hypoelastic(&mut self, l: &Matrix3<f64>) -> Matrix3<f64> {
        let mut strain = (l + l.transpose()) * 0.5;
        // Half of the angle of Cayley's rotation.
        let half = (0.25 * (l[(1, 0)] - l[(0, 1)])).atan();
        let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), half).into_inner();
        if self.thins {
            strain[(2, 2)] = self.thinning() * strain.trace();
        }
        self.ratio *= swelling(strain.trace());
        let halfway = turn * tensor(self.stress) * turn.transpose() + self.elastic_stress(&strain);
        turn * halfway * turn.transpose()
    }

    /// `-p 1 + 2 mu dev(D)`, `p = K/gamma (J^-gamma - 1)`.
    fn fluid(&mut self, [gamma, viscosity]: [f64; 2], l: &Matrix3<f64>, dt: f64) -> Matrix3<f64> {
        self.ratio *= swelling(l.trace());
        let (_, sheared) = split(&((l + l.transpose()) * 0.5));
        let viscous = sheared * (2.0 * viscosity / dt);
        self.viscous += viscous.dot(&sheared) * self.ratio * self.volume;
        let j = self.ratio * self.squeezed;
        let pressure = self.bulk / gamma * (j.powf(-gamma) - 1.0);
        viscous - Matrix3::identity() * pressure
    }

    /// Hencky's elasticity, `b <- f b f^T` and `eps = ln(b)/2`, and the return of the Cauchy stress to a yield surface.
    fn hencky(&mut self, l: &Matrix3<f64>, dt: f64) -> Matrix3<f64> {
        let f = cayley(l);
        let before = self.elastic_strain(&(tensor(self.stress) * self.ratio));
        let b = f * function(&(before * 2.0), f64::exp) * f.transpose();
        let mut strain = function(&((b + b.transpose()) * 0.5), f64::ln) * 0.5;
        if self.thins {
            strain[(2, 2)] = self.thinning() * (strain[(0, 0)] + strain[(1, 1)]);
        }
        let dilates = self.dilates();
        self.ratio *= (strain.trace() - before.trace()).exp();
        let Some(trial) = self.touching(self.elastic_stress(&strain) / self.ratio) else {
            return Matrix3::zeros();
        };
        let new = match self.model {
            MaterialModel::VonMises {
                yield_stress,
                hardening_modulus,
                ..
            } => self.von_mises([yield_stress, hardening_modulus], trial),
            MaterialModel::DruckerPrager(numbers) => drucker_prager(&numbers, dilates, trial),
            MaterialModel::MohrCoulomb(numbers) => self.mohr_coulomb(&numbers, trial),
            MaterialModel::MuI(numbers) => self.mu_i(&numbers, trial, dt),
            _ => trial,
        };
        // The moduli of Cauchy stress are those of small strains over the volume.
        let flow = self.elastic_strain(&(trial - new)) * self.ratio;
        self.lost += new.dot(&flow) * self.ratio * self.volume;
        let sheared = 2.0 * shear(&split(&flow).1);
        self.plastic_strain += match self.model {
            MaterialModel::VonMises { .. } => sheared / 3.0_f64.sqrt(),
            _ if self.model.keeps_plastic_strain() => sheared,
            _ => 0.0,
        };
        new
    }

    /// A trial stress where grains touch, or none where they are apart. Grains that meet are sheared only from then on.
    fn touching(&mut self, trial: Matrix3<f64>) -> Option<Matrix3<f64>> {
        if !self.separates() {
            return Some(trial);
        }
        let stiff = self.bulk / self.ratio;
        let (mean, mut deviator) = split(&trial);
        let beyond = mean + stiff * self.gap;
        if beyond > 0.0 {
            self.gap = beyond / stiff;
            return None;
        }
        if self.gap > 0.0 {
            deviator *= beyond / mean;
        }
        self.gap = 0.0;
        Some(Matrix3::identity() * beyond + deviator)
    }

    /// The share of its dilation that sand still has.
    fn dilates(&self) -> f64 {
        let MaterialModel::DruckerPrager(numbers) = self.model else {
            return 1.0;
        };
        match numbers.critical_state {
            None => 1.0,
            Some(CriticalState::ShearStrain(of)) => (-self.plastic_strain / of).exp(),
            Some(CriticalState::Volume(of)) => {
                ((1.0 / self.ratio - 1.0 / of) / (1.0 - 1.0 / of)).clamp(0.0, 1.0)
            }
        }
    }

    /// `q = sigma_0 + H alpha`, the stress `q` being the tensile one.
    fn von_mises(&self, [strength, hardening]: [f64; 2], trial: Matrix3<f64>) -> Matrix3<f64> {
        let (mean, deviator) = split(&trial);
        let q = (1.5 * deviator.norm_squared()).sqrt();
        let beyond = q - strength - hardening * self.plastic_strain;
        if beyond <= 0.0 {
            return trial;
        }
        let stiff = 3.0 * self.shear / self.ratio;
        let kept = 1.0 - stiff / (stiff + hardening) * beyond / q;
        Matrix3::identity() * mean + deviator * kept
    }

    /// Returns principal stresses to `k sigma_1 - sigma_3 <= sigma_c`, or to the edge of two such surfaces if it would pass the
    /// stress between them; then none is above the tensile strength (Clausen, Damkilde and Andersen 2006).
    fn mohr_coulomb(&self, numbers: &Frictional, trial: Matrix3<f64>) -> Matrix3<f64> {
        let ratio = |angle: f64| {
            let sin = angle.to_radians().sin();
            (1.0 + sin) / (1.0 - sin)
        };
        let (k, flows) = (ratio(numbers.friction_angle), ratio(numbers.dilation_angle));
        let strength = 2.0 * numbers.cohesion * k.sqrt();
        let eigen = trial.symmetric_eigen();
        let mut order = [0, 1, 2];
        order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
        let p = Vector3::from(order.map(|i| eigen.eigenvalues[i]));
        // Of the surface between a larger and a smaller stress: its normal, and the stress that its flow takes.
        let surface = |high: usize, low: usize| {
            let (mut normal, mut flow) = (Vector3::zeros(), Vector3::zeros());
            (normal[high], normal[low]) = (k, -1.0);
            (flow[high], flow[low]) = (flows, -1.0);
            let taken = self.elastic_stress(&Matrix3::from_diagonal(&flow));
            (normal, taken.diagonal())
        };
        let beyond = |normal: &Vector3<f64>| normal.dot(&p) - strength;
        let (normal, taken) = surface(0, 2);
        let mut q = p;
        if beyond(&normal) > 0.0 {
            q = p - taken * (beyond(&normal) / normal.dot(&taken));
            let passed = if q[1] > q[0] {
                Some(surface(1, 2))
            } else if q[2] > q[1] {
                Some(surface(0, 1))
            } else {
                None
            };
            if let Some((other, also)) = passed {
                let [a, b] = [&normal, &other].map(|n| [n.dot(&taken), n.dot(&also)]);
                let both = Matrix2::new(a[0], a[1], b[0], b[1]);
                let over = Vector2::new(beyond(&normal), beyond(&other));
                let flow = both.try_inverse().expect("two surfaces") * over;
                q = p - taken * flow.x - also * flow.y;
            }
        }
        let most = numbers.tensile_strength.min(strength / (k - 1.0));
        q = q.map(|q| q.min(most));
        if q == p {
            return trial;
        }
        let mut new = Vector3::zeros();
        for (k, i) in order.into_iter().enumerate() {
            new[i] = q[k];
        }
        let turn = eigen.eigenvectors;
        turn * Matrix3::from_diagonal(&new) * turn.transpose()
    }

    /// `tau = mu(I) p` where it flows, with the rate of flow of the interval, by halving the range of that rate (Jop, Forterre and
    /// Pouliquen 2006).
    fn mu_i(&self, numbers: &Inertial, trial: Matrix3<f64>, dt: f64) -> Matrix3<f64> {
        let (mean, deviator) = split(&trial);
        let (tau, pressure) = (shear(&deviator), -mean);
        if tau <= numbers.static_friction * pressure {
            return trial;
        }
        let strength = |rate: f64| {
            let time = numbers.grain_diameter / (pressure / numbers.grain_density).sqrt();
            let number = rate * time;
            let more = numbers.limit_friction - numbers.static_friction;
            let friction = more * number / (numbers.inertial_number + number);
            (numbers.static_friction + friction) * pressure
        };
        let left = |rate: f64| tau - self.shear / self.ratio * rate * dt;
        let [mut low, mut high] = [0.0, tau / (self.shear / self.ratio * dt)];
        for _ in 0..100 {
            let middle = 0.5 * (low + high);
            if left(middle) > strength(middle) {
                low = middle;
            } else {
                high = middle;
            }
        }
        Matrix3::identity() * mean + deviator * (left(low) / tau)
    }
}

/// Returns the mean stress and `tau` to Drucker-Prager's surfaces, `tau + q sigma <= k` and `sigma <= sigma_t` (Jiang 2020 eqs. 31
/// to 35), with a share of the dilation. A line halves the corner of the two surfaces. A stress beyond both returns to the
/// surface on its side of the line, or to the corner if it would end beyond the other surface. Only the ratio of the moduli
/// matters.
fn drucker_prager(numbers: &Frictional, dilates: f64, trial: Matrix3<f64>) -> Matrix3<f64> {
    let (mean, deviator) = split(&trial);
    let tau = shear(&deviator);
    let root = |angle: f64| (9.0 + 12.0 * angle.to_radians().tan().powi(2)).sqrt();
    let slope = |angle: f64| 3.0 * angle.to_radians().tan() / root(angle);
    let q = slope(numbers.friction_angle);
    let q_flow = slope(numbers.dilation_angle) * dilates;
    let k = 3.0 * numbers.cohesion / root(numbers.friction_angle);
    let most = numbers.tensile_strength.min(k / q);
    let beyond = tau + q * mean - k;
    if beyond <= 0.0 && mean <= most {
        return trial;
    }
    let halves = ((1.0 + q * q).sqrt() - q) * (mean - most);
    let to_shear = mean <= most || tau - (k - q * most) > halves;
    let flow = beyond.max(0.0) / (numbers.shear_modulus + numbers.bulk_modulus * q * q_flow);
    let moved = if to_shear {
        mean - numbers.bulk_modulus * q_flow * flow
    } else {
        mean
    };
    let new = moved.min(most);
    let kept = if tau > 0.0 {
        tau.min(k - q * new) / tau
    } else {
        1.0
    };
    Matrix3::identity() * new + deviator * kept
}
