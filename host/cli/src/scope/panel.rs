//! The firmware's parameters: their values, and one that is being edited.

use bristle_core::command::{Changes, Command};
use bristle_core::parameters::ENTRIES;
use std::collections::BTreeMap;

/// Values as they were last heard, and what is being typed.
#[derive(Default)]
pub struct Panel {
    /// It is shown.
    pub open: bool,
    /// Place of the chosen one.
    pub chosen: usize,
    /// What is typed for it.
    pub typed: String,
    values: BTreeMap<u8, f32>,
}

impl Panel {
    /// A value has come.
    pub fn take(&mut self, number: u8, value: f32) {
        self.values.insert(number, value);
    }

    /// Value of the one at a place.
    pub fn value(&self, place: usize) -> Option<f32> {
        u8::try_from(place)
            .ok()
            .and_then(|number| self.values.get(&number).copied())
    }

    /// All that have come, as a log notes them.
    pub fn named(&self) -> impl Iterator<Item = (String, String)> + '_ {
        self.values.iter().map(|(&number, value)| {
            let name = ENTRIES
                .get(usize::from(number))
                .map_or("unknown", |entry| entry.name);
            (format!("parameter {name}"), value.to_string())
        })
    }

    /// Chooses the next one, or the one before.
    pub fn choose(&mut self, down: bool) {
        let last = ENTRIES.len() - 1;
        self.chosen = if down {
            (self.chosen + 1).min(last)
        } else {
            self.chosen.saturating_sub(1)
        };
        self.typed.clear();
    }

    /// Types a character of a number.
    pub fn key(&mut self, key: char) -> bool {
        let fits = key.is_ascii_digit() || matches!(key, '.' | '-' | '+' | 'e');
        if fits {
            self.typed.push(key);
        }
        fits
    }

    /// The order that sets the chosen one to what was typed, and then asks for it; none where that is no number.
    pub fn enter(&mut self) -> Option<(&'static str, [Command; 2])> {
        let entry = ENTRIES.get(self.chosen)?;
        let number = u8::try_from(self.chosen).ok()?;
        let value = std::mem::take(&mut self.typed).parse().ok()?;
        let mut changes = Changes::default();
        changes.add(number, value);
        Some((entry.name, [Command::Set(changes), Command::Get(number)]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_that_is_typed_becomes_an_order() {
        let mut panel = Panel::default();
        panel.choose(true);
        assert!("2.5e-3".chars().all(|key| panel.key(key)) && !panel.key('q'));
        let (name, [set, get]) = panel.enter().unwrap();
        assert_eq!((name, get), (ENTRIES[1].name, Command::Get(1)));
        let Command::Set(changes) = set else {
            panic!("{set:?}")
        };
        assert_eq!(changes.iter().collect::<Vec<_>>(), [(1, 2.5e-3)]);
        // What is no number is no order, and is gone.
        assert!(panel.key('-') && panel.enter().is_none() && panel.typed.is_empty());
        panel.chosen = ENTRIES.len() - 1;
        panel.choose(true);
        assert_eq!(panel.chosen, ENTRIES.len() - 1);
    }
}
