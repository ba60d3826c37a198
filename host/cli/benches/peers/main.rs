//! The joint fit against a SciPy implementation of the same cost on the same data, in one run: `cargo xtask peers`.
//!
//! A minute of logs at 10 kHz is simulated and identified by the command. Then one fit, from the start that identification
//! chose, is made here and by `peer.py` in a virtual environment of its own, from files that hold the same motion and
//! weights. The figures go to `docs/peers.md`.

use bristle_gap::axis_file::FrictionModel;
use bristle_gap::identify::joint::{Data, Joint, Search, Usable, Weighting, prepare};
use bristle_gap::inverse::{self, Free, Owner, STANDS_STILL};
use bristle_gap::output::write_atomically;
use bristle_gap::{AxisFile, Log};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

type Failure = Box<dyn std::error::Error>;

/// The minute: experiments and their lengths, s.
const LOGS: [(&str, u32); 4] = [
    ("ladder", 16),
    ("sine", 14),
    ("dahl-ramp", 16),
    ("break-away", 14),
];
/// Torque noise, N m rms: a hundredth of Coulomb friction.
const NOISE_NM: &str = "0.0002";
/// The same cost, but for the order of sums.
const SAME: f64 = 1e-6;
/// What is asked for.
const MOST_S: f64 = 10.0;
const MOST_MB: f64 = 300.0;
const LEAST_RATIO: f64 = 20.0;

fn main() -> Result<(), Failure> {
    let folder = tempfile::tempdir()?;
    let axis_path = folder.path().join("axis.toml");
    std::fs::write(&axis_path, axis())?;
    let logs = simulate(folder.path(), &axis_path)?;
    let whole = identify(folder.path(), &axis_path, &logs)?;
    let task = folder.path().join("task");
    let own = fit(&axis_path, &logs, &task)?;
    let python = match python() {
        Ok(python) => python,
        Err(why) => {
            eprintln!(
                "SKIPPED: {why}; install python3 with venv, and see that pip reaches its registry"
            );
            return Ok(());
        }
    };
    eprintln!("fitting with SciPy, minutes");
    let peer = Command::new(python)
        .arg(here().join("peer.py"))
        .arg(&task)
        .stderr(Stdio::inherit())
        .output()?;
    let peer: Value = serde_json::from_slice(&peer.stdout)?;
    report(&whole, &own, &peer)
}

fn here() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("benches/peers")
}

/// The bench axis with an encoder that shows the bristles.
fn axis() -> String {
    include_str!("../../../../axes/bench.toml")
        .replace("counts_per_rev = 16384", "counts_per_rev = 262144")
}

fn simulate(folder: &Path, axis: &Path) -> Result<Vec<PathBuf>, Failure> {
    LOGS.iter()
        .map(|(name, seconds)| {
            let log = folder.join(format!("{name}.csv"));
            let done = Command::new(env!("CARGO_BIN_EXE_bristle"))
                .args([
                    "simulate",
                    "--experiment",
                    name,
                    "--torque-noise-nm",
                    NOISE_NM,
                ])
                .args(["--seconds", &seconds.to_string()])
                .arg("--axis")
                .arg(axis)
                .arg("--out")
                .arg(&log)
                .stdout(Stdio::null())
                .status()?;
            if done.success() {
                Ok(log)
            } else {
                Err(format!("simulate {name} failed").into())
            }
        })
        .collect()
}

/// What the whole command took. Linux keeps the last two; elsewhere they are zero.
struct Whole {
    wall_s: f64,
    cpu_s: f64,
    most_mb: f64,
}

fn identify(folder: &Path, axis: &Path, logs: &[PathBuf]) -> Result<Whole, Failure> {
    let begin = Instant::now();
    let mut child = Command::new(env!("CARGO_BIN_EXE_bristle"))
        .arg("identify")
        .arg("--axis")
        .arg(axis)
        .arg("--out")
        .arg(folder.join("fitted.toml"))
        .args(logs)
        .stdout(Stdio::null())
        .spawn()?;
    let (mut most_mb, mut cpu_s) = (0.0_f64, 0.0_f64);
    loop {
        let status = std::fs::read_to_string(format!("/proc/{}/status", child.id()));
        let peak = status.ok().and_then(|text| {
            let line = text.lines().find(|line| line.starts_with("VmHWM:"))?;
            line.split_whitespace().nth(1)?.parse::<f64>().ok()
        });
        most_mb = most_mb.max(peak.unwrap_or(0.0) / 1024.0);
        let stat = std::fs::read_to_string(format!("/proc/{}/stat", child.id()));
        // User and system time, the 12th and 13th word after the name, in hundredths of a second.
        let ticks = stat.ok().and_then(|text| {
            let words = text.rsplit_once(')')?.1.split_whitespace().skip(11).take(2);
            words
                .map(|word| word.parse::<f64>().ok())
                .sum::<Option<f64>>()
        });
        cpu_s = cpu_s.max(ticks.unwrap_or(0.0) / 100.0);
        if let Some(status) = child.try_wait()? {
            let wall_s = begin.elapsed().as_secs_f64();
            return if status.success() {
                Ok(Whole {
                    wall_s,
                    cpu_s,
                    most_mb,
                })
            } else {
                Err("identify failed".into())
            };
        }
        std::thread::sleep(Duration::from_millis(10));
    }
}

