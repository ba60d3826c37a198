//! The elasto-plastic model in 32-bit fixed point, for a microcontroller without a floating-point unit or a check of
//! the one that has it.
//!
//! Scaling: displacement and z in encoder counts (I16F16), speed in counts per sample (I16F16), 1/z_ss in 1/count
//! (I8F24), torque as a share of a stated full scale (I2F30). Every sum that could leave its range saturates.
//! Products widen to 64 bits, which a Cortex-M4 does in one instruction; the only division is one of 32 by 32 bits.
//!
//! The equations are those of [`super::elasto_plastic`].

use core::hint::cold_path;

use super::elasto_plastic::{ElastoPlastic, HALF_SINE};
use crate::error::{ParameterError, positive, require};
use crate::stribeck::{Curve, SEGMENTS};
use fixed::types::extra::U29;
use fixed::types::{I2F30, I8F24, I16F16};

/// A share between -4 and 4.
pub type Share = fixed::FixedI32<U29>;

/// How the fixed-point units relate to SI.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scaling {
    /// Angle of one count, rad.
    pub rad_per_count: f64,
    /// Length of a sample, s.
    pub sample_time_s: f64,
    /// Torque of 1.0, N m; it should exceed the largest friction torque, which saturates at twice this.
    pub full_scale_nm: f64,
    /// Top of the Stribeck table, rad/s; the curve stays at its last value above.
    pub top_speed_rad_s: f64,
}

/// Parameters in fixed-point units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ElastoPlasticFixed {
    /// One more than there are ends of segments: the last segment is flat, and holds every higher speed.
    z_ss_bits: [i32; SEGMENTS + 2],
    per_z_ss_bits: [i32; SEGMENTS + 2],
    segments_per_speed: I16F16,
    top_speed: I16F16,
    z_max: I16F16,
    breakaway_ratio: Share,
    per_mixed_range: I8F24,
    stiffness: I8F24,
    damping: I8F24,
    viscous: I8F24,
}

/// Deflection in counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct State {
    /// z.
    pub z_counts: I16F16,
}

/// A place in the tables of steady deflection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    segment: usize,
    part: u32,
}

impl ElastoPlasticFixed {
    /// The model in the given scaling.
    ///
    /// # Errors
    /// z_ss outside 1/64 to 1024 counts; stiction above 3.5 times Coulomb friction; a ratio above 0.99; a torque coefficient of 128 full scales per count or more,
    /// or a stiffness so small against full scale that fewer than 12 bits are left of it.
    pub fn new<C: Curve<f64>>(
        model: &ElastoPlastic<f64, C>,
        scaling: &Scaling,
    ) -> Result<Self, ParameterError> {
        let count = positive("rad_per_count", scaling.rad_per_count)?;
        let sample = positive("sample_time_s", scaling.sample_time_s)?;
        let full = positive("full_scale_nm", scaling.full_scale_nm)?;
        let top = positive("top_speed_rad_s", scaling.top_speed_rad_s)?;
        let mut z_ss_bits = [0; SEGMENTS + 2];
        let mut per_z_ss_bits = [0; SEGMENTS + 2];
        for (i, (z, per_z)) in z_ss_bits.iter_mut().zip(&mut per_z_ss_bits).enumerate() {
            let counts = model.z_ss_rad(top * i.min(SEGMENTS) as f64 / SEGMENTS as f64) / count;
            require(
                "z_ss in counts",
                counts,
                (1.0 / 64.0..=1024.0).contains(&counts),
                "1/64 to 1024",
            )?;
            *z = I16F16::saturating_from_num(counts).to_bits();
            *per_z = I8F24::saturating_from_num(1.0 / counts).to_bits();
        }
        // A deflection of z_max as a share of the least z_ss has to fit a share, which ends at 4.
        let fall = model.curve().stiction_nm() / model.curve().coulomb_nm();
        require(
            "stiction over Coulomb friction",
            fall,
            fall <= 3.5,
            "at most 3.5",
        )?;
        let ratio = model.breakaway_ratio();
        require("breakaway_ratio", ratio, ratio <= 0.99, "at most 0.99")?;
        let segments_per_speed = SEGMENTS as f64 * count / (top * sample);
        require(
            "top_speed_rad_s",
            top,
            (1.0..32768.0).contains(&segments_per_speed),
            "between 1/512 and 64 counts a sample",
        )?;
        let coefficient = |name, per_count: f64, least: f64| {
            require(
                name,
                per_count,
                (least..128.0).contains(&per_count),
                "at least 2^-12 (stiffness) and below 128 full scales per count",
            )
            .map(I8F24::saturating_from_num)
        };
        Ok(Self {
            z_ss_bits,
            per_z_ss_bits,
            segments_per_speed: I16F16::saturating_from_num(segments_per_speed),
            top_speed: I16F16::saturating_from_num(SEGMENTS as f64 / segments_per_speed),
            z_max: I16F16::saturating_from_num(model.z_max_rad() / count),
            breakaway_ratio: Share::saturating_from_num(ratio),
            per_mixed_range: I8F24::saturating_from_num(1.0 / (1.0 - ratio)),
            stiffness: coefficient(
                "stiffness in full scales per count",
                model.stiffness_nm_rad() * count / full,
                1.0 / 4096.0,
            )?,
            damping: coefficient(
                "damping in full scales per count and sample",
                model.damping_nm_s_rad() * count / (sample * full),
                0.0,
            )?,
            viscous: coefficient(
                "viscous in full scales per count and sample",
                model.viscous_nm_s_rad() * count / (sample * full),
                0.0,
            )?,
        })
    }

