//! The firmware's ELF, which `cargo xtask build-firmware` makes.

use bristle_image::Image;
use defmt_decoder::Table;
use std::io::Write as _;
use std::path::PathBuf;

/// Where the ELF is: `BRISTLE_FIRMWARE`, or where the firmware's build puts it.
fn path() -> PathBuf {
    if let Some(path) = std::env::var_os("BRISTLE_FIRMWARE") {
        return path.into();
    }
    let root = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../..");
    let target = std::env::var_os("CARGO_TARGET_DIR")
        .map_or_else(|| root.join("firmware/target"), PathBuf::from);
    target.join("thumbv7em-none-eabihf/release/bristle-firmware")
}

/// The image, or a loud word that there is none.
pub fn firmware() -> Option<Image> {
    let path = path();
    match Image::read(&path) {
        Ok(image) => Some(image),
        Err(error) if !path.exists() => {
            let line = "=".repeat(80);
            // Past the macros, whose output a passing test swallows.
            let _ = writeln!(
                std::io::stderr(),
                "{line}\nSKIPPED: no firmware image ({error}).\nBuild it with `cargo xtask build-firmware`.\n{line}"
            );
            assert!(
                std::env::var_os("BRISTLE_REQUIRE_FIRMWARE").is_none(),
                "BRISTLE_REQUIRE_FIRMWARE is set, so that a missing image is a failure"
            );
            None
        }
        Err(error) => panic!("{error}"),
    }
}

/// The image's log lines.
pub fn table(image: &Image) -> Table {
    Table::parse(image.bytes())
        .expect("defmt section")
        .expect("the image logs")
}
