use super::*;
use crate::experiment::Experiment;
use crate::parameters::{BENCH, Parameters};
use std::vec::Vec;

const TICK_S: f32 = 1e-4;

fn well(raw: u32) -> Input {
    Input {
        raw,
        ..Input::default()
    }
}

/// A tick that follows an order.
fn ordered(controller: &mut Controller, config: &Config, raw: u32, order: Order) -> Output {
    controller.obey(config, &order);
    controller.step(config, &well(raw))
}

fn play(experiment: Experiment<f32>, bounds: Bounds<f32>) -> Order {
    BENCH.build(TICK_S, 1).unwrap().play(experiment, &bounds)
}

fn sine(amplitude_nm: f32) -> Order {
    let experiment = Experiment::Sine {
        amplitude_nm,
        period_ticks: 10_000,
    };
    play(experiment, Bounds::open(u32::MAX))
}

/// Armed at tick 200 with the axis at rest.
fn armed(config: &Config) -> Controller {
    let mut controller = Controller::new(config, 7, false);
    for _ in 0..200 {
        controller.step(config, &well(7));
    }
    ordered(&mut controller, config, 7, Order::Request(Request::Arm));
    controller
}

#[test]
fn plays_the_experiment_from_its_beginning_once_armed() {
    let config = BENCH.build(TICK_S, 1).unwrap();
    let mut controller = Controller::new(&config, 7, false);
    for _ in 0..200 {
        let output = ordered(&mut controller, &config, 7, sine(0.01));
        assert_eq!((output.torque_nm, output.drive_enabled), (0.0, false));
    }
    let mut controller = armed(&config);
    let mut player = Player::new(
        Experiment::Sine {
            amplitude_nm: 0.01,
            period_ticks: 10_000,
        },
        TICK_S,
    );
    for k in 0..3000 {
        if k == 0 {
            controller.obey(&config, &sine(0.01));
        }
        let output = controller.step(&config, &well(7));
        let crate::experiment::Reference::Torque(expected) = player.next_tick() else {
            panic!("a sine is a torque")
        };
        assert_eq!(output.torque_nm, expected);
        assert_eq!(output.record.tick, 201 + k);
        assert_eq!(output.record.status.limit(), Some(Limit::None));
    }
}

#[test]
fn a_stopped_experiment_does_not_resume() {
    let config = BENCH.build(TICK_S, 1).unwrap();
    let mut controller = armed(&config);
    ordered(&mut controller, &config, 7, sine(0.01));
    for _ in 0..2000 {
        controller.step(&config, &well(7));
    }
    ordered(&mut controller, &config, 7, Order::Request(Request::Stop));
    let torques: Vec<f32> = (0..200)
        .map(|_| controller.step(&config, &well(7)).torque_nm)
        .collect();
    assert!(torques.windows(2).all(|pair| pair[1] <= pair[0]));
    assert_eq!(torques[199], 0.0);
}

/// Plays a sine of 0.03 N m within bounds until it ends: its ticks, why, and the torques from then on.
fn ended(bounds: Bounds<f32>, raw: impl Fn(u32) -> u32) -> (u32, End, Vec<f32>) {
    let config = BENCH.build(TICK_S, 1).unwrap();
    let mut controller = armed(&config);
    let sine = Experiment::Sine {
        amplitude_nm: 0.03,
        period_ticks: 10_000,
    };
    controller.obey(&config, &play(sine, bounds));
    for k in 0..5000 {
        let record = controller.step(&config, &well(raw(k))).record;
        if record.status.flags() & FLAG_EXPERIMENT == 0 {
            let end = record.status.ended().unwrap();
            let rest = (0..100)
                .map(|_| controller.step(&config, &well(raw(k))))
                .map(|output| {
                    assert_eq!(output.record.status.ended(), Some(end));
                    output.torque_nm
                });
            let torques = core::iter::once(record.torque_ref_nm).chain(rest);
            return (k, end, torques.collect());
        }
        assert_eq!(record.status.ended(), Some(End::None));
    }
    panic!("it did not end")
}

