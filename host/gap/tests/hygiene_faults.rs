//! Each fault, planted into sound records, is found and named.

mod records;

use bristle_gap::experiments::Named;
use bristle_gap::hygiene::{Code, Hygiene, Severity, inspect};
use bristle_gap::log::{EffortKind, PositionKind};
use bristle_gap::{AxisFile, Log};
use records::{linear, record, rotary};

/// Records in which every fault of effort and motion shows: inertia, both directions, speeds beyond the friction curve.
fn cases() -> Vec<(AxisFile, Log)> {
    let mut out = Vec::new();
    for (i, axis) in [
        rotary(1000.0, 17),
        rotary(10_000.0, 14),
        rotary(3000.0, 20),
        linear(1000.0),
    ]
    .into_iter()
    .enumerate()
    {
        for named in [Named::Sine, Named::Reversals, Named::BreakAway] {
            let log = record(&axis, named, 6.0, 0.02, 30 + i as u64);
            out.push((axis.clone(), log));
        }
    }
    out
}

fn finds(axis: &AxisFile, log: &Log, code: Code, severity: Severity) -> Hygiene {
    let hygiene = inspect(log, axis).unwrap();
    let texts: Vec<_> = hygiene.findings.iter().map(ToString::to_string).collect();
    assert!(
        hygiene
            .findings
            .iter()
            .any(|finding| finding.code == code && finding.severity == severity),
        "{code:?} not in {texts:?}, {:?} {:?}",
        hygiene.balance,
        hygiene.skew
    );
    assert_eq!(hygiene.findings.len(), 1, "{texts:?}");
    assert!(!texts[0].contains('\n'));
    hygiene
}

/// Samples of a code that are left out.
fn excluded(hygiene: &Hygiene, code: Code) -> Vec<std::ops::Range<usize>> {
    hygiene
        .excluded
        .iter()
        .filter(|excluded| excluded.code == code)
        .map(|excluded| excluded.samples.clone())
        .collect()
}

#[test]
fn wrong_sign_of_effort_or_encoder() {
    for (axis, log) in cases() {
        let mut effort = log.clone();
        for column in &mut effort.efforts {
            column.values.iter_mut().for_each(|u| *u = -*u);
        }
        finds(&axis, &effort, Code::WrongSign, Severity::Fatal);
        let mut encoder = log;
        encoder.position.values.iter_mut().for_each(|q| *q = -*q);
        let hygiene = finds(&axis, &encoder, Code::WrongSign, Severity::Fatal);
        if encoder.position_ref.is_some() {
            assert!(hygiene.findings[0].text.contains("encoder's"));
        }
    }
}

#[test]
fn wrong_counts_by_a_factor_in_counts() {
    for (axis, log) in cases() {
        for factor in [2.0, 4.0, 10.0, 0.5, 0.25] {
            // The log counts; the file has the wrong number of counts a turn.
            let count = bristle_gap::stretch::rad_per_count(&axis).unwrap();
            let mut counted = log.clone();
            counted.position.kind = PositionKind::Counts;
            counted
                .position
                .values
                .iter_mut()
                .for_each(|q| *q = (*q / count).round());
            // The position reference tells nothing here: it is in the drive's unit.
            let mut wrong = axis.clone();
            wrong.axis.counts_per_turn = axis.axis.counts_per_turn.map(|counts| counts / factor);
            let hygiene = inspect(&counted, &wrong).unwrap();
            let finding = hygiene
                .findings
                .iter()
                .find(|finding| finding.code == Code::WrongScale)
                .unwrap_or_else(|| panic!("{factor} {hygiene:?}"));
            let shown = if factor < 1.0 {
                format!("times 1/{}", 1.0 / factor)
            } else {
                format!("times {factor}")
            };
            assert!(finding.text.contains(&shown), "{factor}: {finding}");
            assert_eq!(hygiene.findings.len(), 1, "{hygiene:?}");
        }
    }
}

#[test]
fn wrong_counts_by_the_grid_of_positions() {
    let axis = rotary(1000.0, 14);
    let log = record(&axis, Named::Reversals, 6.0, 0.01, 5);
    for factor in [2.0, 4.0, 0.25] {
        let mut wrong = axis.clone();
        wrong.axis.counts_per_turn = axis.axis.counts_per_turn.map(|counts| counts * factor);
        let hygiene = finds(&wrong, &log, Code::WrongScale, Severity::Warning);
        assert!(hygiene.findings[0].text.contains("should be 16384"));
    }
}

#[test]
fn an_inertia_that_is_off_is_no_wrong_scale() {
    for (mut axis, log) in cases() {
        for off in [0.9, 1.1, 1.4] {
            let right = axis.axis.inertia;
            axis.axis.inertia *= off;
            let hygiene = inspect(&log, &axis).unwrap();
            assert!(hygiene.findings.is_empty(), "{off}: {hygiene:?}");
            axis.axis.inertia = right;
        }
    }
}

