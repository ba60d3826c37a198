//! How much of the gap that two effects close belongs to each of them, whichever is thought of first: the mean of what it
//! closes alone and what it closes beside the other. Shapley 1953, Contributions to the Theory of Games 2.

use super::closed::closed;
use super::hypothesis::Hypothesis;
use super::tried::Search;

/// The two effects of a hypothesis, each with its share of the gap, 1 being all of it; below zero for one that only opens it.
/// None where one of them was not fitted alone, or where there are not two.
pub(super) fn credits(search: &Search, pair: &Hypothesis) -> Option<[(&'static str, f64); 2]> {
    let [one, other] = pair.ids()[..] else {
        return None;
    };
    let closes = |h: &Hypothesis| closed(search, &h.held_out).value;
    let alone = [closes(search.alone(one)?), closes(search.alone(other)?)];
    let [first, second] = shared(alone, closes(pair));
    Some([(one, first), (other, second)])
}

/// What both do, shared between two of whom each does so much alone.
fn shared([one, other]: [f64; 2], both: f64) -> [f64; 2] {
    let apart = 0.5 * (one - other);
    [0.5 * both + apart, 0.5 * both - apart]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn credits_add_up_to_what_both_close() {
        // Half of 0.6 alone and of 0.9 - 0.2 beside the other; half of 0.2 and of 0.9 - 0.6.
        let [one, other] = shared([0.6, 0.2], 0.9);
        assert!((one - 0.65).abs() < 1e-15 && (other - 0.25).abs() < 1e-15);
        // Two that do the same alone share evenly, and one that does nothing gains nothing.
        assert_eq!(shared([0.5, 0.5], 0.5), [0.25, 0.25]);
        assert_eq!(shared([0.5, 0.0], 0.5), [0.5, 0.0]);
        for both in [0.1, 0.7, 1.0] {
            let sum: f64 = shared([0.8, -0.1], both).iter().sum();
            assert!((sum - both).abs() < 1e-15, "{sum}");
        }
    }
}
