//! The diagnosis as a page to read: verdict, budget of the gap, where it lies, what explains it, before and after.

use super::closed::closed_over;
use super::held_out::spreads;
use super::hypothesis::Hypothesis;
use super::maps::{Map, maps};
use super::regime::{Node, Regime};
use super::tried::Search;
use super::{Closed, Kind, Outcome};
use crate::inverse::{Own, Owner};
use crate::report::{Bars, Plot, Report, Table, short};
use bristle_plant::Unit;

/// Candidates and regions that a table shows.
const ROWS: usize = 12;

/// What the page says beside the diagnosis.
#[derive(Clone, Debug, Default)]
pub struct Context {
    /// Name of the axis file.
    pub axis: String,
    /// Name and value: command, version, files.
    pub facts: Vec<(String, String)>,
    /// What logs and axis file lack, a line each.
    pub hygiene: Vec<String>,
}

/// The page.
pub fn report(outcome: &Outcome, context: &Context) -> Report {
    let diagnosis = &outcome.diagnosis;
    // Where nothing is named, the most probable effect shows what it would do.
    let shown = match outcome.verdict.named.first() {
        Some(&place) => Some(&outcome.verdict.ranked[place].0),
        None => outcome.verdict.ranked.first().map(|(best, _)| best),
    };
    let mut page = Report::new(&format!("Gap of {}", context.axis)).lead(&diagnosis.sentence());
    page = budget(page, outcome, shown);
    if let Some(shown) = shown {
        page = located(page, outcome, shown);
    }
    page = ranking(page, outcome);
    page = parameters(page, outcome, shown);
    page = page.heading("What these logs can tell apart");
    if diagnosis.confusable.is_empty() {
        page =
            page.paragraph("Every two of the fitted effects leave different traces in these logs.");
    }
    for group in &diagnosis.confusable {
        page = page.paragraph(&format!("Alike in these logs: {}.", group.join(" and ")));
    }
    page = page.heading("Next experiment");
    page = match &diagnosis.next_experiment {
        Some(next) => page.paragraph(&next.why).paragraph(&next.what),
        None if diagnosis.verdict.kind == Kind::Unknown => {
            page.paragraph("No experiment can be chosen while no candidate explains the gap.")
        }
        None => page.paragraph("None is needed to decide this."),
    };
    if let Some(shown) = shown {
        page = overlays(page, outcome, shown);
    }
    page = page.heading("Logs and axis file");
    let lines = context.hygiene.iter().chain(&diagnosis.notes);
    for line in lines {
        page = page.paragraph(line);
    }
    page = page.table(records(&outcome.search));
    let facts: Vec<(&str, &str)> = context
        .facts
        .iter()
        .map(|(name, value)| (name.as_str(), value.as_str()))
        .collect();
    page.facts(&facts)
}

fn interval(closed: &Closed) -> String {
    format!(
        "{:.2} ({:.2} to {:.2})",
        closed.value, closed.low, closed.high
    )
}

fn named(shown: Option<&Hypothesis>) -> String {
    shown.map_or_else(|| "no effect".to_string(), |h| h.ids().join(" + "))
}

/// Rms of the given simulator over the nodes that `keep` says.
fn as_given(search: &Search, keep: &dyn Fn(&Node) -> bool) -> f64 {
    crate::signal::rms(
        search
            .nodes
            .iter()
            .zip(&search.as_given)
            .filter(|(node, _)| !node.excluded && keep(node))
            .map(|(_, rest)| *rest),
    )
}

