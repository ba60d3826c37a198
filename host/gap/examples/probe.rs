use bristle_gap::inverse::{Model, Record, fit};
use bristle_gap::signal::rms;
use bristle_gap::{AxisFile, Believed, Log};
use std::path::Path;
fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let path = Path::new(&args[0]);
    let file = AxisFile::read(path).unwrap();
    let believed = Believed::new(&file, path).unwrap();
    let t = std::time::Instant::now();
    let records: Vec<Record> = args[1..]
        .iter()
        .map(|p| Record::new(&Log::read(Path::new(p)).unwrap(), &file, &believed, &[]).unwrap())
        .collect();
    println!("prep {:?}", t.elapsed());
    for r in &records {
        println!(
            "{} step {} kernel {} nodes {} qnoise {:.2e} unoise {:.2e} noise {:.2e} cmd {}",
            r.name,
            r.step_s,
            r.kernel.length,
            r.nodes(),
            r.position_noise_rad,
            r.effort_noise_nm,
            r.noise_nm(believed.inertia_kg_m2),
            r.commanded
        );
    }
    let model = Model::base(&believed, &records, 0.2).unwrap();
    let t = std::time::Instant::now();
    let r0 = model.left_over(&records, &model.start()).unwrap();
    println!("eval {:?}", t.elapsed());
    let s: Vec<f64> = records
        .iter()
        .flat_map(|r| {
            std::iter::repeat_n(
                1.0 / r
                    .noise_nm(believed.inertia_kg_m2)
                    .max(0.003 * believed.coulomb_nm),
                r.nodes(),
            )
        })
        .collect();
    let t = std::time::Instant::now();
    let f = fit(&model, &records, &s, model.start()).unwrap();
    println!("fit {:?}", t.elapsed());
    let mut at = 0;
    for r in &records {
        let n = r.nodes();
        println!(
            "{}: before {:.4e} after {:.4e}  median {:.3e}",
            r.name,
            rms(r0[at..at + n].iter().copied()),
            rms(f.left_over[at..at + n].iter().copied()),
            {
                let mut a: Vec<f64> = f.left_over[at..at + n].iter().map(|x| x.abs()).collect();
                a.sort_by(f64::total_cmp);
                a[n / 2] / 0.6745
            }
        );
        at += n;
    }
    for (free, v) in model.free.iter().zip(model.values(&f.at)) {
        println!("  {} {} -> {}", free.name, free.start, v);
    }
    if std::env::var("DUMP").is_ok() {
        for r in &records {
            let st = &r.stretches[0];
            for n in 0..r.nodes_of(st) {
                let k = r.middle(n);
                println!(
                    "D {} {} {} {} {}",
                    k as f64 * r.step_s,
                    st.velocity_rad_s[k],
                    st.effort_nm[k],
                    f.left_over[n],
                    st.position_rad[k]
                );
            }
        }
    }
}
