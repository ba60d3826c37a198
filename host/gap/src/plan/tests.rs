use super::*;
use crate::axis_file::AxisFile;

fn axis(text: &str) -> Believed {
    let path = Path::new("axis.toml");
    Believed::new(&AxisFile::parse(text, path).unwrap(), path).unwrap()
}

fn bench() -> Believed {
    axis(include_str!("../../../../axes/bench.toml"))
}

fn emps() -> Believed {
    axis(include_str!("../../../../axes/emps.toml"))
}

fn whole(axis: &Believed) -> Plan {
    let steps = Named::ALL.into_iter().enumerate().map(|(i, named)| Step {
        why: format!("because of \"{i}\"\n"),
        rest_ticks: 7 * i as u32,
        ..Step::new(named, axis)
    });
    Plan {
        most_s: 240.0,
        ..Plan::new(steps.collect())
    }
}

#[test]
fn what_is_written_reads_back_equal() {
    for axis in [bench(), emps()] {
        let plan = whole(&axis);
        plan.check(&axis, Path::new("plan.toml")).unwrap();
        let text = plan.to_toml(&axis);
        assert_eq!(Plan::parse(&text, "plan.toml", &axis), Ok(plan), "{text}");
    }
}

#[test]
fn what_is_left_out_is_sized_for_the_axis() {
    let axis = bench();
    let text = "[plan]\nrest_s = 0.25\n[[experiment]]\nkind = \"sine\"\nperiod_s = 2\n";
    let plan = Plan::parse(text, "plan.toml", &axis).unwrap();
    let mut expected = Step::new(Named::Sine, &axis);
    expected.rest_ticks = 2500;
    if let Experiment::Sine { period_ticks, .. } = &mut expected.experiment {
        *period_ticks = 20_000;
    }
    assert_eq!(plan.steps, [expected]);
    assert_eq!(plan.total_s(&axis), 5.25);
}

#[test]
fn mistakes_are_one_line_with_place_and_remedy() {
    let first = "[[experiment]]\nkind = \"sine\"\n";
    for (text, expected) in [
        ("", "plan.toml:1:1: a plan has a list of experiments; "),
        ("[plan\n", "plan.toml:1:6: not TOML: "),
        (
            "experiment = 1\n",
            "plan.toml:1:14: a plan has a list of experiments; ",
        ),
        (
            "experiment = []\n",
            "plan.toml:1:14: 0 experiments; give 1 to 1000",
        ),
        (
            "[[experimemt]]\nkind = \"sine\"\n",
            "plan.toml:1:3: unknown key `experimemt` in a plan; did you mean experiment?",
        ),
        (
            "[plan]\nrest = 1\n",
            "plan.toml:2:1: unknown key `rest` in [plan]; did you mean rest_s?",
        ),
        (
            "[[experiment]]\nperiod_s = 1\n",
            "plan.toml:1:1: an experiment without kind; add kind = \"...\", one of sine, pulse,",
        ),
        (
            "[[experiment]]\nkind = \"sinus\"\n",
            "plan.toml:2:8: unknown kind `sinus`; did you mean \"sine\"?",
        ),
        (
            &format!("{first}amplitude_rad = 1\n"),
            "plan.toml:3:1: unknown key `amplitude_rad` in the experiment sine; did you mean amplitude_nm?",
        ),
        (
            &format!("{first}amplitude_n = 1\n"),
            "plan.toml:3:1: amplitude_n is for a linear axis, and this one is rotary; use amplitude_nm",
        ),
        (
            &format!("{first}amplitude_nm = nan\n"),
            "plan.toml:3:16: amplitude_nm is NaN; it must be a finite number",
        ),
        (
            &format!("{first}period_s = 0\n"),
            "plan.toml:3:12: period_s is 0.0; it must be from 0.0001 to",
        ),
        (
            &format!("{first}seconds = 1e9\n"),
            "plan.toml:3:11: seconds is 1000000000.0; it must be from 0.0001 to",
        ),
        (
            &format!("{first}why = 3\n"),
            "plan.toml:3:7: why is a number; write it in quotes",
        ),
        (
            &format!("{first}most_speed_rad_s = 315\n"),
            "plan.toml:3:20: most_speed_rad_s is 315.0, and the axis allows 314.0 rad/s; lower it, or raise \
             speed_limit_rad_s",
        ),
        (
            &format!("{first}most_travel_rad = 101\n"),
            "plan.toml:3:19: most_travel_rad is 101.0, and the axis allows 100.0 rad; ",
        ),
        (
            &format!("{first}most_torque_nm = 0.03\n"),
            "plan.toml:2:8: the sine asks for 3.5100e-2 N m, beyond its most_torque_nm of 0.03; make it smaller",
        ),
        (
            "[[experiment]]\nkind = \"ladder\"\nratio = 2\n",
            "plan.toml:2:8: the ladder has a value out of range; ratio is from above 0 to 1",
        ),
        (
            &format!("[plan]\nmost_s = 5\n{first}"),
            "plan.toml:2:10: the plan takes 5.5 s, and most_s is 5 s; shorten it",
        ),
    ] {
        let error = Plan::parse(text, "plan.toml", &bench())
            .unwrap_err()
            .to_string();
        assert!(error.starts_with(expected), "{error}\n  not\n{expected}");
        assert_eq!(error.lines().count(), 1);
    }
}

#[test]
fn a_plan_beyond_the_axis_is_not_written() {
    let axis = axis(
        "[axis]\ninertia_kg_m2 = 1e-4\n[friction]\ncoulomb_nm = 0.05\n[drive]\ntorque_limit_nm = 0.06\n",
    );
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("plan.toml");
    let plan = Plan::new(vec![Step::new(Named::Pulse, &axis)]);
    // 1.75 times 0.05 N m.
    let error = plan.check(&axis, &path).unwrap_err().to_string();
    assert!(
        error.contains("the pulse asks for 8.7500e-2 N m"),
        "{error}"
    );
    assert!(plan.write(&path, &axis).is_err());
    assert!(!path.exists());
}
