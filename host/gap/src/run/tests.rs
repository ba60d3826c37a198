use super::*;
use crate::axis_file::AxisFile;
use crate::axis_file::EffectEntry;
use crate::believed::Noise;
use crate::experiments::Named;
use crate::log::Log;
use bristle_plant::Unit;

/// Takes note of everything; stops after so many words of progress.
#[derive(Default)]
struct Notes {
    done: Vec<Done>,
    words: usize,
    most_words: Option<usize>,
}

impl Watch for Notes {
    fn progress(&mut self, _: usize, _: &Step, share: f64) {
        assert!((0.0..=1.0).contains(&share), "{share}");
        self.words += 1;
    }

    fn done(&mut self, done: Done) {
        self.done.push(done);
    }

    fn go_on(&self) -> bool {
        self.most_words.is_none_or(|most| self.words < most)
    }
}

fn axis(text: &str) -> Believed {
    let path = Path::new("axis.toml");
    Believed::new(&AxisFile::parse(text, path).unwrap(), path).unwrap()
}

fn bench() -> Believed {
    axis(include_str!("../../../../axes/bench.toml"))
}

fn layout(unit: Unit) -> Layout {
    Layout {
        unit,
        ..Layout::FIRMWARE
    }
}

/// Plays a plan on the virtual axis into a folder.
fn play(
    plan: &Plan,
    axis: &Believed,
    real: &Believed,
    notes: &mut Notes,
) -> (tempfile::TempDir, Result<(), InputError>) {
    let folder = tempfile::tempdir().unwrap();
    let mut bench = Virtual::new(axis, real, Noise::default(), 1).unwrap();
    let run = Run {
        about: About::new(),
        axis,
        layout: layout(axis.unit),
    };
    let place =
        |number: usize, step: &Step| folder.path().join(format!("{number}-{}.csv", step.name()));
    let played = run.play(plan, &mut bench, &place, notes);
    (folder, played)
}

fn alone(step: Step, axis: &Believed, real: &Believed) -> Done {
    let mut notes = Notes::default();
    let (_folder, played) = play(&Plan::new(vec![step]), axis, real, &mut notes);
    played.unwrap();
    notes.done.remove(0)
}

fn header(path: &Path) -> String {
    let text = std::fs::read_to_string(path).unwrap();
    text.lines().next().unwrap().to_owned()
}

#[test]
fn every_experiment_makes_a_log_with_the_columns_of_a_capture() {
    for text in [
        include_str!("../../../../axes/bench.toml"),
        include_str!("../../../../axes/emps.toml"),
    ] {
        let axis = axis(text);
        let plan = Plan::new(Named::ALL.map(|named| Step::new(named, &axis)).into());
        let mut notes = Notes::default();
        let (_folder, played) = play(&plan, &axis, &axis, &mut notes);
        played.unwrap();
        assert_eq!(notes.done.len(), Named::ALL.len());
        let mut expected = Vec::new();
        layout(axis.unit).header(&mut expected).unwrap();
        for (done, step) in notes.done.iter().zip(&plan.steps) {
            assert_eq!(done.seen.end, End::Finished, "{done:?}");
            assert_eq!(
                (done.seen.samples, done.seen.lost),
                (u64::from(step.bounds.ticks), 0)
            );
            let path = done.log.as_ref().unwrap();
            assert_eq!(format!("{}\n", header(path)).as_bytes(), expected);
            let log = Log::read(path).unwrap();
            assert_eq!((log.len() as u64, log.gaps().len()), (done.seen.samples, 0));
            assert_eq!(log.unit.unwrap_or(axis.unit), axis.unit);
            // Every one of them moves the axis or loads its bristles.
            assert!(done.torque_nm > 0.05 * axis.coulomb_nm, "{done:?}");
        }
        let moved = |named: Named| {
            let place = Named::ALL.iter().position(|its| *its == named).unwrap();
            notes.done[place].travel_rad
        };
        // What follows a position gets there, and a tenth of Coulomb friction stays in presliding.
        let z_ss = axis.coulomb_nm / axis.stiffness_nm_rad;
        let needs = |named: Named| Step::new(named, &axis).experiment.needs(1.0).travel_rad;
        for named in [Named::Moves, Named::Reversals] {
            let share = moved(named) / needs(named);
            assert!((0.95..1.1).contains(&share), "{named:?}: {share}");
        }
        assert!(moved(Named::Prbs) < z_ss);
        assert!(moved(Named::Multisine) > z_ss);
    }
}

#[test]
fn the_same_seed_makes_the_same_log() {
    let axis = bench();
    let plan = Plan::new(vec![Step::new(Named::Multisine, &axis)]);
    let logs: Vec<Vec<u8>> = [3, 3, 4]
        .into_iter()
        .map(|seed| {
            let noise = Noise {
                torque_nm: 1e-3,
                position_rad: 0.0,
            };
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("log.csv");
            let mut bench = Virtual::new(&axis, &axis, noise, seed).unwrap();
            let run = Run {
                about: About::new(),
                axis: &axis,
                layout: layout(axis.unit),
            };
            run.play(
                &plan,
                &mut bench,
                &|_, _| path.clone(),
                &mut Notes::default(),
            )
            .unwrap();
            std::fs::read(path).unwrap()
        })
        .collect();
    assert_eq!(logs[0], logs[1]);
    assert_ne!(logs[0], logs[2]);
}

