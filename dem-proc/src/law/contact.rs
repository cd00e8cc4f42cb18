//! A law that combines a normal spring, a tangential part and a dashpot.

use super::dashpot::{Dashpot, Drag, dissipated};
use super::history::Part;
use super::normal::Normal;
use super::tangent::Tangent;
use super::{Kinematics, Law, Loss, PairProperties, Response, Stiffness};

/// A normal spring `N` with a tangential part `T` and a dashpot `D`. The dashpot never pulls: if it would make the
/// normal force negative, that force is zero. Coulomb's limit uses the pressing part of the normal force, so adhesion
/// does not make a contact slip.
#[derive(Debug, Clone, Copy)]
pub struct Contact<N, T, D> {
    /// Normal spring.
    pub normal: N,
    /// Friction.
    pub tangent: T,
    /// Damping.
    pub dashpot: D,
}

impl<N: Normal, T: Tangent, D: Dashpot> Law for Contact<N, T, D> {
    /// Of the tangential part, and of the dashpot.
    type History = (T::State, Drag);
    type Pair = (N::Pair, D::Pair);

    fn pair(&self, properties: &PairProperties) -> Self::Pair {
        let normal = self.normal.pair(properties);
        // A dashpot with constant coefficients needs a spring with constant stiffness.
        let k_n = self.normal.stiffness(&normal, 0.0);
        let dashpot = self
            .dashpot
            .pair([k_n, self.tangent.stiffness(k_n)], properties.mass);
        (normal, dashpot)
    }

    #[inline]
    fn stiffness(&self, pair: &Self::Pair, overlap: f64) -> Stiffness {
        let normal = self.normal.stiffness(&pair.0, overlap);
        Stiffness {
            normal,
            tangential: self.tangent.stiffness(normal),
            rolling: 0.0,
        }
    }

    fn dashpots(&self, pair: &Self::Pair) -> [[f64; 2]; 2] {
        // At any overlap: whether there is a spring along T is asked, and springs of dashpots with constants are constant.
        let k_n = self.normal.stiffness(&pair.0, 1.0);
        (self.dashpot).constants(&pair.1, [k_n, self.tangent.stiffness(k_n)])
    }

    #[inline]
    fn normal(&self, pair: &Self::Pair, overlap: f64) -> [f64; 2] {
        let normal = &self.normal;
        [
            normal.force(&pair.0, overlap),
            normal.pull(&pair.0, overlap),
        ]
    }

    #[inline]
    fn response_to_spring(
        &self,
        pair: &Self::Pair,
        spring: f64,
        kinematics: &Kinematics,
        before: &Self::History,
    ) -> Response<Self::History> {
        let k_n = self.normal.stiffness(&pair.0, kinematics.overlap);
        let k_t = self.tangent.stiffness(k_n);
        let [viscous_n, viscous_t] = self.dashpot.drag(&pair.1, [k_n, k_t], kinematics.velocity);
        let pushed = spring + viscous_n;
        let pressing = if pushed > 0.0 { pushed } else { 0.0 };
        let slide = self
            .tangent
            .slide(k_t, pressing, viscous_t, kinematics.moved[1], &before.0);
        // Without damping the limit of friction leaves the rounding of the spring's force, which is no work of a dashpot.
        let dashpot = if viscous_t == 0.0 { 0.0 } else { slide.dashpot };
        let drag = Part([pressing - spring, dashpot]);
        Response {
            normal: pressing,
            tangential: slide.spring + slide.dashpot,
            moment: 0.0,
            history: (slide.state, drag),
            loss: Loss {
                friction: slide.loss,
                viscous: dissipated(kinematics.moved, &before.1, &drag),
            },
        }
    }

    #[inline]
    fn separate(&self, _: &Self::Pair, kinematics: &Kinematics, before: &Self::History) -> Loss {
        // When the contact opens, the force of the dashpot ends. Motion after that dissipates nothing (docs/energy.md).
        let held = kinematics.share_in_contact();
        let way = kinematics.moved.map(|u| u * held);
        Loss {
            friction: self.tangent.separate(kinematics.moved[1], &before.0),
            viscous: dissipated(way, &before.1, &Drag::default()),
        }
    }

    fn energy(&self, pair: &Self::Pair, overlap: f64, history: &Self::History) -> f64 {
        self.normal.energy(&pair.0, overlap) + self.tangent.energy(&history.0)
    }
}
