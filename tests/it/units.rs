//! Shares and keys: what machines have to agree on without asking each other.

use std::collections::BTreeMap;

use truegrind::units::done::{Done, Ended, Output, SCHEMA};
use truegrind::units::key::{Fields, of_run, of_unit, sha256};
use truegrind::units::run::{self, Run, Unit};
use truegrind::units::share::Share;

/// By another implementation (Python's hashlib): a version that shares otherwise would do units twice and leave others out while jobs
/// of both run.
#[test]
fn a_share_follows_from_the_name_as_ever() {
    let names = ["a.mod", "line 1/b.mod", "über.nc"];
    assert_eq!(names.map(|name| Share::of_name(name, 8)), [1, 8, 1]);
    assert_eq!(
        of_unit("r", [("a", "b")]),
        "e7e5ef8d915ae9d75cf3b719b1ed6763b1edc2b896adf740cd15e33f4d18e2f9"
    );
}

#[test]
fn shares_are_equal_on_average_and_leave_nothing_out() {
    let mut sizes = BTreeMap::new();
    for number in 0..10_000 {
        let name = format!("p{number}.mod");
        let doing: Vec<u32> = (1..=50).filter(|&number| Share { number, of: 50 }.has(&name)).collect();
        assert_eq!(doing.len(), 1, "{name}");
        *sizes.entry(doing[0]).or_insert(0) += 1;
    }
    assert!(sizes.len() == 50 && sizes.values().all(|size| (130..280).contains(size)), "{sizes:?}");
}

/// Fields do not run together: what ends one does not begin the next.
#[test]
fn every_border_and_every_field_counts() {
    let all = [
        of_run("compensate", "a", ["b", "c"]),
        of_run("compensate", "ab", ["c"]),
        of_run("compensate", "a", ["bc"]),
        of_run("compensate", "a", ["c", "b"]),
        of_run("deviation", "a", ["b", "c"]),
        of_unit("a", [("b", "c")]),
        of_unit("a", [("bc", "")]),
        of_unit("ab", [("", "c")]),
        Fields::new("a").text("b").hex(),
        Fields::new("ab").hex(),
    ];
    for (at, key) in all.iter().enumerate() {
        assert!(key.len() == 64 && !all[..at].contains(key), "{at}");
    }
    // FIPS 180-4, the one-block message.
    assert_eq!(sha256(b"abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}

#[test]
fn lists_and_records_come_back_and_a_torn_record_counts_for_nothing() {
    let run = Run {
        schema: run::SCHEMA.to_owned(),
        version: "1".to_owned(),
        verb: "compensate".to_owned(),
        run: "r".to_owned(),
        shares: Some(3),
        context: serde_json::json!({ "nominal": false, "deep": { "units": "}" } }),
        units: vec![
            Unit { under: Some("in".to_owned()), paths: vec!["in/a.mod".to_owned()] },
            Unit { under: None, paths: vec!["b.mod".to_owned(), "c \"d\".mod".to_owned()] },
        ],
    };
    let text = run.to_text().unwrap();
    assert_eq!(Run::from_bytes(text.as_bytes()).unwrap(), run);
    let none = Run { units: Vec::new(), ..run };
    assert_eq!(Run::from_bytes(none.to_text().unwrap().as_bytes()).unwrap(), none);
    assert!(
        Run::from_bytes(text.replace("run/1", "run/2").as_bytes())
            .unwrap_err()
            .contains("expected truegrind.run/1")
    );
    let done = Done {
        schema: SCHEMA.to_owned(),
        key: "k".to_owned(),
        unit: "a.mod".to_owned(),
        ended: Ended::Done,
        outputs: vec![Output { file: "a.mod".to_owned(), below: true, sha256: sha256(b"") }],
        record: serde_json::json!([1, "two"]),
    };
    let text = done.to_text(&done.record.to_string()).unwrap();
    assert_eq!(Done::from_bytes(text.as_bytes(), "k"), Some(done));
    assert_eq!(Done::from_bytes(text.as_bytes(), "another"), None);
    for length in 0..text.len() - 1 {
        assert_eq!(Done::from_bytes(&text.as_bytes()[..length], "k"), None);
        let zeroed: Vec<u8> =
            text.bytes().enumerate().map(|(at, byte)| if at < length { byte } else { 0 }).collect();
        assert_eq!(Done::from_bytes(&zeroed, "k"), None);
    }
}
