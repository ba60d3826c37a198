//! A proposed plan stays within limits and time, is worth more than any experiment alone, and says what cannot be shown.

use bristle_core::experiment::fields::in_single_precision;
use bristle_core::experiment::{Bounds, End};
use bristle_gap::believed::Noise;
use bristle_gap::identify::Verdict;
use bristle_gap::plan::travel_limit_rad;
use bristle_gap::propose::{Proposal, Wish, propose};
use bristle_gap::run::{Bench, Virtual};
use bristle_gap::{AxisFile, Believed};
use std::path::Path;

const BENCH: &str = include_str!("../../../axes/bench.toml");
/// An encoder that shows the bristles: 80 counts of z_ss; and limits that bind.
const LIMITS: &str =
    "[drive]\ntravel_limit_rad = 1.5\nspeed_limit_rad_s = 20\ntorque_limit_nm = 0.08\n";

fn axis(text: &str) -> (AxisFile, Believed) {
    let path = Path::new("axis.toml");
    let file = AxisFile::parse(text, path).unwrap();
    let believed = Believed::new(&file, path).unwrap();
    (file, believed)
}

fn proposal(file: &AxisFile, most_s: f64) -> Proposal {
    let wish = Wish {
        most_s,
        noise: Noise::default(),
        seed: 1,
    };
    propose(file, Path::new("axis.toml"), &wish, &|_| ()).unwrap()
}

fn fine() -> String {
    let fine = BENCH.replace("counts_per_rev = 16384", "counts_per_rev = 262144");
    assert_ne!(fine, BENCH);
    fine
}

#[test]
fn within_limits_and_time_and_better_than_any_experiment_alone() {
    let (file, believed) = axis(&(fine() + LIMITS));
    let proposal = proposal(&file, 40.0);
    assert!(proposal.total_s <= 40.0, "{}", proposal.total_s);
    assert!(proposal.plan.total_s(&believed) <= proposal.total_s + 1e-9);
    proposal.plan.check(&believed, Path::new("plan")).unwrap();
    assert!(
        proposal.tried[1] < proposal.tried[0],
        "limits bind: {:?}",
        proposal.tried
    );
    // Each ends because its time is over, and has used half of the travel at most.
    for step in &proposal.plan.steps {
        assert!(step.why.starts_with("narrows "), "{}", step.why);
        let mut bench = Virtual::new(&believed, &believed, Noise::default(), 7).unwrap();
        let bounds = Bounds {
            travel_rad: (0.5 * travel_limit_rad(&believed)) as f32,
            speed_rad_s: believed.speed_limit_rad_s as f32,
            torque_nm: believed.torque_limit_nm() as f32,
            ticks: step.bounds.ticks,
        };
        let experiment = in_single_precision(&step.experiment);
        let seen = bench
            .play(&experiment, &bounds, &mut |_, _| Ok(true))
            .unwrap();
        assert_eq!(seen.end, End::Finished, "{}: {:?}", step.name(), seen);
    }
    let (name, best) = proposal.alone[0];
    println!("{:.1} nats; {} alone {best:.1}", proposal.nats, name.name());
    // A nat is an interval narrowed to 0.37 of itself; the margin is against rounding alone.
    assert!(proposal.nats > best + 0.1, "{} {best}", proposal.nats);
}

#[test]
fn what_a_coarse_encoder_hides_is_named_with_its_reason() {
    // A count is 0.8 of z_ss.
    let coarse = BENCH.replace("counts_per_rev = 16384", "counts_per_rev = 4096");
    let (file, _) = axis(&coarse);
    let proposal = proposal(&file, 15.0);
    let names: Vec<&str> = proposal
        .hidden
        .iter()
        .map(|(name, _)| name.as_str())
        .collect();
    assert_eq!(
        names,
        ["stiffness_nm_rad", "damping_nm_s_rad", "breakaway_ratio"]
    );
    assert!(
        proposal.hidden[0].1.contains("finer encoder"),
        "{:?}",
        proposal.hidden
    );
    let inertia = proposal.expected.iter().find(|e| e.name == "inertia_kg_m2");
    assert_eq!(inertia.unwrap().verdict, Verdict::Identified);
}

#[test]
fn limits_that_leave_no_motion_are_said_to_show_nothing() {
    // A count is 0.4 mrad: the axis may not move by a tenth of one.
    let tight = "[drive]\ntravel_limit_rad = 1e-5\ntorque_limit_nm = 1e-3\n";
    let (file, _) = axis(&(BENCH.to_string() + tight));
    let proposal = proposal(&file, 15.0);
    for name in ["inertia_kg_m2", "coulomb_nm", "stiffness_nm_rad"] {
        let found = proposal.expected.iter().find(|e| e.name == name).unwrap();
        assert_eq!(found.verdict, Verdict::NotIdentified, "{name}");
        assert!(found.advice.is_some(), "{name}");
    }
}

#[test]
fn refuses_what_cannot_be_planned() {
    let wish = |most_s| Wish {
        most_s,
        noise: Noise::default(),
        seed: 1,
    };
    let path = Path::new("axis.toml");
    let (file, _) = axis(BENCH);
    let error = propose(&file, path, &wish(1.0), &|_| ()).err().unwrap();
    assert!(error.to_string().contains("allow more time"), "{error}");
    let file = AxisFile::parse("[axis]\ninertia_kg_m2 = 1e-4\n", path).unwrap();
    let error = propose(&file, path, &wish(60.0), &|_| ()).err().unwrap();
    assert!(error.to_string().contains("coulomb_nm"), "{error}");
}
