//! Plots: what to draw, as JSON for `plots.js`.

use super::decimate;
use super::text::{push_json_numbers, push_json_string};

/// Lines longer than this are drawn decimated.
pub const MAX_POINTS: usize = 20_000;

/// A plot of a report, made by [`Plot::over`] or [`Plot::xy`].
#[derive(Debug, Clone)]
pub enum Plot {
    /// Several values over one shared x, mostly time.
    Time(TimePlot),
    /// Curves of points joined in their order, such as hysteresis loops.
    Xy(XyPlot),
}

impl Plot {
    /// A plot of values over the shared `x`, for example `("time", "s", &t)`.
    ///
    /// All such plots of a report with the same label and unit share the cursor and the zoom in x.
    pub fn over(label: &str, unit: &str, x: &[f64]) -> TimePlot {
        TimePlot {
            head: Head::new(label, unit),
            x: x.to_vec(),
            lines: Vec::new(),
        }
    }

    /// A plot of one value against another, where x need not ascend.
    pub fn xy(x_label: &str, x_unit: &str) -> XyPlot {
        XyPlot {
            head: Head::new(x_label, x_unit),
            curves: Vec::new(),
        }
    }

    pub(super) fn head(&self) -> &Head {
        match self {
            Plot::Time(p) => &p.head,
            Plot::Xy(p) => &p.head,
        }
    }

    /// Appends the plot as a JSON object. Returns sentences to print under the plot.
    pub(super) fn push_json(&self, out: &mut String) -> Vec<String> {
        match self {
            Plot::Time(p) => p.push_json(out),
            Plot::Xy(p) => p.push_json(out),
        }
    }

    /// The plot in a sentence, for readers who do not see it.
    pub(super) fn description(&self) -> String {
        let (head, names): (_, Vec<&str>) = match self {
            Plot::Time(p) => (&p.head, p.lines.iter().map(|l| l.0.as_str()).collect()),
            Plot::Xy(p) => (&p.head, p.curves.iter().map(|c| c.name.as_str()).collect()),
        };
        let mut text = String::new();
        if !head.title.is_empty() {
            text.push_str(&head.title);
            text.push_str(": ");
        }
        text.push_str(&format!("plot of {} over {}", head.y.text(), head.x.text()));
        if !names.is_empty() {
            text.push_str(&format!("; lines: {}", names.join(", ")));
        }
        text
    }
}

impl From<TimePlot> for Plot {
    fn from(plot: TimePlot) -> Self {
        Plot::Time(plot)
    }
}

impl From<XyPlot> for Plot {
    fn from(plot: XyPlot) -> Self {
        Plot::Xy(plot)
    }
}

/// What both kinds of plot have.
#[derive(Debug, Clone)]
pub(super) struct Head {
    pub(super) title: String,
    pub(super) note: String,
    x: Quantity,
    y: Quantity,
}

impl Head {
    fn new(label: &str, unit: &str) -> Self {
        Head {
            title: String::new(),
            note: String::new(),
            x: Quantity::new(label, unit),
            y: Quantity::new("", ""),
        }
    }

    fn push_json(&self, kind: &str, out: &mut String) {
        out.push_str("{\"kind\":");
        push_json_string(out, kind);
        out.push_str(",\"x\":");
        push_json_string(out, &self.x.text());
        out.push_str(",\"y\":");
        push_json_string(out, &self.y.text());
        // Names the first column of the legend, where a unit would repeat the axis.
        out.push_str(",\"xName\":");
        push_json_string(out, &self.x.label);
    }
}

/// The name of an axis and its unit, empty for a bare number.
#[derive(Debug, Clone)]
struct Quantity {
    label: String,
    unit: String,
}

impl Quantity {
    fn new(label: &str, unit: &str) -> Self {
        Quantity {
            label: label.to_owned(),
            unit: unit.to_owned(),
        }
    }

    fn text(&self) -> String {
        if self.unit.is_empty() {
            self.label.clone()
        } else {
            format!("{} [{}]", self.label, self.unit)
        }
    }
}

/// Values over one shared x. See [`Plot::over`].
#[derive(Debug, Clone)]
pub struct TimePlot {
    head: Head,
    x: Vec<f64>,
    lines: Vec<(String, Vec<f64>)>,
}

impl TimePlot {
    /// The heading of the plot.
    pub fn title(mut self, title: &str) -> Self {
        self.head.title = title.to_owned();
        self
    }

    /// The label of the y axis and its unit.
    pub fn y(mut self, label: &str, unit: &str) -> Self {
        self.head.y = Quantity::new(label, unit);
        self
    }

    /// A sentence to print under the plot.
    pub fn note(mut self, text: &str) -> Self {
        self.head.note = text.to_owned();
        self
    }

    /// Adds a line with a value for each x. NaN makes a gap.
    pub fn line(mut self, name: &str, ys: &[f64]) -> Self {
        self.lines.push((name.to_owned(), ys.to_vec()));
        self
    }

