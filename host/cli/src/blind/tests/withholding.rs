//! A term taken out of a file.

use super::super::withhold::withhold;
use bristle_gap::{AxisFile, InputError, Log};
use serde_json::{Value, json};
use std::path::Path;

#[test]
fn withholding_takes_a_term_out_and_says_what_is_won_back() {
    let path = Path::new("axis.toml");
    let text = "[axis]\nmass_kg = 95\n\n[friction]\nmodel = \"elasto-plastic\"\ncoulomb_n = 20\nstiction_n = 24\n\n[[effect]]\nid = \
                \"mechanics.offset\"\nforce_n = 3\n";
    let axis = AxisFile::parse(text, path).unwrap();
    let log = Log::parse("time_s,force_n,position_m\n0,0,0\n1,1,1\n", "log.csv").unwrap();
    // Gap 1 with an offset in the file, 5 without; the diagnosis closes to 2 and finds 2.5 N.
    let answerer = |file: &AxisFile, _: &[Log]| -> Result<Value, InputError> {
        let offset = file
            .effects
            .iter()
            .find(|effect| effect.id == "mechanics.offset");
        let before = offset.map_or(5.0, |effect| {
            1.0 + 2.0 * (3.0 - effect.parameter("force_n").unwrap()).abs()
        });
        Ok(json!({
            "verdict": {"kind": "effect"},
            "gap": {"before": before, "after": before.min(2.0)},
            "candidates": [{"effect": "mechanics.offset", "parameters": {"force_n": 2.5}}, {"effect": "friction.asymmetry"}],
        }))
    };
    let logs = [log];
    let result = withhold(
        &axis,
        path,
        "mechanics.offset",
        &logs,
        &logs,
        &answerer,
        |_| {},
    )
    .unwrap();
    assert!(result.named_first);
    assert_eq!(result.train.share, Some(0.75));
    assert_eq!(
        (result.held_out[0].1.closed, result.held_out[0].1.share),
        (2.0, Some(0.75))
    );
    let other = withhold(
        &axis,
        path,
        "friction.stribeck",
        &logs,
        &[],
        &answerer,
        |_| {},
    )
    .unwrap();
    assert!(!other.named_first && other.train.share.is_none());
    let error = withhold(
        &axis,
        path,
        "actuator.cogging",
        &logs,
        &[],
        &answerer,
        |_| {},
    )
    .unwrap_err();
    assert_eq!(
        error.to_string(),
        "axis.toml: has no term actuator.cogging to take out; it has mechanics.offset, friction.stribeck, friction.presliding"
    );
}
