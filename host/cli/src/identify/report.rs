//! The report: Stribeck map and fit, presliding, Dahl loop, what is left over, intervals, correlation.

use super::steps::{Found, Step};
use crate::output::short;
use bristle_gap::identify::joint::{Errors, Identified, Provenance, Usable};
use bristle_gap::report::{Plot, Report, Table};
use bristle_gap::{AxisFile, Unit};
use std::f64::consts::TAU;

/// Points of a drawn curve.
const POINTS: usize = 400;

/// The whole report.
pub fn report(
    identified: &Identified,
    held_out: &[Errors],
    steps: &[Step],
    provenance: &Provenance,
    logs: &[Usable],
    axis: &AxisFile,
    notes: &[String],
) -> Report {
    let unit = axis.unit;
    let mut report = Report::new("Identification").lead(&super::sentence(identified));
    for note in notes {
        report = report.paragraph(note);
    }
    report = report
        .table(super::estimates(identified))
        .table(super::errors(&identified.errors, held_out, unit));
    if !identified.compared.is_empty() {
        report = report.table(super::compared(identified, unit));
    }
    report = report
        .heading("Stribeck map")
        .plot(stribeck(identified, steps, unit));
    report = presliding(report, identified, steps, unit);
    report = dahl(report, identified, steps, unit);
    report = rest(report.heading("What is left over"), identified, unit);
    report = report
        .table(correlation(identified))
        .table(step_table(steps, unit));
    let mut facts: Vec<(&str, &str)> = vec![
        ("command", &provenance.command),
        ("version", &provenance.version),
        ("date", &provenance.date),
    ];
    for (name, hash) in &provenance.logs {
        facts.push((name, hash));
    }
    let samples: usize = logs.iter().map(|usable| usable.log.len()).sum();
    let samples = samples.to_string();
    facts.push(("samples", &samples));
    report.facts(&facts)
}

fn speed(unit: Unit) -> String {
    format!("{}/s", unit.position())
}

fn stribeck(identified: &Identified, steps: &[Step], unit: Unit) -> Plot {
    let believed = identified.joint.believed();
    let top = identified.data.scale.top_speed_rad_s;
    let velocities: Vec<f64> = (0..=POINTS)
        .map(|i| top * (2.0 * i as f64 / POINTS as f64 - 1.0))
        .map(|v| v.abs().powf(1.5).copysign(v) / top.sqrt().max(f64::MIN_POSITIVE))
        .collect();
    let mut plot = Plot::xy("velocity", &speed(unit))
        .title("Friction over constant speed")
        .y("friction", unit.effort());
    if let Ok(contact) = believed.contact(believed.model) {
        let level: Vec<f64> = velocities
            .iter()
            .map(|&v| contact.steady_state_nm(v))
            .collect();
        plot = plot.line("joint fit", &velocities, &level);
    }
    for step in steps {
        if let Some(Found::Steady(map, fit)) = &step.found {
            let offset = fit.best().offset_nm;
            let v: Vec<f64> = map.points.iter().map(|p| p.velocity_rad_s).collect();
            let f: Vec<f64> = map.points.iter().map(|p| p.torque_nm - offset).collect();
            plot = plot.points(&format!("{}: constant speed", step.log), &v, &f);
            let curve: Vec<f64> = velocities
                .iter()
                .map(|&v| fit.best().torque_nm(v) - offset)
                .collect();
            plot = plot.line(
                &format!("{}: steady-state fit", step.log),
                &velocities,
                &curve,
            );
        }
    }
    plot.into()
}

/// Of J, sigma1 + sigma2 and sigma0 in stick: gain and phase of position over effort, and the step.
struct Stick {
    name: String,
    inertia: f64,
    damping: f64,
    stiffness: f64,
}