#[test]
fn a_bound_that_is_passed_ends_the_experiment_with_its_reason() {
    let open = Bounds::open(4000);
    let at_rest = |_| 7;
    let (ticks, end, torques) = ended(Bounds { ticks: 300, ..open }, at_rest);
    assert_eq!((ticks, end), (300, End::Finished));
    // Down by the ramp, 1e-4 N m a tick, from 0.03 sin(2 pi 0.03) = 5.6e-3.
    assert!(torques.windows(2).all(|pair| pair[1] <= pair[0]));
    assert!(torques[0] > 5e-3 && torques[99] == 0.0);
    // 0.03 sin(2 pi t) passes 0.01 N m at 0.0541 s; the torque itself never does.
    let torque_nm = 0.01;
    let (ticks, end, torques) = ended(Bounds { torque_nm, ..open }, at_rest);
    assert_eq!((ticks, end), (541, End::Torque));
    assert!(torques[0] <= torque_nm);
    // A count every 25 ticks: 0.1 rad are 261 counts.
    let crawl = |k: u32| 7_u32.wrapping_sub(k / 25);
    let travel_rad = 0.02;
    let (ticks, end, _) = ended(Bounds { travel_rad, ..open }, crawl);
    // 52 counts are allowed.
    assert_eq!((ticks, end), (53 * 25, End::Travel));
    // Ten counts a tick are 38 rad/s.
    let fast = |k: u32| 7 + 10 * k;
    let speed_rad_s = 5.0;
    let (_, end, _) = ended(
        Bounds {
            speed_rad_s,
            ..open
        },
        fast,
    );
    assert_eq!(end, End::Speed);
    // Ends in the tick in which it begins, which shows both.
    let mut controller = armed(&BENCH.build(TICK_S, 1).unwrap());
    let config = BENCH.build(TICK_S, 1).unwrap();
    let ladder = Experiment::SpeedLadder {
        top_rad_s: 10.0,
        ratio: 0.5,
        hold_ticks: 10,
    };
    let order = play(ladder, Bounds { torque_nm, ..open });
    let output = ordered(&mut controller, &config, 7, order);
    let status = output.record.status;
    assert_eq!(status.ended(), Some(End::Torque));
    assert!(status.flags() & FLAG_EXPERIMENT != 0 && output.torque_nm == 0.0);
    let next = controller.step(&config, &well(7)).record.status;
    assert_eq!(next.ended(), Some(End::Torque));
    assert_eq!(next.flags() & FLAG_EXPERIMENT, 0);
}

#[test]
fn a_stop_and_a_fault_end_an_experiment_with_their_reasons() {
    let config = BENCH.build(TICK_S, 1).unwrap();
    let mut controller = armed(&config);
    ordered(&mut controller, &config, 7, sine(0.01));
    let stopped = ordered(&mut controller, &config, 7, Order::Request(Request::Stop));
    assert_eq!(stopped.record.status.ended(), Some(End::Stopped));
    let again = ordered(&mut controller, &config, 7, sine(0.01));
    assert_eq!(again.record.status.ended(), Some(End::None));
    let fault = controller.step(&config, &well(100_000));
    assert_eq!(fault.record.status.ended(), Some(End::Fault));
}

#[test]
fn new_parameters_leave_the_states_alone() {
    let config = BENCH.build(TICK_S, 1).unwrap();
    let mut controller = armed(&config);
    let mut raw = 7_u32;
    let mut last = ordered(&mut controller, &config, raw, sine(0.03)).record;
    for k in 0..2000_u32 {
        raw = raw.wrapping_add(u32::from(k % 50 == 0));
        last = controller.step(&config, &well(raw)).record;
    }
    let changed = Parameters {
        viscous_nm_s_rad: 0.003,
        l1_1_s: 1800.0,
        ..BENCH
    };
    let config = changed.build(TICK_S, 1).unwrap();
    controller.take_over(&config);
    let next = controller.step(&config, &well(raw)).record;
    // A tick's change of each, and no more: 8 rad/s^2 per mN m, and the sine's slope.
    assert!((next.velocity_rad_s - last.velocity_rad_s).abs() < 0.1);
    assert_eq!(next.z_time_free_rad, last.z_time_free_rad);
    assert!((next.torque_ref_nm - last.torque_ref_nm).abs() < 2e-5);
    assert_eq!(next.tick, last.tick + 1);
}