struct Own {
    seconds: f64,
    cost_at_start: f64,
    cost: f64,
    values: Vec<(String, f64)>,
    nodes: usize,
}

/// The fit, and the task for the peer.
fn fit(axis_path: &Path, logs: &[PathBuf], task: &Path) -> Result<Own, Failure> {
    let fail = |error: bristle_gap::InputError| error.to_string();
    let axis = AxisFile::read(axis_path).map_err(fail)?;
    let usable = logs
        .iter()
        .map(|path| Ok(Usable::from(Log::read(path).map_err(fail)?)))
        .collect::<Result<Vec<_>, Failure>>()?;
    let (file, records) = prepare(&usable, &axis, axis_path).map_err(fail)?;
    let mut data = Data::new(records, &file, axis_path, Weighting::Noise).map_err(fail)?;
    let kind = FrictionModel::ElastoPlastic;
    let joint = Joint::new(&data, &file, axis_path, kind, &[], Search::Near).map_err(fail)?;
    data.weigh(&joint);
    let model = &joint.model;
    let start = model.start();
    let standing = inverse::fit_at(model, &data.records, &data.weights, start.clone());
    let mut seconds = f64::INFINITY;
    let mut fitted = None;
    // The first one also wakes the threads.
    for _ in 0..3 {
        let begin = Instant::now();
        let fit = inverse::fit(model, &data.records, &data.weights, start.clone()).map_err(fail)?;
        seconds = seconds.min(begin.elapsed().as_secs_f64());
        fitted = Some(fit);
    }
    let fitted = fitted.ok_or("no fit")?;
    write_task(task, &data, &model.free)?;
    Ok(Own {
        seconds,
        cost_at_start: standing.map_err(fail)?.cost,
        cost: fitted.cost,
        values: model
            .free
            .iter()
            .zip(model.values(&fitted.at))
            .map(|(free, value)| (name(free), value))
            .collect(),
        nodes: data.weights.len(),
    })
}

fn name(free: &Free) -> String {
    match free.owner {
        Owner::Own(_) => free.name.clone(),
        _ => "offset".to_string(),
    }
}

fn write_task(folder: &Path, data: &Data, free: &[Free]) -> Result<(), Failure> {
    std::fs::create_dir_all(folder)?;
    let array = |name: &str, values: &[f64]| {
        let bytes: Vec<u8> = values.iter().flat_map(|x| x.to_le_bytes()).collect();
        std::fs::write(folder.join(name), bytes)
    };
    array("weights.f64", &data.weights)?;
    for (place, record) in data.records.iter().enumerate() {
        let [stretch] = &record.stretches[..] else {
            return Err("a simulated log has a gap".into());
        };
        for (name, values) in [
            ("effort_nm", &stretch.effort_nm),
            ("position_rad", &stretch.position_rad),
            ("smooth_rad", &stretch.smooth_rad),
            ("velocity_rad_s", &stretch.velocity_rad_s),
        ] {
            array(&format!("{place}-{name}.f64"), values)?;
        }
    }
    let records = data
        .records
        .iter()
        .map(|record| json!({"step_s": record.step_s, "kernel": record.kernel.length}));
    let free = free.iter().map(|free| {
        json!({
            "name": name(free),
            "logarithmic": free.logarithmic,
            "range": free.range,
            "start": free.coordinate(free.start),
            "center": free.center,
            "spread": free.spread,
        })
    });
    let task = json!({
        "tolerance": STANDS_STILL,
        "records": records.collect::<Vec<_>>(),
        "free": free.collect::<Vec<_>>(),
    });
    std::fs::write(folder.join("task.json"), task.to_string())?;
    Ok(())
}

