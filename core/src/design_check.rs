//! What an encoder, a sample rate and observer gains can show of an axis, before anyone trusts a plot of z.

use crate::friction::ElastoPlastic;
use crate::observer::luenberger::{self, Luenberger};
use crate::stribeck::Curve;

/// How a finding bears on trust.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Verdict {
    /// Nothing to mind.
    Good,
    /// Works within limits that the words say.
    Mind,
    /// What was asked for cannot be had.
    Bad,
}

/// One finding.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Finding {
    /// Stable name of what was looked at.
    pub name: &'static str,
    /// The number.
    pub value: f64,
    /// Its unit.
    pub unit: &'static str,
    /// How it bears on trust.
    pub verdict: Verdict,
    /// The verdict in words.
    pub words: &'static str,
}

/// What the check looks at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Design {
    /// Settings of the Luenberger-like observer, which hold axis, encoder and sample time.
    pub settings: luenberger::Settings<f64>,
    /// Largest torque that the intended experiment or the drive gives, N m.
    pub available_nm: f64,
}

/// Number of findings.
pub const FINDINGS: usize = 10;

/// Looks at a design. Whether the gains are stable is for [`Luenberger::new`] to say; its growth is among the findings.
pub fn check<C: Curve<f64> + Copy>(
    friction: &ElastoPlastic<f64, C>,
    design: &Design,
) -> [Finding; FINDINGS] {
    let s = &design.settings;
    let count = s.rad_per_count;
    let coulomb = friction.curve().coulomb_nm();
    let z_ss = coulomb / friction.stiffness_nm_rad() / count;
    let bristle_damping = friction.damping_nm_s_rad() + friction.viscous_nm_s_rad();
    let natural_rad_s = libm::sqrt(friction.stiffness_nm_rad() / s.inertia_kg_m2);
    let samples = core::f64::consts::TAU / (natural_rad_s * s.sample_time_s);
    let damping_ratio = bristle_damping / (2.0 * s.inertia_kg_m2 * natural_rad_s);
    let own_damping_1_s = bristle_damping / s.inertia_kg_m2;
    let difference = difference_noise_rad_s(count, s.sample_time_s);
    let luenberger = luenberger_noise_rad_s(s, friction.viscous_nm_s_rad());
    let stiction = friction.curve().stiction_nm();
    let passive_viscous = friction.damping_nm_s_rad() * (stiction / coulomb - 1.0);
    [
        graded(
            "z_ss",
            z_ss,
            "counts",
            z_ss,
            [4.0, 1.0],
            [
                "presliding spans several counts: z can be seen",
                "presliding spans few counts: z is seen in coarse steps",
                "presliding lies below one count: no position-only observer can see it",
            ],
        ),
        graded(
            "presliding natural frequency",
            natural_rad_s / core::f64::consts::TAU,
            "Hz",
            samples,
            [20.0, 6.0],
            [
                "sampled often enough: 20 or more samples a period",
                "sampled sparsely: 6 to 20 samples a period, expect phase error in stick",
                "fewer than 6 samples a period: the stick dynamics cannot be followed at this rate",
            ],
        ),
        graded(
            "samples per presliding period",
            samples,
            "samples",
            samples,
            [20.0, 6.0],
            ["enough", "sparse", "too few"],
        ),
        Finding {
            name: "presliding damping ratio",
            value: damping_ratio,
            unit: "",
            verdict: if damping_ratio >= 0.1 {
                Verdict::Good
            } else {
                Verdict::Mind
            },
            words: if damping_ratio >= 1.0 {
                "the axis creeps in stick, it does not ring"
            } else if damping_ratio >= 0.1 {
                "the axis rings in stick and settles"
            } else {
                "the axis rings long in stick: expect z to oscillate after every stop"
            },
        },
        either(
            "l1 against (sigma1+sigma2)/J",
            own_damping_1_s,
            "1/s",
            s.l1_1_s > own_damping_1_s,
            Verdict::Mind,
            [
                "l1 exceeds the axis' own damping in stick: it sets the pace of the velocity error",
                "l1 is below the axis' own damping in stick: it adds little there; damping, not stability, is what this \
                 condition is about",
            ],
        ),
        either(
            "viscous friction for a passive model",
            passive_viscous,
            "N m s/rad",
            friction.viscous_nm_s_rad() >= passive_viscous,
            Verdict::Mind,
            [
                "sigma2 is at least sigma1 (F_S/F_C - 1): the model never returns more energy than it stored",
                "sigma2 is below sigma1 (F_S/F_C - 1): through the Stribeck fall the model can return energy it never took",
            ],
        ),
        either(
            "observer error dies out",
            s.l1_1_s,
            "1/s",
            Luenberger::new(*friction, *s).is_ok(),
            Verdict::Bad,
            [
                "at this sample time, in stick and in slip",
                "not at this sample time: the observer refuses this l1",
            ],
        ),
        graded(
            "velocity noise of the difference quotient",
            difference,
            "rad/s rms",
            stribeck_reach(friction) / difference,
            [5.0, 1.0],
            [
                "far below the Stribeck velocity: usable as it is",
                "within reach of the Stribeck velocity: filter it",
                "larger than the Stribeck velocity: it cannot place f_ss on its curve",
            ],
        ),
        graded(
            "velocity noise of the Luenberger-like estimate",
            luenberger,
            "rad/s rms",
            stribeck_reach(friction) / luenberger,
            [5.0, 1.0],
            [
                "far below the Stribeck velocity: it may feed f_ss",
                "within reach of the Stribeck velocity: f_ss flickers near it",
                "larger than the Stribeck velocity: f_ss flickers over its whole curve; lower l1 or a finer encoder",
            ],
        ),
        either(
            "torque at hand against break-away",
            design.available_nm / stiction,
            "times stiction",
            design.available_nm > stiction,
            Verdict::Bad,
            [
                "enough to break away",
                "the axis never breaks away: only presliding can be measured",
            ],
        ),
    ]
}

