use super::*;

const LIMITS: Limits = Limits {
    torque_nm: 0.1,
    slew_nm: 0.01,
    ramp_nm: 0.02,
    speed_rad_s: 100.0,
    limit_ticks: 50,
    command_ticks: 200,
    stuck_nm: 0.05,
    stuck_ticks: 20,
    counts_per_turn: 1000,
    index_counts: 2,
    boot_ticks: 3,
};

const WELL: Observation = Observation {
    wanted_nm: 0.0,
    velocity_rad_s: 0.0,
    z_rad: 0.0,
    step_counts: 1,
    alarms: Alarms(0),
};

fn asked(supervisor: &mut Supervisor, request: Request) -> Verdict {
    supervisor.ask(&LIMITS, request);
    supervisor.step(&LIMITS, &WELL)
}

fn wanting(wanted_nm: f32) -> Observation {
    Observation { wanted_nm, ..WELL }
}

/// Armed, with an experiment under way and a torque of 0.06 N m on the drive.
fn running() -> Supervisor {
    let mut supervisor = Supervisor::new(false);
    for _ in 0..LIMITS.boot_ticks {
        supervisor.step(&LIMITS, &WELL);
    }
    asked(&mut supervisor, Request::Arm);
    asked(&mut supervisor, Request::Start);
    for _ in 0..10 {
        supervisor.step(&LIMITS, &wanting(0.06));
    }
    assert_eq!(supervisor.state(), State::Armed);
    supervisor
}

fn is_off(verdict: Verdict) -> bool {
    verdict.torque_nm == 0.0 && !verdict.drive_enabled
}

#[test]
fn nothing_flows_before_arming() {
    let mut supervisor = Supervisor::new(false);
    for tick in 0..100 {
        assert!(is_off(supervisor.step(&LIMITS, &wanting(0.05))));
        let state = if tick + 1 < LIMITS.boot_ticks {
            State::Boot
        } else {
            State::Idle
        };
        assert_eq!(supervisor.state(), state);
    }
    assert!(is_off(asked(&mut supervisor, Request::Start)));
    assert_eq!(supervisor.refused(), 1);
}

#[test]
fn arming_alone_gives_no_torque() {
    let mut supervisor = Supervisor::new(false);
    asked(&mut supervisor, Request::Arm);
    assert_eq!((supervisor.state(), supervisor.refused()), (State::Boot, 1));
    for _ in 0..3 {
        supervisor.step(&LIMITS, &WELL);
    }
    let unwell = Observation {
        alarms: Alarms::UNWELL,
        ..WELL
    };
    assert!(is_off(supervisor.step(&LIMITS, &unwell)));
    assert!(is_off(asked(&mut supervisor, Request::Arm)));
    assert_eq!((supervisor.state(), supervisor.refused()), (State::Idle, 2));
    let verdict = asked(&mut supervisor, Request::Arm);
    assert!(verdict.drive_enabled && verdict.torque_nm == 0.0);
    let verdict = supervisor.step(&LIMITS, &wanting(0.05));
    assert!(verdict.drive_enabled && verdict.torque_nm == 0.0);
}

/// Each fault once: what brings it, and after how many ticks of it.
#[test]
fn every_fault_takes_the_drive_away_and_stays() {
    let cases = [
        (Fault::NotFinite, wanting(f32::NAN), 1),
        (Fault::NotFinite, wanting(f32::INFINITY), 1),
        (
            Fault::NotFinite,
            Observation {
                velocity_rad_s: f32::NAN,
                ..WELL
            },
            1,
        ),
        (
            Fault::DriveFault,
            Observation {
                alarms: Alarms::UNWELL,
                ..WELL
            },
            1,
        ),
        (
            Fault::EncoderIllegal,
            Observation {
                alarms: Alarms::ILLEGAL,
                ..WELL
            },
            1,
        ),
        (
            Fault::Overspeed,
            Observation {
                velocity_rad_s: -101.0,
                ..WELL
            },
            1,
        ),
        (
            Fault::Overspeed,
            Observation {
                alarms: Alarms::REJECTED,
                ..WELL
            },
            1,
        ),
        (
            Fault::DeadlineMissed,
            Observation {
                alarms: Alarms::LATE,
                ..WELL
            },
            1,
        ),
        (
            Fault::StuckEncoder,
            Observation {
                step_counts: 0,
                ..wanting(0.06)
            },
            20,
        ),
        // Five ticks of slew first, then at the limit.
        (Fault::LimitTooLong, wanting(0.2), 51),
    ];
    for (fault, cause, ticks) in cases {
        let mut supervisor = running();
        for tick in 1..ticks {
            assert!(
                supervisor.step(&LIMITS, &cause).drive_enabled,
                "{fault:?} already after {tick} ticks"
            );
        }
        assert!(is_off(supervisor.step(&LIMITS, &cause)), "{fault:?}");
        assert_eq!(
            (supervisor.state(), supervisor.fault()),
            (State::Fault, fault)
        );
        assert!(!fault.text().is_empty());
        for request in [
            Request::Arm,
            Request::Start,
            Request::KeepAlive,
            Request::Stop,
        ] {
            assert!(is_off(asked(&mut supervisor, request)));
            assert_eq!(supervisor.fault(), fault, "latched");
        }
        asked(&mut supervisor, Request::ClearFault);
        assert_eq!(
            (supervisor.state(), supervisor.fault()),
            (State::Idle, Fault::None)
        );
        assert!(asked(&mut supervisor, Request::Arm).drive_enabled);
    }
}