#[test]
fn gaps_and_jitter() {
    let axis = rotary(1000.0, 17);
    let mut log = record(&axis, Named::Sine, 4.0, 0.01, 1);
    let sound = log.clone();
    log.time_s[1500..].iter_mut().for_each(|t| *t += 0.25);
    let hygiene = finds(&axis, &log, Code::Gap, Severity::Excluded);
    assert_eq!(excluded(&hygiene, Code::Gap), vec![1499..1500]);
    assert!(hygiene.findings[0].text.contains("0.250000 s missing"));

    let mut log = sound;
    for (k, t) in log.time_s.iter_mut().enumerate() {
        // 0.1 of the step, a pseudo-random sign.
        *t += 1e-4 * if (k * k) % 7 < 3 { 1.0 } else { -1.0 };
    }
    finds(&axis, &log, Code::Jitter, Severity::Warning);
}

#[test]
fn saturation_at_the_limit_of_the_drive() {
    for rate_hz in [3000.0, 10_000.0] {
        let mut axis = rotary(rate_hz, 17);
        // A speed loop that asks for more than the drive gives.
        axis.drive.torque_limit = Some(0.2);
        let log = record(&axis, Named::Ladder, 4.0, 0.01, 1);
        let u = &log.effort(EffortKind::TorqueMeasured).unwrap().values;
        let at_limit: Vec<usize> = (0..u.len()).filter(|&k| u[k].abs() >= 0.1999).collect();
        let hygiene = finds(&axis, &log, Code::Saturated, Severity::Excluded);
        let usable = hygiene.usable(log.len());
        // Isolated samples at the limit are no plateau; all but a few lie in the stretches.
        let left = at_limit.iter().filter(|&&k| usable[k]).count();
        assert!(
            at_limit.len() > 20 && left * 10 < at_limit.len(),
            "{left} of {}",
            at_limit.len()
        );
        assert!(usable.iter().filter(|usable| **usable).count() * 2 > log.len());
    }
}

#[test]
fn saturation_where_the_limit_is_not_known() {
    for rate_hz in [1000.0, 10_000.0] {
        let axis = rotary(rate_hz, 17);
        let sound = record(&axis, Named::Sine, 4.0, 0.0, 1);
        let clip = |log: &mut Log| {
            log.efforts[0]
                .values
                .iter_mut()
                .for_each(|u| *u = u.clamp(-0.11, 0.11));
        };
        let mut with_reference = sound.clone();
        clip(&mut with_reference);
        finds(&axis, &with_reference, Code::Saturated, Severity::Excluded);
        let mut alone = sound.clone();
        clip(&mut alone);
        alone.efforts.truncate(1);
        finds(&axis, &alone, Code::Saturated, Severity::Excluded);
        // A command that is flat at its peak is a wish, not a limit.
        let mut wish = sound;
        clip(&mut wish);
        wish.efforts[1].values = wish.efforts[0].values.clone();
        assert!(inspect(&wish, &axis).unwrap().findings.is_empty());
    }
}

#[test]
fn stuck_encoder() {
    for (axis, log) in cases() {
        // Frozen for a tenth of a second while fast, then back where it should be; from there on, wherever it froze.
        let rate = 1.0 / log.median_step_s();
        let (n, from) = ((0.1 * rate) as usize, fastest(&log));
        let mut back = log.clone();
        let held = back.position.values[from];
        back.position.values[from..from + n].fill(held);
        let hygiene = finds(&axis, &back, Code::StuckEncoder, Severity::Excluded);
        covers(&hygiene, Code::StuckEncoder, from + 1..from + n - 1);

        // Counts that are lost without a trace of force: only an encoder this fine shows that no axis stops so.
        let count = bristle_gap::stretch::rad_per_count(&axis).unwrap();
        if count > 1e-5 {
            continue;
        }
        let mut offset = log.clone();
        let lost = offset.position.values[from + n] - held;
        offset.position.values[from..from + n].fill(held);
        offset.position.values[from + n..]
            .iter_mut()
            .for_each(|q| *q -= lost);
        let hygiene = finds(&axis, &offset, Code::StuckEncoder, Severity::Excluded);
        covers(&hygiene, Code::StuckEncoder, from + 1..from + n - 1);
    }
}

#[test]
fn encoder_that_died_under_effort() {
    for (axis, log) in cases() {
        let mut dead = log.clone();
        let half = log.len() / 2;
        let held = dead.position.values[half];
        dead.position.values[half..].fill(held);
        let coulomb = axis.friction.coulomb.unwrap();
        // The controller winds up.
        for (k, u) in dead.efforts[0].values[half..].iter_mut().enumerate() {
            *u = coulomb * (1.0 + 5.0 * k as f64 / half as f64);
        }
        let hygiene = finds(&axis, &dead, Code::StuckEncoder, Severity::Excluded);
        covers(&hygiene, Code::StuckEncoder, half + 1..log.len());
    }
}

