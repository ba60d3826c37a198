//! `bristle trials`: how often the right answer comes out, on virtual axes drawn by seed.

mod diagnose;
mod identify;
mod score;

use bristle_gap::InputError;
use clap::Subcommand;

/// Try the tool on virtual axes drawn by seed, and count how often it is right.
#[derive(clap::Args)]
pub struct Args {
    #[command(subcommand)]
    what: What,
}

#[derive(Subcommand)]
enum What {
    Diagnose(diagnose::Args),
    Identify(identify::Args),
}

/// Runs the subcommand.
pub fn run(args: &Args) -> Result<(), InputError> {
    match &args.what {
        What::Diagnose(args) => diagnose::run(args),
        What::Identify(args) => identify::run(args),
    }
}