#[test]
fn silence_ramps_down_before_it_disables() {
    let mut supervisor = running();
    let mut ticks = 0;
    while supervisor.state() == State::Armed {
        supervisor.step(&LIMITS, &wanting(0.06));
        ticks += 1;
        assert!(ticks <= LIMITS.command_ticks);
    }
    assert_eq!(supervisor.fault(), Fault::CommandTimeout);
    // 0.06 to 0.04 in the tick that latched; two ramp steps of 0.02 are left.
    let verdict = supervisor.step(&LIMITS, &wanting(0.06));
    assert!(verdict.drive_enabled && verdict.limit == Limit::Ramp);
    assert!((verdict.torque_nm - 0.02).abs() < 1e-6);
    let mut last = verdict;
    for _ in 0..3 {
        last = supervisor.step(&LIMITS, &wanting(0.06));
    }
    assert!(is_off(last));
}

#[test]
fn a_worse_fault_ends_the_ramp() {
    let mut supervisor = running();
    while supervisor.state() == State::Armed {
        supervisor.step(&LIMITS, &wanting(0.06));
    }
    let cause = Observation {
        alarms: Alarms::ILLEGAL,
        ..WELL
    };
    assert!(is_off(supervisor.step(&LIMITS, &cause)));
    assert_eq!(
        supervisor.fault(),
        Fault::CommandTimeout,
        "the first one stays"
    );
}

#[test]
fn keep_alive_keeps_alive() {
    let mut supervisor = running();
    for tick in 0..2000 {
        if tick % 100 == 0 {
            supervisor.ask(&LIMITS, Request::KeepAlive);
        }
        supervisor.step(&LIMITS, &wanting(0.06));
    }
    assert_eq!(supervisor.state(), State::Armed);
}

#[test]
fn stop_ramps_and_start_goes_on() {
    let mut supervisor = running();
    supervisor.ask(&LIMITS, Request::Stop);
    let verdict = supervisor.step(&LIMITS, &wanting(0.06));
    assert_eq!(verdict.limit, Limit::Ramp);
    for _ in 0..5 {
        supervisor.step(&LIMITS, &wanting(0.06));
    }
    let verdict = supervisor.step(&LIMITS, &wanting(0.06));
    assert!(verdict.drive_enabled && verdict.torque_nm == 0.0);
    asked(&mut supervisor, Request::Start);
    let verdict = supervisor.step(&LIMITS, &wanting(0.06));
    assert_eq!((verdict.torque_nm, verdict.limit), (0.01, Limit::Slew));
    assert!(is_off(asked(&mut supervisor, Request::Disarm)));
    assert_eq!(supervisor.state(), State::Idle);
}

#[test]
fn watchdog_reset_is_told_and_must_be_cleared() {
    let mut supervisor = Supervisor::new(true);
    assert!(is_off(asked(&mut supervisor, Request::Arm)));
    assert_eq!(supervisor.fault(), Fault::WatchdogReset);
    asked(&mut supervisor, Request::ClearFault);
    assert_eq!(supervisor.state(), State::Idle);
}

#[test]
fn index_must_come_back_at_whole_turns() {
    let at = |supervisor: &mut Supervisor, index: u32| {
        let alarms = Alarms::INDEX.when(!supervisor.index_fits(&LIMITS, index));
        supervisor.step(&LIMITS, &Observation { alarms, ..WELL });
    };
    // Across the counter's wrap, both directions, within the tolerance.
    let mut supervisor = running();
    for index in [u32::MAX - 10, 989, 1991, 987, u32::MAX - 10] {
        at(&mut supervisor, index);
        assert_eq!(supervisor.fault(), Fault::None, "{index}");
    }
    at(&mut supervisor, 992);
    assert_eq!(supervisor.fault(), Fault::IndexMismatch);
    // A count lost every turn stays within the tolerance each time, but adds up.
    let mut supervisor = running();
    let mut turns = 0;
    while supervisor.fault() == Fault::None {
        at(&mut supervisor, turns * 999);
        turns += 1;
        assert!(turns < 10);
    }
    assert_eq!(turns, 4);
}

#[test]
fn numbers_and_texts_are_there_for_all() {
    for (number, &fault) in Fault::ALL.iter().enumerate() {
        assert_eq!(Fault::of(number as u8), Some(fault));
    }
    assert_eq!(Fault::of(Fault::ALL.len() as u8), None);
    assert_eq!(State::ALL.len(), 4);
    assert_eq!(Limit::of(4), Some(Limit::Ramp));
}

#[test]
fn limits_that_mean_nothing_are_refused() {
    assert!(LIMITS.checked().is_ok());
    for bad in [
        Limits {
            torque_nm: f32::NAN,
            ..LIMITS
        },
        Limits {
            slew_nm: 0.0,
            ..LIMITS
        },
        Limits {
            ramp_nm: -1.0,
            ..LIMITS
        },
        Limits {
            stuck_ticks: 0,
            ..LIMITS
        },
        Limits {
            counts_per_turn: 0,
            ..LIMITS
        },
        Limits {
            index_counts: -1,
            ..LIMITS
        },
    ] {
        assert!(bad.checked().is_err());
    }
}
