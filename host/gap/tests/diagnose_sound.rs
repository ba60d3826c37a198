//! A diagnosis rests on sound logs: what is wrong as a whole is an error with its remedy, what shows nothing decides
//! nothing, and the rest is noted.

mod records;

use bristle_gap::diagnose::{Diagnosis, Kind, Options, diagnose};
use bristle_gap::experiments::Named;
use bristle_gap::{AxisFile, Believed, InputError, Log};
use records::{linear, record, rotary};
use std::path::Path;

fn diagnosed(logs: &[Log], axis: &AxisFile) -> Result<Diagnosis, InputError> {
    let believed = Believed::new(axis, Path::new("axis.toml")).unwrap();
    // Nothing to accuse: the search costs nothing.
    let options = Options {
        catalogue: Vec::new(),
    };
    diagnose(logs, axis, &believed, &options, &|_| ()).map(|outcome| outcome.diagnosis)
}

#[test]
fn a_wrong_sign_is_an_error_of_its_file() {
    let axis = linear(1000.0);
    let sound = record(&axis, Named::Sine, 6.0, 0.01, 1);
    let mut wrong = sound.clone();
    wrong.file = "turned.csv".into();
    for effort in &mut wrong.efforts {
        effort.values.iter_mut().for_each(|u| *u = -*u);
    }
    let error = diagnosed(&[sound, wrong], &axis).unwrap_err();
    assert_eq!(error.file, Path::new("turned.csv"));
    assert!(error.message.starts_with("wrong-sign: "), "{error}");
    assert_eq!(error.remedy, "change the sign of that column");
}

#[test]
fn a_log_that_never_moved_decides_nothing() {
    let axis = rotary(1000.0, 17);
    let mut still = record(&axis, Named::Sine, 6.0, 0.01, 1);
    still.file = "still.csv".into();
    still.position.values.fill(0.1);
    let alone = diagnosed(std::slice::from_ref(&still), &axis).unwrap();
    assert_eq!(alone.verdict.kind, Kind::Insufficient);
    assert!(alone.notes[0].starts_with("still.csv: never-moved: "));

    // Beside one that moved it is left out: the gap is that of the other alone.
    let moved = record(&axis, Named::Sine, 6.0, 0.01, 1);
    let alone = diagnosed(std::slice::from_ref(&moved), &axis).unwrap();
    assert!(alone.notes.is_empty(), "{:?}", alone.notes);
    let both = diagnosed(&[moved, still], &axis).unwrap();
    assert_eq!(both.verdict.kind, alone.verdict.kind);
    assert_eq!(both.gap.before.to_bits(), alone.gap.before.to_bits());
    assert!(both.notes[0].starts_with("still.csv: never-moved: "));
}

#[test]
fn what_hygiene_leaves_out_is_not_fitted() {
    let axis = rotary(1000.0, 17);
    let sound = record(&axis, Named::Sine, 6.0, 0.01, 1);
    let mut jumps = sound.clone();
    // Half a turn lost for good: fitted, it would be an acceleration of 3e6 rad/s^2.
    jumps.position.values[3500..]
        .iter_mut()
        .for_each(|q| *q += 3.0);
    let sound = diagnosed(&[sound], &axis).unwrap();
    let jumps = diagnosed(&[jumps], &axis).unwrap();
    assert!(
        jumps.notes[0].contains("position-jump"),
        "{:?}",
        jumps.notes
    );
    // Neither fitted nor followed by the bristles: a hundredth of Coulomb friction at most.
    let off = (jumps.gap.before - sound.gap.before).abs();
    assert!(off < 0.0008, "{} {}", jumps.gap.before, sound.gap.before);
}

#[test]
fn a_log_of_another_scale_is_left_out() {
    let axis = linear(1000.0);
    let sound = [Named::Sine, Named::Moves].map(|named| record(&axis, named, 6.0, 0.01, 1));
    let alone = diagnosed(&sound[..1], &axis).unwrap();
    let mut doubled = sound[1].clone();
    doubled.file = "doubled.csv".into();
    // On no grid that says so by itself.
    doubled
        .position
        .values
        .iter_mut()
        .for_each(|q| *q *= 1.9997);
    let both = diagnosed(&[sound[0].clone(), doubled.clone()], &axis).unwrap();
    assert!(
        both.notes[0].starts_with("doubled.csv: wrong-scale: ")
            && both.notes[0].contains("left out"),
        "{:?}",
        both.notes
    );
    assert_eq!(both.gap.before.to_bits(), alone.gap.before.to_bits());
    // Where no other log speaks for the file, it may be the file.
    let error = diagnosed(&[doubled], &axis).unwrap_err();
    assert!(error.message.starts_with("wrong-scale: "), "{error}");
}
