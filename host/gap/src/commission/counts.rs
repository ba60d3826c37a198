//! Counts of a turn, judged by what is usual.

use super::Weight;
use crate::report::short;

/// Lines that encoders are sold with.
const LINES: [f64; 22] = [
    100.0, 128.0, 200.0, 250.0, 256.0, 360.0, 400.0, 500.0, 512.0, 720.0, 1000.0, 1024.0, 1250.0,
    1800.0, 2000.0, 2048.0, 2500.0, 3600.0, 4096.0, 5000.0, 8192.0, 10_000.0,
];
/// Factors by which a quadrature decoder, or a data sheet, is misread.
const MISREAD: [f64; 4] = [4.0, 2.0, 0.5, 0.25];

/// A mark that a hand brings back to its place is off by this part of a turn, or this part of a metre.
const HAND: f64 = 0.03;

/// Whether two numbers are one, to a part.
fn alike(a: f64, b: f64, part: f64) -> bool {
    (a / b).ln().abs() < part
}

/// The factor by which counts were misread, if `ratio` to what is believed is one.
pub(super) fn misread(ratio: f64, part: f64) -> Option<f64> {
    MISREAD
        .into_iter()
        .find(|&factor| alike(ratio, factor, part))
}

/// Counts of a turn for what a hand over so many turns measured, what that means, and in words.
pub(super) fn judge(
    measured: f64,
    believed: Option<f64>,
    turns: f64,
    turn: &str,
) -> (f64, Weight, String) {
    let part = HAND / turns;
    let shown = format!(
        "{measured:.0} counts a {turn} by hand, to within {:.1} %",
        100.0 * part
    );
    if let Some(believed) = believed {
        if alike(measured, believed, part) {
            let text = format!("{shown}: {believed} as in the axis file");
            return (believed, Weight::Sound, text);
        }
        if let Some(factor) = misread(measured / believed, part) {
            let counts = factor * believed;
            let times = if factor < 1.0 {
                format!("1/{}", 1.0 / factor)
            } else {
                format!("{factor}")
            };
            let text = format!(
                "{shown}: {counts}, which is {times} times the {believed} of the axis file; lines and counts after \
                 quadrature are a factor of 4 apart"
            );
            return (counts, Weight::Changed, text);
        }
    }
    let powers = (7..=24).map(|bits| f64::from(1_u32 << bits));
    let usual = LINES.into_iter().map(|lines| 4.0 * lines).chain(powers);
    let nearest = usual
        .filter(|&usual| alike(measured, usual, part))
        .min_by(|a, b| {
            (a / measured)
                .ln()
                .abs()
                .total_cmp(&(b / measured).ln().abs())
        });
    let said = believed.map_or(String::new(), |believed| {
        format!(", and not the {believed} of the axis file")
    });
    match nearest {
        Some(counts) => {
            let weight = if believed.is_some() {
                Weight::Changed
            } else {
                Weight::Sound
            };
            let text = format!("{shown}: {counts}, the nearest usual number{said}");
            (counts, weight, text)
        }
        None => {
            let text = format!(
                "{shown}: no usual number is near{said}; turn it by more turns, or read the encoder's label ({} lines?)",
                short((measured / 4.0).round())
            );
            (measured.round(), Weight::Doubtful, text)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hand_names_the_counts() {
        let cases = [
            // As believed; four times; a usual number that nobody believed in; none that is usual.
            (16_300.0, Some(16_384.0), 16_384.0, Weight::Sound),
            (65_000.0, Some(16_384.0), 65_536.0, Weight::Changed),
            (4100.0, Some(16_384.0), 4096.0, Weight::Changed),
            (19_950.0, Some(16_384.0), 20_000.0, Weight::Changed),
            (19_950.0, None, 20_000.0, Weight::Sound),
            (17_500.0, Some(16_384.0), 17_500.0, Weight::Doubtful),
        ];
        for (measured, believed, counts, weight) in cases {
            let judged = judge(measured, believed, 3.0, "turn");
            assert_eq!((judged.0, judged.1), (counts, weight), "{}", judged.2);
        }
    }
}