    /// Deflection that no input exceeds, counts.
    #[inline]
    pub fn z_max(&self) -> I16F16 {
        self.z_max
    }

    /// Where a speed in counts per sample, zero or more, stands in the tables.
    #[inline]
    pub fn place(&self, speed: I16F16) -> Place {
        let speed = i64::from(speed.min(self.top_speed).to_bits());
        let x = ((speed * i64::from(self.segments_per_speed.to_bits())) >> 16) as u32;
        Place {
            segment: (x >> 16).min(SEGMENTS as u32) as usize,
            part: x & 0xffff,
        }
    }

    /// z_ss in counts, with the sign of `direction`.
    #[inline]
    pub fn z_ss_along(&self, place: Place, direction: I16F16) -> I16F16 {
        let z_ss = I16F16::from_bits(between(&self.z_ss_bits, place));
        if direction < I16F16::ZERO {
            z_ss.wrapping_neg()
        } else {
            z_ss
        }
    }

    /// 1/z_ss, 1/count.
    #[inline]
    pub fn per_z_ss(&self, place: Place) -> I8F24 {
        I8F24::from_bits(between(&self.per_z_ss_bits, place))
    }

    /// alpha at a share of z_ss that is counted positive in the direction of motion.
    #[inline]
    pub fn alpha(&self, share: Share) -> Share {
        if share <= self.breakaway_ratio {
            return Share::ZERO;
        }
        if share >= Share::ONE {
            return Share::ONE;
        }
        let past = i64::from(share.wrapping_sub(self.breakaway_ratio).to_bits());
        let x = ((past * i64::from(self.per_mixed_range.to_bits())) >> 24) as i32;
        half_sine(Share::from_bits(x))
    }

    /// A deflection of at most z_max as a share of z_ss, positive where `direction` is.
    #[inline]
    pub fn share_along(&self, z: I16F16, per_z_ss: I8F24, direction: I16F16) -> Share {
        let share = (i64::from(z.to_bits()) * i64::from(per_z_ss.to_bits())) >> 11;
        let share = Share::from_bits(share as i32);
        if direction < I16F16::ZERO {
            share.wrapping_neg()
        } else {
            share
        }
    }

    /// A deflection within z_max.
    #[inline]
    pub fn within(&self, z: I16F16) -> I16F16 {
        z.max(self.z_max.wrapping_neg()).min(self.z_max)
    }