/// Start of the fastest tenth of a second that leaves some room at the ends.
fn fastest(log: &Log) -> usize {
    let n = (0.1 / log.median_step_s()) as usize;
    let q = &log.position.values;
    (n * 5..q.len() - n * 5)
        .max_by(|&a, &b| (q[a + n] - q[a]).abs().total_cmp(&(q[b + n] - q[b]).abs()))
        .unwrap()
}

fn covers(hygiene: &Hygiene, code: Code, range: std::ops::Range<usize>) {
    let out = excluded(hygiene, code);
    assert!(
        out.iter()
            .any(|out| out.start <= range.start && range.end <= out.end),
        "{out:?} {range:?}"
    );
    let all: usize = out.iter().map(|out| out.len()).sum();
    // Twice what is wrong, and some samples for each end.
    assert!(all <= 2 * range.len() + 10, "{out:?} {range:?}");
}

#[test]
fn outliers_and_jumps() {
    for (axis, log) in cases() {
        // A tenth of what the axis moves in all, for one sample.
        let size = 0.1
            * (log
                .position
                .values
                .iter()
                .fold(0.0_f64, |m, q| m.max(q.abs())));
        for at in [700, log.len() / 2] {
            let mut outlier = log.clone();
            outlier.position.values[at] += size;
            let hygiene = finds(&axis, &outlier, Code::PositionOutlier, Severity::Excluded);
            covers(&hygiene, Code::PositionOutlier, at..at + 1);

            let mut jump = log.clone();
            jump.position.values[at..]
                .iter_mut()
                .for_each(|q| *q += size);
            let hygiene = finds(&axis, &jump, Code::PositionJump, Severity::Excluded);
            covers(&hygiene, Code::PositionJump, at..at + 1);
        }
    }
}

#[test]
fn effort_that_is_not_there() {
    let axis = rotary(1000.0, 17);
    let mut log = record(&axis, Named::Sine, 4.0, 0.01, 1);
    log.efforts[1].values.fill(0.0);
    finds(&axis, &log, Code::ZeroEffort, Severity::Warning);
    log.efforts.remove(1);
    log.efforts[0].values.fill(0.0);
    finds(&axis, &log, Code::ZeroEffort, Severity::Fatal);
}

#[test]
fn too_short_or_never_moved() {
    let axis = rotary(1000.0, 17);
    let mut log = record(&axis, Named::Sine, 0.09, 0.01, 1);
    finds(&axis, &log, Code::TooShort, Severity::Fatal);
    log = record(&axis, Named::Sine, 4.0, 0.01, 1);
    log.position.values.fill(0.1);
    finds(&axis, &log, Code::NeverMoved, Severity::Fatal);
}

#[test]
fn velocity_column_of_another_unit_sign_or_place() {
    for (axis, log) in cases() {
        let step_s = log.median_step_s();
        let velocity = bristle_gap::signal::derivative(&log.position.values, step_s);
        let with = |values: Vec<f64>| {
            let mut log = log.clone();
            log.velocity = Some(values);
            log
        };
        assert!(
            inspect(&with(velocity.clone()), &axis)
                .unwrap()
                .findings
                .is_empty()
        );
        for factor in [-1.0, 9.549, 0.159] {
            let scaled = velocity.iter().map(|v| factor * v).collect();
            let hygiene = finds(
                &axis,
                &with(scaled),
                Code::VelocityMismatch,
                Severity::Warning,
            );
            let mut words = hygiene.findings[0].text.split_whitespace();
            let said: f64 = words.find_map(|word| word.parse().ok()).unwrap();
            // Central differences summed by trapezoids: they differ by some 1e-5, and four decimals are said.
            assert!((said / factor - 1.0).abs() < 1e-3, "{said} {factor}");
        }
        let other = log.efforts[0].values.iter().rev().copied().collect();
        finds(
            &axis,
            &with(other),
            Code::VelocityMismatch,
            Severity::Warning,
        );
    }
}

#[test]
fn effort_late_or_early() {
    for (axis, shift) in [
        (rotary(1000.0, 17), 4_isize),
        (rotary(1000.0, 17), -4),
        (rotary(10_000.0, 20), 6),
        (rotary(10_000.0, 20), -30),
    ] {
        // The ramps end in steps of torque, which the acceleration follows at once.
        let mut log = record(&axis, Named::BreakAway, 12.0, 0.01, 3);
        log.efforts.truncate(1);
        let u = log.efforts[0].values.clone();
        for k in 0..u.len() {
            let from = (k as isize - shift).clamp(0, u.len() as isize - 1);
            log.efforts[0].values[k] = u[from as usize];
        }
        let hygiene = finds(&axis, &log, Code::TimingSkew, Severity::Warning);
        let samples = hygiene.skew.unwrap().samples;
        // Half a sample: what a fit of whole samples could not tell apart either.
        assert!(
            (samples - shift as f64).abs() < 0.5,
            "{samples} for {shift}"
        );
    }
}
