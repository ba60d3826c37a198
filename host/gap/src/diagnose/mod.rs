//! The gap: where it lies, which effect causes it, how far it shrinks.

mod candidate;
mod held_out;
mod likelihood;
mod regime;
mod search;
mod spectrum;

pub use held_out::spreads;
pub use regime::{Node, Regime};
pub use search::{Hypothesis, Search, catalogue, search};
