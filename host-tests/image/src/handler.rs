//! What the whole handler costs: in the experiment of the thesis, and in the ticks that are not like its.

use crate::budget::Row;
use crate::clocks::Cause;
use crate::cost::Cost;
use crate::elf::Image;
use crate::host::{Session, TICK_CYCLES};
use crate::machine::Stop;
use crate::names;
use bristle_core::command::{Changes, Command, PART_POINTS, Reply, TablePart, parameter};
use bristle_core::experiment::{Bounds, Experiment};
use bristle_core::feed_forward::{POINTS, Span};
use bristle_core::parameters::BENCH;
use bristle_core::supervisor::Fault;

/// Estimated cycles that the handler may take.
const LIMIT: Option<u64> = Some(600);

/// Its row in the experiment of the thesis.
const HANDLER: &str = "whole handler";

/// The experiment of the thesis.
const SINE: Experiment<f32> = Experiment::Sine {
    amplitude_nm: 0.035,
    period_ticks: 10_000,
};

/// The others, such that the axis of the bench slides, sticks and reverses in each.
const OTHERS: [Experiment<f32>; 8] = [
    Experiment::PulseThenOscillation {
        pulse_nm: 0.04,
        pulse_ticks: 500,
        mean_nm: 0.01,
        amplitude_nm: 0.01,
        period_ticks: 1000,
    },
    Experiment::Reversals {
        amplitude_rad: 1.0,
        period_ticks: 10_000,
    },
    Experiment::SpeedLadder {
        top_rad_s: 5.0,
        ratio: 0.7,
        hold_ticks: 500,
    },
    Experiment::Prbs {
        amplitude_nm: 0.01,
        clock_ticks: 10,
    },
    Experiment::DahlRamp {
        amplitude_rad: 0.01,
        period_ticks: 10_000,
    },
    Experiment::RestAndBreakAway {
        peak_nm: 0.04,
        ramp_ticks: 1000,
        dwell_ticks: 300,
    },
    Experiment::Multisine {
        amplitude_nm: 0.04,
        period_ticks: 4096,
    },
    Experiment::Moves {
        length_rad: 2.0,
        move_ticks: 3000,
        pause_ticks: 100,
        pauses: 4,
    },
];

/// Ticks that a repetition is longer than the one before: no divisor of what repeats in the image or the experiment.
const SHIFT: u64 = 37;