fn presliding(report: Report, identified: &Identified, steps: &[Step], unit: Unit) -> Report {
    let mut sticks = Vec::new();
    let believed = identified.joint.believed();
    if believed.model.has_bristles() {
        sticks.push(Stick {
            name: "joint fit".to_string(),
            inertia: believed.whole_inertia_kg_m2(),
            damping: believed.damping_nm_s_rad + believed.viscous_nm_s_rad,
            stiffness: believed.stiffness_nm_rad,
        });
    }
    for step in steps {
        if let Some(Found::Presliding(found)) = &step.found {
            sticks.push(Stick {
                name: format!("{}: instrumental variables", step.log),
                inertia: found.continuous.inertia_kg_m2(),
                damping: found.continuous.damping_nm_s_rad(),
                stiffness: found.continuous.stiffness_nm_rad(),
            });
        }
    }
    let Some(first) = sticks.first() else {
        return report
            .paragraph("No presliding: neither the model nor a log shows the axis in stick.");
    };
    let natural = (first.stiffness / first.inertia).sqrt();
    let frequencies: Vec<f64> = (0..=POINTS)
        .map(|i| natural / TAU * 10.0_f64.powf(4.0 * i as f64 / POINTS as f64 - 2.0))
        .collect();
    let decades: Vec<f64> = frequencies.iter().map(|f| f.log10()).collect();
    let slowest = sticks
        .iter()
        .map(|s| 2.0 * s.damping / s.stiffness + 10.0 / (s.stiffness / s.inertia).sqrt())
        .fold(0.0, f64::max);
    let times: Vec<f64> = (0..=POINTS)
        .map(|i| slowest * i as f64 / POINTS as f64)
        .collect();
    let per = format!("dB re {}/{}", unit.position(), unit.effort());
    let mut gain = Plot::over("log10 frequency", "log10 Hz", &decades)
        .title("Presliding: gain")
        .y("gain", &per);
    let mut phase = Plot::over("log10 frequency", "log10 Hz", &decades)
        .title("Presliding: phase")
        .y("phase", "deg");
    let mut step = Plot::over("time since the step", "s", &times)
        .title("Presliding: step of effort")
        .y(
            "position",
            &format!("{}/{}", unit.position(), unit.effort()),
        );
    for stick in &sticks {
        let response: Vec<(f64, f64)> = frequencies
            .iter()
            .map(|f| {
                let w = TAU * f;
                (stick.stiffness - stick.inertia * w * w, stick.damping * w)
            })
            .collect();
        let gains: Vec<f64> = response
            .iter()
            .map(|(a, b)| -20.0 * a.hypot(*b).log10())
            .collect();
        let phases: Vec<f64> = response
            .iter()
            .map(|(a, b)| -b.atan2(*a).to_degrees())
            .collect();
        gain = gain.line(&stick.name, &gains);
        phase = phase.line(&stick.name, &phases);
        step = step.line(&stick.name, &stick.step(&times));
    }
    report
        .heading("Presliding")
        .plot(gain)
        .plot(phase)
        .plot(step)
}

impl Stick {
    /// Answer to a step of one, stepped finely and implicitly: poles may be real or not.
    fn step(&self, times: &[f64]) -> Vec<f64> {
        const FINE: usize = 50;
        let dt = (times[1] - times[0]) / FINE as f64;
        let (mut q, mut v) = (0.0, 0.0);
        let mut out = vec![0.0];
        for _ in 1..times.len() {
            for _ in 0..FINE {
                v = (v + dt / self.inertia * (1.0 - self.stiffness * q))
                    / (1.0 + dt / self.inertia * (self.damping + dt * self.stiffness));
                q += dt * v;
            }
            out.push(q);
        }
        out
    }
}

