//! Limits that follow from what was found.

use super::{Allowed, Weight};
use crate::axis_file::AxisFile;
use crate::report::short;
use bristle_plant::Unit;

/// Counts a second that an encoder input with a digital filter follows: 16,384 counts at 50 turns a second, see
/// `core::parameters`.
const COUNTS_S: f64 = 819_200.0;
/// Share of the travel in which the torque limit has to stop the axis.
const STOPS_WITHIN: f64 = 0.5;

/// What they follow from.
pub(super) struct Found {
    pub rad_per_count: f64,
    pub inertia_kg_m2: f64,
    pub break_away_nm: f64,
    pub offset_nm: f64,
}

/// Limits of an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Limits {
    pub torque_nm: f64,
    pub speed_rad_s: f64,
    pub travel_rad: f64,
    /// What the speed follows from.
    because: &'static str,
}

/// The torque and travel that were allowed, and the fastest speed that the encoder follows and from which the torque
/// limit, less the offset, stops the axis within half of its travel: v^2 = 2 T x/J.
pub(super) fn safe(found: &Found, file: &AxisFile, allowed: &Allowed) -> Limits {
    let torque_nm = file
        .drive
        .torque_limit
        .map_or(allowed.torque_nm, |its| its.min(allowed.torque_nm));
    let travel_rad = file
        .drive
        .travel_limit
        .map_or(allowed.travel_rad, |its| its.min(allowed.travel_rad));
    let brakes_nm = (torque_nm - found.offset_nm.abs()).max(0.0);
    let stops = (2.0 * brakes_nm * STOPS_WITHIN * travel_rad / found.inertia_kg_m2).sqrt();
    let speeds = [
        (
            stops,
            "from there the torque limit stops it within half of the travel",
        ),
        (
            COUNTS_S * found.rad_per_count,
            "faster the encoder's input may lose counts",
        ),
        (
            file.drive.speed_limit.unwrap_or(f64::INFINITY),
            "as in the axis file",
        ),
    ];
    let (speed_rad_s, because) = speeds
        .into_iter()
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .unwrap_or((stops, ""));
    Limits {
        torque_nm,
        speed_rad_s,
        travel_rad,
        because,
    }
}

/// In words.
pub(super) fn say(
    limits: &Limits,
    found: &Found,
    file: &AxisFile,
    mut find: impl FnMut(Weight, String),
) {
    let (length, effort) = match file.unit {
        Unit::Rotary => ("rad", "N m"),
        Unit::Linear => ("m", "N"),
    };
    let needs = found.break_away_nm + found.offset_nm.abs();
    let torque = short(limits.torque_nm);
    if limits.torque_nm < 1.5 * needs {
        let text = format!(
            "{torque} {effort} are less than 1.5 times the {} that it takes to break away: loops will stand at the \
             limit; allow more where drive and mechanics bear it",
            short(needs)
        );
        find(Weight::Doubtful, text);
    } else {
        let text = format!(
            "{torque} {effort}, {} times what it takes to break away",
            short(limits.torque_nm / needs)
        );
        find(Weight::Sound, text);
    }
    let changed = file
        .drive
        .speed_limit
        .is_some_and(|its| limits.speed_rad_s < its);
    let weight = if changed {
        Weight::Changed
    } else {
        Weight::Sound
    };
    find(
        weight,
        format!(
            "{} {length}/s: {}",
            short(limits.speed_rad_s),
            limits.because
        ),
    );
    find(
        Weight::Sound,
        format!(
            "{} {length} of travel either way, as allowed",
            short(limits.travel_rad)
        ),
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_torque_stops_the_axis_within_half_of_its_travel() {
        let found = Found {
            rad_per_count: 1e-5,
            inertia_kg_m2: 1e-4,
            break_away_nm: 0.02,
            offset_nm: -0.02,
        };
        let allowed = Allowed {
            torque_nm: 0.1,
            travel_rad: 4.0,
            turns: 3.0,
        };
        let mut file = AxisFile::new(Unit::Rotary, 1e-4);
        let limits = safe(&found, &file, &allowed);
        // 0.08 N m on 1e-4 kg m^2 are 800 rad/s^2: 1600 x 2 rad is the square of the speed; the encoder bears 8 rad/s.
        assert!((limits.speed_rad_s - 8.192).abs() < 1e-9);
        let coarse = Found {
            rad_per_count: 1e-3,
            ..found
        };
        let limits = safe(&coarse, &file, &allowed);
        assert!((limits.speed_rad_s - 3200.0_f64.sqrt()).abs() < 1e-9);
        file.drive.speed_limit = Some(5.0);
        assert_eq!(safe(&coarse, &file, &allowed).speed_rad_s, 5.0);
    }
}
