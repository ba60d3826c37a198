//! Draws reports in headless Chromium: an example that is used like by a reader, and a diagnosis.
//!
//! Skipped, loudly, where there is no Chromium. With `BRISTLE_KEEP_REPORT=dir` the pages and their
//! pictures stay in folders of `dir` to be looked at.

use std::f64::consts::TAU;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

use bristle_gap::axis_file::EffectEntry;
use bristle_gap::believed::Noise;
use bristle_gap::diagnose::{Context, Options, diagnose, report, reproduced};
use bristle_gap::experiments::Named;
use bristle_gap::report::{Plot, Report, Table};
use bristle_gap::simulate::{Input, simulate};
use bristle_gap::{AxisFile, Believed};
use bristle_plant::effect::ALL;

#[test]
fn the_plots_draw_and_zoom() {
    let test = include_str!("report_selftest.js");
    let Some(dom) = drawn("example", &example(), test) else {
        return;
    };
    assert_eq!(dom.matches("<canvas").count(), 3, "a canvas for each plot");
    assert_eq!(dom.matches("role=\"img\"").count(), 3);
    assert_eq!(attribute(&dom, "data-selftest"), Some("passed"));
}

#[test]
fn a_diagnosis_draws() {
    let page = diagnosis();
    let html = page.to_html();
    for heading in [
        "Budget of the gap",
        "Where it lies",
        "What explains it",
        "Fitted parameters",
        "What these logs can tell apart",
        "Next experiment",
        "Before and after",
        "Logs and axis file",
    ] {
        assert!(html.contains(&format!("<h2>{heading}</h2>")), "{heading}");
    }
    let Some(dom) = drawn("diagnosis", &page, "") else {
        return;
    };
    // Position, speed, time, two spectra; effort and rest of the one log.
    assert_eq!(dom.matches("<canvas").count(), 7);
    assert_eq!(dom.matches("class=\"bars\"").count(), 2);
}

/// The page after its script has run, without an error in it; none where there is no browser, said loudly.
fn drawn(name: &str, report: &Report, test: &str) -> Option<String> {
    let Some(chromium) = find_chromium() else {
        // Past the macros, whose output a passing test swallows.
        let _ = writeln!(
            std::io::stderr(),
            "SKIPPED: no chromium on PATH; the {name} report was not drawn in a browser"
        );
        return None;
    };
    let (dir, keep) = match std::env::var_os("BRISTLE_KEEP_REPORT") {
        Some(dir) => (PathBuf::from(dir).join(name), true),
        None => {
            let own = format!("bristle-report-{name}-{}", std::process::id());
            (std::env::temp_dir().join(own), false)
        }
    };
    std::fs::create_dir_all(&dir).unwrap();
    let page = report.to_html();
    std::fs::write(dir.join("report.html"), &page).unwrap();
    let tested = page.replace("</body>", &format!("<script>{test}</script></body>"));
    std::fs::write(dir.join("selftest.html"), tested).unwrap();

    let browser = Browser { chromium, dir };
    let dom = browser.run("selftest.html", &["--dump-dom"]);
    assert_eq!(attribute(&dom, "data-error"), None, "error in the page");
    if keep {
        browser.picture("light.png", 1200, &[]);
        browser.picture("phone.png", 500, &[]);
        let dark = "--blink-settings=preferredColorScheme=0";
        browser.picture("dark.png", 1200, &[dark]);
        let pdf = format!("--print-to-pdf={}", browser.dir.join("print.pdf").display());
        browser.run("report.html", &[dark, "--no-pdf-header-footer", &pdf]);
    } else {
        std::fs::remove_dir_all(&browser.dir).unwrap();
    }
    Some(dom)
}

/// The diagnosis of a virtual axis with cogging that its axis file does not know of.
fn diagnosis() -> Report {
    let path = Path::new("axis.toml");
    let text = "[axis]\ninertia_kg_m2 = 1e-4\ncounts_per_rev = 65536\n[friction]\ncoulomb_nm = 0.02\n\
        stiffness_nm_rad = 20\ndamping_nm_s_rad = 0.02\nviscous_nm_s_rad = 0.001\n[observer]\nrate_hz = 2000\n";
    let axis = AxisFile::parse(text, path).unwrap();
    let believed = Believed::new(&axis, path).unwrap();
    let mut real = believed.clone();
    let values = [("amplitude_nm", 0.004), ("order_per_rev", 12.0)];
    real.effects.push(EffectEntry {
        id: "actuator.cogging".to_string(),
        parameters: values.map(|(name, x)| (name.to_string(), x)).to_vec(),
    });
    let noise = Noise {
        torque_nm: 2e-4,
        position_rad: 0.0,
    };
    let input = Input::Experiment(Named::Reversals, 6.0);
    let log = simulate(&input, &axis, &real, noise, 1, |_| ())
        .unwrap()
        .log(real.unit, Path::new("reversals"));
    let options = Options {
        catalogue: ALL
            .iter()
            .filter(|entry| ["actuator.cogging", "actuator.lag"].contains(&entry.id))
            .collect(),
    };
    let mut outcome = diagnose(&[log], &axis, &believed, &options, &|_| ()).unwrap();
    outcome.diagnosis.reproduced = reproduced(&outcome).unwrap();
    let context = Context {
        axis: "axis.toml".to_string(),
        facts: vec![("version".to_string(), "test".to_string())],
        hygiene: believed.assumed.clone(),
    };
    report(&outcome, &context)
}