#[test]
fn silence_is_a_fault_in_its_tick_whatever_is_watched_and_with_a_shorter_limit_too() {
    // Armed in tick 200, playing from 201: the time-out is 10,000 ticks, or 1,000 from tick 1701 on.
    for (ticks, shorter, fault_tick) in [
        (u32::MAX, false, 10_201),
        (20_000, false, 10_201),
        (5_000, false, 10_201),
        (20_000, true, 1_701),
    ] {
        let mut config = BENCH.build(TICK_S, 1).unwrap();
        let mut controller = armed(&config);
        let experiment = Experiment::Sine {
            amplitude_nm: 0.001,
            period_ticks: 10_000,
        };
        let order = play(experiment, Bounds::open(ticks));
        let mut record = ordered(&mut controller, &config, 7, order).record;
        while record.status.fault() == Some(Fault::None) {
            if shorter && record.tick == 1_700 {
                let quick = Parameters {
                    command_timeout_s: 0.1,
                    ..BENCH
                };
                config = quick.build(TICK_S, 1).unwrap();
                controller.take_over(&config);
            }
            record = controller.step(&config, &well(7)).record;
            assert!(record.tick <= fault_tick, "{ticks} {shorter}");
        }
        assert_eq!(record.status.fault(), Some(Fault::CommandTimeout));
        assert_eq!(record.tick, fault_tick);
    }
}

#[test]
fn each_request_moves_the_time_out_on() {
    let config = BENCH.build(TICK_S, 1).unwrap();
    let mut controller = armed(&config);
    // Begins in tick 201, whose time-out alone would come in tick 10,201.
    let mut record = ordered(&mut controller, &config, 7, sine(0.001)).record;
    while record.status.fault() == Some(Fault::None) {
        if [5_000, 12_000].contains(&record.tick) {
            controller.obey(&config, &Order::Request(Request::KeepAlive));
        }
        record = controller.step(&config, &well(7)).record;
        assert!(record.tick <= 22_001);
    }
    // A second after the tick that followed the last one.
    assert_eq!(record.status.fault(), Some(Fault::CommandTimeout));
    assert_eq!(record.tick, 22_001);
    assert_eq!(record.status.ended(), Some(End::Fault));
}

#[test]
fn a_request_in_the_tick_of_the_time_out_costs_neither_the_next_one_nor_the_end() {
    let config = BENCH.build(TICK_S, 1).unwrap();
    let experiment = Experiment::Sine {
        amplitude_nm: 0.001,
        period_ticks: 10_000,
    };
    // Begins in tick 201: the time-out comes in tick 10,201 without the request, and 10,000 later with it.
    for (ticks, last_tick, end) in [
        (15_000, 15_201, End::Finished),
        (30_000, 20_201, End::Fault),
    ] {
        let mut controller = armed(&config);
        let order = play(experiment, Bounds::open(ticks));
        let mut record = ordered(&mut controller, &config, 7, order).record;
        while record.status.ended() == Some(End::None) {
            assert!(record.tick < last_tick, "{ticks}");
            if record.tick == 10_200 {
                controller.obey(&config, &Order::Request(Request::KeepAlive));
            }
            record = controller.step(&config, &well(7)).record;
        }
        assert_eq!((record.tick, record.status.ended()), (last_tick, Some(end)));
    }
}

#[test]
fn a_jump_of_the_counter_is_a_fault_and_control_goes_on() {
    let config = BENCH.build(TICK_S, 1).unwrap();
    let mut controller = armed(&config);
    ordered(&mut controller, &config, 7, sine(0.03));
    let output = controller.step(&config, &well(100_000));
    assert_eq!(output.record.status.fault(), Some(Fault::Overspeed));
    assert_eq!((output.torque_nm, output.drive_enabled), (0.0, false));
    let output = controller.step(&config, &well(100_000));
    assert_eq!(output.record.status.state(), Some(State::Fault));
    assert_eq!(controller.rejected()[0], 1);
}