#[test]
fn a_bound_ends_an_experiment_and_the_plan_goes_on() {
    let axis = bench();
    let sine = || Step::new(Named::Sine, &axis);
    let mut travel = sine();
    travel.bounds.travel_rad = 0.2;
    let mut speed = sine();
    speed.bounds.speed_rad_s = 1.0;
    // The loop wants J times 314 1/s times 3 rad/s = 0.024 N m at once.
    let mut torque = Step::new(Named::Ladder, &axis);
    torque.bounds.torque_nm = 0.02;
    let plan = Plan::new(vec![travel, speed, torque, sine()]);
    let mut notes = Notes::default();
    let (_folder, played) = play(&plan, &axis, &axis, &mut notes);
    played.unwrap();
    let ends: Vec<End> = notes.done.iter().map(|done| done.seen.end).collect();
    assert_eq!(ends, [End::Travel, End::Speed, End::Torque, End::Finished]);
    let count = axis.rad_per_count();
    assert!((notes.done[0].travel_rad - 0.2).abs() < count);
    // One tick of 1.35 times stiction on the inertia beyond the bound.
    let tick_rad_s = 1.35 * axis.stiction_nm / axis.inertia_kg_m2 * 1e-4;
    assert!(
        notes.done[1].speed_rad_s <= 1.0 + tick_rad_s,
        "{:?}",
        notes.done[1]
    );
    assert!(notes.done[2].torque_nm <= 0.02);
    assert!(
        notes.done[..2]
            .iter()
            .all(|done| done.seen.samples < 10_000)
    );
    // A sample is no log.
    assert_eq!((notes.done[2].seen.samples, &notes.done[2].log), (1, &None));
}

#[test]
fn a_fault_ends_the_plan_and_keeps_what_was_recorded() {
    let axis = bench();
    let mut real = axis.clone();
    // Friction three times as large: the axis does not break away.
    real.coulomb_nm *= 3.0;
    real.stiction_nm *= 3.0;
    let plan = Plan::new(vec![
        Step::new(Named::Prbs, &axis),
        Step::new(Named::Sine, &axis),
        Step::new(Named::Moves, &axis),
    ]);
    let mut notes = Notes::default();
    let (_folder, played) = play(&plan, &axis, &real, &mut notes);
    let error = played.unwrap_err().to_string();
    assert!(
        error.contains(
            "the sine was ended by a fault: torque above break-away but no encoder count"
        ),
        "{error}"
    );
    let ends: Vec<End> = notes.done.iter().map(|done| done.seen.end).collect();
    assert_eq!(ends, [End::Finished, End::Fault]);
    let log = Log::read(notes.done[1].log.as_ref().unwrap()).unwrap();
    assert_eq!(log.len() as u64, notes.done[1].seen.samples);
}

#[test]
fn a_stop_keeps_what_was_recorded() {
    let axis = bench();
    let plan = Plan::new(vec![
        Step::new(Named::Sine, &axis),
        Step::new(Named::Moves, &axis),
    ]);
    let mut notes = Notes {
        // At the beginning, and then every thousand samples.
        most_words: Some(4),
        ..Notes::default()
    };
    let (_folder, played) = play(&plan, &axis, &axis, &mut notes);
    played.unwrap();
    assert_eq!(notes.done.len(), 1);
    assert_eq!(notes.done[0].seen.end, End::Stopped);
    let log = Log::read(notes.done[0].log.as_ref().unwrap()).unwrap();
    assert_eq!(log.len(), 2001);
}

#[test]
fn an_axis_that_drifts_is_brought_back_within_its_travel() {
    let text = include_str!("../../../../axes/bench.toml").to_owned();
    let axis = axis(&(text + "[drive]\ntravel_limit_rad = 3.0\n"));
    let mut real = axis.clone();
    real.effects.push(EffectEntry {
        id: "mechanics.offset".to_owned(),
        parameters: vec![("torque_nm".to_owned(), 0.004)],
    });
    let mut step = Step::new(Named::Sine, &axis);
    step.bounds.ticks = 20_000;
    step.rest_ticks = 0;
    let plan = Plan::new(vec![step; 5]);
    let folder = tempfile::tempdir().unwrap();
    let mut bench = Virtual::new(&axis, &real, Noise::default(), 1).unwrap();
    let run = Run {
        about: About::new(),
        axis: &axis,
        layout: Layout {
            truth: true,
            ..layout(axis.unit)
        },
    };
    let mut notes = Notes::default();
    let place = |number: usize, _: &Step| folder.path().join(format!("{number}.csv"));
    run.play(&plan, &mut bench, &place, &mut notes).unwrap();
    assert_eq!(notes.done.len(), 5);
    let mut farthest = 0.0_f64;
    for done in &notes.done {
        let log = Log::read(done.log.as_ref().unwrap()).unwrap();
        let count = axis.rad_per_count();
        for counts in &log.position.values {
            farthest = farthest.max((counts * count).abs());
        }
    }
    // Each sine alone drifts by more than half of the travel, so that without the way back the second one would leave it.
    assert!(notes.done[0].travel_rad > 1.5, "{:?}", notes.done[0]);
    assert!(farthest <= 3.0 + axis.rad_per_count(), "{farthest}");
    assert!(notes.done[4].seen.samples > 10_000, "{:?}", notes.done[4]);
}

