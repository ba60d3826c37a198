//! Effort as inertia, Coulomb and viscous friction and offset times the measured motion, away from rest:
//! u = J a + F_C sgn v + F_v v + c. Signs, factors and timing of the columns follow from it.
//!
//! Positions that are c times too large leave F_C as it is and divide J and F_v by c. Torque and encoder signs cannot be
//! told apart from these alone: both change every sign of the balance.

use super::position::Grid;
use super::regression::{BLOCKS, Sums, fit};
use super::{Code, Hygiene, Severity};
use crate::axis_file::AxisFile;
use crate::error::InputError;
use crate::log::{EffortKind, Log};
use crate::signal::correlation;
use crate::stretch::{Motion, Stretch, cutoff_hz, rad_per_count};

/// A number and its standard error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// Value.
    pub value: f64,
    /// One standard error.
    pub standard_error: f64,
}

impl Estimate {
    /// How many standard errors the value lies from zero.
    fn significance(self) -> f64 {
        self.value / self.standard_error.max(f64::MIN_POSITIVE)
    }
}

/// The balance of a log, as far as the log shows it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Balance {
    /// kg m^2
    pub inertia: Option<Estimate>,
    /// F_C, N m.
    pub coulomb_nm: Option<Estimate>,
    /// F_v, N m s/rad.
    pub viscous_nm_s_rad: Option<Estimate>,
    /// N m
    pub offset_nm: Option<Estimate>,
    /// Coulomb and viscous friction at the mean speed, N m.
    pub friction_nm: Estimate,
    /// Share of the effort's variance that it explains.
    pub explained: f64,
    /// Cut-off of the low-pass on all signals, Hz.
    pub cutoff_hz: f64,
}

/// When the effort was recorded against the position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Skew {
    /// Effort later than position, s; negative: earlier.
    pub effort_late_s: Estimate,
    /// The same in samples.
    pub samples: f64,
    /// Share of the balance's residual power that it takes away.
    pub gain: f64,
}

/// Factors of encoders and gears; their inverses too.
const FACTORS: [f64; 10] = [2.0, 3.0, 4.0, 5.0, 8.0, 10.0, 16.0, 20.0, 50.0, 100.0];
/// Standard errors from zero before a sign counts.
const SIGNIFICANT: f64 = 5.0;
/// Up to so many times the Stribeck velocity friction falls with speed, which takes inertia away as a factor would: at twice it a
/// Gaussian has fallen to a fiftieth.
const FALLS: f64 = 2.0;
/// A balance that explains less says nothing.
const EXPLAINS: f64 = 0.5;

pub(super) fn inspect(
    log: &Log,
    axis: &AxisFile,
    stretches: &[Stretch],
    grid: Grid,
    out: &mut Hygiene,
) -> Result<(), InputError> {
    let count = rad_per_count(axis).unwrap_or(0.0);
    let cutoff = cutoff_hz(stretches, count);
    let rows = Rows::new(log, axis, stretches, cutoff, count, out);
    let Some(mut balance) = rows.balance(0) else {
        return Ok(());
    };
    if balance.explained >= EXPLAINS && !wrong_sign(log, &balance, out)? {
        if let Some(aligned) = timing(log, axis, &rows, out)? {
            // A late effort takes its share of the inertia away, which must not look like a factor.
            balance = aligned;
        }
        // A grid that agrees leaves no factor to look for; one that differs has named it.
        if grid == Grid::Unseen {
            wrong_scale(axis, &balance, rows.mean_speed, out);
        }
    }
    out.balance = Some(balance);
    Ok(())
}

/// What the balance is fitted to.
struct Rows {
    motions: Vec<Motion>,
    used: Vec<Vec<bool>>,
    step_s: f64,
    mean_speed: f64,
    samples: usize,
    cutoff_hz: f64,
    /// Every how manieth sample is a row: low-passed ones between say the same.
    stride: usize,
}

