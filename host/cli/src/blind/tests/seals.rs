//! Making, answering and opening a set, and what is refused.

use super::super::answer::{answer, part};
use super::super::make;
use super::super::open::open;
use super::super::page::Score;
use super::super::seal::{Answers, CaseFiles, Key, SCHEMA, SEAL, Seal, Set};
use super::*;
use bristle_gap::{AxisFile, InputError, Log};
use bristle_withheld::{Case, LogTable};
use std::fs;
use std::path::{Path, PathBuf};

/// A set of two cases whose logs are a ramp; the scorer and the seals do not care.
struct Fixture {
    folder: tempfile::TempDir,
}

impl Fixture {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let fixture = Self { folder };
        let truths = [truth(Class::Single, &[COGGING]), truth(Class::Clean, &[])];
        let mut cases = Vec::new();
        for (i, truth) in truths.iter().enumerate() {
            let ramp: Vec<f64> = (0..50).map(f64::from).collect();
            let case = Case {
                axis_toml: "[axis]\ninertia_kg_m2 = 1e-3\n".to_owned(),
                logs: vec![LogTable {
                    name: "sine".to_owned(),
                    columns: vec![
                        ("time_s", ramp.clone()),
                        ("torque_nm", ramp.clone()),
                        ("position_rad", ramp),
                    ],
                }],
                truth: truth.clone(),
            };
            let name = format!("case-{:04}", i + 1);
            let files = make::write_case(&fixture.cases().join(&name), &case).unwrap();
            cases.push(CaseFiles { case: name, files });
        }
        let key = Key {
            schema: SCHEMA,
            program: seal::program(),
            seed: 3,
            salt: "salt".to_owned(),
            cases: cases
                .iter()
                .map(|case| case.case.clone())
                .zip(truths)
                .collect(),
        };
        let key_sha256 = seal::write(&fixture.key(), &key).unwrap();
        let seal = Seal {
            schema: SCHEMA,
            program: seal::program(),
            made: seal::now(),
            key_sha256,
            cases,
        };
        seal::write(&fixture.cases().join(SEAL), &seal).unwrap();
        fixture
    }

    fn cases(&self) -> PathBuf {
        self.folder.path().join("cases")
    }

    fn key(&self) -> PathBuf {
        self.folder.path().join("key.json")
    }

    fn answers(&self) -> PathBuf {
        self.folder.path().join("answers.json")
    }

    fn answer(&self) -> Answers {
        answer(&self.cases(), &self.answers(), 1, &cogging).unwrap()
    }

    fn open(&self) -> Result<Score, InputError> {
        open(&self.cases(), &self.key(), &self.answers(), None)
    }

    fn refusal(&self) -> String {
        self.open().unwrap_err().to_string()
    }
}

/// Says cogging of everything.
fn cogging(_: &AxisFile, _: &[Log]) -> Result<Value, InputError> {
    Ok(said(
        "effect",
        &["actuator.cogging"],
        0.9,
        &["actuator.cogging"],
    ))
}

fn replace(path: &Path, from: &str, to: &str) {
    let text = fs::read_to_string(path).unwrap();
    assert!(text.contains(from), "{from} not in {}", path.display());
    fs::write(path, text.replacen(from, to, 1)).unwrap();
}

#[test]
fn an_untouched_set_is_scored() {
    let fixture = Fixture::new();
    let answers = fixture.answer();
    let score = fixture.open().unwrap();
    assert_eq!(score.outcomes.iter().filter(|one| one.exact).count(), 1);
    let figure = |name: &str| {
        score
            .figures
            .iter()
            .find(|figure| figure.name == name)
            .unwrap()
    };
    assert_eq!(figure("4x single: exact").value, Some(1.0));
    assert_eq!(figure("clean: accused").value, Some(1.0));
    assert!(!figure("clean: accused").holds() && figure("4x single: exact").holds());
    // Without a case there is no figure, and no figure does not hold.
    assert!(figure("pair: both found").value.is_none() && !figure("pair: both found").holds());
    // One right and one wrong at 0.9.
    let calibration = score.calibration.as_ref().unwrap();
    assert!(
        (calibration.expected_error - 0.4).abs() < 1e-12
            && (calibration.brier - 0.41).abs() < 1e-12
    );
    let page = score.markdown("bristle blind open");
    assert!(
        page.contains("| case-0002 | 7 | clean |") && !page.contains("| case-0001 |"),
        "{page}"
    );
    assert!(score.report("c").to_html().contains("Reliability"));
    assert!(
        open(
            &fixture.cases(),
            &fixture.key(),
            &fixture.answers(),
            Some(&answers.sha256)
        )
        .is_ok()
    );
    let error = open(
        &fixture.cases(),
        &fixture.key(),
        &fixture.answers(),
        Some("00"),
    )
    .unwrap_err();
    assert!(
        error.to_string().contains("not the 00 that was given"),
        "{error}"
    );
}

#[test]
fn a_tampered_key_is_refused() {
    let fixture = Fixture::new();
    fixture.answer();
    replace(&fixture.key(), "actuator.cogging", "actuator.ripple");
    let error = fixture.refusal();
    assert!(
        error.contains("key.json: was changed after it was sealed: SHA-256"),
        "{error}"
    );
}

