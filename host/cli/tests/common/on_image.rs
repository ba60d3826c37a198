//! The firmware's image in the emulator, which `cargo xtask test` builds and names.

/// The options that name emulator and image; none, said loudly, where nobody names them.
pub fn on_image() -> Option<[String; 6]> {
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
    Some(words.map(str::to_owned))
}
