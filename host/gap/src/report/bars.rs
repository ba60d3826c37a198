//! Bars: a few numbers of one kind beside each other, drawn without a script.

use super::text::html;

/// Bars from zero, the longest as wide as there is room.
#[derive(Debug, Clone)]
pub struct Bars {
    title: String,
    rows: Vec<(String, f64, String)>,
}

impl Bars {
    /// Without any bar yet.
    pub fn new(title: &str) -> Self {
        Self {
            title: title.to_owned(),
            rows: Vec::new(),
        }
    }

    /// Adds a bar with what stands beside it. What is not finite or below zero has no length.
    pub fn bar(mut self, name: &str, value: f64, shown: &str) -> Self {
        self.rows.push((name.to_owned(), value, shown.to_owned()));
        self
    }

    pub(super) fn push_html(&self, out: &mut String) {
        let length = |value: f64| {
            if value.is_finite() {
                value.max(0.0)
            } else {
                0.0
            }
        };
        let longest = self
            .rows
            .iter()
            .map(|row| length(row.1))
            .fold(0.0, f64::max);
        out.push_str(&format!(
            "<figure class=\"bars\">\n<h3>{}</h3>\n",
            html(&self.title)
        ));
        for (name, value, shown) in &self.rows {
            let share = if longest > 0.0 {
                100.0 * length(*value) / longest
            } else {
                0.0
            };
            out.push_str(&format!(
                "<div class=\"bar\"><span class=\"name\">{}</span><span class=\"track\"><span class=\"fill\" \
                 style=\"width:{share:.2}%\"></span></span><span class=\"value\">{}</span></div>\n",
                html(name),
                html(shown)
            ));
        }
        out.push_str("</figure>\n");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_are_shares_of_the_longest() {
        let mut out = String::new();
        Bars::new("<gap>")
            .bar("before", 4.0, "4 N m")
            .bar("after", 1.0, "1 N m")
            .bar("none", f64::NAN, "-")
            .push_html(&mut out);
        for piece in [
            "&lt;gap&gt;",
            "width:100.00%",
            "width:25.00%",
            "width:0.00%",
        ] {
            assert!(out.contains(piece), "{piece} in {out}");
        }
    }
}
