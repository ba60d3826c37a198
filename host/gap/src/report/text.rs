//! Writing text and numbers into HTML and JSON.

/// A number with four significant digits.
pub fn short(value: f64) -> String {
    let magnitude = value.abs();
    if value == 0.0 || !value.is_finite() {
        format!("{value}")
    } else if (1e-3..1e5).contains(&magnitude) {
        let digits = (3 - magnitude.log10().floor() as i32).max(0) as usize;
        format!("{value:.digits$}")
    } else {
        format!("{value:.3e}")
    }
}

/// Appends `text` to `out` so that HTML shows it as it is, in content and in quoted attributes.
pub(super) fn push_html(out: &mut String, text: &str) {
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            // HTML replaces a NUL anyway; here it stays visible.
            '\0' => out.push('\u{fffd}'),
            c => out.push(c),
        }
    }
}

/// `text` as HTML.
pub(super) fn html(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    push_html(&mut out, text);
    out
}

/// Appends `text` as a JSON string that cannot end the `<script>` element around it.
pub(super) fn push_json_string(out: &mut String, text: &str) {
    out.push('"');
    for c in text.chars() {
        match c {
            '"' => out.push_str("\\\""),
            '\\' => out.push_str("\\\\"),
            // Both `</script>` and `<!--` begin with this character.
            '<' => out.push_str("\\u003c"),
            c if c.is_control() => out.push_str(&format!("\\u{:04x}", c as u32)),
            c => out.push(c),
        }
    }
    out.push('"');
}

/// Appends `values` as a JSON array. What is not finite becomes null, a gap in the line.
pub(super) fn push_json_numbers(out: &mut String, values: &[f64]) {
    let digits = digits_for(values);
    out.push('[');
    for (i, &v) in values.iter().enumerate() {
        if i > 0 {
            out.push(',');
        }
        push_json_number(out, v, digits);
    }
    out.push(']');
}

/// Significant digits that keep about 7 digits of the span of `values`.
///
/// Seven digits of each value alone would flatten a small signal on a large offset, and would
/// merge the samples of a log whose clock starts far from zero.
fn digits_for(values: &[f64]) -> usize {
    let finite = || values.iter().copied().filter(|v| v.is_finite());
    let max_abs = finite().fold(0.0, |m: f64, v| m.max(v.abs()));
    let min = finite().fold(f64::INFINITY, f64::min);
    let max = finite().fold(f64::NEG_INFINITY, f64::max);
    let span = max - min;
    if span.is_finite() && span > 0.0 && max_abs > span {
        let extra = (max_abs / span).log10().ceil();
        (7 + extra as usize).min(17)
    } else {
        7
    }
}

fn push_json_number(out: &mut String, value: f64, digits: usize) {
    if !value.is_finite() {
        out.push_str("null");
        return;
    }
    let rounded: f64 = format!("{:.*e}", digits - 1, value)
        .parse()
        .unwrap_or(value);
    if rounded == 0.0 {
        // Also hides the sign of a negative zero.
        out.push('0');
        return;
    }
    let plain = rounded.to_string();
    let exponent = format!("{rounded:e}");
    out.push_str(if exponent.len() < plain.len() {
        &exponent
    } else {
        &plain
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbers(values: &[f64]) -> String {
        let mut out = String::new();
        push_json_numbers(&mut out, values);
        out
    }

    #[test]
    fn four_digits() {
        let shown = [0.0, 1.5, 0.0123456, 1234.56, 99999.4, 1e-7, f64::NAN].map(short);
        assert_eq!(
            shown,
            ["0", "1.500", "0.01235", "1235", "99999", "1.000e-7", "NaN"]
        );
    }

    #[test]
    fn html_is_escaped() {
        assert_eq!(
            html("<b a=\"1\" b='2'>&</b>"),
            "&lt;b a=&quot;1&quot; b=&#39;2&#39;&gt;&amp;&lt;/b&gt;"
        );
    }

    #[test]
    fn json_string_cannot_close_the_script() {
        let mut out = String::new();
        push_json_string(&mut out, "</script><!-- \"\\\n\u{7f}é");
        assert!(!out.contains('<'));
        let back: String = serde_json::from_str(&out).unwrap();
        assert_eq!(back, "</script><!-- \"\\\n\u{7f}é");
    }

    #[test]
    fn numbers_are_short_and_gaps_are_null() {
        assert_eq!(
            numbers(&[
                0.1 + 0.2,
                -0.0,
                f64::NAN,
                f64::INFINITY,
                1e-12,
                -1.0 / 3.0,
                2.0
            ]),
            "[0.3,0,null,null,1e-12,-0.3333333,2]"
        );
    }

    #[test]
    fn a_large_offset_keeps_the_signal() {
        let xs: Vec<f64> = (0..100).map(|i| 1.7e9 + f64::from(i) * 1e-4).collect();
        let back: Vec<f64> = serde_json::from_str(&numbers(&xs)).unwrap();
        for (a, b) in xs.iter().zip(&back) {
            assert!((a - b).abs() < 1e-6, "{a} {b}");
        }
        // One constant has no span to keep.
        assert_eq!(numbers(&[1.0 / 3.0, 1.0 / 3.0]), "[0.3333333,0.3333333]");
    }
}
