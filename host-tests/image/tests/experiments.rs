//! Every experiment on the image, with its bounds, as `bristle run` orders it: equal to the host bit for bit.

mod common;
#[path = "common/reference.rs"]
mod reference;

use bristle_core::command::{Command, Reply};
use bristle_core::experiment::bounds::Refusal;
use bristle_core::experiment::fields::in_single_precision;
use bristle_core::experiment::{Bounds, End, Experiment};
use bristle_core::parameters::BENCH;
use bristle_core::trace::Record;
use bristle_gap::experiments::Named;
use bristle_gap::plan::Step;
use bristle_gap::{AxisFile, Believed};
use bristle_image::host::Session;
use reference::{SINE, bits, on_the_host};
use std::path::Path;

/// Ticks for which each plays: a whole move with its pause, and a pulse with its rest.
const TICKS: u32 = 6000;

fn bench() -> Believed {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../axes/bench.toml");
    Believed::new(&AxisFile::read(&path).unwrap(), &path).unwrap()
}

/// Plays one to its end, and on until the torque is gone.
fn play(session: &mut Session<'_>, experiment: Experiment<f32>, bounds: Bounds<f32>) -> End {
    let from = session.heard.records.len();
    let reply = session.ask(&Command::Play(experiment, bounds)).unwrap();
    assert!(matches!(reply, Reply::Accepted { .. }), "{reply:?}");
    session.run(u64::from(bounds.ticks) + 1500).unwrap();
    let ended = |r: &Record| r.status.ended();
    let records = &session.heard.records[from..];
    let end = ended(records.last().unwrap()).unwrap();
    assert_ne!(end, End::None);
    end
}

#[test]
fn every_experiment_plays_for_its_time_and_equals_the_host() {
    let Some(image) = common::firmware() else {
        return;
    };
    let table = common::table(&image);
    let mut session = Session::new(&image, &table).unwrap();
    session.arm().unwrap();
    let axis = bench();
    let mut plays = Vec::new();
    let tick = bristle_image::names::interrupt("TIM7_DAC");
    for named in Named::ALL {
        let step = Step::new(named, &axis);
        let experiment = in_single_precision(&step.experiment);
        plays.push((experiment, Bounds::open(TICKS)));
        session.machine.clear_costs();
        assert_eq!(
            play(&mut session, experiment, Bounds::open(TICKS)),
            End::Finished
        );
        let cost = session.machine.cost(tick);
        println!(
            "{:<10} the handler takes at most {} instructions, some {} cycles",
            named.name(),
            cost.most_instructions,
            cost.most_cycles
        );
        // A tenth of the 17,000 cycles of a tick.
        assert!(cost.most_cycles < 1700, "{named:?}: {cost:?}");
    }
    // Bounds that end it: 0.05 rad, 1 rad/s, and less torque than the loop of a move asks for.
    for (experiment, bounds, expected) in [
        (
            SINE,
            Bounds {
                travel_rad: 0.05,
                ..Bounds::open(TICKS)
            },
            End::Travel,
        ),
        (
            SINE,
            Bounds {
                speed_rad_s: 1.0,
                ..Bounds::open(TICKS)
            },
            End::Speed,
        ),
        (
            in_single_precision(&Step::new(Named::Moves, &axis).experiment),
            Bounds {
                torque_nm: 0.02,
                ..Bounds::open(TICKS)
            },
            End::Torque,
        ),
    ] {
        plays.push((experiment, bounds));
        assert_eq!(play(&mut session, experiment, bounds), expected);
    }

    let heard = &session.heard;
    assert_eq!((heard.continuity.lost, session.faulted(0)), (0, None));
    let counts = &session.knobs.borrow().counts[..heard.records.len()];
    let host = on_the_host(&BENCH, None, &heard.records, counts, &plays);
    for (image, host) in heard.records.iter().zip(&host) {
        assert_eq!(bits(image), bits(host), "tick {}", image.tick);
        let status = |r: &Record| (r.status.state(), r.status.ended(), r.status.flags());
        assert_eq!(status(image), status(host), "tick {}", image.tick);
    }
    println!("{} ticks equal to the host's bit for bit", host.len());
}

#[test]
fn what_asks_for_too_much_is_refused_by_the_image() {
    let Some(image) = common::firmware() else {
        return;
    };
    let table = common::table(&image);
    let mut session = Session::new(&image, &table).unwrap();
    session.arm().unwrap();
    let far = Experiment::Moves {
        length_rad: 2.0,
        move_ticks: 5000,
        pause_ticks: 100,
        pauses: 1,
    };
    let near = Bounds {
        travel_rad: 1.0,
        ..Bounds::open(TICKS)
    };
    let strong = Experiment::Sine {
        amplitude_nm: 0.2,
        period_ticks: 1000,
    };
    for (experiment, bounds, refusal) in [
        (far, near, Refusal::Travel),
        (strong, Bounds::open(u32::MAX), Refusal::Torque),
        (SINE, Bounds::open(0), Refusal::Range),
    ] {
        let reply = session.ask(&Command::Play(experiment, bounds)).unwrap();
        assert_eq!(reply, Reply::Refused(refusal));
    }
    session.run(1000).unwrap();
    let torque = |r: &Record| r.torque_ref_nm == 0.0;
    assert!(session.heard.records.iter().all(torque));
}
