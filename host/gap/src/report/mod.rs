//! Reports: one HTML file with tables and zoomable plots.
//!
//! The file holds all it needs (styles, script, data), opens offline and asks the network for
//! nothing. It adapts to a phone, to a dark theme and to paper.
//!
//! ```
//! use bristle_gap::report::{Plot, Report, Table};
//!
//! let t = [0.0, 0.1, 0.2];
//! let html = Report::new("Axis 1")
//!     .lead("Friction matches the axis file within 2 %.")
//!     .heading("Run")
//!     .plot(Plot::over("time", "s", &t).y("velocity", "rad/s").line("measured", &[0.0, 0.5, 0.4]))
//!     .table(Table::new("Parameters", &["name", "value"]).row(&["sigma_0", "1.2e5"]))
//!     .facts(&[("seed", "7")])
//!     .to_html();
//! assert!(html.starts_with("<!DOCTYPE html>"));
//! ```

mod bars;
mod decimate;
mod plot;
mod table;
mod text;

pub use bars::Bars;
pub use plot::{MAX_POINTS, Plot, TimePlot, XyPlot};
pub use table::Table;
pub use text::short;

use text::{html, push_html};

const UPLOT_JS: &str = include_str!("vendor/uPlot.iife.min.js");
const UPLOT_CSS: &str = include_str!("vendor/uPlot.min.css");
const UPLOT_LICENSE: &str = include_str!("vendor/LICENSE-uPlot");
const PLOTS_JS: &str = include_str!("plots.js");
const REPORT_CSS: &str = include_str!("report.css");

/// The page may run its own script and style and load nothing, whatever is in the data.
const POLICY: &str = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; \
                      img-src data:; base-uri 'none'; form-action 'none'";

const HOW_TO_ZOOM: &str = "Drag across a plot to zoom, double-click to reset. Ctrl + wheel zooms \
                           at the pointer. Click a name in the legend to hide its line.";

/// A report, built from the top to the bottom. All texts are plain text; HTML in them is shown,
/// not obeyed.
#[derive(Debug, Clone)]
pub struct Report {
    title: String,
    sections: Vec<Section>,
}

#[derive(Debug, Clone)]
enum Section {
    Lead(String),
    Heading(String),
    Paragraph(String),
    Table(Table),
    Bars(Bars),
    Plot(Plot),
    Facts(Vec<(String, String)>),
}

impl Report {
    /// An empty report.
    pub fn new(title: &str) -> Self {
        Report {
            title: title.to_owned(),
            sections: Vec::new(),
        }
    }

    /// The verdict in a sentence, set off from the rest.
    pub fn lead(self, text: &str) -> Self {
        self.add(Section::Lead(text.to_owned()))
    }

    /// A heading.
    pub fn heading(self, text: &str) -> Self {
        self.add(Section::Heading(text.to_owned()))
    }

    /// A paragraph.
    pub fn paragraph(self, text: &str) -> Self {
        self.add(Section::Paragraph(text.to_owned()))
    }

    /// A table.
    pub fn table(self, table: Table) -> Self {
        self.add(Section::Table(table))
    }

    /// Bars.
    pub fn bars(self, bars: Bars) -> Self {
        self.add(Section::Bars(bars))
    }

    /// A plot.
    pub fn plot(self, plot: impl Into<Plot>) -> Self {
        self.add(Section::Plot(plot.into()))
    }

    /// Where the report comes from: command line, version, seed, files.
    pub fn facts(self, facts: &[(&str, &str)]) -> Self {
        let own = facts.iter().map(|(n, v)| ((*n).into(), (*v).into()));
        self.add(Section::Facts(own.collect()))
    }

    fn add(mut self, section: Section) -> Self {
        self.sections.push(section);
        self
    }