#[test]
fn an_experiment_has_the_room_that_is_left_of_the_travel() {
    let text = include_str!("../../../../axes/bench.toml").to_owned();
    let axis = axis(&(text + "[drive]\ntravel_limit_rad = 3.0\n"));
    let mut real = axis.clone();
    // Drifts one way under the sine.
    real.effects.push(EffectEntry {
        id: "mechanics.offset".to_owned(),
        parameters: vec![("torque_nm".to_owned(), 0.006)],
    });
    let mut first = Step::new(Named::Sine, &axis);
    first.bounds.travel_rad = 1.2;
    let mut second = Step::new(Named::Sine, &axis);
    second.bounds.ticks = 200_000;
    let mut notes = Notes::default();
    let (_folder, played) = play(&Plan::new(vec![first, second]), &axis, &real, &mut notes);
    played.unwrap();
    let farthest = |done: &Done| {
        let log = Log::read(done.log.as_ref().unwrap()).unwrap();
        let counts = log.position.values.iter();
        counts.fold(0.0_f64, |most, counts| most.max(counts.abs())) * axis.rad_per_count()
    };
    assert!(notes.done.iter().all(|done| done.seen.end == End::Travel));
    // From where the plan began, not from where the second experiment did.
    let reached = farthest(&notes.done[1]);
    assert!((2.9..=3.0 + 1e-9).contains(&reached), "{reached}");
    assert!(notes.done[1].travel_rad < 2.0);
}

/// A virtual axis whose link breaks after so many samples.
struct Breaking(Virtual, u64);

impl Bench for Breaking {
    fn play(
        &mut self,
        experiment: &Experiment<f32>,
        bounds: &Bounds<f32>,
        take: &mut Take<'_>,
    ) -> Result<Seen, InputError> {
        let left = &mut self.1;
        self.0.play(experiment, bounds, &mut |sample, truth| {
            if *left == 0 {
                return Err(InputError::new("link", "it broke", "mend it"));
            }
            *left -= 1;
            take(sample, truth)
        })
    }

    fn rest(&mut self, ticks: u32, go_on: &dyn Fn() -> bool) -> Result<(), InputError> {
        self.0.rest(ticks, go_on)
    }

    fn counts(&self) -> i64 {
        self.0.counts()
    }
}

#[test]
fn a_link_that_breaks_keeps_what_was_recorded() {
    let axis = bench();
    let plan = Plan::new(vec![Step::new(Named::Sine, &axis); 2]);
    let folder = tempfile::tempdir().unwrap();
    let virtual_axis = Virtual::new(&axis, &axis, Noise::default(), 1).unwrap();
    let run = Run {
        about: About::new(),
        axis: &axis,
        layout: layout(axis.unit),
    };
    let mut notes = Notes::default();
    let place = |number: usize, _: &Step| folder.path().join(format!("{number}.csv"));
    let mut bench = Breaking(virtual_axis, 1234);
    let error = run.play(&plan, &mut bench, &place, &mut notes).unwrap_err();
    assert_eq!(error.to_string(), "link: it broke; mend it");
    assert_eq!(notes.done.len(), 1);
    let log = Log::read(notes.done[0].log.as_ref().unwrap()).unwrap();
    assert_eq!(log.len(), 1234);
}

#[test]
fn what_asks_for_too_much_does_not_begin() {
    let axis = bench();
    let mut step = Step::new(Named::Moves, &axis);
    step.bounds.travel_rad = 0.5;
    let mut bench = Virtual::new(&axis, &axis, Noise::default(), 1).unwrap();
    let bounds = Bounds {
        travel_rad: 0.5,
        ..Bounds::open(1000)
    };
    let experiment = in_single_precision(&step.experiment);
    let error = bench
        .play(&experiment, &bounds, &mut |_, _| Ok(true))
        .unwrap_err();
    assert!(
        error
            .to_string()
            .contains("asks for more travel than its bound")
    );
}

#[test]
fn one_experiment_runs_alone() {
    let axis = bench();
    let done = alone(Step::new(Named::Sine, &axis), &axis, &axis);
    // The sine of 1.35 times stiction breaks away: many times z_ss of 1.9 mrad.
    assert!(done.travel_rad > 0.1, "{done:?}");
}