fn budget(page: Report, outcome: &Outcome, shown: Option<&Hypothesis>) -> Report {
    let search = &outcome.search;
    let unit = search.scale.unit.effort();
    let base = &search.base;
    let moves = |node: &Node| node.regime != Regime::Rest;
    let mut page = page.heading("Budget of the gap");
    let with = format!("with {}", named(shown));
    let of = shown.unwrap_or(base);
    if let Some(part) = closed_over(search, &of.held_out, &moves) {
        let [before, after, floor] = part.rms_nm;
        let value = |x: f64| format!("{} {unit}", short(x));
        let given = as_given(search, &moves);
        let mut bars = Bars::new("Effort that is not explained, rms while moving")
            .bar("as given", given, &value(given))
            .bar("parameters refitted", before, &value(before));
        if shown.is_some() {
            bars = bars.bar(&with, after, &value(after));
        }
        if let Some(ceiling) = outcome.diagnosis.gap.ceiling {
            let least = before - ceiling.value * (before - floor.min(before));
            bars = bars.bar("with a smooth black box", least, &value(least));
        }
        bars = bars.bar("floor", floor, &value(floor));
        if let Some(drift) = outcome.diagnosis.gap.drift {
            bars = bars.bar("slow drift", drift, &value(drift));
        }
        page = page.bars(bars);
    }
    let mut table = Table::new(
        &format!("By log and by regime, {unit} rms on data that took no part in the fit"),
        &[
            "part",
            "as given",
            "refitted",
            "with effect",
            "floor",
            "closed",
        ],
    );
    let mut row = |name: &str, keep: &dyn Fn(&Node) -> bool| {
        if let Some(part) = closed_over(search, &of.held_out, keep) {
            let [before, after, floor] = part.rms_nm;
            table.rows.push(vec![
                name.to_string(),
                short(as_given(search, keep)),
                short(before),
                short(after),
                short(floor),
                interval(&part.closed),
            ]);
        }
    };
    row("all while moving", &moves);
    for (place, record) in search.records.iter().enumerate() {
        row(&record.name, &|node| node.record == place && moves(node));
    }
    for regime in Regime::ALL {
        row(regime.name(), &|node| node.regime == regime);
    }
    page = page.table(table);
    let reproduced = &outcome.diagnosis.reproduced;
    if reproduced.is_empty() {
        return page;
    }
    let mut table = Table::new(
        "Integrated on the virtual axis: position error, rms, with the parameters of all data",
        &[
            "view",
            "log",
            "effect",
            "refitted",
            "with effect",
            "unit",
            "closed",
            "",
        ],
    );
    for row in reproduced
        .iter()
        .filter(|row| row.view.starts_with("position"))
    {
        table.rows.push(vec![
            row.view.clone(),
            row.log.clone(),
            row.effect.clone(),
            short(row.before),
            short(row.after),
            row.unit.to_string(),
            format!("{:.2}", row.closed_fraction.value),
            if row.worse { "worse" } else { "" }.to_string(),
        ]);
    }
    page.table(table).paragraph(
        "A window starts anew from the measured motion, and a straight line is taken off its error. A free run \
         integrates every error of effort twice: it shows drift before it shows anything else.",
    )
}

