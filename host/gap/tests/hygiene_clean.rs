//! Sound records raise no finding, whatever the experiment, rate, encoder and noise.

mod records;

use bristle_gap::axis_file::EffectEntry;
use bristle_gap::experiments::Named;
use bristle_gap::hygiene::{Code, inspect};
use bristle_gap::{AxisFile, Log};
use records::{linear, record, rotary};

fn sound(axis: &AxisFile, what: &str, named: Named, noise: f64, seed: u64) -> Option<String> {
    in_log(&record(axis, named, 6.0, noise, seed), axis, what, named)
}

fn in_log(log: &Log, axis: &AxisFile, what: &str, named: Named) -> Option<String> {
    let hygiene = inspect(log, axis).unwrap();
    if let Some(b) = &hygiene.balance {
        let inertia = b.inertia.map_or(0.0, |j| j.value / axis.axis.inertia);
        let late = hygiene.skew.map(|skew| (skew.samples, skew.gain));
        println!(
            "{what} {named:?}: J {inertia:.2}, at {:.0} Hz, late {late:.2?}",
            b.cutoff_hz
        );
    }
    let (low, high) = log
        .position
        .values
        .iter()
        .fold((f64::MAX, f64::MIN), |(low, high), &q| {
            (low.min(q), high.max(q))
        });
    let count = bristle_gap::stretch::rad_per_count(axis).unwrap();
    // A record that stays within a count cannot be fitted, whatever was asked of the axis: then, and only then, it says so.
    let still = high - low < 1.5 * count;
    let unsaid: Vec<_> = hygiene
        .findings
        .iter()
        .filter(|finding| !(still && finding.code == Code::NeverMoved))
        .map(ToString::to_string)
        .collect();
    assert!(!still || !hygiene.findings.is_empty(), "{what} {named:?}");
    (!unsaid.is_empty()).then(|| format!("{what} {named:?}: {unsaid:?}"))
}

#[test]
fn clean_rotary_records_raise_nothing() {
    let mut wrong = Vec::new();
    let mut seed = 0;
    for rate_hz in [500.0, 1000.0, 3000.0, 10_000.0] {
        for (bits, noise) in [
            (12, 0.0),
            (12, 0.03),
            (14, 0.005),
            (17, 0.03),
            (20, 0.01),
            (20, 0.0),
        ] {
            let axis = rotary(rate_hz, bits);
            for named in Named::ALL {
                seed += 1;
                let what = format!("{rate_hz} Hz, {bits} bit, noise {noise}");
                wrong.extend(sound(&axis, &what, named, noise, seed));
            }
        }
    }
    assert!(wrong.is_empty(), "{}\n{wrong:#?}", wrong.len());
}

#[test]
fn clean_linear_records_raise_nothing() {
    let mut wrong = Vec::new();
    for rate_hz in [500.0, 1000.0, 10_000.0] {
        for noise in [0.0, 0.03] {
            for named in Named::ALL {
                let what = format!("linear {rate_hz} Hz, noise {noise}");
                wrong.extend(sound(&linear(rate_hz), &what, named, noise, 7));
            }
        }
    }
    assert!(wrong.is_empty(), "{}\n{wrong:#?}", wrong.len());
}

#[test]
fn axis_files_that_are_off_and_other_loops_raise_nothing() {
    let mut wrong = Vec::new();
    for (i, off) in [0.9, 1.1].into_iter().enumerate() {
        for (rate_hz, bits) in [(1000.0, 14), (10_000.0, 17)] {
            for (stiff, effect) in [
                (0.4, None),
                (1.5, None),
                (
                    1.0,
                    Some((
                        "actuator.cogging",
                        vec![("amplitude_nm", 0.02), ("order_per_rev", 24.0)],
                    )),
                ),
                (1.0, Some(("mechanics.offset", vec![("torque_nm", 0.02)]))),
            ] {
                let mut truth = rotary(rate_hz, bits);
                truth.control.velocity_gain = Some(truth.axis.inertia * stiff * 100.0);
                truth.effects.extend(effect.iter().map(|(id, values)| {
                    EffectEntry {
                        id: (*id).to_string(),
                        parameters: values
                            .iter()
                            .map(|(name, value)| ((*name).to_string(), *value))
                            .collect(),
                    }
                }));
                let mut believed = rotary(rate_hz, bits);
                believed.axis.inertia *= off;
                for level in [
                    &mut believed.friction.coulomb,
                    &mut believed.friction.viscous,
                ] {
                    *level = level.map(|level| level / off);
                }
                for named in Named::ALL {
                    let log = record(&truth, named, 6.0, 0.02, 50 + i as u64);
                    let what = format!("{rate_hz} Hz, off {off}, loop {stiff}, {effect:?}");
                    wrong.extend(in_log(&log, &believed, &what, named));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}\n{wrong:#?}", wrong.len());
}

#[test]
fn steps_of_a_coarser_encoder_than_the_file_says_are_no_jumps() {
    let believed = rotary(10_000.0, 16);
    // Beyond the four counts that rounding is allowed.
    let count = bristle_gap::stretch::rad_per_count(&believed).unwrap();
    let step = 23.0 * count;
    let mut truth = believed.clone();
    truth.effects.push(EffectEntry {
        id: "sensor.quantization".to_string(),
        parameters: [("step_rad".to_string(), step)].into(),
    });
    for named in [Named::Sine, Named::Ladder] {
        let mut log = record(&truth, named, 6.0, 0.01, 77);
        // Its digits below are noise: the smallest step on record is a count.
        for q in log.position.values.iter_mut().step_by(97) {
            *q += count;
        }
        let jumps = inspect(&log, &believed).unwrap().jumps;
        assert!(jumps.is_empty(), "{named:?}: {} jumps", jumps.len());
    }
}
