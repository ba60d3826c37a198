//! Virtual axes by chance raise no alarm: other loops, drives, encoders and experiments than hygiene was written on, with
//! axis files whose parameters are off by up to a tenth.

use bristle_gap::Log;
use bristle_gap::hygiene::{Code, Finding, Severity, inspect};
use bristle_gap::trial::{Wanted, draw};
use bristle_plant::effect::ALL;
use rayon::prelude::*;

/// Findings of a trial's logs; none where no axis shows the effects.
fn findings(seed: u64, effects: &[&'static str]) -> Option<Vec<(String, Finding)>> {
    let wanted = Wanted {
        effects: effects.to_vec(),
        share: 4.0,
        parameter_error: 0.1,
    };
    let trial = draw(seed, &wanted).unwrap()?;
    let of = |log: &Log| {
        let file = log.file.display().to_string();
        let found = inspect(log, &trial.axis).unwrap().findings;
        found
            .into_iter()
            .map(move |finding| (file.clone(), finding))
    };
    Some(trial.logs.iter().flat_map(of).collect())
}

#[test]
fn clean_axes_raise_nothing() {
    let found: Vec<_> = (5000..5030_u64)
        .into_par_iter()
        .filter_map(|seed| findings(seed, &[]))
        .collect();
    assert_eq!(found.len(), 30);
    let wrong: Vec<_> = found
        .iter()
        .filter(|findings| !findings.is_empty())
        .collect();
    println!("false alarms {}/30, limit 0", wrong.len());
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// What an effect truly does to a log, and the finding that names it.
const TRUE: [(&str, Code); 5] = [
    ("sensor.delay", Code::TimingSkew),
    // Effort that acts late and effort that was recorded early are the same log; so is one that lags by a time constant,
    // where nothing is faster than that.
    ("actuator.delay", Code::TimingSkew),
    ("actuator.lag", Code::TimingSkew),
    ("sensor.lost_counts", Code::PositionJump),
    ("mechanics.end_stop", Code::StuckEncoder),
];

#[test]
fn effects_are_no_fault_of_the_log() {
    let found: Vec<_> = ALL
        .par_iter()
        .enumerate()
        .filter_map(|(i, entry)| Some((entry.id, findings(5200 + i as u64, &[entry.id])?)))
        .collect();
    let (mut true_ones, mut wrong) = (0, Vec::new());
    for (id, findings) in &found {
        for (file, finding) in findings {
            if TRUE.contains(&(*id, finding.code)) {
                assert!(finding.severity < Severity::Fatal, "{id} {file}: {finding}");
                true_ones += 1;
            } else if finding.severity > Severity::Note {
                wrong.push(format!("{id} {file}: {finding}"));
            }
        }
    }
    println!(
        "{} effects, {true_ones} findings that name the effect, false alarms {}, limit 0",
        found.len(),
        wrong.len()
    );
    assert!(found.len() >= 20, "{}", found.len());
    assert!(wrong.is_empty(), "{wrong:#?}");
}
