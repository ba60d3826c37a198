//! The experiment of the thesis, and what `core` makes of it on the host.

use bristle_core::controller::{Controller, Input};
use bristle_core::experiment::{Bounds, Experiment};
use bristle_core::feed_forward::FeedForward;
use bristle_core::order::Order;
use bristle_core::parameters::Parameters;
use bristle_core::supervisor::{Request, State};
use bristle_core::trace::{FLAG_EXPERIMENT, Record};

/// The experiment: 0.035 N m, 1 s.
pub const SINE: Experiment<f32> = Experiment::Sine {
    amplitude_nm: 0.035,
    period_ticks: 10_000,
};

/// What both have to agree on, bit for bit: z of both observers, velocity and torque.
pub fn bits(record: &Record) -> [u32; 4] {
    [
        record.z_luenberger_rad,
        record.z_time_free_rad,
        record.velocity_rad_s,
        record.torque_ref_nm,
    ]
    .map(f32::to_bits)
}

/// The host's run of `core` on the counts that the image saw: these experiments one after the other, with the orders at
/// the ticks at which they show, and parameters and a feed-forward table that are in use before the first of them.
pub fn on_the_host(
    parameters: &Parameters,
    table: Option<&FeedForward<f32>>,
    records: &[Record],
    counts: &[u32],
    plays: &[(Experiment<f32>, Bounds<f32>)],
) -> Vec<Record> {
    let config = parameters.build(1e-4, 1).unwrap();
    let mut controller = Controller::new(&config, 0, false);
    let armed = |r: &Record| r.status.state() == Some(State::Armed);
    let arm = records.iter().position(armed);
    let mut plays = plays.iter();
    let mut played = false;
    let step = |(i, &raw): (usize, &u32)| {
        let before = played;
        played = records[i].status.flags() & FLAG_EXPERIMENT != 0;
        let order = if Some(i) == arm {
            Some(Order::Request(Request::Arm))
        } else if played && !before {
            plays.next().map(|play| config.play(play.0, &play.1))
        } else {
            // Only so that it does not time out; when they come makes no difference.
            (i % 500 == 0).then_some(Order::Request(Request::KeepAlive))
        };
        if let Some(order) = order {
            controller.obey(&config, &order);
        }
        let input = Input {
            raw,
            ..Input::default()
        };
        controller.step_with(&config, table, &input).record
    };
    counts.iter().enumerate().map(step).collect()
}