/// Root-mean-square error of (q' - q)/T from quantisation: two independent uniform errors of a count, Delta/(T sqrt 6).
pub fn difference_noise_rad_s(rad_per_count: f64, sample_time_s: f64) -> f64 {
    rad_per_count / (sample_time_s * libm::sqrt(6.0))
}

/// Root-mean-square error of the Luenberger-like velocity from quantisation while sliding.
///
/// e' = (1 - T (l1 + sigma2/J)) e + l1 (n' - n) with white n of variance Delta^2/12 has the variance
/// l1^2 (Delta^2/12) 2/(1 + a).
pub fn luenberger_noise_rad_s(settings: &luenberger::Settings<f64>, viscous_nm_s_rad: f64) -> f64 {
    let pole = 1.0
        - settings.sample_time_s * (settings.l1_1_s + viscous_nm_s_rad / settings.inertia_kg_m2);
    settings.l1_1_s * settings.rad_per_count * libm::sqrt(2.0 / (12.0 * (1.0 + pole)))
}

/// Speed at which half of the Stribeck fall is done, rad/s; infinite for a curve that does not fall.
fn stribeck_reach<C: Curve<f64>>(friction: &ElastoPlastic<f64, C>) -> f64 {
    let curve = friction.curve();
    let half = 0.5 * (curve.stiction_nm() + curve.coulomb_nm());
    if curve.stiction_nm() <= curve.coulomb_nm() {
        return f64::INFINITY;
    }
    let (mut low, mut high) = (0.0, 1e6);
    for _ in 0..80 {
        let middle = 0.5 * (low + high);
        if curve.level_nm(middle) > half {
            low = middle;
        } else {
            high = middle;
        }
    }
    high
}

