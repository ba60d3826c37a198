//! Every bad file has one line that names the place and the remedy.

use std::path::Path;

use bristle_gap::{AxisFile, InputError, Log, Unit};

/// What is wrong, the file, and the line that a user reads after the file's name.
type Case = (&'static str, &'static [u8], &'static str);

const LOGS: &[Case] = &[
    (
        "an empty file",
        b"",
        "log.csv:1: the file is empty; give a log with a header and at least two rows",
    ),
    (
        "blank lines only",
        b"\n\n",
        "log.csv:1: the file is empty; give a log with a header and at least two rows",
    ),
    (
        "a header only",
        b"time_s,torque_nm,position_rad\n",
        "log.csv:1: only a header, no rows; a log needs at least two rows",
    ),
    (
        "one row only",
        b"time_s,torque_nm,position_rad\n0,1,2\n",
        "log.csv:2: one row only; a log needs at least two rows",
    ),
    (
        "not UTF-8",
        b"time_s,torque_nm,position_rad\n0,1,2\n1,\xff,2\n",
        "log.csv:3:3: not UTF-8 text: byte 0xff has no meaning here; give a text file in UTF-8, or one packed with gzip",
    ),
    (
        "a zero byte",
        b"time_s,torque_nm,position_rad\n0,1,2\n\x001,1,2\n",
        "log.csv:3:1: not a text file: it holds a zero byte; give a text file in UTF-8, or one packed with gzip",
    ),
    (
        "UTF-16",
        b"\xff\xfet\x00i\x00",
        "log.csv:1:1: the text is UTF-16; save the file as UTF-8",
    ),
    (
        "gzip that is none",
        b"\x1f\x8babcdefghijkl",
        "log.csv:1: the gzip data are damaged (invalid gzip header); copy or record the file again",
    ),
    (
        "a header without time",
        b"torque_nm,position_rad\n1,2\n3,4\n",
        "log.csv:1: missing column: time_s; the header has `torque_nm`, `position_rad`",
    ),
    (
        "a slip in a name",
        b"time_s,torque_Nm,position_rad\n0,1,2\n1,1,2\n",
        "log.csv:1: missing column: an effort (torque_nm, force_n, torque_ref_nm, force_ref_n, current_a or voltage_v); did you mean torque_nm (in N m) where it says `torque_Nm`?",
    ),
    (
        "milliseconds",
        b"time_ms,torque_nm,position_rad\n0,1,2\n1,1,2\n",
        "log.csv:1: missing column: time_s; did you mean time_s (in s) where it says `time_ms`?",
    ),
    (
        "nothing known",
        b"a,b\n0,1\n1,2\n",
        "log.csv:1: missing columns: time_s, and an effort (torque_nm, force_n, torque_ref_nm, force_ref_n, current_a or voltage_v), and a position (position_rad, position_m or position_counts); the header has `a`, `b`",
    ),
    (
        "no header",
        b"0,1,2\n1,1,2\n",
        "log.csv:1:1: the first line holds numbers, not the names of columns; put a header such as time_s,torque_nm,position_rad before it",
    ),
    (
        "semicolons",
        b"time_s;torque_nm;position_rad\n0;1;2\n1;1;2\n",
        "log.csv:1:1: the header `time_s;torque_nm;position_rad` is separated by semicolons; separate columns by commas, and write numbers with a decimal point",
    ),
    (
        "tabs",
        b"time_s\ttorque_nm\tposition_rad\n0\t1\t2\n",
        "log.csv:1:1: the header `time_s\\ttorque_nm\\tposition_rad` is separated by tabs; separate columns by commas, and write numbers with a decimal point",
    ),
    (
        "a comment above the header",
        b"# bench 3\ntime_s,torque_nm,position_rad\n0,1,2\n1,1,2\n",
        "log.csv:1:1: `# bench 3` is a comment, which a log cannot hold; delete the lines that start with #",
    ),
    (
        "a comment among the rows",
        b"time_s,torque_nm,position_rad\n0,1,2\n# pause\n1,1,2\n",
        "log.csv:3: a comment, which a log cannot hold; delete the lines that start with #",
    ),
    (
        "a name twice",
        b"time_s,torque_nm,torque_nm,position_rad\n0,1,1,2\n1,1,1,2\n",
        "log.csv:1: column torque_nm: stands twice in the header; rename or delete one of the two",
    ),
    (
        "a column without a name",
        b"time_s,torque_nm,,position_rad\n0,1,1,2\n1,1,1,2\n",
        "log.csv:1: column 3: has no name in the header; name it, or delete the column",
    ),
    (
        "torque and force",
        b"time_s,torque_nm,force_n,position_rad\n0,1,1,2\n1,1,1,2\n",
        "log.csv:1: column force_n: force_n is of a linear axis, torque_nm of a rotary one; use torque and rad for a rotary axis, force and m for a linear one",
    ),
    (
        "torque and metres",
        b"time_s,torque_nm,position_m\n0,1,2\n1,1,2\n",
        "log.csv:1: column position_m: position_m is of a linear axis, torque_nm of a rotary one; use torque and rad for a rotary axis, force and m for a linear one",
    ),
    (
        "force and radians",
        b"time_s,force_n,position_rad\n0,1,2\n1,1,2\n",
        "log.csv:1: column position_rad: position_rad is of a rotary axis, force_n of a linear one; use torque and rad for a rotary axis, force and m for a linear one",
    ),
    (
        "a load in metres behind a motor in radians",
        b"time_s,current_a,position_rad,position_load_m\n0,1,2,3\n1,1,2,3\n",
        "log.csv:1: column position_load_m: position_load_m is of a linear axis, position_rad of a rotary one; use torque and rad for a rotary axis, force and m for a linear one",
    ),
    (
        "a missing cell",
        b"time_s,torque_nm,position_rad\n0,1,2\n1,1\n",
        "log.csv:3: column position_rad: 2 cells where the header names 3 columns; complete the row or delete it",
    ),
    (
        "a cell too many",
        b"time_s,torque_nm,position_rad\n0,1,2\n1,1,2,3\n",
        "log.csv:3: column 4: 4 cells where the header names 3 columns; delete what is too much; write numbers with a decimal point",
    ),
    (
        "decimal commas",
        b"time_s,torque_nm,position_rad\n0,0,1,0,2,0\n",
        "log.csv:2: column 4: 6 cells where the header names 3 columns; delete what is too much; write numbers with a decimal point",
    ),
    (
        "an empty cell",
        b"time_s,torque_nm,position_rad\n0,1,2\n1,,2\n",
        "log.csv:3: column torque_nm: the cell is empty; fill it or delete the row; a gap in time is allowed",
    ),
    (
        "NaN",
        b"time_s,torque_nm,position_rad\n0,1,2\n1,NaN,2\n",
        "log.csv:3: column torque_nm: is not a number (NaN); delete the row; a gap in time is allowed",
    ),
    (
        "an infinity",
        b"time_s,torque_nm,position_rad\n0,1,2\n1,1,-inf\n",
        "log.csv:3: column position_rad: `-inf` is infinite; delete the row; a gap in time is allowed",
    ),
    (
        "too large for a number",
        b"time_s,torque_nm,position_rad\n0,1,2\n1,1e999,2\n",
        "log.csv:3: column torque_nm: `1e999` is infinite; delete the row; a gap in time is allowed",
    ),
    (
        "not a number",
        b"time_s,torque_nm,position_rad\n0,1,2\n1,abc,2\n",
        "log.csv:3: column torque_nm: `abc` is not a number; write a number with a decimal point and without its unit",
    ),
    (
        "a number with its unit",
        b"time_s,torque_nm,position_rad\n0,1 Nm,2\n1,1,2\n",
        "log.csv:2: column torque_nm: `1 Nm` is not a number; write a number with a decimal point and without its unit",
    ),
    (
        "a quoted decimal comma",
        b"time_s,torque_nm,position_rad\n0,\"0,5\",2\n1,1,2\n",
        "log.csv:2: column torque_nm: `0,5` is not a number; write a number with a decimal point and without its unit",
    ),
    (
        "the same time twice",
        b"time_s,torque_nm,position_rad\n0,1,2\n0.5,1,2\n0.5,1,2\n",
        "log.csv:4: column time_s: time `0.5` stands twice in a row; delete the duplicate row, or print time with more digits",
    ),
    (
        "time backwards",
        b"time_s,torque_nm,position_rad\n0,1,2\n0.5,1,2\n0.25,1,2\n",
        "log.csv:4: column time_s: time goes back from 0.5 to `0.25`; sort the rows by time, or give one record a file",
    ),
    (
        "NaN as time",
        b"time_s,torque_nm,position_rad\nnan,1,2\n0.5,1,2\n",
        "log.csv:2: column time_s: is not a number (NaN); delete the row; a gap in time is allowed",
    ),
    (
        "part of a count",
        b"time_s,torque_nm,position_counts\n0,1,2\n1,1,2.5\n",
        "log.csv:3: column position_counts: `2.5` is not a whole number of counts within 2^53; give encoder counts, or name the column position_rad or position_m",
    ),
    (
        "more counts than a double tells apart",
        b"time_s,torque_nm,position_counts\n0,1,2\n1,1,1e16\n",
        "log.csv:3: column position_counts: `1e16` is not a whole number of counts within 2^53; give encoder counts, or name the column position_rad or position_m",
    ),
    (
        "an open quote",
        b"time_s,torque_nm,position_rad\n0,1,2\n1,\"1,2\n2,1,2\n",
        "log.csv:3: column position_rad: 2 cells where the header names 3 columns; close the quote that opens in this row",
    ),
    (
        "carriage returns and blank lines in the count of lines",
        b"time_s,torque_nm,position_rad\r\n0,1,2\r\n\r\n1,x,2\r\n",
        "log.csv:4: column torque_nm: `x` is not a number; write a number with a decimal point and without its unit",
    ),
    (
        "a line break in a cell",
        b"time_s,torque_nm,position_rad,note\n0,1,2,\"a\nb\"\n1,x,2,c\n",
        "log.csv:4: column torque_nm: `x` is not a number; write a number with a decimal point and without its unit",
    ),
    (
        "control characters in a cell",
        b"time_s,torque_nm,position_rad\n0,1,2\n1,\x1b[2J,2\n",
        "log.csv:3: column torque_nm: `\\u{1b}[2J` is not a number; write a number with a decimal point and without its unit",
    ),
];

const AXES: &[Case] = &[
    (
        "an empty file",
        b"",
        "axis.toml:1:1: the section [axis] is missing; add `inertia_kg_m2 = ...` (rotary) or `mass_kg = ...` (linear) to [axis]",
    ),
    (
        "no axis section",
        b"[friction]\ncoulomb_nm = 1\n",
        "axis.toml:1:1: the section [axis] is missing; add `inertia_kg_m2 = ...` (rotary) or `mass_kg = ...` (linear) to [axis]",
    ),
    (
        "no inertia",
        b"[axis]\ncounts_per_rev = 100\n",
        "axis.toml:1:2: the inertia is missing; add `inertia_kg_m2 = ...` (rotary) or `mass_kg = ...` (linear) to [axis]",
    ),
    (
        "a slip in the inertia",
        b"[axis]\ninertia_kgm2 = 1e-4\n",
        "axis.toml:2:1: unknown key `inertia_kgm2` in [axis]; did you mean inertia_kg_m2?",
    ),
    (
        "inertia and mass",
        b"[axis]\ninertia_kg_m2 = 1e-4\nmass_kg = 1\n",
        "axis.toml:3:1: mass_kg stands beside inertia_kg_m2; keep the first for a linear axis, the second for a rotary one",
    ),
    (
        "a slip in a section",
        b"[axis]\ninertia_kg_m2 = 1e-4\n[fricton]\n",
        "axis.toml:3:2: unknown section `fricton`; did you mean [friction]?",
    ),
    (
        "a slip in the only section",
        b"[axes]\ninertia_kg_m2 = 1\n",
        "axis.toml:1:2: unknown section `axes`; did you mean [axis]?",
    ),
    (
        "a section from elsewhere",
        b"[axis]\ninertia_kg_m2 = 1e-4\n[zzz]\n",
        "axis.toml:3:2: unknown section `zzz`; the sections are [axis], [friction], [drive], [control], [observer] and [[effect]]",
    ),
    (
        "a key above every section",
        b"inertia_kg_m2 = 1e-4\n",
        "axis.toml:1:1: unknown section `inertia_kg_m2`; inertia_kg_m2 belongs below [axis]",
    ),
    (
        "a slip in a key",
        b"[axis]\ninertia_kg_m2 = 1e-4\n[friction]\ncoulom_nm = 1\n",
        "axis.toml:4:1: unknown key `coulom_nm` in [friction]; did you mean coulomb_nm?",
    ),
    (
        "a key from elsewhere",
        b"[axis]\ninertia_kg_m2 = 1e-4\n[friction]\nzzz = 1\n",
        "axis.toml:4:1: unknown key `zzz` in [friction]; the keys are coulomb_nm, stiction_nm, stribeck_velocity_rad_s, stribeck_exponent, stiffness_nm_rad, damping_nm_s_rad, viscous_nm_s_rad, breakaway_ratio, dahl_exponent, friction_lag_s, dwell_s, rest_velocity_rad_s, model, stribeck_shape",
    ),
    (
        "a key in the wrong section",
        b"[axis]\ninertia_kg_m2 = 1e-4\n[friction]\nlag_s = 1\n",
        "axis.toml:4:1: unknown key `lag_s` in [friction]; it belongs below [drive]",
    ),
    (
        "a linear key on a rotary axis",
        b"[axis]\ninertia_kg_m2 = 1e-4\n[friction]\ncoulomb_n = 1\n",
        "axis.toml:4:1: coulomb_n is for a linear axis, and inertia_kg_m2 makes this one rotary; use coulomb_nm",
    ),
    (
        "a rotary key on a linear axis",
        b"[axis]\nmass_kg = 10\ncounts_per_rev = 1\n",
        "axis.toml:3:1: counts_per_rev is for a rotary axis, and mass_kg makes this one linear; use counts_per_m",
    ),
    (
        "a negative inertia",
        b"[axis]\ninertia_kg_m2 = -1\n",
        "axis.toml:2:17: inertia_kg_m2 is -1.0; it must be a finite number above zero",
    ),
    (
        "no mass at all",
        b"[axis]\nmass_kg = 0\n",
        "axis.toml:2:11: mass_kg is 0.0; it must be a finite number above zero",
    ),
    (
        "NaN",
        b"[axis]\ninertia_kg_m2 = 1e-4\n[friction]\nviscous_nm_s_rad = nan\n",
        "axis.toml:4:20: viscous_nm_s_rad is NaN; it must be a finite number, zero or above",
    ),
    (
        "an infinity",
        b"[axis]\ninertia_kg_m2 = 1e-4\n[friction]\n  stiffness_nm_rad = inf\n",
        "axis.toml:4:22: stiffness_nm_rad is inf; it must be a finite number above zero",
    ),
    (
        "too large for a number",
        b"[axis]\ninertia_kg_m2 = 1e-4\n[friction]\nstiffness_nm_rad = 1e999\n",
        "axis.toml:4:20: stiffness_nm_rad is inf; it must be a finite number above zero",
    ),
    (
        "a ratio above one",
        b"[axis]\ninertia_kg_m2 = 1e-4\n[friction]\nbreakaway_ratio = 1.2\n",
        "axis.toml:4:19: breakaway_ratio is 1.2; it must be from 0 to below 1",
    ),
    (
        "stiction below Coulomb friction",
        b"[axis]\ninertia_kg_m2 = 1e-4\n[friction]\nstiction_nm = 0.1\ncoulomb_nm = 0.2\n",
        "axis.toml:4:15: stiction_nm is 0.1, below coulomb_nm = 0.2; it must be at least coulomb_nm",
    ),
    (
        "the same on a linear axis",
        b"[axis]\nmass_kg = 10\n[friction]\ncoulomb_n = 0.2\nstiction_n = 0.1\n",
        "axis.toml:5:14: stiction_n is 0.1, below coulomb_n = 0.2; it must be at least coulomb_n",
    ),
    (
        "half a sample",
        b"[axis]\ninertia_kg_m2 = 1e-4\n[drive]\ndelay_samples = 0.5\n",
        "axis.toml:4:17: delay_samples is 0.5; it must be a whole number from 0 to 1000",
    ),
    (
        "a string for a number",
        b"[axis]\ninertia_kg_m2 = 1e-4\n[friction]\ncoulomb_nm = \"0.1\"\n",
        "axis.toml:4:14: coulomb_nm is a string; it must be a finite number, zero or above",
    ),
    (
        "true for a number",
        b"[axis]\ninertia_kg_m2 = 1e-4\n[drive]\nlag_s = true\n",
        "axis.toml:4:9: lag_s is true or false; it must be a finite number, zero or above",
    ),
    (
        "a number for a section",
        b"axis = 3\n",
        "axis.toml:1:8: axis is a number, not a section; write [axis] on a line of its own, its keys below it",
    ),
    (
        "brackets doubled",
        b"[[axis]]\ninertia_kg_m2 = 1\n",
        "axis.toml:1:1: axis is an array, not a section; write [axis] on a line of its own, its keys below it",
    ),
    (
        "a slip in a model",
        b"[axis]\ninertia_kg_m2 = 1e-4\n[friction]\nmodel = \"elastoplastic\"\n",
        "axis.toml:4:9: unknown model `elastoplastic`; did you mean \"elasto-plastic\"?",
    ),
    (
        "a model from elsewhere",
        b"[axis]\ninertia_kg_m2 = 1e-4\n[friction]\nmodel = \"zzz\"\n",
        "axis.toml:4:9: unknown model `zzz`; it must be one of coulomb, coulomb-viscous, stiction, stribeck, karnopp, armstrong, dahl, bristle, bliman-sorine, lugre, elasto-plastic",
    ),
    (
        "a number for a model",
        b"[axis]\ninertia_kg_m2 = 1e-4\n[friction]\nmodel = 3\n",
        "axis.toml:4:9: model is a number; it must be one of coulomb, coulomb-viscous, stiction, stribeck, karnopp, armstrong, dahl, bristle, bliman-sorine, lugre, elasto-plastic, in quotes",
    ),
    (
        "a slip in a shape",
        b"[axis]\ninertia_kg_m2 = 1e-4\n[friction]\nstribeck_shape = \"gausian\"\n",
        "axis.toml:4:18: unknown stribeck_shape `gausian`; did you mean \"gaussian\"?",
    ),
    (
        "an effect in single brackets",
        b"[axis]\ninertia_kg_m2 = 1e-4\n[effect]\nid = \"a\"\n",
        "axis.toml:3:1: effect is a table, not a list of effects; write [[effect]] in double brackets, id = \"...\" and parameters below it",
    ),
    (
        "an effect without id",
        b"[axis]\ninertia_kg_m2 = 1e-4\n[[effect]]\na = 1\n",
        "axis.toml:3:1: an effect without id; give it an id such as id = \"mechanics.offset\"",
    ),
    (
        "an id that is none",
        b"[axis]\ninertia_kg_m2 = 1e-4\n[[effect]]\nid = 1\n",
        "axis.toml:4:6: the id of an effect is not a name; give it an id such as id = \"mechanics.offset\"",
    ),
    (
        "a parameter that is none",
        b"[axis]\ninertia_kg_m2 = 1e-4\n[[effect]]\nid = \"a\"\nb = \"c\"\n",
        "axis.toml:5:5: b is a string; it must be a finite number",
    ),
    (
        "a parameter that is infinite",
        b"[axis]\ninertia_kg_m2 = 1e-4\n[[effect]]\nid = \"a\"\nb = inf\n",
        "axis.toml:5:5: b is inf; it must be a finite number",
    ),
    (
        "no TOML",
        b"[axis]\ninertia_kg_m2 = 1e-4\ncounts_per_rev 5\n",
        "axis.toml:3:16: not TOML: key with no value, expected `=`; mend it; strings stand in quotes, a key stands once",
    ),
    (
        "a key twice",
        b"[axis]\ninertia_kg_m2 = 1e-4\ninertia_kg_m2 = 1\n",
        "axis.toml:3:1: not TOML: duplicate key; mend it; strings stand in quotes, a key stands once",
    ),
    (
        "a decimal comma",
        b"[axis]\ninertia_kg_m2 = 0,5\n",
        "axis.toml:2:18: not TOML: unexpected key or value, expected newline, `#`; mend it; strings stand in quotes, a key stands once",
    ),
    (
        "no value",
        b"[axis]\ninertia_kg_m2 =\n",
        "axis.toml:2:16: not TOML: string values must be quoted, expected literal string; mend it; strings stand in quotes, a key stands once",
    ),
    (
        "characters before the mistake",
        b"[axis]\ninertia_kg_m2 = 1\n[friction]\nmodel = \"\xc3\xa9\" # \xc3\xa9\n",
        "axis.toml:4:9: unknown model `é`; it must be one of coulomb, coulomb-viscous, stiction, stribeck, karnopp, armstrong, dahl, bristle, bliman-sorine, lugre, elasto-plastic",
    ),
    (
        "not UTF-8",
        b"[axis]\n\xff",
        "axis.toml:2:1: not UTF-8 text: byte 0xff has no meaning here; give a text file in UTF-8, or one packed with gzip",
    ),
];

fn check<T>(name: &str, cases: &[Case], read: impl Fn(&Path) -> Result<T, InputError>) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    let mut wrong = Vec::new();
    for (what, bytes, expected) in cases {
        std::fs::write(&path, bytes).unwrap();
        let line = match read(&path) {
            Ok(_) => "no error".to_owned(),
            Err(error) => error.to_string(),
        };
        let line = line.replace(&format!("{}", path.display()), name);
        if line != *expected {
            wrong.push(format!(
                "{what}\n  expected: {expected}\n  found:    {line}"
            ));
        }
    }
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
}