/// The interpreter of a virtual environment with what the peer needs, made where it is missing.
fn python() -> Result<PathBuf, String> {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("peers-venv");
    let python = folder.join("bin/python");
    let run = |command: &mut Command, what: &str| {
        let done = command.stdout(Stdio::null()).status();
        match done {
            Ok(status) if status.success() => Ok(()),
            Ok(status) => Err(format!("{what} failed: {status}")),
            Err(error) => Err(format!("{what} failed: {error}")),
        }
    };
    if !python.exists() {
        let mut make = Command::new("python3");
        run(make.args(["-m", "venv"]).arg(&folder), "python3 -m venv")?;
    }
    let mut install = Command::new(&python);
    install
        .args([
            "-m",
            "pip",
            "install",
            "--quiet",
            "--disable-pip-version-check",
            "-r",
        ])
        .arg(here().join("requirements.txt"));
    run(&mut install, "pip install")?;
    Ok(python)
}

fn report(whole: &Whole, own: &Own, peer: &Value) -> Result<(), Failure> {
    let of = |name: &str| {
        peer[name]
            .as_f64()
            .ok_or(format!("the peer gave no {name}"))
    };
    let (seconds, cost, at_start) = (of("seconds")?, of("cost")?, of("cost_at_start")?);
    if (at_start / own.cost_at_start - 1.0).abs() > SAME {
        return Err(format!(
            "peer.py computes another cost: {at_start} at the start, here {}",
            own.cost_at_start
        )
        .into());
    }
    let ratio = seconds / own.seconds;
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let mut text = format!(
        "# The joint fit against SciPy\n\nWritten by `cargo xtask peers`, on {cores} cores. 60 s of logs at 10 kHz of a \
         virtual axis, elasto-plastic model with offset and skew, {} parameters, {} nodes.\n\n",
        own.values.len(),
        own.nodes
    );
    text += "| | wall time, s | limit | processor time, s | peak memory, MB | limit |\n|---|---:|---:|---:|---:|---:|\n";
    text += &format!(
        "| `bristle identify`, the whole command | {:.2} | {MOST_S} | {:.2} | {:.0} | {MOST_MB} |\n\n",
        whole.wall_s, whole.cpu_s, whole.most_mb
    );
    text +=
        "One fit of the same cost from the same start (weighted effort left over, and priors):\n\n";
    text += "| | wall time, s | cost at the start | cost | peak memory, MB |\n|---|---:|---:|---:|---:|\n";
    text += &format!(
        "| here, of three the fastest | {:.3} | {:.3} | {:.5} | |\n",
        own.seconds, own.cost_at_start, own.cost
    );
    text += &format!(
        "| SciPy | {seconds:.2} | {at_start:.3} | {cost:.5} | {:.0} |\n\n",
        of("most_mb")?
    );
    text += &format!(
        "{ratio:.0} times as fast (asked for: {LEAST_RATIO}). SciPy evaluated {} times and made {} Jacobians.\n\n",
        of("evaluations")?,
        of("jacobians")?
    );
    text += "| parameter | here | SciPy |\n|---|---:|---:|\n";
    for (name, value) in &own.values {
        let other = peer["values"][name].as_f64().unwrap_or(f64::NAN);
        text += &format!("| `{name}` | {value:.6e} | {other:.6e} |\n");
    }
    text += "\nThe peer (`host/cli/benches/peers/peer.py`) is NumPy and SciPy's MINPACK, the algorithm that the crate here \
             carries over, with the same tolerances. What does not depend on the moment before is vectorised over time; the \
             deflection of the bristles does, and is a loop over time in Python whose every turn moves all records and \
             all perturbed parameters of a Jacobian on at once. No compiler for Python takes part.\n";
    print!("{text}");
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/peers.md");
    write_atomically(&page, |writer| writer.write_all(text.as_bytes()))
        .map_err(|e| e.to_string())?;
    let failed: Vec<&str> = [
        (whole.wall_s > MOST_S, "time of the command"),
        (whole.most_mb > MOST_MB, "memory of the command"),
        (ratio < LEAST_RATIO, "ratio to SciPy"),
        // Both stop where a step gains less than the tolerance.
        (own.cost > cost * (1.0 + STANDS_STILL), "cost"),
    ]
    .into_iter()
    .filter_map(|(fails, what)| fails.then_some(what))
    .collect();
    if failed.is_empty() {
        return Ok(());
    }
    Err(format!("not met: {}", failed.join(", ")).into())
}