    /// The whole page.
    pub fn to_html(&self) -> String {
        let mut body = String::new();
        let mut data = String::new();
        let mut plots = 0;
        for section in &self.sections {
            match section {
                Section::Lead(text) => push_element(&mut body, "p class=\"lead\"", text),
                Section::Heading(text) => push_element(&mut body, "h2", text),
                Section::Paragraph(text) => push_element(&mut body, "p", text),
                Section::Table(table) => table.push_html(&mut body),
                Section::Bars(bars) => bars.push_html(&mut body),
                Section::Facts(facts) => push_facts(&mut body, facts),
                Section::Plot(plot) => {
                    if plots == 0 {
                        push_element(&mut body, "p class=\"hint\"", HOW_TO_ZOOM);
                    } else {
                        data.push_str(",\n");
                    }
                    let notes = plot.push_json(&mut data);
                    push_figure(&mut body, plots, plot, &notes);
                    plots += 1;
                }
            }
        }

        let mut out = String::with_capacity(body.len() + data.len() + 80_000);
        out.push_str("<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n");
        out.push_str(&format!(
            "<meta http-equiv=\"Content-Security-Policy\" content=\"{POLICY}\">\n"
        ));
        out.push_str(
            "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <meta name=\"color-scheme\" content=\"light dark\">\n",
        );
        out.push_str(&format!("<title>{}</title>\n", html(&self.title)));
        if plots > 0 {
            out.push_str(&format!("<style>{UPLOT_CSS}</style>\n"));
        }
        out.push_str(&format!("<style>\n{REPORT_CSS}</style>\n</head>\n<body>\n"));
        out.push_str(&format!("<main>\n<h1>{}</h1>\n", html(&self.title)));
        out.push_str(&body);
        out.push_str("</main>\n");
        if plots > 0 {
            push_scripts(&mut out, &data);
        }
        out.push_str("</body>\n</html>\n");
        out
    }
}

/// `tag` may carry attributes.
fn push_element(out: &mut String, tag: &str, text: &str) {
    let name = tag.split(' ').next().unwrap_or(tag);
    out.push_str(&format!("<{tag}>{}</{name}>\n", html(text)));
}

fn push_figure(out: &mut String, index: usize, plot: &Plot, notes: &[String]) {
    let head = plot.head();
    out.push_str(&format!("<figure class=\"plot\" id=\"plot-{index}\">\n"));
    out.push_str("<div class=\"plot-head\">");
    out.push_str(&format!("<h3>{}</h3></div>\n", html(&head.title)));
    out.push_str("<div class=\"plot-body\" role=\"group\" aria-label=\"");
    push_html(out, &plot.description());
    out.push_str("\"></div>\n");
    out.push_str(
        "<noscript><p class=\"note\">This plot is drawn by a script inside this file; \
         scripts are switched off here.</p></noscript>\n",
    );
    let own = Some(&head.note).filter(|n| !n.is_empty());
    for note in own.into_iter().chain(notes) {
        push_element(out, "p class=\"note\"", note);
    }
    out.push_str("</figure>\n");
}

fn push_facts(out: &mut String, facts: &[(String, String)]) {
    out.push_str("<dl class=\"facts\">\n");
    for (name, value) in facts {
        out.push_str(&format!(
            "<div><dt>{}</dt><dd>{}</dd></div>\n",
            html(name),
            html(value)
        ));
    }
    out.push_str("</dl>\n");
}

