//! Friction that differs by direction: larger by a share one way, smaller by it the other.

use super::{Effect, Entry, Instant, Kind, Parameter};

struct Asymmetry {
    share: f64,
}

impl Effect for Asymmetry {
    fn friction(&mut self, _: &Instant, friction_nm: f64) -> f64 {
        // The sign of friction, not of velocity: the two agree in sliding, and this one has no step in presliding.
        friction_nm + self.share * friction_nm.abs()
    }
}

pub(super) const ENTRY: Entry = Entry {
    id: "friction.asymmetry",
    parameters: &[Parameter {
        name: "share",
        linear_name: "share",
        default: 0.0,
        kind: Kind::Size,
        range: |_| [-0.4, 0.4],
    }],
    build: |values, _| Box::new(Asymmetry { share: values[0] }),
};

#[cfg(test)]
mod tests {
    use super::*;
    use crate::unit::Unit;

    #[test]
    fn is_more_one_way_and_less_the_other() {
        let mut effect = (ENTRY.build)(&[0.2], Unit::Rotary);
        let now = Instant::default();
        assert!((effect.friction(&now, 1.0) - 1.2).abs() < 1e-15);
        assert!((effect.friction(&now, -1.0) + 0.8).abs() < 1e-15);
        assert_eq!(effect.friction(&now, 0.0), 0.0);
    }
}