/// A finding that is good or not.
fn either(
    name: &'static str,
    value: f64,
    unit: &'static str,
    holds: bool,
    otherwise: Verdict,
    words: [&'static str; 2],
) -> Finding {
    let (verdict, words) = if holds {
        (Verdict::Good, words[0])
    } else {
        (otherwise, words[1])
    };
    Finding {
        name,
        value,
        unit,
        verdict,
        words,
    }
}

/// A finding that is good from the first limit on, and bad below the second.
fn graded(
    name: &'static str,
    value: f64,
    unit: &'static str,
    grade: f64,
    limits: [f64; 2],
    words: [&'static str; 3],
) -> Finding {
    let (verdict, words) = if grade >= limits[0] {
        (Verdict::Good, words[0])
    } else if grade >= limits[1] {
        (Verdict::Mind, words[1])
    } else {
        (Verdict::Bad, words[2])
    };
    Finding {
        name,
        value,
        unit,
        verdict,
        words,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stribeck::Stribeck;

    const SETTINGS: luenberger::Settings<f64> = luenberger::Settings {
        inertia_kg_m2: 2.5246e-5,
        rad_per_count: core::f64::consts::TAU / 16384.0,
        sample_time_s: 1e-4,
        l1_1_s: 1700.0,
        l2: 0.0,
        offset_nm: 0.0,
        max_speed_rad_s: 314.0,
        max_torque_nm: 1.0,
    };

    fn thesis(coulomb_nm: f64) -> [Finding; FINDINGS] {
        let curve = Stribeck::constant(coulomb_nm).unwrap();
        let friction = ElastoPlastic::new(curve, 10.53, 0.076, 0.0029, 0.7).unwrap();
        let design = Design {
            settings: SETTINGS,
            available_nm: 0.035,
        };
        check(&friction, &design)
    }

    fn value(findings: &[Finding], name: &str) -> Finding {
        *findings.iter().find(|f| f.name == name).unwrap()
    }

    #[test]
    fn thesis_presliding_lies_below_a_count() {
        let z_ss = value(&thesis(4.61e-4), "z_ss");
        // 4.61e-4/10.53 = 4.4e-5 rad of 3.8e-4: a ninth.
        assert!((1.0 / z_ss.value - 8.76).abs() < 0.01, "{z_ss:?}");
        assert_eq!(z_ss.verdict, Verdict::Bad);
    }

    #[test]
    fn thesis_other_coulomb_friction_never_breaks_away() {
        let findings = thesis(0.0533);
        let z_ss = value(&findings, "z_ss");
        assert!((z_ss.value - 13.2).abs() < 0.01, "{z_ss:?}");
        assert_eq!(
            value(&findings, "torque at hand against break-away").verdict,
            Verdict::Bad
        );
    }

    #[test]
    fn thesis_l1_condition() {
        let l1 = value(&thesis(4.61e-4), "l1 against (sigma1+sigma2)/J");
        assert!((l1.value - 3125.0).abs() < 1.0, "{l1:?}");
        assert_eq!(l1.verdict, Verdict::Mind);
        assert_eq!(
            value(&thesis(4.61e-4), "observer error dies out").verdict,
            Verdict::Good
        );
    }

    #[test]
    fn noise_is_what_a_quantised_ramp_gives() {
        let s = SETTINGS;
        let viscous = 0.0029;
        let (mut difference_sum, mut estimate_sum) = (0.0, 0.0);
        // At one speed the errors of neighbouring samples hang together; over the speeds of a count they average out.
        let speeds = 97;
        let samples = 2_000;
        for speed in 0..speeds {
            let per_sample = 7.0 + (f64::from(speed) + 0.382) / f64::from(speeds);
            let v = per_sample * s.rad_per_count / s.sample_time_s;
            let (mut estimate, mut last) = (v, 0.0);
            for k in 1..=samples {
                let counts = (f64::from(k) * per_sample).floor();
                let step_rad = (counts - last) * s.rad_per_count;
                last = counts;
                // The observer in sliding, where friction is known up to its viscous part.
                estimate += s.l1_1_s * (step_rad - s.sample_time_s * estimate)
                    - s.sample_time_s * viscous / s.inertia_kg_m2 * (estimate - v);
                difference_sum += (step_rad / s.sample_time_s - v).powi(2);
                estimate_sum += (estimate - v).powi(2);
            }
        }
        let samples = samples * speeds;
        let rms = |sum: f64| (sum / f64::from(samples)).sqrt();
        let difference = difference_noise_rad_s(s.rad_per_count, s.sample_time_s);
        let observer = luenberger_noise_rad_s(&s, viscous);
        // The average over 97 speeds is a sum for the integral over a count: a twentieth covers it.
        assert!((rms(difference_sum) / difference - 1.0).abs() < 0.05);
        assert!((rms(estimate_sum) / observer - 1.0).abs() < 0.05);
    }
}