fn located(page: Report, outcome: &Outcome, shown: &Hypothesis) -> Report {
    let search = &outcome.search;
    let unit = search.scale.unit;
    let (effort, position) = (unit.effort(), unit.position());
    let maps = maps(search, shown);
    let after = format!("with {}", shown.ids().join(" + "));
    let mut page = page.heading("Where it lies");
    let mut table = Table::new(
        "Where the gap is denser than the time spent there, by more than chance",
        &["along", "part", "of the gap", "of the time", "by chance"],
    );
    for region in outcome.diagnosis.concentrated().take(ROWS) {
        table = table.row(&[
            region.axis.to_string(),
            region.label.clone(),
            format!("{:.0} %", 100.0 * region.share),
            format!("{:.0} %", 100.0 * region.time_share),
            region.chance(),
        ]);
    }
    page = if table.rows.is_empty() {
        page.paragraph("No part of the motion, the travel or the time holds more of the gap than chance would give it.")
    } else {
        page.table(table).paragraph(
            "Of what the refitted simulator leaves beyond what is open. By chance: the probability that noise would show any \
             such part among all that were looked at. Of frequencies and waves, the time is the share that noise has there.",
        )
    };
    let speed = format!("{position}/s");
    let along = |title: &str, name: &str, symbol: &str, map: &Map| {
        Plot::xy(name, symbol)
            .title(title)
            .y("rest of effort", effort)
            .line("mean, refitted", &map.at, &map.mean[0])
            .line(&format!("mean, {after}"), &map.at, &map.mean[1])
            .line("rms, refitted", &map.at, &map.before)
            .line(&format!("rms, {after}"), &map.at, &map.after)
    };
    let line = |title: &str, name: &str, symbol: &str, map: &Map| {
        Plot::xy(name, symbol)
            .title(title)
            .line("refitted", &map.at, &map.before)
            .line(&after, &map.at, &map.after)
    };
    for (title, name, symbol, map) in [
        ("Against position", "position", position, &maps.position),
        ("Against speed", "velocity", speed.as_str(), &maps.speed),
        (
            "Over time since a log's start",
            "time since start",
            "s",
            &maps.time,
        ),
    ] {
        if !map.at.is_empty() {
            page = page.plot(along(title, name, symbol, map));
        }
    }
    let order = match unit {
        Unit::Rotary => "waves a turn",
        Unit::Linear => "waves a metre",
    };
    page = page.plot(
        line("Spectrum over angle", order, "", &maps.order)
            .y("amplitude", effort)
            .note("Least squares of one wave at a time; an order that the logs pass no whole wave of is left out."),
    );
    if !maps.frequency.at.is_empty() {
        page = page.plot(
            line("Spectrum over time", "frequency", "Hz", &maps.frequency)
                .y("density", &format!("{effort}/sqrt(Hz)")),
        );
    }
    page
}

fn ranking(page: Report, outcome: &Outcome) -> Report {
    let diagnosis = &outcome.diagnosis;
    let unit = diagnosis.gap.unit;
    let others = &diagnosis.others;
    let mut bars = Bars::new("Probability");
    let mut table = Table::new(
        "Candidates, each fitted jointly with the simulator's own parameters",
        &[
            "effect",
            "probability",
            &format!("gap after, {unit}"),
            "closed",
            "gain alone (null), nats",
            "values",
        ],
    );
    for candidate in diagnosis.candidates.iter().take(ROWS) {
        if candidate.probability >= 5e-4 {
            bars = bars.bar(
                &candidate.effect,
                candidate.probability,
                &format!("{:.3}", candidate.probability),
            );
        }
        let values: Vec<String> = candidate
            .parameters
            .iter()
            .map(|(name, value)| format!("{name} {}", short(*value)))
            .collect();
        table = table.row(&[
            candidate.effect.clone(),
            format!("{:.3}", candidate.probability),
            short(candidate.gap_after),
            interval(&candidate.closed_fraction),
            gained(&outcome.search, &candidate.effect),
            values.join(", "),
        ]);
    }
    for (name, probability) in [
        ("nothing missing", others.none),
        ("parameters alone", others.parameters),
        ("not in the catalogue", others.unknown),
    ] {
        bars = bars.bar(name, probability, &format!("{probability:.3}"));
    }
    let page = page.heading("What explains it").bars(bars).table(table);
    match diagnosis.credit_sentence() {
        Some(credit) => page.paragraph(&credit),
        None => page,
    }
}

/// What an effect gains alone, and what it gains on records of the refitted simulator without it.
fn gained(search: &Search, id: &str) -> String {
    let nats = search
        .alone(id)
        .map(|h| format!("{:.0}", h.score - search.base.score));
    match (nats, search.null(id)) {
        (Some(nats), Some(null)) => format!("{nats} ({:.0})", null.nats),
        (Some(nats), None) => nats,
        (None, _) => "-".to_string(),
    }
}

