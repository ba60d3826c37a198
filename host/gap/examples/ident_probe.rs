//! probe
use bristle_gap::axis_file::FrictionModel;
use bristle_gap::identify::joint::*;
use bristle_gap::{AxisFile, Log};
use std::path::Path;
fn main() {
    let args: Vec<String> = std::env::args().collect();
    let axis = AxisFile::read(&args[1]).unwrap();
    let with: Vec<String> = args[2]
        .split(',')
        .filter(|s| !s.is_empty())
        .map(String::from)
        .collect();
    let logs: Vec<Usable> = args[4..]
        .iter()
        .filter(|s| !s.starts_with('@'))
        .map(|p| Usable {
            log: Log::read(p).unwrap(),
            excluded: vec![],
        })
        .collect();
    let held: Vec<Usable> = args[4..]
        .iter()
        .filter(|s| s.starts_with('@'))
        .map(|p| Usable {
            log: Log::read(&p[1..]).unwrap(),
            excluded: vec![],
        })
        .collect();
    let t = std::time::Instant::now();
    let options = Options {
        model: FrictionModel::from_name(&args[3]),
        with: entries(&with).unwrap(),
        weighting: if std::env::var("PLAIN").is_ok() {
            Weighting::Equal
        } else {
            Weighting::Noise
        },
    };
    let out = identify(&logs, &axis, Path::new(&args[1]), &options, &|_| {}).unwrap();
    println!(
        "{:?} {:?} cost {}",
        t.elapsed(),
        out.joint.kind,
        out.joint.fit.cost
    );
    for e in out.estimates.iter().chain(&out.timing) {
        println!(
            "{:40} {:12.5e} {:?} {:?} prof {} {:?}",
            e.name, e.value, e.low, e.high, e.profiled, e.verdict
        );
    }
    for c in &out.compared {
        println!("{c:?}");
    }
    for e in &out.errors {
        println!("{e:?}");
    }
    if !held.is_empty() {
        let (_, records) = prepare(&held, &axis, Path::new(&args[1])).unwrap();
        for e in errors(&out.joint, &records).unwrap() {
            println!("held {e:?}");
        }
    }
}