fn push_scripts(out: &mut String, data: &str) {
    out.push_str("<script type=\"application/json\" id=\"plot-data\">[\n");
    out.push_str(data);
    out.push_str("\n]</script>\n");
    // The licence asks to travel with every copy, and a report is one.
    out.push_str(&format!("<script>\n/*\n{UPLOT_LICENSE}*/\n"));
    // uPlot reads the pixel ratio of the screen. Paper is finer than a plain screen, and a
    // printed canvas keeps the pixels it has: so at least two of them for each CSS pixel.
    out.push_str("var uPlot = (function (devicePixelRatio) {\n");
    out.push_str(UPLOT_JS);
    out.push_str("\nreturn uPlot;\n})(Math.max(2, window.devicePixelRatio));\n</script>\n");
    out.push_str(&format!("<script>\n{PLOTS_JS}</script>\n"));
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The JSON in the page, as a browser would find it.
    fn plot_data(page: &str) -> serde_json::Value {
        let (_, rest) = page.split_once("id=\"plot-data\">").unwrap();
        let (json, _) = rest.split_once("</script>").unwrap();
        serde_json::from_str(json).unwrap()
    }

    #[test]
    fn hostile_texts_stay_texts() {
        let evil = "</script></title><img src=x onerror=\"alert(1)\">'&";
        let x = [0.0, 1.0];
        let page = Report::new(evil)
            .lead(evil)
            .heading(evil)
            .paragraph(evil)
            .table(Table::new(evil, &[evil]).row(&[evil]))
            .plot(
                Plot::over(evil, evil, &x)
                    .title(evil)
                    .note(evil)
                    .y(evil, evil)
                    .line(evil, &x),
            )
            .plot(Plot::xy(evil, evil).title(evil).line(evil, &x, &x))
            .facts(&[(evil, evil)])
            .to_html();
        assert!(!page.contains("<img"));
        assert_eq!(page.matches("</title>").count(), 1);
        // Data, uPlot and our glue.
        assert_eq!(page.matches("</script>").count(), 3);
        assert_eq!(plot_data(&page)[0]["lines"][0]["name"], evil);
    }

    #[test]
    fn the_page_asks_the_network_for_nothing() {
        let page = Report::new("t")
            .plot(Plot::over("time", "s", &[0.0]).line("a", &[0.0]))
            .to_html();
        for tag in ["<link", " src=", "@import", "url(", "fetch(", "XMLHttp"] {
            assert!(!page.contains(tag), "{tag}");
        }
        assert!(page.contains("default-src 'none'"));
    }

    #[test]
    fn a_report_without_plots_carries_no_script() {
        let page = Report::new("t").paragraph("p").to_html();
        assert!(!page.contains("<script"));
    }

    #[test]
    fn data_is_json_with_gaps() {
        let t = [0.0, 1.0, 2.0];
        let page = Report::new("t")
            .plot(
                Plot::over("time", "s", &t)
                    .line("a", &[1.0, f64::NAN, 3.0])
                    .line("short", &[1.0]),
            )
            .plot(
                Plot::xy("x", "m")
                    .line("loop", &[0.0, 1.0, 0.5], &t)
                    .points("p", &[], &[]),
            )
            .to_html();
        let data = plot_data(&page);
        assert_eq!(
            data[0]["data"],
            serde_json::json!([[0, 1, 2], [1, null, 3], [1, null, null]])
        );
        assert_eq!(
            data[1]["data"],
            serde_json::json!([[[0, 1, 0.5], [0, 1, 2]], [[], []]])
        );
        assert_eq!(data[1]["lines"][1]["points"], true);
        assert!(page.contains("short: 1 values for 3 places"));
    }

    #[test]
    fn x_is_sorted_and_says_so() {
        let page = Report::new("t")
            .plot(Plot::over("time", "s", &[2.0, f64::NAN, 1.0]).line("a", &[20.0, 5.0, 10.0]))
            .to_html();
        let data = plot_data(&page);
        assert_eq!(data[0]["data"], serde_json::json!([[1, 2], [10, 20]]));
        assert!(page.contains("time steps back in the data; drawn sorted."));
        assert!(page.contains("1 samples without a time are left out."));
    }

    #[test]
    fn long_lines_say_they_are_decimated_and_keep_the_peak() {
        let t: Vec<f64> = (0..100_000).map(|i| f64::from(i) * 1e-3).collect();
        let mut y = vec![0.0; t.len()];
        y[54_321] = 9.0;
        let page = Report::new("t")
            .plot(Plot::over("time", "s", &t).line("a", &y))
            .to_html();
        assert!(page.contains("Drawn decimated, "));
        let data = plot_data(&page);
        let xs = data[0]["data"][0].as_array().unwrap();
        let ys = data[0]["data"][1].as_array().unwrap();
        assert!(xs.len() <= MAX_POINTS + 2 && xs.len() == ys.len());
        let at = ys.iter().position(|v| v.as_f64() == Some(9.0)).unwrap();
        assert_eq!(xs[at].as_f64(), Some(54.321));
    }
}