    fn push_json(&self, out: &mut String) -> Vec<String> {
        let mut notes = Vec::new();
        for (name, ys) in &self.lines {
            note_lengths(name, self.x.len(), ys.len(), &mut notes);
        }
        let order = self.usable_order(&mut notes);
        let mut x = take(&self.x, &order);
        let mut lines: Vec<Vec<f64>> = self.lines.iter().map(|(_, ys)| take(ys, &order)).collect();
        let views: Vec<&[f64]> = lines.iter().map(Vec::as_slice).collect();
        if let Some(keep) = decimate::envelope(x.len(), &views, MAX_POINTS) {
            notes.push(decimated_note("", x.len(), keep.len()));
            x = take(&x, &keep);
            lines = lines.iter().map(|ys| take(ys, &keep)).collect();
        }

        self.head.push_json("time", out);
        out.push_str(",\"lines\":[");
        for (i, (name, _)) in self.lines.iter().enumerate() {
            push_line(i, name, false, out);
        }
        out.push_str("],\"data\":[");
        push_json_numbers(out, &x);
        for ys in &lines {
            out.push(',');
            push_json_numbers(out, ys);
        }
        out.push_str("]}");
        notes
    }

    /// Indices of the samples with a finite x, in ascending x: drawing searches x by halving.
    fn usable_order(&self, notes: &mut Vec<String>) -> Vec<usize> {
        let x = &self.x;
        let mut order: Vec<usize> = (0..x.len()).filter(|&i| x[i].is_finite()).collect();
        if order.len() < x.len() {
            let lost = x.len() - order.len();
            notes.push(format!(
                "{lost} samples without a {} are left out.",
                self.head.x.label
            ));
        }
        if !order.is_sorted_by(|&a, &b| x[a] <= x[b]) {
            notes.push(format!(
                "{} steps back in the data; drawn sorted.",
                self.head.x.label
            ));
            order.sort_by(|&a, &b| x[a].total_cmp(&x[b]));
        }
        order
    }
}

/// Curves of one value against another. See [`Plot::xy`].
#[derive(Debug, Clone)]
pub struct XyPlot {
    head: Head,
    curves: Vec<Curve>,
}

#[derive(Debug, Clone)]
struct Curve {
    name: String,
    points: bool,
    xs: Vec<f64>,
    ys: Vec<f64>,
}

impl XyPlot {
    /// The heading of the plot.
    pub fn title(mut self, title: &str) -> Self {
        self.head.title = title.to_owned();
        self
    }

    /// The label of the y axis and its unit.
    pub fn y(mut self, label: &str, unit: &str) -> Self {
        self.head.y = Quantity::new(label, unit);
        self
    }

    /// A sentence to print under the plot.
    pub fn note(mut self, text: &str) -> Self {
        self.head.note = text.to_owned();
        self
    }

    /// Adds a curve that joins the points in their order. NaN in x or y makes a gap.
    pub fn line(self, name: &str, xs: &[f64], ys: &[f64]) -> Self {
        self.curve(name, false, xs, ys)
    }

    /// Adds points that are not joined, for example measurements beside a fitted curve.
    pub fn points(self, name: &str, xs: &[f64], ys: &[f64]) -> Self {
        self.curve(name, true, xs, ys)
    }

    fn curve(mut self, name: &str, points: bool, xs: &[f64], ys: &[f64]) -> Self {
        self.curves.push(Curve {
            name: name.to_owned(),
            points,
            xs: xs.to_vec(),
            ys: ys.to_vec(),
        });
        self
    }

    fn push_json(&self, out: &mut String) -> Vec<String> {
        let mut notes = Vec::new();
        self.head.push_json("xy", out);
        out.push_str(",\"lines\":[");
        for (i, curve) in self.curves.iter().enumerate() {
            push_line(i, &curve.name, curve.points, out);
        }
        out.push_str("],\"data\":[");
        for (i, curve) in self.curves.iter().enumerate() {
            note_lengths(&curve.name, curve.xs.len(), curve.ys.len(), &mut notes);
            let len = curve.xs.len().min(curve.ys.len());
            let (xs, ys) = (&curve.xs[..len], &curve.ys[..len]);
            if i > 0 {
                out.push(',');
            }
            out.push('[');
            if let Some(keep) = decimate::outline(xs, ys, MAX_POINTS) {
                notes.push(decimated_note(&curve.name, len, keep.len()));
                push_json_numbers(out, &take(xs, &keep));
                out.push(',');
                push_json_numbers(out, &take(ys, &keep));
            } else {
                push_json_numbers(out, xs);
                out.push(',');
                push_json_numbers(out, ys);
            }
            out.push(']');
        }
        out.push_str("]}");
        notes
    }
}

/// The values at `places`; a missing one is a gap.
fn take(values: &[f64], places: &[usize]) -> Vec<f64> {
    let at = |&i: &usize| values.get(i).copied().unwrap_or(f64::NAN);
    places.iter().map(at).collect()
}

fn push_line(index: usize, name: &str, points: bool, out: &mut String) {
    if index > 0 {
        out.push(',');
    }
    out.push_str("{\"name\":");
    push_json_string(out, name);
    out.push_str(if points {
        ",\"points\":true}"
    } else {
        ",\"points\":false}"
    });
}

fn decimated_note(name: &str, from: usize, to: usize) -> String {
    let start = if name.is_empty() {
        "Drawn".to_owned()
    } else {
        format!("{name}: drawn")
    };
    format!("{start} decimated, {to} of {from} samples; the extremes of every stretch are kept.")
}

/// A caller's mistake, said under the plot: a report that is there beats a panic.
fn note_lengths(name: &str, xs: usize, ys: usize, notes: &mut Vec<String>) {
    if xs != ys {
        notes.push(format!(
            "{name}: {ys} values for {xs} places; the rest is not drawn."
        ));
    }
}