    /// Advances z by a displacement in counts during one sample at a speed in counts per sample, and gives the torque
    /// as a share of full scale.
    #[inline]
    pub fn step(&self, state: &mut State, displacement: I16F16) -> I2F30 {
        let z = state.z_counts;
        let speed = displacement.saturating_abs();
        let place = self.place(speed);
        let per_z_ss = self.per_z_ss(place);
        let half_way = self.within(z.saturating_add(displacement >> 1));
        let alpha = self.alpha(self.share_along(half_way, per_z_ss, displacement));
        // |dq|/z_ss and alpha |dq|/z_ss, both with 24 fractional bits and stopped before they overflow.
        let travel = (i64::from(speed.to_bits()) * i64::from(per_z_ss.to_bits())) >> 16;
        let travel = travel.min(i64::from(i32::MAX)) as i32;
        let decay = ((i64::from(travel) * i64::from(alpha.to_bits())) >> 29) as i32;
        let sum = z.saturating_add(displacement);
        let next = if decay >= LARGEST_DECAY {
            self.z_ss_along(place, displacement)
        } else {
            let inverse = i64::from(inverse_of_one_plus(decay.cast_unsigned()).cast_signed());
            // Rounded to nearest: a cut would pull z the same way at every step.
            I16F16::from_bits(((i64::from(sum.to_bits()) * inverse + (1 << 29)) >> 30) as i32)
        };
        let next = self.within(next);
        state.z_counts = next;
        // Below 2^57, 2^58 and 2^62: the sum cannot overflow, only its narrowing can.
        let product = |a: I8F24, b: I16F16| i64::from(a.to_bits()) * i64::from(b.to_bits());
        let torque = product(self.stiffness, next)
            .wrapping_add(product(self.damping, next.wrapping_sub(z)))
            .wrapping_add(product(self.viscous, displacement))
            >> 10;
        I2F30::from_bits(i32::try_from(torque).unwrap_or_else(|_| {
            cold_path();
            if torque < 0 { i32::MIN } else { i32::MAX }
        }))
    }
}

/// A table's value at a place.
#[inline]
fn between(table: &[i32; SEGMENTS + 2], place: Place) -> i32 {
    let value = |i: usize| table.get(i).copied().unwrap_or(0);
    let (low, high) = (value(place.segment), value(place.segment + 1));
    let rise = (i64::from(high.wrapping_sub(low)) * i64::from(place.part)) >> 16;
    low.wrapping_add(rise as i32)
}

/// From a decay of 127 on, z' is z_ss to better than one part in a hundred, and its inverse would lose its bits.
const LARGEST_DECAY: i32 = 127 << 24;

/// 1/(1 + x) in 30 fractional bits for x in 24 fractional bits below 128: a 16-bit quotient, then one Newton step.
#[inline]
fn inverse_of_one_plus(x: u32) -> u32 {
    let d = (1_u32 << 24).wrapping_add(x);
    // 2^32/(d/2^8) has 16 fractional bits. d/2^8 from its parts, so that the compiler sees that it is not zero.
    let coarse = u64::from(u32::MAX / ((1 << 16) + (x >> 8)));
    // r (2 - d r): 24 + 16 fractional bits inside, which is less than 2^42; 30 outside.
    let rest = (2_u64 << 40).wrapping_sub(u64::from(d) * coarse);
    ((coarse * u64::from((rest >> 16) as u32)) >> 10) as u32
}

/// [`super::elasto_plastic::half_sine`] in fixed point; `x` is between 0 and 1.
#[inline]
fn half_sine(x: Share) -> Share {
    // |u| <= 1/2, s <= 1/4 and |q| < 2.3: nothing here can leave -4..4.
    let half = Share::from_bits(1 << 28);
    let quarter = Share::from_bits(1 << 27);
    let u = x.wrapping_sub(half);
    let s = product(u, u);
    let mut q = Share::ZERO;
    for &c in COEFFICIENTS.iter().rev() {
        q = product(q, s).wrapping_add(c);
    }
    let slope = Share::ONE.wrapping_add(product(s.wrapping_sub(quarter), q));
    let y = half.wrapping_add(product(u, slope));
    y.max(Share::ZERO).min(Share::ONE)
}

/// A product that fits: one wide multiplication, which the crate's own does not become where it is inlined.
#[inline]
fn product(a: Share, b: Share) -> Share {
    Share::from_bits(((i64::from(a.to_bits()) * i64::from(b.to_bits())) >> 29) as i32)
}

const COEFFICIENTS: [Share; 4] = {
    let mut out = [Share::ZERO; 4];
    let mut i = 0;
    while i < out.len() {
        out[i] = Share::from_bits((HALF_SINE[i] * (1_i64 << 29) as f64) as i32);
        i += 1;
    }
    out
};

#[cfg(test)]
mod tests {
    use super::*;
    use crate::friction::{Friction, Motion, elasto_plastic};
    use crate::stribeck::{Shape, Stribeck, Table};
    use std::println;

    const SCALING: Scaling = Scaling {
        rad_per_count: core::f64::consts::TAU / 16384.0,
        sample_time_s: 1e-4,
        full_scale_nm: 0.1,
        top_speed_rad_s: 2.4,
    };

