//! Records for tests.

use crate::axis_file::AxisFile;
use crate::believed::{Believed, Noise};
use crate::experiments::Named;
use crate::inverse::Record;
use crate::simulate::{Input, simulate};
use std::path::Path;

/// An experiment on the axis of a file, with so much torque noise on its rotor, N m rms a sample of the log.
pub(super) fn record(
    named: Named,
    seconds: f64,
    file: &AxisFile,
    believed: &Believed,
    torque_nm: f64,
) -> Record {
    let noise = Noise {
        torque_nm,
        position_rad: 0.0,
    };
    let input = Input::Experiment(named, seconds);
    let log = simulate(&input, file, believed, noise, 1, |_| ())
        .unwrap()
        .log(believed.unit, Path::new(named.name()));
    Record::new(&log, file, believed, &[]).unwrap()
}
