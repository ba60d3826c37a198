//! Sound records raise no finding, whatever the experiment, rate, encoder and noise.

mod records;

use bristle_gap::AxisFile;
use bristle_gap::experiments::Named;
use bristle_gap::hygiene::{Code, inspect};
use records::{linear, record, rotary};

fn sound(axis: &AxisFile, what: &str, named: Named, noise: f64, seed: u64) -> Option<String> {
    let log = record(axis, named, 6.0, noise, seed);
    let hygiene = inspect(&log, axis).unwrap();
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
