//! Tables of a report.

use super::text::{html, push_html};

/// A table. Columns of numbers are set right-aligned.
#[derive(Debug, Clone, Default)]
pub struct Table {
    /// What the table shows; may be empty.
    pub caption: String,
    /// The names of the columns.
    pub header: Vec<String>,
    /// The rows, each with a cell for each column.
    pub rows: Vec<Vec<String>>,
}

impl Table {
    /// A table without rows.
    pub fn new(caption: &str, header: &[&str]) -> Self {
        Table {
            caption: caption.to_owned(),
            header: header.iter().map(|h| (*h).to_owned()).collect(),
            rows: Vec::new(),
        }
    }

    /// Adds a row.
    pub fn row<S: AsRef<str>>(mut self, cells: &[S]) -> Self {
        let cells = cells.iter().map(|c| c.as_ref().to_owned());
        self.rows.push(cells.collect());
        self
    }

    pub(super) fn push_html(&self, out: &mut String) {
        let widest = self.rows.iter().map(Vec::len).max().unwrap_or(0);
        let columns = self.header.len().max(widest);
        let class: Vec<&str> = (0..columns)
            .map(|c| {
                if self.is_numeric(c) {
                    " class=\"number\""
                } else {
                    ""
                }
            })
            .collect();
        // The box scrolls by itself, so that a wide table does not widen a phone's page.
        out.push_str("<div class=\"table\" tabindex=\"0\"><table>\n");
        if !self.caption.is_empty() {
            out.push_str(&format!("<caption>{}</caption>\n", html(&self.caption)));
        }
        if !self.header.is_empty() {
            out.push_str("<thead><tr>");
            for (c, class) in class.iter().enumerate() {
                let name = self.header.get(c).map_or("", String::as_str);
                out.push_str(&format!("<th scope=\"col\"{class}>{}</th>", html(name)));
            }
            out.push_str("</tr></thead>\n");
        }
        out.push_str("<tbody>\n");
        for row in &self.rows {
            out.push_str("<tr>");
            for (c, class) in class.iter().enumerate() {
                out.push_str(&format!("<td{class}>"));
                push_html(out, row.get(c).map_or("", String::as_str));
                out.push_str("</td>");
            }
            out.push_str("</tr>\n");
        }
        out.push_str("</tbody>\n</table></div>\n");
    }

    /// A column is one of numbers if all its filled cells are.
    fn is_numeric(&self, column: usize) -> bool {
        let mut any = false;
        for row in &self.rows {
            let cell = row.get(column).map_or("", |c| c.trim());
            if matches!(cell, "" | "-" | "–" | "—" | "NaN" | "n/a") {
                continue;
            }
            if !is_number(cell) {
                return false;
            }
            any = true;
        }
        any
    }
}

/// A number, alone or followed by a tolerance or unit: `-1.2e-3`, `4 %`, `0.51 ± 0.02 Nm`.
fn is_number(cell: &str) -> bool {
    let first = cell.split_whitespace().next().unwrap_or("");
    let bare = first
        .trim_start_matches(['<', '>', '≤', '≥', '±', '~', '≈'])
        .trim_end_matches(['%', '°', '×']);
    let minus = bare.replace('\u{2212}', "-");
    // Rust also reads words such as "inf" and "nan" as numbers; a digit is asked for.
    minus.contains(|c: char| c.is_ascii_digit()) && minus.parse::<f64>().is_ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_recognised() {
        for cell in [
            "1",
            "-1.2e-3",
            "4 %",
            "4%",
            "0.51 ± 0.02 Nm",
            "−3.5",
            "<0.1",
        ] {
            assert!(is_number(cell), "{cell}");
        }
        for cell in ["F_c", "2026-01-01", "inf", "axis 1", "1.2.3", "Nm"] {
            assert!(!is_number(cell), "{cell}");
        }
    }

    #[test]
    fn columns_of_numbers_align_right() {
        let mut out = String::new();
        Table::new("c", &["name", "value"])
            .row(&["F_c", "1.5"])
            .row(&["F_s", "-"])
            .row(&["short"])
            .push_html(&mut out);
        assert!(out.contains("<th scope=\"col\">name</th>"));
        assert!(out.contains("<th scope=\"col\" class=\"number\">value</th>"));
        assert!(out.contains("<td>F_c</td><td class=\"number\">1.5</td>"));
        assert!(out.contains("<td>short</td><td class=\"number\"></td>"));
    }
}