type Run = fn(&mut Session<'_>) -> Result<(), String>;

/// Counts the handler of the firmware's image.
///
/// # Errors
/// An image that does not do what it is asked to.
pub fn rows(image: &Image) -> Result<Vec<Row>, String> {
    let lines = defmt_decoder::Table::parse(image.bytes())
        .map_err(|e| e.to_string())?
        .ok_or("the image does not log")?;
    let runs: [(&str, Run); 6] = [
        (HANDLER, sine),
        ("whole handler, orders and ends", orders),
        ("whole handler, faults", faults),
        ("whole handler, one sine after another", replays),
        ("whole handler, other experiments", others),
        ("whole handler, compensation and table", compensated),
    ];
    let mut after = Cost::default();
    let mut together = Vec::new();
    let mut rows = Vec::new();
    for (name, run) in runs {
        let mut session = Session::new(image, &lines)?;
        session.arm()?;
        run(&mut session).map_err(|e| format!("{name}: {e}"))?;
        let [handler, follower] = ["TIM7_DAC", "CORDIC"].map(names::interrupt);
        rows.push(Row {
            name: name.to_owned(),
            cost: session.machine.cost(handler),
            limit: LIMIT,
        });
        after.add(session.machine.cost(follower));
        together.push(Row {
            name: name.replace(HANDLER, "handler and follower"),
            cost: session.machine.cost_with_the_one_before(follower),
            // In the experiment of the thesis both together keep what the handler alone may take.
            limit: LIMIT.filter(|_| name == HANDLER),
        });
    }
    rows.push(Row {
        name: "follower, in all of these".to_owned(),
        cost: after,
        limit: LIMIT,
    });
    rows.extend(together);
    Ok(rows)
}

fn sine(session: &mut Session<'_>) -> Result<(), String> {
    play(session, SINE, u32::MAX)?;
    run(session, 20_000)
}

/// Stop, disarm and arm, time over, other parameters, at ever other places of the sine.
fn orders(session: &mut Session<'_>) -> Result<(), String> {
    for k in 0..20 {
        let ticks = 1000 + SHIFT * k;
        play(session, SINE, u32::MAX)?;
        run(session, ticks)?;
        ask(session, &Command::Stop)?;
        run(session, 1000)?;
        play(session, SINE, ticks as u32)?;
        run(session, ticks + 1000)?;
        play(session, SINE, u32::MAX)?;
        run(session, ticks)?;
        ask(session, &set(&[("l1_1_s", 1800.0 - k as f32)]))?;
        ask(session, &Command::Disarm)?;
        run(session, 500)?;
        ask(session, &Command::Arm)?;
    }
    Ok(())
}

/// Each fault that an axis or a host can bring about, several times, at ever other places of the sine.
fn faults(session: &mut Session<'_>) -> Result<(), String> {
    // The first while the sine still passes the index, which a runaway leaves behind.
    fault(session, SINE, Fault::IndexMismatch, 10_000)?;
    for k in 0..8 {
        // Every other time within a loop.
        let experiment = if k % 2 == 0 { SINE } else { OTHERS[1] };
        for one in [
            Fault::EncoderIllegal,
            Fault::DriveFault,
            Fault::DeadlineMissed,
            Fault::LimitTooLong,
            Fault::CommandTimeout,
            Fault::WatchdogReset,
            Fault::StuckEncoder,
            Fault::Overspeed,
        ] {
            fault(session, experiment, one, 1500 + 3 * SHIFT * k)?;
        }
    }
    Ok(())
}

/// Brings a fault about after so many ticks of an experiment, and mends it.
fn fault(
    session: &mut Session<'_>,
    experiment: Experiment<f32>,
    fault: Fault,
    ticks: u64,
) -> Result<(), String> {
    play(session, experiment, u32::MAX)?;
    run(session, ticks)?;
    bring_about(session, fault)?;
    let stands = session.heard.records.last().map(|r| r.status.fault());
    if stands != Some(Some(fault)) {
        return Err(format!("{fault:?} does not come: {stands:?}"));
    }
    run(session, 3000)?;
    ask(session, &Command::ClearFault)?;
    ask(session, &Command::Arm)
}

fn bring_about(session: &mut Session<'_>, fault: Fault) -> Result<(), String> {
    let calm = session.knobs.borrow().clone();
    match fault {
        // The observers refuse what would make it.
        Fault::None | Fault::NotFinite => {}
        Fault::EncoderIllegal => session.knobs.borrow_mut().illegal_transition = true,
        Fault::IndexMismatch => {
            session.knobs.borrow_mut().lost_counts += 20;
            run(session, 10_000)?;
        }
        Fault::Overspeed => session.knobs.borrow_mut().runs_away_nm = Some(2.0),
        Fault::LimitTooLong => {
            ask(session, &set(&[("slew_limit_nm_s", 0.1)]))?;
            run(session, 12_000)?;
            ask(session, &set(&[("slew_limit_nm_s", BENCH.slew_limit_nm_s)]))?;
        }
        Fault::DeadlineMissed => {
            let next = session.machine.bus().next_tick().ok_or("no tick")?;
            session
                .machine
                .bus()
                .hold_tick_until(next + TICK_CYCLES / 4);
        }
        Fault::DriveFault => session.knobs.borrow_mut().healthy = false,
        Fault::CommandTimeout => {
            session.stalled = true;
            run(session, 11_000)?;
            session.stalled = false;
            // What was lost meanwhile is made up for, and the trace reaches the present.
            run(session, 1000)?;
        }
        Fault::WatchdogReset => {
            let end = session.machine.cycles() + 205 * TICK_CYCLES;
            session.machine.bus().hold_tick_until(end);
            if session.run(1000) != Err(Stop::Reset(Cause::Watchdog)) {
                return Err("no reset".to_owned());
            }
            run(session, 5000)?;
        }
        Fault::StuckEncoder => {
            session.knobs.borrow_mut().stuck = true;
            run(session, 15_000)?;
        }
    }
    run(session, 400)?;
    let mut knobs = session.knobs.borrow_mut();
    (knobs.healthy, knobs.stuck) = (calm.healthy, calm.stuck);
    knobs.runs_away_nm = calm.runs_away_nm;
    Ok(())
}

/// A sine begins while another one plays.
fn replays(session: &mut Session<'_>) -> Result<(), String> {
    for k in 0..20 {
        play(session, SINE, u32::MAX)?;
        run(session, 1000 + SHIFT * k)?;
    }
    Ok(())
}

fn others(session: &mut Session<'_>) -> Result<(), String> {
    for experiment in OTHERS {
        play(session, experiment, 15_000)?;
        run(session, 17_000)?;
    }
    Ok(())
}

/// The other experiments with friction compensation and a feed-forward table.
fn compensated(session: &mut Session<'_>) -> Result<(), String> {
    let shares = [("friction_forward", 0.5), ("friction_feedback", 0.5)];
    ask(session, &set(&shares))?;
    for backward in [false, true] {
        for first in (0..POINTS).step_by(PART_POINTS) {
            let part = TablePart {
                backward,
                first: first as u16,
                torques_nm: std::array::from_fn(|i| if i % 2 == 0 { 1e-3 } else { -1e-3 }),
            };
            ask(session, &Command::TablePut(part))?;
        }
    }
    ask(
        session,
        &Command::TableUse(Span::Period(std::f32::consts::TAU), 0.1),
    )?;
    others(session)
}

fn play(session: &mut Session<'_>, experiment: Experiment<f32>, ticks: u32) -> Result<(), String> {
    ask(session, &Command::Play(experiment, Bounds::open(ticks)))
}

fn set(values: &[(&str, f32)]) -> Command {
    let mut changes = Changes::default();
    for &(name, value) in values {
        changes.add(parameter(name).expect("a parameter"), value);
    }
    Command::Set(changes)
}

fn ask(session: &mut Session<'_>, command: &Command) -> Result<(), String> {
    match session.ask(command)? {
        Reply::Accepted { .. } => Ok(()),
        reply => Err(format!("{command:?}: {reply:?}")),
    }
}

fn run(session: &mut Session<'_>, ticks: u64) -> Result<(), String> {
    session.run(ticks).map_err(|e| format!("{e:?}"))
}
