//! Axes that the tests of the elasto-plastic model and its observers share.

use bristle_core::Real;
use bristle_core::friction::ElastoPlastic;
use bristle_core::stribeck::{Shape, Stribeck};

/// Parameters of an axis, from a jewel bearing to a press.
#[derive(Clone, Copy, Debug)]
pub struct Parameters {
    pub coulomb: f64,
    pub ratio: f64,
    pub v_s: f64,
    pub kind: u8,
    pub stiffness: f64,
    pub damping: f64,
    pub viscous: f64,
    pub breakaway: f64,
}

impl Parameters {
    pub fn curve<T: Real>(&self) -> Stribeck<T> {
        let velocity_rad_s = T::of(self.v_s);
        let shape = match self.kind % 6 {
            0 => Shape::Gaussian { velocity_rad_s },
            1 => Shape::Lorentzian { velocity_rad_s },
            2 => Shape::Exponential { velocity_rad_s },
            3 => Shape::PiecewiseLinear {
                slope_nm_s_rad: T::of(self.coulomb / self.v_s),
            },
            4 => Shape::GeneralisedExponential {
                rate: T::ONE / velocity_rad_s,
                exponent: T::of(0.5),
            },
            _ => Shape::Constant,
        };
        let coulomb = T::of(self.coulomb);
        Stribeck::new(coulomb, coulomb * T::of(self.ratio), shape).unwrap()
    }

    pub fn model<T: Real>(&self) -> ElastoPlastic<T, Stribeck<T>> {
        ElastoPlastic::new(
            self.curve(),
            T::of(self.stiffness),
            T::of(self.damping),
            T::of(self.viscous),
            T::of(self.breakaway),
        )
        .unwrap()
    }
}

/// The bench axis of the project; z_ss at speed is 1.9e-3 rad.
pub const BENCH: Parameters = Parameters {
    coulomb: 0.020,
    ratio: 1.3,
    v_s: 0.3,
    kind: 0,
    stiffness: 10.53,
    damping: 0.076,
    viscous: 0.0029,
    breakaway: 0.7,
};
