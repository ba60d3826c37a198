//! What no effect of the list explains is unknown, and what the simulator leaves over of its own records is not.

mod trials;

use bristle_gap::diagnose::Kind;
use trials::{drawn, verdict_on};

/// Verdict on the trial of a seed that has these effects, with a few others in the catalogue.
fn verdict(seed: u64, effects: &[&'static str]) -> Kind {
    let accused = ["actuator.deadzone", "friction.lag", "mechanics.offset"];
    verdict_on(&drawn(seed, effects), &accused).0
}

#[test]
fn noise_of_the_sensor_that_no_effect_of_the_list_makes_is_unknown() {
    // It takes nothing of the torque that a model would miss: refitted parameters explain the rest.
    assert_eq!(verdict(9204, &["sensor.jitter"]), Kind::Unknown);
    assert_eq!(verdict(9205, &["sensor.lost_counts"]), Kind::Unknown);
    assert_eq!(verdict(9206, &["sensor.quantization"]), Kind::Unknown);
}

#[test]
fn noise_that_the_simulator_makes_of_its_own_records_is_no_gap() {
    // The effort's noise shakes bristles at 500 Hz: 3.7 times what is open were left over, and are of the simulator's own records.
    assert_eq!(verdict(9103, &[]), Kind::Parameters);
}
