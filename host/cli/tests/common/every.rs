//! A plan of every experiment there is.

/// All of them, in the order in which the plan has them.
pub const KINDS: [&str; 9] = [
    "sine",
    "pulse",
    "reversals",
    "ladder",
    "prbs",
    "dahl-ramp",
    "break-away",
    "multisine",
    "moves",
];

/// Each for 1.5 s.
pub fn plan() -> String {
    let steps = KINDS.map(|kind| format!("[[experiment]]\nkind = \"{kind}\"\nseconds = 1.5\n"));
    format!("[plan]\nrest_s = 0.1\n{}", steps.concat())
}