    fn bench() -> ElastoPlastic<f64, Table<f64>> {
        let shape = Shape::Gaussian {
            velocity_rad_s: 0.3,
        };
        let curve = Stribeck::new(0.020, 0.026, shape).unwrap();
        let table = Table::new(&curve, SCALING.top_speed_rad_s).unwrap();
        ElastoPlastic::new(table, 10.53, 0.076, 0.0029, 0.7).unwrap()
    }

    #[test]
    fn inverse_is_close_over_its_range() {
        let worst = (0..1_000_000_u32)
            .map(|i| i * 2147)
            .map(|x| {
                let exact = 1.0 / (1.0 + f64::from(x) / f64::from(1 << 24));
                (f64::from(inverse_of_one_plus(x)) / f64::from(1 << 30) - exact).abs()
            })
            .fold(0.0, f64::max);
        // The 16-bit quotient is off by 2^-16 + 2^-16; Newton squares that relative error times d: d 2^-32 4, at most
        // 2^-23 absolute of 1/d for d = 128, and the cut to 30 bits adds 2^-24 times r = 1.
        assert!(worst < 2.0_f64.powi(-22), "{worst:e}");
    }

    #[test]
    fn half_sine_matches_the_floating_one() {
        let worst = (0..=1 << 16)
            .map(|i| i << 13)
            .map(|bits| {
                let x = Share::from_bits(bits);
                (half_sine(x).to_num::<f64>() - elasto_plastic::half_sine(x.to_num::<f64>())).abs()
            })
            .fold(0.0, f64::max);
        // Some fifteen operations, each cut to 2^-29.
        assert!(worst < 15.0 * 2.0_f64.powi(-29), "{worst:e}");
    }

    #[test]
    fn follows_the_f64_model() {
        let model = bench();
        let fixed = ElastoPlasticFixed::new(&model, &SCALING).unwrap();
        let mut state = State::default();
        let mut reference = elasto_plastic::State::default();
        let (mut worst_z, mut worst_f) = (0.0_f64, 0.0_f64);
        for k in 0..200_000 {
            let t = f64::from(k) * 1e-4;
            let speed = 0.4 * (3.0 * t).sin() + 0.02 * (40.0 * t).sin();
            let displacement = I16F16::from_num(speed);
            let torque = fixed.step(&mut state, displacement).to_num::<f64>();
            let motion = Motion {
                velocity_rad_s: displacement.to_num::<f64>() * SCALING.rad_per_count / 1e-4,
                applied_nm: 0.0,
                dt_s: 1e-4,
            };
            let expected = model.step(&mut reference, motion);
            let z = reference.z_rad / SCALING.rad_per_count;
            worst_z = worst_z.max((state.z_counts.to_num::<f64>() - z).abs());
            worst_f = worst_f.max((torque * SCALING.full_scale_nm - expected).abs());
        }
        let z_ss = model.z_ss_rad(2.4) / SCALING.rad_per_count;
        // Every step in the mixed range rounds z by at most 2^-17 count, and sliding z_ss far forgets it. From a
        // reversal at 1.2e-4 count/sample^2 those 5 counts take 290 samples. Torque adds one rounding over T in damping.
        let limit_z = 290.0 * 2.0_f64.powi(-17);
        let limit_f = 10.53 * limit_z * SCALING.rad_per_count
            + 0.076 * SCALING.rad_per_count / 1e-4 * 2.0_f64.powi(-16);
        println!(
            "fixed z {worst_z:.2e}/{limit_z:.2e} count of {z_ss:.1}, torque {worst_f:.2e}/{limit_f:.2e} N m"
        );
        assert!(worst_z < limit_z);
        assert!(worst_f < limit_f);
    }

    #[test]
    fn bounded_for_any_step() {
        let fixed = ElastoPlasticFixed::new(&bench(), &SCALING).unwrap();
        let mut state = State::default();
        let mut bits = 1_u32;
        for _ in 0..100_000 {
            bits = bits.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let shift = (bits >> 3) % 32;
            fixed.step(&mut state, I16F16::from_bits(bits.cast_signed() >> shift));
            assert!(state.z_counts.abs() <= fixed.z_max());
        }
    }

    #[test]
    fn refuses_a_scaling_it_cannot_hold() {
        let coarse = Scaling {
            rad_per_count: 1.0,
            ..SCALING
        };
        let error = ElastoPlasticFixed::new(&bench(), &coarse).unwrap_err();
        assert_eq!(error.name, "z_ss in counts");
    }
}
