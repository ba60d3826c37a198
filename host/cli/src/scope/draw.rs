//! The picture.

use super::buffer::{Point, against, bounds, envelope};
use super::{Plots, Scope};
use bristle_core::parameters::ENTRIES;
use bristle_core::supervisor::{Fault, Limit, State};
use bristle_core::trace::FLAG_EXPERIMENT;
use bristle_gap::report::short;
use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Style, Stylize};
use ratatui::symbols::Marker;
use ratatui::text::{Line, Span};
use ratatui::widgets::{Axis, Block, Chart, Dataset, GraphType, List, ListState, Paragraph};

/// Points of a plot of two values: as many as a terminal has room for.
const MOST_POINTS: usize = 1500;
/// Width of the parameters.
const PANEL: u16 = 40;

/// Draws it.
pub fn draw(frame: &mut Frame<'_>, scope: &Scope) {
    let rows = [
        Constraint::Length(3),
        Constraint::Min(8),
        Constraint::Length(2),
    ];
    let [head, middle, foot] = Layout::vertical(rows).areas(frame.area());
    frame.render_widget(Paragraph::new(status(scope)), head);
    let panel = if scope.panel.open { PANEL } else { 0 };
    let columns = [
        Constraint::Fill(3),
        Constraint::Fill(2),
        Constraint::Length(panel),
    ];
    let [curves, plots, parameters] = Layout::horizontal(columns).areas(middle);
    over_time(frame, curves, scope);
    pairs(frame, plots, scope);
    if scope.panel.open {
        draw_panel(frame, parameters, scope);
    }
    frame.render_widget(Paragraph::new(help(scope)), foot);
}

fn or_number(known: Option<&'static str>, number: u8) -> String {
    known.map_or(number.to_string(), str::to_owned)
}

/// Source and losses; state, limit and fault in words; what was said last.
fn status(scope: &Scope) -> Vec<Line<'_>> {
    let summary = scope.feed.summary();
    let time_s = scope.buffer.last().map_or(0.0, |point| point.time_s);
    let lost = format!("{} lost", summary.lost);
    let lost = if summary.lost > 0 {
        lost.red()
    } else {
        lost.green()
    };
    let mut first = vec![
        Span::from(scope.name.clone()).bold(),
        Span::from(format!("  {time_s:.2} s  {} samples, ", summary.samples)),
        lost,
    ];
    if summary.restarts > 0 {
        first.push(format!(", {} restarts", summary.restarts).red());
    }
    if let Some(recording) = &scope.recording {
        first.push(
            format!("  REC {} samples", recording.samples())
                .red()
                .bold(),
        );
    }
    if scope.paused_s.is_some() {
        first.push("  PAUSED".yellow().bold());
    }
    let second = match scope.buffer.last() {
        None => vec![Span::from("no sample yet")],
        Some(point) => state(point, scope),
    };
    let (said, bad) = &scope.said;
    let said = Span::from(said.clone());
    let third = if *bad { said.red() } else { said.dim() };
    vec![Line::from(first), Line::from(second), Line::from(third)]
}

fn state(point: &Point, scope: &Scope) -> Vec<Span<'static>> {
    let status = point.status;
    let [state, limit, fault, flags] = status.0.to_le_bytes();
    let name = or_number(status.state().map(State::text), state);
    let shown = match status.state() {
        Some(State::Armed) => name.green().bold(),
        Some(State::Fault) => name.red().bold(),
        _ => name.bold(),
    };
    let limited = or_number(status.limit().map(Limit::text), limit);
    let mut spans = vec![
        shown,
        Span::from("  limited by: "),
        if status.limit() == Some(Limit::None) {
            limited.dim()
        } else {
            limited.yellow()
        },
        Span::from("  "),
    ];
    let why = or_number(status.fault().map(Fault::text), fault);
    spans.push(if fault == Fault::None as u8 {
        why.dim()
    } else {
        format!("fault {fault}: {why}").red().bold()
    });
    if flags & FLAG_EXPERIMENT != 0 {
        spans.push("  experiment plays".cyan());
    } else if let Some(ended) = status.ended() {
        spans.push(format!("  last experiment: {}", ended.text()).dim());
    }
    spans.push(Span::from(format!(
        "  trigger: {}",
        scope.trigger.on.name()
    )));
    if scope.trigger.on.has_level() {
        spans.push(Span::from(format!(" {}", short(scope.trigger.level))));
    }
    spans
}

fn help(scope: &Scope) -> Vec<Line<'static>> {
    let orders = if scope.feed.takes_orders() {
        format!(
            "a arm  e/s start {}  x stop  d disarm  c clear  p parameters",
            scope.experiment().name()
        )
    } else {
        "this source only sends".to_owned()
    };
    vec![
        Line::from("q quit  space pause  +/- zoom  left/right scroll  tab plots  t trigger  [ ] level  r record").dim(),
        Line::from(orders).dim(),
    ]
}

/// A curve, its name and colour.
struct Curve {
    name: &'static str,
    points: Vec<(f64, f64)>,
    color: Color,
}