#[test]
fn a_changed_case_file_is_refused_by_answer_and_open() {
    let fixture = Fixture::new();
    fixture.answer();
    replace(
        &fixture.cases().join("case-0002").join("axis.toml"),
        "1e-3",
        "2e-3",
    );
    let error = fixture.refusal();
    assert!(
        error.contains("axis.toml: was changed after it was sealed"),
        "{error}"
    );
    fs::remove_file(fixture.answers()).unwrap();
    let error = answer(&fixture.cases(), &fixture.answers(), 1, &cogging)
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("case-0002") && error.contains("was changed"),
        "{error}"
    );
    assert!(!fixture.answers().exists());
}

#[test]
fn a_changed_or_missing_answer_is_refused() {
    let fixture = Fixture::new();
    fixture.answer();
    let untouched = fs::read(fixture.answers()).unwrap();
    replace(
        &fixture.answers(),
        "\"effect\": \"actuator.cogging\"",
        "\"effect\": \"actuator.ripple\"",
    );
    let error = fixture.refusal();
    assert!(
        error.contains("the answer to case-0001 was changed after it was sealed"),
        "{error}"
    );

    // One whose own hash was made anew still breaks the seal of all.
    let mut answers: Answers = serde_json::from_slice(&untouched).unwrap();
    answers.answers[1] = sealed("case-0002", said("none", &[], 0.9, &[]));
    seal::write(&fixture.answers(), &answers).unwrap();
    assert!(
        fixture
            .refusal()
            .contains("the list of answers was changed"),
        "{}",
        fixture.refusal()
    );

    let mut answers: Answers = serde_json::from_slice(&untouched).unwrap();
    answers.answers.pop();
    answers.sha256 = answers.hash();
    seal::write(&fixture.answers(), &answers).unwrap();
    assert!(
        fixture.refusal().contains("holds no answer to case-0002"),
        "{}",
        fixture.refusal()
    );

    replace(
        &fixture.cases().join(SEAL),
        "\"schema\": 1",
        "\"schema\":  1",
    );
    fs::write(fixture.answers(), untouched).unwrap();
    assert!(
        fixture.refusal().contains("answers another set"),
        "{}",
        fixture.refusal()
    );
}

#[test]
fn a_stopped_run_goes_on_and_is_not_scored_before_its_end() {
    let fixture = Fixture::new();
    // The second case fails as a crash would: an error of the files, not of the diagnosis.
    let second = fixture.cases().join("case-0002").join("axis.toml");
    let good = fs::read(&second).unwrap();
    fs::remove_file(&second).unwrap();
    assert!(answer(&fixture.cases(), &fixture.answers(), 1, &cogging).is_err());
    assert!(part(&fixture.answers()).exists());
    assert!(
        fixture.refusal().contains("not every answer is sealed"),
        "{}",
        fixture.refusal()
    );
    fs::write(&second, good).unwrap();
    // Whoever answers now gives another answer: that of the first case stands.
    let other =
        |_: &AxisFile, _: &[Log]| -> Result<Value, InputError> { Ok(said("none", &[], 0.7, &[])) };
    let answers = answer(&fixture.cases(), &fixture.answers(), 1, &other).unwrap();
    let kinds: Vec<&str> = answers
        .answers
        .iter()
        .map(|one| {
            one.answer.as_ref().unwrap()["verdict"]["kind"]
                .as_str()
                .unwrap()
        })
        .collect();
    assert_eq!(kinds, ["effect", "none"]);
    assert!(!part(&fixture.answers()).exists());
    assert!(fixture.open().is_ok());
    // Sealed answers are not given a second time.
    assert!(answer(&fixture.cases(), &fixture.answers(), 1, &other).is_err());
}

#[test]
fn a_set_is_made_the_same_twice_and_can_be_read() {
    use clap::Parser;
    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        args: make::Args,
    }
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    let make_at = |out: &str, key: &str| {
        let (out, key) = (path(out), path(key));
        make::run(
            &Line::parse_from([
                "x",
                "--cases",
                "2",
                "--seed",
                "4",
                "--out",
                &out,
                "--key-out",
                &key,
            ])
            .args,
        )
    };
    make_at("a", "a.json").unwrap();
    make_at("b", "b.json").unwrap();
    let (a, b) = (
        Set::read(&folder.path().join("a")).unwrap(),
        Set::read(&folder.path().join("b")).unwrap(),
    );
    assert_eq!(
        (&a.seal.cases, &a.seal.key_sha256),
        (&b.seal.cases, &b.seal.key_sha256)
    );
    for case in &a.seal.cases {
        a.check(case).unwrap();
        let at = a.folder.join(&case.case);
        let axis = AxisFile::read(at.join("axis.toml")).unwrap();
        for name in case.files.keys().filter(|name| name.contains("csv")) {
            let log = Log::read(at.join(name)).unwrap();
            assert!(log.notices().is_empty(), "{:?}", log.notices());
            assert_eq!(
                log.effort_nm(&axis).unwrap().len(),
                log.position_rad(&axis).unwrap().len()
            );
        }
    }
    // Nothing readable beside the cases says what is in them.
    let seal = fs::read_to_string(a.folder.join(SEAL)).unwrap();
    let key: Key = seal::read(&folder.path().join("a.json")).unwrap();
    for effect in key.cases.values().flat_map(|truth| &truth.effects) {
        assert!(!seal.contains(&effect.id));
    }
    assert!(
        make_at("a", "c.json")
            .unwrap_err()
            .to_string()
            .contains("is not empty")
    );
    assert!(
        make_at("d", "d/key.json")
            .unwrap_err()
            .to_string()
            .contains("lies among the cases")
    );
}