impl Rows {
    fn new(
        log: &Log,
        axis: &AxisFile,
        stretches: &[Stretch],
        cutoff: f64,
        count: f64,
        out: &Hygiene,
    ) -> Self {
        let step_s = log.median_step_s();
        let motions: Vec<Motion> = stretches
            .iter()
            .map(|stretch| stretch.motion(cutoff))
            .collect();
        let speeds = || motions.iter().flat_map(|motion| &motion.velocity_rad_s);
        let top = speeds().fold(0.0_f64, |m, v| m.max(v.abs()));
        // Counts pass three times as fast as the low-pass, which then takes their sawtooth off; the friction curve has
        // fallen to its end; and a twentieth of the top speed keeps presliding out where nothing else is known.
        let mut slowest = (3.0 * cutoff * count).max(0.05 * top);
        if let Some(stribeck) = axis.friction.stribeck_velocity {
            slowest = slowest.max((4.0 * stribeck).min(0.3 * top));
        }
        // The filter smears whatever happens over about a quarter of its period.
        let smear = (0.25 / (cutoff * step_s)).ceil() as usize;
        let usable = out.usable(log.len());
        let used: Vec<Vec<bool>> = stretches
            .iter()
            .zip(&motions)
            .map(|(stretch, motion)| {
                let n = motion.velocity_rad_s.len();
                let mut used = vec![true; n];
                let mut close = |k: usize, reach: usize| {
                    used[k.saturating_sub(reach)..(k + reach + 1).min(n)].fill(false);
                };
                for (k, v) in motion.velocity_rad_s.iter().enumerate() {
                    if v.abs() < slowest {
                        close(k, smear);
                    }
                    if !usable[stretch.range.start + k] {
                        close(k, 4 * smear);
                    }
                }
                close(0, 4 * smear);
                close(n - 1, 4 * smear);
                used
            })
            .collect();
        let (mut sum, mut rows) = (0.0, 0.0);
        for (motion, used) in motions.iter().zip(&used) {
            for (v, used) in motion.velocity_rad_s.iter().zip(used) {
                if *used {
                    sum += v.abs();
                    rows += 1.0;
                }
            }
        }
        Self {
            motions,
            used,
            step_s,
            mean_speed: if rows > 0.0 { sum / rows } else { 0.0 },
            samples: log.len(),
            cutoff_hz: cutoff,
            stride: ((0.1 / (cutoff * step_s)) as usize).max(1),
        }
    }

    /// The balance with the effort read so many samples later.
    fn balance(&self, shift: isize) -> Option<Balance> {
        let found = fit(&self.sums(shift), self.mean_speed)?;
        let of = |i: usize| {
            found.seen[i].then_some(Estimate {
                value: found.value[i],
                standard_error: found.standard_error[i],
            })
        };
        Some(Balance {
            inertia: of(0),
            coulomb_nm: of(1),
            viscous_nm_s_rad: of(2),
            offset_nm: of(3),
            friction_nm: Estimate {
                value: found.friction.0,
                standard_error: found.friction.1,
            },
            explained: found.explained,
            cutoff_hz: self.cutoff_hz,
        })
    }

    fn sums(&self, shift: isize) -> [Sums; BLOCKS] {
        let mut blocks = [Sums::default(); BLOCKS];
        let mut index = 0;
        for (motion, used) in self.motions.iter().zip(&self.used) {
            for (k, used) in used.iter().enumerate() {
                let block = index * BLOCKS / self.samples.max(1);
                index += 1;
                if !used || !k.is_multiple_of(self.stride) {
                    continue;
                }
                let Some(&effort) = k
                    .checked_add_signed(shift)
                    .and_then(|k| motion.effort_nm.get(k))
                else {
                    continue;
                };
                let v = motion.velocity_rad_s[k];
                let x = [motion.acceleration_rad_s2[k], v.signum(), v, 1.0];
                blocks[block.min(BLOCKS - 1)].add(x, effort);
            }
        }
        blocks
    }
}

