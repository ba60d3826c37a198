//! The axis that a subcommand works on.

use crate::output;
use bristle_gap::axis_file::EffectEntry;
use bristle_gap::believed::Noise;
use bristle_gap::{AxisFile, Believed, InputError};
use std::path::{Path, PathBuf};

/// The demonstration axis, built in so that nothing else is needed.
pub const BENCH_AXIS: &str = include_str!("../../../axes/bench.toml");

/// An axis file and what follows from it.
pub struct Setup {
    /// As written.
    pub file: AxisFile,
    /// Completed.
    pub believed: Believed,
    /// Where it came from.
    pub name: String,
}

impl Setup {
    /// Reads an axis file, or takes the built-in one.
    pub fn new(path: Option<&PathBuf>) -> Result<Self, InputError> {
        let (file, path) = match path {
            Some(path) => (AxisFile::read(path)?, path.as_path()),
            None => {
                let path = Path::new("built-in bench axis");
                (AxisFile::parse(BENCH_AXIS, path)?, path)
            }
        };
        let believed = Believed::new(&file, path)?;
        output::notices(&believed.assumed);
        Ok(Self {
            believed,
            file,
            name: path.display().to_string(),
        })
    }

    /// Length of a sample at the observers' rate, s.
    pub fn sample_time_s(&self) -> f64 {
        1.0 / self.believed.rate_hz
    }
}

/// What sets a virtual axis apart from what its file says.
#[derive(clap::Args)]
pub struct Real {
    /// An effect to add, with its parameters, see `bristle effects`; may be given several times.
    #[arg(long, value_name = "ID[:KEY=VALUE,...]")]
    pub effect: Vec<String>,
    #[command(flatten)]
    noisy: Noisy,
}

/// Noise of a virtual axis.
#[derive(clap::Args)]
pub struct Noisy {
    /// Torque noise on the rotor, rms (force on a linear axis).
    #[arg(long, value_name = "N m", default_value_t = 0.0, value_parser = output::not_negative)]
    torque_noise_nm: f64,
    /// Noise of the position sensor before its quantisation, rms (m on a linear axis).
    #[arg(long, value_name = "rad", default_value_t = 0.0, value_parser = output::not_negative)]
    position_noise_rad: f64,
    /// Seed of the noise.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
}

impl Noisy {
    /// The noise.
    pub fn noise(&self) -> Noise {
        Noise {
            torque_nm: self.torque_noise_nm,
            position_rad: self.position_noise_rad,
        }
    }
}

impl Real {
    /// The axis with the effects added.
    pub fn axis(&self, believed: &Believed) -> Result<Believed, InputError> {
        let mut real = believed.clone();
        for text in &self.effect {
            real.effects.push(effect(text)?);
        }
        // Before any file is read: a name that does not exist is cheaper to mend now.
        real.effects()?;
        Ok(real)
    }

    /// Its noise.
    pub fn noise(&self) -> Noise {
        self.noisy.noise()
    }

    /// Seed of its noise.
    pub fn seed(&self) -> u64 {
        self.noisy.seed
    }

    /// Whether anything is set apart.
    pub fn is_given(&self) -> bool {
        !self.effect.is_empty() || self.noise() != Noise::default()
    }
}

fn effect(text: &str) -> Result<EffectEntry, InputError> {
    let wrong = |message: String| {
        InputError::new(
            format!("--effect {text}"),
            message,
            "write it as ID or ID:KEY=VALUE,KEY=VALUE",
        )
    };
    let (id, rest) = text.split_once(':').unwrap_or((text, ""));
    let mut parameters = Vec::new();
    for pair in rest.split(',').filter(|pair| !pair.is_empty()) {
        let (name, value) = pair
            .split_once('=')
            .ok_or_else(|| wrong(format!("`{pair}` has no value")))?;
        let value: f64 = value
            .parse()
            .map_err(|_| wrong(format!("`{value}` is not a number")))?;
        parameters.push((name.to_string(), value));
    }
    Ok(EffectEntry {
        id: id.to_string(),
        parameters,
    })
}
