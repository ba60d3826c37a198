//! `bristle blind`: cases whose effect is withheld, the diagnosis's sealed answers to them, and the score.

mod answer;
mod answerer;
mod calibration;
mod make;
mod miss;
mod misses;
mod open;
mod page;
mod path;
mod score;
mod seal;
#[cfg(test)]
mod tests;
mod withhold;

use bristle_gap::InputError;
use clap::Subcommand;

/// Check the diagnosis on cases whose effect is withheld.
///
/// `make` writes cases and a key, `answer` diagnoses them without the key and seals what it says, `open` compares. The
/// person who makes a set and the one who answers it can be two. `withhold` does the same on a record of a real axis: it
/// takes a term out of the axis file and sees whether the diagnosis names it.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  bristle blind make --cases 200 --out cases --key-out cases.key.json\n  bristle blind answer cases \
                  --out answers.json\n  bristle blind open cases --key cases.key.json --answers answers.json --report \
                  blind.html\n  bristle blind withhold --term mechanics.offset --axis axis.toml train.csv --held-out \
                  other.csv"
)]
pub struct Args {
    #[command(subcommand)]
    step: Step,
}

#[derive(Subcommand)]
enum Step {
    Make(make::Args),
    Answer(answer::Args),
    Open(open::Args),
    Withhold(withhold::Args),
}

/// Runs the subcommand.
pub fn run(args: &Args) -> Result<(), InputError> {
    match &args.step {
        Step::Make(args) => make::run(args),
        Step::Answer(args) => answer::run(args),
        Step::Open(args) => open::run(args),
        Step::Withhold(args) => withhold::run(args),
    }
}