#[test]
fn bad_logs() {
    check("log.csv", LOGS, |path| Log::read(path));
}

#[test]
fn bad_axis_files() {
    check("axis.toml", AXES, |path| AxisFile::read(path));
}

#[test]
fn files_that_are_not_there() {
    let folder = tempfile::tempdir().unwrap();
    let missing = folder.path().join("none.csv");
    for error in [
        Log::read(&missing).unwrap_err(),
        AxisFile::read(&missing).unwrap_err(),
    ] {
        let expected = format!(
            "{}: there is no such file; check the path",
            missing.display()
        );
        assert_eq!(error.to_string(), expected);
    }
    for error in [
        Log::read(folder.path()).unwrap_err(),
        AxisFile::read(folder.path()).unwrap_err(),
    ] {
        let expected = format!(
            "{}: is a directory; name a file in it",
            folder.path().display()
        );
        assert_eq!(error.to_string(), expected);
    }
}

#[test]
fn truncated_gzip() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.csv.gz");
    let text = "time_s,torque_nm,position_rad\n0,1,2\n1,1,2\n";
    Log::parse(text, "").unwrap().write(&path).unwrap();
    let whole = std::fs::read(&path).unwrap();
    // The name does not matter, the first bytes do.
    let path = folder.path().join("log.csv");
    for length in 2..whole.len() {
        std::fs::write(&path, &whole[..length]).unwrap();
        let line = Log::read(&path).unwrap_err().to_string();
        assert!(
            line.contains(": the gzip data end too early; copy or record the file again"),
            "{length} bytes: {line}"
        );
    }
}

