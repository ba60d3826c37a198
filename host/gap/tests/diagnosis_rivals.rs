//! Two that explain nearly the same are told apart by what each leaves on records of its own; what is left that no effect of the list makes is said.

mod trials;

use bristle_gap::diagnose::{Kind, catalogue};
use trials::{diagnosed, drawn};

/// What is said of the trial of a seed with one effect, by all of the catalogue but some.
fn verdict(seed: u64, effect: &'static str, without: &[&str]) -> (Kind, Vec<String>) {
    let ids = catalogue().into_iter().map(|entry| entry.id);
    let accused: Vec<&str> = ids.filter(|id| !without.contains(id)).collect();
    let said = diagnosed(&drawn(seed, &[effect]), &accused).verdict;
    (said.kind, said.effects)
}

#[test]
fn an_offset_is_told_from_an_asymmetry_that_ties_with_it() {
    // 82 nats speak for the offset on the measured records, 55 on its own, -12 on those of the asymmetry.
    let there = "mechanics.offset";
    let said = verdict(19367, there, &[]);
    assert_eq!(said, (Kind::Effect, vec![there.to_string()]));
}

#[test]
fn an_inertia_that_asks_for_a_second_effect_stands_for_one_of_no_list() {
    // Friction over position gains 69 nats beside the inertia that changes, -40 where that is all there is.
    let there = "actuator.ripple";
    assert_eq!(verdict(19256, there, &[there]), (Kind::Unknown, Vec::new()));
}

#[test]
fn a_tone_that_goes_on_evenly_is_no_noise_of_the_recorder() {
    let there = "disturbance.periodic";
    assert_eq!(verdict(19259, there, &[there]), (Kind::Unknown, Vec::new()));
}

#[test]
fn what_takes_parameters_to_where_they_are_not_believed_stands_for_another() {
    // Friction over position leaves nothing, with parameters that are believed 27 nats less.
    let there = "actuator.ripple";
    assert_eq!(verdict(18419, there, &[there]), (Kind::Unknown, Vec::new()));
}

#[test]
fn bristles_that_carry_nearly_all_of_static_friction_are_presliding_in_another_form() {
    // Friction that remembers came out at 0.88 of it, and explains as much as presliding, which is there.
    let there = "friction.presliding";
    let said = verdict(19018, there, &[]);
    assert_eq!(said, (Kind::Effect, vec![there.to_string()]));
    assert_eq!(verdict(18615, there, &[there]), (Kind::Unknown, Vec::new()));
}
