//! Friction compensation and a feed-forward table in the image: equal to the host bit for bit, what they gain, and that the
//! axis swings with no wrong parameter.

mod common;
#[path = "common/reference.rs"]
mod reference;

use bristle_core::command::{Changes, Command, PART_POINTS, Reply, TablePart, parameter};
use bristle_core::experiment::{Bounds, Experiment, Player, Reference};
use bristle_core::feed_forward::{FeedForward, POINTS, Span};
use bristle_core::parameters::{BENCH, Parameters};
use bristle_core::trace::{FLAG_EXPERIMENT, Record};
use bristle_image::host::Session;
use std::f32::consts::TAU;

const REVERSALS: Experiment<f32> = Experiment::Reversals {
    amplitude_rad: 1.0,
    period_ticks: 20_000,
};
/// One and a quarter periods.
const TICKS: u32 = 25_000;

fn accepted(session: &mut Session<'_>, command: &Command) {
    let reply = session.ask(command).unwrap();
    assert!(
        matches!(reply, Reply::Accepted { .. }),
        "{command:?}: {reply:?}"
    );
}

/// With these shares compensated, while all friction is believed to be so many times what it is.
fn believing(share: f32, [friction_forward, friction_feedback]: [f32; 2]) -> Parameters {
    Parameters {
        coulomb_nm: share * BENCH.coulomb_nm,
        stiction_nm: share * BENCH.stiction_nm,
        stribeck_velocity_rad_s: share * BENCH.stribeck_velocity_rad_s,
        stiffness_nm_rad: share * BENCH.stiffness_nm_rad,
        damping_nm_s_rad: share * BENCH.damping_nm_s_rad,
        viscous_nm_s_rad: share * BENCH.viscous_nm_s_rad,
        friction_forward,
        friction_feedback,
        ..BENCH
    }
}

fn set(session: &mut Session<'_>, parameters: &Parameters) {
    let mut changes = Changes::default();
    for name in [
        "coulomb_nm",
        "stiction_nm",
        "stribeck_velocity_rad_s",
        "stiffness_nm_rad",
        "damping_nm_s_rad",
        "viscous_nm_s_rad",
        "friction_forward",
        "friction_feedback",
    ] {
        let number = parameter(name).unwrap();
        changes.add(number, parameters.get(number).unwrap());
    }
    accepted(session, &Command::Set(changes));
}

/// Plays, and gives the samples of the experiment.
fn play(session: &mut Session<'_>, experiment: Experiment<f32>, ticks: u32) -> Vec<Record> {
    let from = session.heard.records.len();
    accepted(session, &Command::Play(experiment, Bounds::open(ticks)));
    session.run(u64::from(ticks) + 1500).unwrap();
    let plays = |r: &&Record| r.status.flags() & FLAG_EXPERIMENT != 0;
    let records: Vec<Record> = session.heard.records[from..]
        .iter()
        .filter(plays)
        .copied()
        .collect();
    assert_eq!(records.len(), ticks as usize);
    records
}

/// Rms tracking error from a quarter of a period on, rad, and changes of direction by three counts and more.
fn follow(session: &mut Session<'_>) -> (f64, u32) {
    let records = play(session, REVERSALS, TICKS);
    let mut player = Player::new(REVERSALS, 1e-4);
    let first = records[0].counts;
    let (mut squares, mut ticks) = (0.0, 0.0);
    let (mut turn, mut forward, mut turns) = (0, true, 0);
    for (k, record) in records.iter().enumerate() {
        let counts = record.counts.wrapping_sub(first);
        let Reference::Position { position_rad, .. } = player.next_tick() else {
            panic!("a position sine")
        };
        if k >= 5000 {
            let error_rad = counts as f32 * BENCH.rad_per_count() - position_rad;
            squares += f64::from(error_rad).powi(2);
            ticks += 1.0;
        }
        turn = if forward {
            turn.max(counts)
        } else {
            turn.min(counts)
        };
        if (counts - turn).abs() >= 3 {
            (turn, forward) = (counts, !forward);
            turns += 1;
        }
    }
    ((squares / ticks).sqrt(), turns)
}