#[test]
fn a_drive_at_rest_is_watched_as_one_that_moves() {
    let config = BENCH.build(TICK_S, 1).unwrap();
    let at_rest = || {
        let mut controller = armed(&config);
        ordered(&mut controller, &config, 7, sine(0.01));
        ordered(&mut controller, &config, 7, Order::Request(Request::Stop));
        let mut record = controller.step(&config, &well(7)).record;
        for _ in 0..2_000 {
            record = controller.step(&config, &well(7)).record;
        }
        assert_eq!(record.status.limit(), Some(Limit::Ramp));
        assert_eq!(record.status.state(), Some(State::Armed));
        assert_eq!(record.torque_ref_nm, 0.0);
        controller
    };
    let unwell = Input {
        alarms: Alarms::UNWELL,
        ..well(7)
    };
    for (input, fault) in [
        (unwell, Fault::DriveFault),
        (well(100_000), Fault::Overspeed),
    ] {
        let record = at_rest().step(&config, &input).record;
        assert_eq!(record.status.fault(), Some(fault));
    }
    // The request was taken before tick 202, the time-out is 10,000 ticks.
    let mut controller = at_rest();
    let mut record = controller.step(&config, &well(7)).record;
    // Other parameters on the way leave it at rest, and what is at rest says so.
    controller.take_over(&config);
    while record.status.fault() == Some(Fault::None) {
        assert_eq!(record.status.limit(), Some(Limit::Ramp));
        assert!(record.tick < 10_202);
        record = controller.step(&config, &well(7)).record;
    }
    assert_eq!(record.status.fault(), Some(Fault::CommandTimeout));
    assert_eq!(record.tick, 10_202);
}

#[test]
fn a_lost_sample_is_told_by_the_next_one_and_changes_nothing_else() {
    let config = BENCH.build(TICK_S, 1).unwrap();
    let ladder = play(
        Experiment::SpeedLadder {
            top_rad_s: 5.0,
            ratio: 0.5,
            hold_ticks: 400,
        },
        Bounds::open(u32::MAX),
    );
    for order in [sine(0.03), ladder] {
        let [mut whole, mut torn] = [(); 2].map(|()| {
            let mut controller = armed(&config);
            ordered(&mut controller, &config, 7, order);
            controller
        });
        for k in 0..5_000_u32 {
            let raw = 7 + k / 20;
            let expected = whole.step(&config, &well(raw));
            let mut output = torn.step(&config, &well(raw));
            if (k % 100).wrapping_sub(1) < 2 {
                assert_ne!(output.record.status.flags() & FLAG_OVERRUN, 0);
                output.record.status.0 &= !(u32::from(FLAG_OVERRUN) << 24);
            }
            assert_eq!(output, expected, "{k}");
            if k % 100 < 2 {
                torn.lose_sample();
            }
        }
        assert_ne!(whole.step(&config, &well(257)).torque_nm, 0.0);
    }
}

#[test]
fn silence_after_an_end_and_a_start_is_a_fault_in_its_tick() {
    let config = BENCH.build(TICK_S, 1).unwrap();
    let mut controller = armed(&config);
    let experiment = Experiment::Sine {
        amplitude_nm: 0.001,
        period_ticks: 10_000,
    };
    // Begins in tick 201 and ends in tick 1201.
    let order = play(experiment, Bounds::open(1_000));
    let mut record = ordered(&mut controller, &config, 7, order).record;
    while record.status.fault() == Some(Fault::None) {
        if record.tick == 1_500 {
            assert_eq!(record.status.ended(), Some(End::Finished));
            controller.obey(&config, &Order::Request(Request::Start));
        }
        record = controller.step(&config, &well(7)).record;
        assert!(record.tick <= 11_501);
    }
    assert_eq!(record.status.fault(), Some(Fault::CommandTimeout));
    assert_eq!(record.tick, 11_501);
}
