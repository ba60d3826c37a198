//! A plan of every experiment there is.

use bristle_gap::experiments::Named;

/// Each for 1.5 s.
pub fn plan() -> String {
    let steps = Named::ALL.map(|kind| {
        let name = kind.name();
        format!("[[experiment]]\nkind = \"{name}\"\nseconds = 1.5\n")
    });
    format!("[plan]\nrest_s = 0.1\n{}", steps.concat())
}
