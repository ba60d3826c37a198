//! The diagnosis as a blind check asks it: files in, the contract's JSON out, nothing else.

use bristle_gap::{AxisFile, InputError, Log};
use serde_json::Value;
use std::process::Command;

/// What the diagnosis says of an axis and its logs.
///
/// # Errors
/// What is wrong with the files, in the words of the diagnosis.
pub fn answer(axis: &AxisFile, logs: &[Log]) -> Result<Value, InputError> {
    let failed = |message: String| {
        InputError::new(
            "bristle diagnose",
            message,
            "run it by hand on the same files",
        )
    };
    let folder = tempfile::tempdir().map_err(|error| failed(error.to_string()))?;
    let (axis_path, json) = (
        folder.path().join("axis.toml"),
        folder.path().join("result.json"),
    );
    axis.write(&axis_path)?;
    let program = std::env::current_exe().map_err(|error| failed(error.to_string()))?;
    let output = Command::new(program)
        .arg("diagnose")
        .arg("--axis")
        .arg(&axis_path)
        .args(logs.iter().map(|log| &log.file))
        .arg("--json")
        .arg(&json)
        .output()
        .map_err(|error| failed(error.to_string()))?;
    if !output.status.success() {
        let said = String::from_utf8_lossy(&output.stderr);
        return Err(failed(
            said.lines().next().unwrap_or("it said nothing").to_owned(),
        ));
    }
    let text = std::fs::read_to_string(&json).map_err(|error| failed(error.to_string()))?;
    serde_json::from_str(&text).map_err(|error| failed(format!("its JSON cannot be read: {error}")))
}