/// What only shows once log and axis file come together.
#[test]
fn logs_that_do_not_fit_their_axis_file() {
    let rotary = AxisFile::new(Unit::Rotary, 1e-4);
    let linear = AxisFile::new(Unit::Linear, 10.0);
    let log = |header: &str| Log::parse(&format!("{header}\n0,1,2\n1,1,2\n"), "log.csv").unwrap();
    let effort = |header, axis| log(header).effort_nm(axis).unwrap_err().to_string();
    assert_eq!(
        effort("time_s,torque_nm,position_rad", &linear),
        "log.csv:1: the log is of a rotary axis, the axis file of a linear one; give the axis file that belongs to the \
         log (inertia_kg_m2 makes it rotary, mass_kg linear)"
    );
    assert_eq!(
        effort("time_s,current_a,position_counts", &rotary),
        "log.csv:1: column current_a: current_a needs torque_constant_nm_a, which the axis file does not give; add \
         `torque_constant_nm_a = ...` to [axis] in the axis file"
    );
    assert_eq!(
        effort("time_s,voltage_v,position_counts", &linear),
        "log.csv:1: column voltage_v: voltage_v needs force_per_volt_n_v, which the axis file does not give; add \
         `force_per_volt_n_v = ...` to [axis] in the axis file"
    );
    let counts = log("time_s,torque_nm,position_counts")
        .position_rad(&rotary)
        .unwrap_err()
        .to_string();
    assert_eq!(
        counts,
        "log.csv:1: column position_counts: counts need counts_per_rev, which the axis file does not give; add \
         `counts_per_rev = ...` to [axis] in the axis file"
    );
}

#[test]
fn what_could_not_be_read_again_is_not_written() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out");
    let mut log = Log::parse("time_s,torque_nm,position_rad\n0,1,2\n1,1,2\n", "").unwrap();
    log.position.values[1] = f64::NAN;
    assert_eq!(
        log.write(&path).unwrap_err().to_string(),
        format!(
            "{}:3: column position_rad: would hold NaN; nothing was written; a simulation that diverges needs a finer step",
            path.display()
        )
    );
    let mut axis = AxisFile::new(Unit::Rotary, 1e-4);
    axis.friction.viscous = Some(f64::NAN);
    assert_eq!(
        axis.write(&path).unwrap_err().to_string(),
        format!(
            "{}:5:20: viscous_nm_s_rad is NaN; it must be a finite number, zero or above",
            path.display()
        )
    );
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}