/// Velocity, torque and deflection over time.
fn over_time(frame: &mut Frame<'_>, area: Rect, scope: &Scope) {
    let [from_s, to_s] = scope.window();
    let columns = usize::from(area.width.max(10));
    let curve = |name, color, value: fn(&Point) -> f32| {
        let points = envelope(
            scope.buffer.window(from_s, to_s),
            columns,
            from_s,
            to_s,
            |point| f64::from(value(point)),
        );
        // Times from the window's beginning: a time since boot has too many digits for an axis.
        let points = points.into_iter().map(|(x, y)| (x - from_s, y)).collect();
        Curve {
            name,
            points,
            color,
        }
    };
    let charts = [
        (
            "velocity, rad/s",
            vec![curve("", Color::Cyan, |point| point.velocity_rad_s)],
        ),
        (
            "torque, N m",
            vec![curve("", Color::Yellow, |point| point.torque_nm)],
        ),
        (
            "z, rad",
            vec![
                curve("time-free", Color::DarkGray, |point| point.z_time_free_rad),
                curve("Luenberger", Color::Green, |point| point.z_rad),
            ],
        ),
    ];
    let areas: [Rect; 3] = Layout::vertical([Constraint::Fill(1); 3]).areas(area);
    for ((title, curves), area) in charts.iter().zip(areas) {
        chart(frame, area, title, curves, [0.0, to_s - from_s], "s");
    }
}

/// z and friction over velocity, friction over position.
fn pairs(frame: &mut Frame<'_>, area: Rect, scope: &Scope) {
    let axis = &scope.axis;
    let rad = axis.rad_per_count();
    // Where the view began, so that the position has few digits.
    let origin = scope.buffer.first().map_or(0, |point| point.counts);
    let friction = |point: &Point| {
        axis.stiffness_nm_rad * f64::from(point.z_rad)
            + axis.viscous_nm_s_rad * f64::from(point.velocity_rad_s)
    };
    let [from_s, to_s] = scope.window();
    let window = || scope.buffer.window(from_s, to_s);
    let velocity = |point: &Point| f64::from(point.velocity_rad_s);
    let draw = |frame: &mut Frame<'_>, area: Rect, plot: Plots| {
        let (title, unit, color, points) = match plot {
            Plots::DeflectionOverVelocity => (
                "z over v, rad",
                "rad/s",
                Color::Green,
                against(window(), MOST_POINTS, |point| {
                    (velocity(point), f64::from(point.z_rad))
                }),
            ),
            Plots::FrictionOverVelocity => (
                "F over v, N m",
                "rad/s",
                Color::Magenta,
                against(window(), MOST_POINTS, |point| {
                    (velocity(point), friction(point))
                }),
            ),
            Plots::FrictionOverPosition | Plots::All => (
                "F over x, N m",
                "rad",
                Color::Magenta,
                against(window(), MOST_POINTS, |point| {
                    ((point.counts - origin) as f64 * rad, friction(point))
                }),
            ),
        };
        let ends = bounds(points.iter().map(|(x, _)| *x));
        let curve = Curve {
            name: "",
            points,
            color,
        };
        chart(frame, area, title, &[curve], ends, unit);
    };
    if scope.plots == Plots::All {
        let all = [
            Plots::DeflectionOverVelocity,
            Plots::FrictionOverVelocity,
            Plots::FrictionOverPosition,
        ];
        let areas: [Rect; 3] = Layout::vertical([Constraint::Fill(1); 3]).areas(area);
        for (plot, area) in all.into_iter().zip(areas) {
            draw(frame, area, plot);
        }
    } else {
        draw(frame, area, scope.plots);
    }
}

fn chart(
    frame: &mut Frame<'_>,
    area: Rect,
    title: &str,
    curves: &[Curve],
    ends: [f64; 2],
    unit: &str,
) {
    let values = curves
        .iter()
        .flat_map(|curve| curve.points.iter().map(|(_, y)| *y));
    let range = bounds(values);
    let data = curves
        .iter()
        .map(|curve| {
            Dataset::default()
                .name(curve.name)
                .marker(Marker::Braille)
                .graph_type(GraphType::Line)
                .style(Style::new().fg(curve.color))
                .data(&curve.points)
        })
        .collect();
    let labels = |[low, high]: [f64; 2]| [short(low), short(high)];
    let [left, right] = labels(ends);
    let chart = Chart::new(data)
        .block(Block::bordered().title(title.to_owned()))
        .x_axis(
            Axis::default()
                .bounds(ends)
                .labels([left, format!("{right} {unit}")]),
        )
        .y_axis(Axis::default().bounds(range).labels(labels(range)));
    frame.render_widget(chart, area);
}

fn draw_panel(frame: &mut Frame<'_>, area: Rect, scope: &Scope) {
    let panel = &scope.panel;
    let lines = ENTRIES.iter().enumerate().map(|(place, entry)| {
        let value = if place == panel.chosen && !panel.typed.is_empty() {
            format!("{}_", panel.typed)
        } else {
            panel
                .value(place)
                .map_or("?".to_owned(), |value| format!("{value}"))
        };
        format!("{:26}{value:>11}", entry.name)
    });
    let entry = ENTRIES.get(panel.chosen);
    let range = entry.map_or(String::new(), |entry| {
        format!("{} to {}", entry.low, entry.high)
    });
    let list = List::new(lines)
        .block(Block::bordered().title("parameters").title_bottom(range))
        .highlight_style(Style::new().reversed());
    let mut state = ListState::default().with_selected(Some(panel.chosen));
    frame.render_stateful_widget(list, area, &mut state);
}

#[cfg(test)]
mod tests;
