//! The gap: where it lies, which effect causes it, how far it shrinks.

mod candidate;
mod held_out;
mod likelihood;
mod regime;
mod search;
mod spectrum;

pub use candidate::{Background, Start};
pub use held_out::{held_out, spreads};
pub use likelihood::{Group, Noise};
pub use regime::{Node, Regime, nodes};
pub use search::{Hypothesis, Search, catalogue, search};
