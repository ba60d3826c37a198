//! The `bristle` command: know and close the gap between a servo axis and its model.

mod about;
mod bench;
mod blind;
mod burst;
mod capture;
mod check;
mod commission;
mod compare;
mod compensate;
mod diagnose;
mod effects;
mod identify;
mod image;
mod link;
mod observe;
mod on;
mod output;
mod plan;
#[cfg(feature = "probe")]
mod probe;
mod remote;
mod run;
mod scope;
mod serve;
mod setup;
mod simulate;
mod source;
mod target;
mod trials;
mod tune;

use bristle_gap::InputError;
use clap::{CommandFactory, Parser, Subcommand};
use std::process::ExitCode;

/// Know and close the gap between a servo axis and its model.
///
/// Exit code 0: a result was produced. 2: bad input or bad usage. 1: a fault of the program.
#[derive(Parser)]
#[command(version, propagate_version = true, max_term_width = 100)]
#[command(after_help = "Start with `bristle bench`: it needs no board and no files.")]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Bench(bench::Args),
    Identify(identify::Args),
    Observe(observe::Args),
    Simulate(simulate::Args),
    Plan(plan::Args),
    Run(Box<run::Args>),
    Commission(Box<commission::Args>),
    Check(check::Args),
    Compare(compare::Args),
    Compensate(compensate::Args),
    Diagnose(diagnose::Args),
    Effects(effects::Args),
    Capture(Box<capture::Args>),
    Burst(burst::Args),
    Target(target::Args),
    Scope(Box<scope::Args>),
    Serve(serve::Args),
    Tune(tune::Args),
    Blind(blind::Args),
    Trials(trials::Args),
    /// Print shell completions.
    #[command(
        after_help = "Example:\n  bristle completions bash > ~/.local/share/bash-completion/completions/bristle"
    )]
    Completions {
        /// For which shell.
        shell: clap_complete::Shell,
    },
}

fn main() -> ExitCode {
    let command = Cli::parse().command;
    match std::panic::catch_unwind(|| run(&command)) {
        Ok(Ok(())) => ExitCode::SUCCESS,
        Ok(Err(error)) => {
            eprintln!("{error}");
            ExitCode::from(2)
        }
        Err(_) => {
            eprintln!(
                "this is a fault of bristle, not of your input; please report it with the lines above"
            );
            ExitCode::from(1)
        }
    }
}

fn run(command: &Command) -> Result<(), InputError> {
    match command {
        Command::Bench(args) => bench::run(args),
        Command::Identify(args) => identify::run(args),
        Command::Observe(args) => observe::run(args),
        Command::Simulate(args) => simulate::run(args),
        Command::Plan(args) => plan::run(args),
        Command::Run(args) => run::run(args),
        Command::Commission(args) => commission::run(args),
        Command::Check(args) => check::run(args),
        Command::Compare(args) => compare::run(args),
        Command::Compensate(args) => compensate::run(args),
        Command::Diagnose(args) => diagnose::run(args),
        Command::Effects(args) => effects::run(args),
        Command::Capture(args) => capture::run(args),
        Command::Burst(args) => burst::run(args),
        Command::Target(args) => target::run(args),
        Command::Scope(args) => scope::run(args),
        Command::Serve(args) => serve::run(args),
        Command::Tune(args) => tune::run(args),
        Command::Blind(args) => blind::run(args),
        Command::Trials(args) => trials::run(args),
        Command::Completions { shell } => {
            let mut script = Vec::new();
            clap_complete::generate(*shell, &mut Cli::command(), "bristle", &mut script);
            output::print(&String::from_utf8_lossy(&script));
            Ok(())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arguments_are_consistent() {
        Cli::command().debug_assert();
    }
}