/// True if the signs contradict each other.
fn wrong_sign(log: &Log, balance: &Balance, out: &mut Hygiene) -> Result<bool, InputError> {
    let Some(inertia) = balance.inertia else {
        return Ok(false);
    };
    let friction = balance.friction_nm;
    if inertia.significance() > -SIGNIFICANT || friction.significance() > -SIGNIFICANT {
        return Ok(false);
    }
    let which = match &log.position_ref {
        Some(reference) if correlation(reference, &log.position.values) < -0.5 => {
            "the position runs against its reference, so it is the encoder's"
        }
        Some(_) => "the position follows its reference, so it is most likely the effort's",
        None => "one log cannot tell whether it is the effort's or the encoder's",
    };
    let text = format!(
        "effort and motion have opposite signs: inertia {:.3e} +- {:.0e}, friction {:.3e} +- {:.0e}; {which}; change the \
         sign of that column",
        inertia.value, inertia.standard_error, friction.value, friction.standard_error
    );
    out.find(Code::WrongSign, Severity::Fatal, text);
    Ok(true)
}

fn wrong_scale(axis: &AxisFile, balance: &Balance, mean_speed: f64, out: &mut Hygiene) {
    let Some(inertia) = balance.inertia else {
        return;
    };
    // An inertia known to less than a tenth cannot name a factor.
    if inertia.significance() < 10.0 {
        return;
    }
    let whole = axis.axis.inertia + axis.axis.load_inertia.unwrap_or(0.0);
    let factor = whole / inertia.value;
    let nearest = FACTORS
        .iter()
        .flat_map(|&factor| [factor, 1.0 / factor])
        .min_by(|a, b| (a / factor).ln().abs().total_cmp(&(b / factor).ln().abs()))
        .unwrap_or(1.0);
    if !(0.85..=1.15).contains(&(factor / nearest)) {
        return;
    }
    let stribeck = axis.friction.stribeck_velocity.unwrap_or(0.0);
    if mean_speed / nearest < FALLS * stribeck {
        return;
    }
    // Coulomb friction must be where the axis file has it: otherwise the file is of another axis.
    let (Some(coulomb), Some(believed)) = (balance.coulomb_nm, axis.friction.coulomb) else {
        return;
    };
    let moved = coulomb.value / believed;
    if !(0.75..=1.3).contains(&moved) || coulomb.significance() < SIGNIFICANT {
        return;
    }
    let (mut agrees, mut viscous_words) = (false, "viscous friction is not seen".to_string());
    if let (Some(viscous), Some(believed_viscous)) =
        (balance.viscous_nm_s_rad, axis.friction.viscous)
    {
        let share = believed_viscous * mean_speed / nearest / believed;
        if viscous.significance() > SIGNIFICANT && believed_viscous > 0.0 && share > 0.05 {
            let its = believed_viscous / viscous.value;
            if !(0.6..=1.67).contains(&(its / nearest)) {
                return;
            }
            agrees = true;
            viscous_words = format!("viscous friction by {its:.2}");
        }
    }
    // Inertia alone must name its factor well: an effect that resembles inertia seldom does.
    if !agrees && !(0.93..=1.07).contains(&(factor / nearest)) {
        return;
    }
    let key = match axis.unit {
        bristle_plant::Unit::Rotary => "counts_per_rev",
        bristle_plant::Unit::Linear => "counts_per_m",
    };
    let shown = if nearest < 1.0 {
        format!("1/{:.0}", 1.0 / nearest)
    } else {
        format!("{nearest:.0}")
    };
    let text = format!(
        "the inertia is off by {factor:.2}, {viscous_words}, while Coulomb friction stays within {:.0} %: positions are \
         about {shown} times what they should be; check {key} (times {shown}) and the unit of the position{}",
        100.0 * (moved - 1.0).abs(),
        if agrees {
            ""
        } else {
            ", or the inertia in the axis file"
        }
    );
    // Cogging or a wrong inertia can look like a factor where viscous friction has no say.
    let severity = if agrees {
        Severity::Fatal
    } else {
        Severity::Note
    };
    out.find(Code::WrongScale, severity, text);
}