fn dahl(report: Report, identified: &Identified, steps: &[Step], unit: Unit) -> Report {
    let believed = identified.joint.believed();
    let mut plot = Plot::xy("position", unit.position())
        .title("Slow loop of friction over position")
        .y("friction", unit.effort());
    let mut any = false;
    if believed.model.has_bristles()
        && let Ok(mut contact) = believed.contact(believed.model)
    {
        // Three z_ss either way, slow against bristles and Stribeck velocity.
        let reach = 3.0 * believed.coulomb_nm / believed.stiffness_nm_rad;
        let slow = 0.01 * believed.stribeck_velocity_rad_s;
        let steps = 1000;
        let (mut at, mut loop_q, mut loop_f) = (0.0, Vec::new(), Vec::new());
        for (turns, direction) in [1.0, -1.0, 1.0].into_iter().enumerate() {
            let way = if turns == 0 { reach } else { 2.0 * reach };
            let dt_s = way / slow / f64::from(steps);
            for _ in 0..steps {
                let friction = contact.step(bristle_core::friction::Motion {
                    velocity_rad_s: direction * slow,
                    applied_nm: direction * believed.stiction_nm,
                    dt_s,
                });
                at += direction * slow * dt_s;
                loop_q.push(at);
                loop_f.push(friction);
            }
        }
        plot = plot.line("joint fit", &loop_q, &loop_f);
        any = true;
    }
    for step in steps {
        if let Some(Found::Dahl(found)) = &step.found {
            let offset = found.instrumental[2];
            for branch in &found.branches {
                let origin = branch.position_rad.first().copied().unwrap_or(0.0);
                let q: Vec<f64> = branch.position_rad.iter().map(|q| q - origin).collect();
                let f: Vec<f64> = branch.torque_nm.iter().map(|f| f - offset).collect();
                plot = plot.points(&step.log, &q, &f);
            }
            any = true;
        }
    }
    if any {
        report.heading("Dahl loop").plot(plot)
    } else {
        report.paragraph("No Dahl loop: neither the model nor a log shows one.")
    }
}

fn rest(mut report: Report, identified: &Identified, unit: Unit) -> Report {
    let data = &identified.data;
    for (place, record) in data.records.iter().enumerate() {
        let (mut times, mut rests, mut velocities) = (Vec::new(), Vec::new(), Vec::new());
        for (node, r) in data.nodes.iter().zip(&identified.joint.fit.left_over) {
            if node.record == place {
                let stretch = &record.stretches[node.stretch];
                times.push(stretch.start_s + node.sample as f64 * record.step_s);
                rests.push(*r);
                velocities.push(stretch.velocity_rad_s[node.sample]);
            }
        }
        report = report
            .plot(
                Plot::over("time", "s", &times)
                    .title(&format!("{}: effort left over", record.name))
                    .y("effort", unit.effort())
                    .line("measured less model", &rests),
            )
            .plot(
                Plot::xy("velocity", &speed(unit))
                    .title(&format!("{}: effort left over, over velocity", record.name))
                    .y("effort", unit.effort())
                    .points("measured less model", &velocities, &rests),
            );
    }
    report
}

fn correlation(identified: &Identified) -> Table {
    let names: Vec<&str> = identified
        .estimates
        .iter()
        .map(|e| e.name.as_str())
        .collect();
    let mut header = vec![""];
    header.extend(&names);
    let mut table = Table::new("Correlation of the estimates", &header);
    for (name, row) in names.iter().zip(&identified.correlation) {
        let mut cells = vec![(*name).to_string()];
        cells.extend(row.iter().map(|c| format!("{c:.2}")));
        table = table.row(&cells);
    }
    table
}

fn step_table(steps: &[Step], unit: Unit) -> Table {
    let mut table = Table::new(
        "The classical steps, each on the log made for it",
        &["step", "log", "parameter", "value", "from", "to", "verdict"],
    );
    for step in steps {
        if let Some(why) = &step.refused {
            table = table.row(&[step.name, &step.log, "-", "", "", "", why]);
        }
        for estimate in &step.estimates {
            table = table.row(&[
                step.name.to_string(),
                step.log.clone(),
                estimate.parameter.name(unit).to_string(),
                short(estimate.value),
                short(estimate.low),
                short(estimate.high),
                estimate.verdict.name().to_string(),
            ]);
        }
    }
    table
}