/// The value of the first attribute `name` in the page.
fn attribute<'a>(dom: &'a str, name: &str) -> Option<&'a str> {
    let (_, rest) = dom.split_once(&format!(" {name}=\""))?;
    rest.split('"').next()
}

struct Browser {
    chromium: PathBuf,
    dir: PathBuf,
}

impl Browser {
    fn run(&self, page: &str, args: &[&str]) -> String {
        let dir = self.dir.canonicalize().unwrap();
        let output = Command::new(&self.chromium)
            .args(["--headless", "--no-sandbox", "--disable-gpu"])
            .args(["--disable-dev-shm-usage", "--virtual-time-budget=20000"])
            // A profile of its own: another Chromium of the same user must not take over.
            .arg(format!("--user-data-dir={}", dir.join("profile").display()))
            .args(args)
            .arg(format!("file://{}", dir.join(page).display()))
            .output()
            .unwrap();
        let text = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{text}");
        String::from_utf8_lossy(&output.stdout).into_owned()
    }

    fn picture(&self, name: &str, width: u32, args: &[&str]) {
        let shot = format!("--screenshot={}", self.dir.join(name).display());
        let size = format!("--window-size={width},2300");
        let all: Vec<&str> = args.iter().copied().chain([&*shot, &*size]).collect();
        self.run("report.html", &all);
    }
}

fn find_chromium() -> Option<PathBuf> {
    let path = std::env::var_os("PATH")?;
    let names = ["chromium", "chromium-browser", "google-chrome", "chrome"];
    std::env::split_paths(&path)
        .flat_map(|dir| names.map(|name| dir.join(name)))
        .find(|file| file.is_file())
}

/// Two time plots, one of them long and with a gap, a loop and a table.
fn example() -> Report {
    let n = 60_000;
    let t: Vec<f64> = (0..n).map(|i| f64::from(i) * 2e-4).collect();
    let velocity: Vec<f64> = t.iter().map(|t| 0.8 * (TAU * 0.25 * t).sin()).collect();
    let mut noise = 1_u32;
    let mut measured: Vec<f64> = velocity
        .iter()
        .map(|v| {
            noise = noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            v + 0.03 * (f64::from(noise >> 8) / f64::from(1 << 24) - 0.5)
        })
        .collect();
    measured[31_000..33_000].fill(f64::NAN);
    let friction: Vec<f64> = velocity.iter().map(|v| stribeck(*v)).collect();
    let model: Vec<f64> = velocity.iter().map(|v| stribeck(*v) * 0.97).collect();

    // Presliding: bristle deflection of some ten micrometres.
    let phase: Vec<f64> = (0..2_000).map(|i| TAU * f64::from(i) / 999.5).collect();
    let z = |lag: f64| -> Vec<f64> { phase.iter().map(|p| 4e-5 * (p - lag).sin()).collect() };
    let force = |size: f64| -> Vec<f64> { phase.iter().map(|p| size * p.sin()).collect() };

    Report::new("Axis X1: friction identified from axis_x1.csv")
        .lead(
            "The LuGre model explains 98.7 % of the friction; the fitted parameters lie within \
             3 % of the axis file.",
        )
        .heading("Run")
        .paragraph("A sine of 0.25 Hz in velocity. The encoder dropped out from 6.2 s to 6.6 s.")
        .plot(
            Plot::over("time", "s", &t)
                .title("Velocity")
                .y("velocity", "rad/s")
                .line("commanded", &velocity)
                .line("measured", &measured),
        )
        .plot(
            Plot::over("time", "s", &t)
                .title("Friction torque")
                .y("torque", "Nm")
                .line("true", &friction)
                .line("model", &model),
        )
        .heading("Presliding")
        .plot(
            Plot::xy("bristle deflection", "m")
                .title("Hysteresis loops")
                .y("torque", "Nm")
                .line("small", &z(0.3), &force(0.35))
                .line("large", &z(0.5), &force(0.6))
                .points("peaks", &[-3.8e-5, 3.8e-5], &[-0.6, 0.6])
                .note("Torque against deflection, two cycles each."),
        )
        .heading("Parameters")
        .table(
            Table::new(
                "Fitted against axis file",
                &["name", "unit", "fitted", "file", "error"],
            )
            .row(&["sigma_0 (stiffness)", "Nm/rad", "15210", "15000", "1.4 %"])
            .row(&["F_c (Coulomb)", "Nm", "0.512", "0.500", "2.4 %"])
            .row(&["F_s (static)", "Nm", "0.748", "0.750", "-0.3 %"])
            .row(&["v_s (Stribeck)", "rad/s", "0.0507", "0.0500", "1.4 %"]),
        )
        .heading("Provenance")
        .facts(&[
            ("command", "bristle identify axis_x1.csv --seed 7"),
            ("version", "bristle 0.1.0 (013bf90)"),
            ("seed", "7"),
        ])
}

fn stribeck(v: f64) -> f64 {
    (0.5 + 0.25 * (-(v / 0.05).powi(2)).exp()) * (v / 0.002).tanh() + 0.1 * v
}
