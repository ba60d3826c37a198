//! The firmware's image in the emulator, which `cargo xtask test` builds and names.

use std::sync::{Mutex, MutexGuard, PoisonError};

/// Two images in real time at once are too much for two cores.
static ALONE: Mutex<()> = Mutex::new(());

/// The options that name emulator and image, for one test at a time; none, said loudly, where nobody names them.
pub fn on_image() -> Option<(MutexGuard<'static, ()>, [String; 6])> {
    let named = |name: &str| std::env::var(name).ok();
    let (Some(emulator), Some(firmware)) = (named("BRISTLE_EMULATOR"), named("BRISTLE_FIRMWARE"))
    else {
        eprintln!(
            "SKIPPED: BRISTLE_EMULATOR and BRISTLE_FIRMWARE name no image; `cargo xtask test` does"
        );
        return None;
    };
    let words = [
        "--on",
        "image",
        "--emulator",
        &emulator,
        "--firmware",
        &firmware,
    ];
    let alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    Some((alone, words.map(str::to_owned)))
}
