//! Output error: the axis simulated forward under the measured effort, against the measured position.
//!
//! Over windows the state is set anew: the axis is led along the measured position before a window, then let go, and what
//! is left of its initial position and velocity is fitted with the window. Free running starts once and shows drift too.

use crate::believed::{Believed, Noise};
use crate::error::InputError;
use crate::inverse::Record;
use crate::signal::rms;
use bristle_plant::axis::Axis;
use rayon::prelude::*;

/// Length of a window, s.
pub const WINDOW_S: f64 = 0.5;
/// The axis is led for so long before a window, s.
const LEAD_S: f64 = 0.1;
/// Bandwidth of what leads it, rad/s.
const LEADS: f64 = 125.0;

/// The axis at the start of a record, driven as the record says.
fn axis(
    believed: &Believed,
    record: &Record,
    at_rad: f64,
    velocity: f64,
) -> Result<Axis, InputError> {
    let mut believed = believed.clone();
    // Fine, so that the reading is the position.
    believed.counts_per_turn = 1e9_f64.min(f64::from(i32::MAX));
    believed.drive = record.drive(believed.drive);
    Ok(believed
        .axis(believed.model, record.step_s, Noise::default(), 0)?
        .starting_at(at_rad, velocity))
}

/// Root-mean-square of the windowed output error of a record, rad; none where no stretch holds a window.
///
/// # Errors
/// The friction model refuses the parameters.
pub fn windowed(believed: &Believed, record: &Record) -> Result<Option<f64>, InputError> {
    let length = (WINDOW_S / record.step_s) as usize;
    let lead = (LEAD_S / record.step_s) as usize;
    let mut windows = Vec::new();
    for stretch in &record.stretches {
        let last = stretch.position_rad.len().saturating_sub(length);
        windows.extend((lead..last).step_by(length).map(|first| (stretch, first)));
    }
    let errors = windows
        .into_par_iter()
        .map(|(stretch, first)| {
            let run = |nudge: [f64; 2]| window(believed, record, stretch, first, length, nudge);
            let step = [
                record.rad_per_count.max(1e-9),
                record.rad_per_count.max(1e-9) / LEAD_S,
            ];
            let moved = [run([step[0], 0.0])?, run([0.0, step[1]])?];
            Ok(without_start(&run([0.0; 2])?, &moved))
        })
        .collect::<Result<Vec<_>, InputError>>()?
        .concat();
    let finite = errors.iter().all(|e| e.is_finite());
    Ok((finite && !errors.is_empty()).then(|| rms(errors)))
}

/// Position error in a window, from a led start nudged in position and velocity.
fn window(
    believed: &Believed,
    record: &Record,
    stretch: &crate::inverse::Stretch,
    first: usize,
    length: usize,
    nudge: [f64; 2],
) -> Result<Vec<f64>, InputError> {
    let from = first - (LEAD_S / record.step_s) as usize;
    let inertia = believed.whole_inertia_kg_m2();
    let mut axis = axis(
        believed,
        record,
        stretch.smooth_rad[from],
        stretch.velocity_rad_s[from],
    )?;
    for k in from..first {
        let motion = axis.truth().motion;
        let lead = LEADS * LEADS * (stretch.smooth_rad[k] - motion.position_rad)
            + 2.0 * LEADS * (stretch.velocity_rad_s[k] - motion.velocity_rad_s);
        axis.advance(stretch.effort_nm[k] + inertia * lead);
    }
    let motion = axis.truth().motion;
    axis = axis.starting_at(
        motion.position_rad + nudge[0],
        motion.velocity_rad_s + nudge[1],
    );
    Ok((first..first + length)
        .map(|k| {
            let error = axis.truth().motion.position_rad - stretch.position_rad[k];
            axis.advance(stretch.effort_nm[k]);
            error
        })
        .collect())
}

/// An error less what two small changes of the start can take away.
fn without_start(base: &[f64], moved: &[Vec<f64>; 2]) -> Vec<f64> {
    let column = |j: usize| -> Vec<f64> { moved[j].iter().zip(base).map(|(m, b)| m - b).collect() };
    let (a, b) = (column(0), column(1));
    let dot = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(x, y)| x * y).sum::<f64>();
    let (aa, ab, bb) = (dot(&a, &a), dot(&a, &b), dot(&b, &b));
    let (ra, rb) = (dot(&a, base), dot(&b, base));
    let determinant = aa * bb - ab * ab;
    let (x, y) = if determinant > 1e-9 * aa * bb {
        (
            (ra * bb - rb * ab) / determinant,
            (rb * aa - ra * ab) / determinant,
        )
    } else if aa > 0.0 {
        (ra / aa, 0.0)
    } else {
        (0.0, 0.0)
    };
    base.iter()
        .zip(a.iter().zip(&b))
        .map(|(e, (a, b))| e - x * a - y * b)
        .collect()
}

/// Simulated position over a record's longest stretch, run freely from its start under the measured effort, beside the
/// measured one, rad.
///
/// # Errors
/// The friction model refuses the parameters.
pub fn free_run(believed: &Believed, record: &Record) -> Result<(Vec<f64>, Vec<f64>), InputError> {
    let Some(stretch) = record
        .stretches
        .iter()
        .max_by_key(|stretch| stretch.effort_nm.len())
    else {
        return Ok((Vec::new(), Vec::new()));
    };
    let mut axis = axis(
        believed,
        record,
        stretch.smooth_rad[0],
        stretch.velocity_rad_s[0],
    )?;
    let simulated = stretch
        .effort_nm
        .iter()
        .map(|&effort| {
            let at = axis.truth().motion.position_rad;
            axis.advance(effort);
            at
        })
        .collect();
    Ok((simulated, stretch.position_rad.clone()))
}
