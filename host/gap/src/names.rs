//! The nearest known name to one that is not known.

/// The candidate most like `name`, if any is like it at all. Case does not count.
pub(crate) fn nearest<'a>(
    name: &str,
    candidates: impl IntoIterator<Item = &'a str>,
) -> Option<&'a str> {
    // The distance is quadratic in the length; no known name is near this long.
    if name.len() > 100 {
        return None;
    }
    let name = name.to_lowercase();
    candidates
        .into_iter()
        .map(|candidate| {
            let likeness = strsim::jaro_winkler(&name, &candidate.to_lowercase());
            (likeness, candidate)
        })
        // Below 0.8 unrelated names begin to look alike: `temperature_c` and `torque_nm` have 0.70.
        .filter(|(likeness, _)| *likeness >= 0.8)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, candidate)| candidate)
}

#[cfg(test)]
mod tests {
    use super::nearest;

    #[test]
    fn finds_slips_of_the_pen_only() {
        let known = ["time_s", "torque_nm", "force_n", "position_rad"];
        assert_eq!(nearest("torque_Nm", known), Some("torque_nm"));
        assert_eq!(nearest("positon_rad", known), Some("position_rad"));
        assert_eq!(nearest("temperature_c", known), None);
        assert_eq!(nearest("", known), None);
        assert_eq!(nearest(&"t".repeat(1000), known), None);
    }
}