fn parameters(page: Report, outcome: &Outcome, shown: Option<&Hypothesis>) -> Report {
    let search = &outcome.search;
    let base = &search.base;
    let mut table = Table::new(
        "The simulator's own parameters",
        &[
            "parameter",
            "as given",
            "refitted",
            "standard deviation",
            "with effect",
        ],
    );
    let after = shown.map(|h| h.model.values(&h.fit.at)).unwrap_or_default();
    let before = base.model.values(&base.fit.at);
    let spreads = spreads(&base.model, &base.fit);
    for (i, free) in base.model.free.iter().enumerate() {
        let deviation = if free.logarithmic {
            spreads[i] * before[i]
        } else {
            spreads[i]
        };
        let name = if free.owner == Owner::Own(Own::Skew) {
            "skew_s (effort acts later than recorded)"
        } else {
            &free.name
        };
        table = table.row(&[
            name.to_string(),
            short(free.start),
            short(before[i]),
            short(deviation),
            after.get(i).map_or("-".to_string(), |x| short(*x)),
        ]);
    }
    page.heading("Fitted parameters").table(table)
}

fn overlays(mut page: Report, outcome: &Outcome, shown: &Hypothesis) -> Report {
    let search = &outcome.search;
    let effort = search.scale.unit.effort();
    let after = format!("with {}", shown.ids().join(" + "));
    page = page.heading("Before and after").paragraph(
        "Effort as the diagnosis sees it, averaged over a few samples, against what each model needs for the measured \
         motion.",
    );
    for (place, record) in search.records.iter().enumerate() {
        let mut time = Vec::new();
        let mut lines: [Vec<f64>; 5] = Default::default();
        let mut at = [usize::MAX, 0];
        for (i, node) in search.nodes.iter().enumerate() {
            if node.record != place {
                continue;
            }
            let stretch = &record.stretches[node.stretch];
            at = if at[0] == node.stretch {
                [node.stretch, at[1] + 1]
            } else {
                if at[0] != usize::MAX {
                    // Nothing is drawn across a gap of the log.
                    time.push(stretch.start_s);
                    lines.iter_mut().for_each(|line| line.push(f64::NAN));
                }
                [node.stretch, 0]
            };
            let measured = stretch.effort_nodes_nm[at[1]];
            let (refitted, with) = (search.base.fit.left_over[i], shown.fit.left_over[i]);
            time.push(node.time_s(&search.records));
            for (line, x) in lines.iter_mut().zip([
                measured,
                measured - refitted,
                measured - with,
                refitted,
                with,
            ]) {
                line.push(x);
            }
        }
        let label = format!("time in {}", record.name);
        let [measured, predicted, better, refitted, with] = &lines;
        page = page
            .plot(
                Plot::over(&label, "s", &time)
                    .title(&format!("Effort, {}", record.name))
                    .y("effort", effort)
                    .line("measured", measured)
                    .line("refitted", predicted)
                    .line(&after, better),
            )
            .plot(
                Plot::over(&label, "s", &time)
                    .title(&format!("What is left over, {}", record.name))
                    .y("rest of effort", effort)
                    .line("refitted", refitted)
                    .line(&after, with),
            );
    }
    page
}

fn records(search: &Search) -> Table {
    let mut table = Table::new(
        "Logs as prepared",
        &[
            "log",
            "length",
            "rate used",
            "stretches",
            "averaged over",
            "effort",
            "noise of effort",
        ],
    );
    let unit = search.scale.unit.effort();
    for record in search.records.iter() {
        let samples: usize = record.stretches.iter().map(|s| s.effort_nm.len()).sum();
        table = table.row(&[
            record.name.clone(),
            format!("{} s", short(samples as f64 * record.step_s)),
            format!("{} Hz", short(1.0 / record.step_s)),
            record.stretches.len().to_string(),
            format!(
                "{} ms",
                short(1e3 * record.step_s * (2 * record.kernel.reach() + 1) as f64)
            ),
            if record.commanded {
                "commanded"
            } else {
                "measured"
            }
            .to_string(),
            format!("{} {unit}", short(record.effort_noise_nm)),
        ]);
    }
    table
}
