//! An effect with parameters by chance, and its size as one number that can be turned up and down.

use super::dice::Dice;
use crate::axis_file::EffectEntry;
use bristle_plant::Unit;
use bristle_plant::effect::{Entry, Kind, Scale};
use std::f64::consts::PI;

/// An effect whose size is still to be set.
#[derive(Clone)]
pub struct Draft {
    /// Which.
    pub entry: &'static Entry,
    /// Values at a level of 1.
    values: Vec<f64>,
    /// Which of them the level moves.
    sizes: Vec<usize>,
    ranges: Vec<[f64; 2]>,
    unit: Unit,
    rad_per_count: f64,
}

/// Waves between the ends of the stroke that an effect of position has at least.
const LEAST_WAVES: f64 = 1.2;
/// Waves a second at the highest speed that can be told from noise, Hz.
const FASTEST_WAVE_HZ: f64 = 150.0;
/// Slots or poles repeat more often than a turn does: a wave a turn would be an unbalance.
const LEAST_COGGING: f64 = 4.0;
/// Sizes may pass the usual range by so much, either way.
const BEYOND: f64 = 1.5;
/// A deflection of fewer counts no encoder shows.
const LEAST_COUNTS: f64 = 3.0;

impl Draft {
    /// Draws the shape of an effect on an axis of a scale.
    pub fn draw(dice: &mut Dice, entry: &'static Entry, scale: &Scale) -> Self {
        let ranges: Vec<[f64; 2]> = entry.parameters.iter().map(|p| (p.range)(scale)).collect();
        let is_size = |i: &usize| matches!(entry.parameters[*i].kind, Kind::Size | Kind::Limit);
        let mut sizes: Vec<usize> = (0..ranges.len()).filter(is_size).collect();
        // Of several parts of an effect one, now and then all.
        let whole = entry.parameters[sizes[0]].kind == Kind::Limit;
        if sizes.len() > 1 && !whole && dice.chance(0.7) {
            sizes = vec![dice.of(&sizes)];
        }
        let values = entry
            .parameters
            .iter()
            .zip(&ranges)
            .enumerate()
            .map(|(i, (parameter, &[low, high]))| match parameter.kind {
                Kind::Size if !sizes.contains(&i) => 0.0,
                Kind::Size if low < 0.0 => {
                    let side = if high <= 0.0 || (low < 0.0 && dice.chance(0.5)) {
                        low
                    } else {
                        high
                    };
                    0.3 * side
                }
                Kind::Size if low > 0.0 => (low * high).sqrt(),
                Kind::Size => 0.3 * high,
                Kind::Limit => high,
                Kind::Order => {
                    let low = match entry.id {
                        "actuator.cogging" => low.max(LEAST_COGGING),
                        _ => low,
                    };
                    let most = (FASTEST_WAVE_HZ / scale.top_speed_rad_s * one_turn(scale.unit))
                        .min(high)
                        .max(low);
                    let least =
                        (LEAST_WAVES / scale.stroke_rad() * one_turn(scale.unit)).clamp(low, most);
                    let order = dice.decades(least, most);
                    match scale.unit {
                        Unit::Rotary => order.round().max(1.0),
                        Unit::Linear => order,
                    }
                }
                Kind::Detail => 0.0,
                Kind::Phase => dice.between(-PI, PI),
                Kind::Frequency => dice.decades(low.max(0.5), high.min(60.0)),
                Kind::Form | Kind::Side => dice.of(&[low, high]),
                Kind::Seed => dice.below(1 << 20) as f64,
                Kind::Shape if low > 0.0 => dice.decades(low, high),
                // Onset, event and stop are laid where the records are.
                _ => dice.between(low, high),
            })
            .collect();
        let mut draft = Self {
            entry,
            values,
            sizes,
            ranges,
            unit: scale.unit,
            rad_per_count: scale.rad_per_count,
        };
        draft.place(dice, scale);
        draft
    }

    /// Places and times where the records are.
    fn place(&mut self, dice: &mut Dice, scale: &Scale) {
        let mut set = |name: &str, value: f64| {
            if let Some(i) = self.entry.parameters.iter().position(|p| p.name == name) {
                self.values[i] = value;
            }
        };
        if self.entry.id == "mechanics.end_stop" {
            // Hit by the last of the stroke: further in, the softest makes much more of a gap than is wanted.
            let depth = scale.stroke_rad() * dice.decades(0.001, 0.1);
            let upper = dice.chance(0.5);
            set("side", if upper { 1.0 } else { -1.0 });
            let place = if upper {
                scale.highest_rad - depth
            } else {
                scale.lowest_rad + depth
            };
            set("position_rad", place);
        }
        for name in ["start_s", "event_s"] {
            set(name, scale.duration_s * dice.between(0.2, 0.7));
        }
    }

    /// Highest level that is physical.
    pub fn most(&self) -> f64 {
        self.sizes
            .iter()
            .map(|&i| match self.entry.parameters[i].kind {
                Kind::Limit => 10.0,
                _ => {
                    let [low, high] = self.ranges[i];
                    let end = if self.values[i] < 0.0 { low } else { high };
                    BEYOND * end / self.values[i]
                }
            })
            .fold(f64::INFINITY, f64::min)
    }

    /// Lowest level that is usual; zero where the range begins there.
    pub fn least(&self) -> f64 {
        self.sizes
            .iter()
            .map(|&i| {
                let parameter = &self.entry.parameters[i];
                let [low, high] = self.ranges[i];
                if parameter.kind == Kind::Limit || low <= 0.0 {
                    0.0
                } else if parameter.name.starts_with("z_ss") {
                    low.max((LEAST_COUNTS * self.rad_per_count).min(high)) / self.values[i]
                } else {
                    low / BEYOND / self.values[i]
                }
            })
            .fold(0.0, f64::max)
    }

    /// Values at a level.
    pub fn values(&self, level: f64) -> Vec<f64> {
        let mut values = self.values.clone();
        for &i in &self.sizes {
            match self.entry.parameters[i].kind {
                // A limit falls as the effect grows.
                Kind::Limit => values[i] /= level,
                _ => values[i] *= level,
            }
        }
        values
    }

    /// The entry of an axis file.
    pub fn at(&self, level: f64) -> EffectEntry {
        let names = self.entry.parameters.iter().map(|p| p.name(self.unit));
        EffectEntry {
            id: self.entry.id.to_string(),
            parameters: names.map(str::to_string).zip(self.values(level)).collect(),
        }
    }
}

/// Travel that orders count waves in.
fn one_turn(unit: Unit) -> f64 {
    match unit {
        Unit::Rotary => std::f64::consts::TAU,
        Unit::Linear => 1.0,
    }
}