/// Shifts the effort until the balance fits best; gives that balance where the shift is a finding.
fn timing(
    log: &Log,
    axis: &AxisFile,
    rows: &Rows,
    out: &mut Hygiene,
) -> Result<Option<Balance>, InputError> {
    // A tenth of the low-pass's period: between such steps the residual bends like a parabola.
    let stride = rows.stride as isize;
    let reach =
        ((LONGEST_SKEW_S / (rows.step_s * stride as f64)).ceil() as isize).clamp(3, MOST_SHIFTS);
    let sums: Vec<_> = (-reach..=reach).map(|i| rows.sums(i * stride)).collect();
    let Some((best, gain)) = lowest(&sums, rows.mean_speed, None) else {
        return Ok(None);
    };
    let samples = best * stride as f64;
    let whole = axis.axis.inertia + axis.axis.load_inertia.unwrap_or(0.0);
    // Only inertia shows the time of an effort; friction's share comes and goes with the sign of velocity.
    let Some(aligned) = rows.balance(samples.round() as isize).filter(|balance| {
        balance.inertia.is_some_and(|inertia| {
            // In presliding a spring takes the place of inertia, and a shift turns one into the other.
            inertia.significance() > 10.0 && (0.5..=2.0).contains(&(inertia.value / whole))
        })
    }) else {
        return Ok(None);
    };
    let mut squares = 0.0;
    for part in 0..PARTS {
        let Some((without, _)) = lowest(&sums, rows.mean_speed, Some(part)) else {
            return Ok(None);
        };
        squares += (without - best).powi(2);
    }
    let parts = PARTS as f64;
    let standard_error = stride as f64 * rows.step_s * ((parts - 1.0) / parts * squares).sqrt();
    let late_s = samples * rows.step_s;
    out.skew = Some(Skew {
        effort_late_s: Estimate {
            value: late_s,
            standard_error,
        },
        samples,
        gain,
    });
    // A command precedes its effect by the drive's delay and lag; whether that is right is not a matter of the record.
    let measured = matches!(
        log.best_effort(axis)?.kind,
        EffortKind::TorqueMeasured | EffortKind::Current
    );
    if measured && samples.abs() >= 1.5 && gain >= 0.9 && late_s.abs() >= 5.0 * standard_error {
        let text = format!(
            "the effort was recorded {:.1} samples ({:.3} ms) {} than the position: shifting it takes away {:.0} % of what \
             the force balance leaves; shift the column, or record both at the same instant",
            samples.abs(),
            late_s.abs() * 1e3,
            if late_s > 0.0 { "later" } else { "earlier" },
            100.0 * gain
        );
        out.find(Code::TimingSkew, Severity::Warning, text);
        return Ok(Some(aligned));
    }
    Ok(None)
}

/// Shifts beyond this are no matter of timing, s.
const LONGEST_SKEW_S: f64 = 0.02;
/// Shifts tried to either side.
const MOST_SHIFTS: isize = 40;
/// Parts of the record of which one at a time is left out.
const PARTS: usize = 4;

/// Shift of least residual, in steps of the list from its middle, and the share of the residual power that it takes
/// away; none where the list does not enclose it.
fn lowest(sums: &[[Sums; BLOCKS]], mean_speed: f64, without: Option<usize>) -> Option<(f64, f64)> {
    let curve = sums
        .iter()
        .map(|blocks| {
            let kept: Vec<Sums> = (0..BLOCKS)
                .filter(|block| without != Some(block * PARTS / BLOCKS))
                .map(|block| blocks[block])
                .collect();
            fit(&kept, mean_speed).map(|fit| fit.left)
        })
        .collect::<Option<Vec<f64>>>()?;
    let best = (0..curve.len()).min_by(|&a, &b| curve[a].total_cmp(&curve[b]))?;
    if best == 0 || best + 1 == curve.len() {
        return None;
    }
    let (before, at, after) = (curve[best - 1], curve[best], curve[best + 1]);
    let bend = before - 2.0 * at + after;
    if bend <= 0.0 {
        return None;
    }
    let middle = curve.len() / 2;
    let shift = best as f64 - middle as f64 + 0.5 * (before - after) / bend;
    Some((shift, 1.0 - at / curve[middle].max(f64::MIN_POSITIVE)))
}
