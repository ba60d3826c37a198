//! The text of an identified axis file: the interval beside what was identified, and where it comes from on top.

use super::interval::Estimate;
use crate::axis_file::AxisFile;

/// Where a fit comes from.
pub struct Provenance {
    /// The command.
    pub command: String,
    /// Of the program.
    pub version: String,
    /// In UTC.
    pub date: String,
    /// Name and SHA-256 of each log.
    pub logs: Vec<(String, String)>,
}

/// The file's text with provenance on top and intervals beside what was identified.
pub fn to_toml(file: &AxisFile, estimates: &[Estimate], provenance: &Provenance) -> String {
    let mut text = format!(
        "# Identified from logs by bristle {} on {}.\n# {}\n",
        provenance.version,
        provenance.date,
        one_line(&provenance.command)
    );
    for (name, hash) in &provenance.logs {
        text += &format!("# log {} sha256 {hash}\n", one_line(name));
    }
    text += "# Intervals are at 90 %.\n\n";
    let mut effect: Option<String> = None;
    for line in file.to_toml().lines() {
        if let Some((key, value)) = line.split_once(" = ") {
            if key == "id" {
                effect = Some(value.trim_matches('"').to_string());
            }
            let name = match &effect {
                Some(id) => format!("{id}.{key}"),
                None => key.to_string(),
            };
            if let Some(estimate) = estimates.iter().find(|estimate| estimate.name == name) {
                text += &format!("# {}\n", beside(estimate));
            }
        }
        text += line;
        text.push('\n');
    }
    text
}

fn beside(estimate: &Estimate) -> String {
    let end = |end: Option<f64>| end.map_or("open".to_string(), |x| format!("{x:.4e}"));
    let mut text = format!(
        "{} to {}, {}",
        end(estimate.low),
        end(estimate.high),
        estimate.verdict.name()
    );
    if let Some(advice) = &estimate.advice {
        text += &format!("; {advice}");
    }
    text
}

fn one_line(text: &str) -> String {
    text.chars()
        .map(|c| if c.is_control() { ' ' } else { c })
        .collect()
}