#[test]
fn compensation_takes_two_thirds_of_the_error_and_swings_with_no_wrong_parameter() {
    let Some(image) = common::firmware() else {
        return;
    };
    let table = common::table(&image);
    let mut session = Session::new(&image, &table).unwrap();
    session.arm().unwrap();
    for share in [1.0, 1.3, 0.7] {
        let [without, with] = [[0.0, 0.0], [0.5, 0.5]].map(|shares| {
            set(&mut session, &believing(share, shares));
            let (error_rad, turns) = follow(&mut session);
            // One and a quarter periods of a sine.
            assert_eq!(turns, 2, "{share} {shares:?}");
            error_rad
        });
        println!("{share} of the friction believed: {with:.6} of {without:.6} rad rms");
        // Believed wrongly, it must still gain.
        let most = if share == 1.0 { 1.0 / 3.0 } else { 1.0 };
        assert!(with < most * without, "{share}: {with} {without}");
    }
    assert_eq!(session.faulted(0), None);
}

#[test]
fn compensation_and_table_equal_the_host() {
    let Some(image) = common::firmware() else {
        return;
    };
    let lines = common::table(&image);
    let mut session = Session::new(&image, &lines).unwrap();
    let parameters = believing(1.0, [0.4, 0.6]);
    let wave = |n: f32, nm: f32| -> [f32; POINTS] {
        std::array::from_fn(|i| nm * (TAU * n * i as f32 / POINTS as f32).sin())
    };
    let directions = [wave(24.0, 2e-3), wave(6.0, -1e-3)];
    session.arm().unwrap();
    set(&mut session, &parameters);
    for (backward, torques) in [(false, &directions[0]), (true, &directions[1])] {
        for first in (0..POINTS).step_by(PART_POINTS) {
            let part = TablePart {
                backward,
                first: first as u16,
                torques_nm: std::array::from_fn(|i| torques[first + i]),
            };
            accepted(&mut session, &Command::TablePut(part));
        }
    }
    let span = Span::Period(TAU);
    // What cannot be laid out is refused, and no table is used because of it.
    let reply = session.ask(&Command::TableUse(span, 0.0)).unwrap();
    assert_eq!(reply, Reply::Inconsistent);
    accepted(&mut session, &Command::TableUse(span, 0.1));
    let experiments = [
        REVERSALS,
        Experiment::SpeedLadder {
            top_rad_s: 5.0,
            ratio: 0.5,
            hold_ticks: 1000,
        },
        reference::SINE,
    ];
    let mut plays = Vec::new();
    for experiment in experiments {
        play(&mut session, experiment, 6000);
        plays.push((experiment, Bounds::open(6000)));
    }
    let [forward, backward] = directions;
    let table = FeedForward::new(span, forward, backward, 0.1, 0.0).unwrap();
    let records = &session.heard.records;
    let counts = &session.knobs.borrow().counts[..records.len()];
    let host = reference::on_the_host(&parameters, Some(&table), records, counts, &plays);
    for (image, host) in records.iter().zip(&host) {
        assert_eq!(
            reference::bits(image),
            reference::bits(host),
            "tick {}",
            image.tick
        );
    }
    // Neither is without effect.
    let plain = reference::on_the_host(&BENCH, None, records, counts, &plays);
    let differ = |other: &[Record]| {
        records
            .iter()
            .zip(other)
            .filter(|(a, b)| reference::bits(a) != reference::bits(b))
            .count()
    };
    let no_table = reference::on_the_host(&parameters, None, records, counts, &plays);
    assert!(differ(&plain) > 6000 && differ(&no_table) > 6000);
    println!("{} ticks equal to the host's bit for bit", host.len());
}
