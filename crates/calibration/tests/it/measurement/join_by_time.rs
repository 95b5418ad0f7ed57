//! A log of joints and a tracker's points, joined by the times of two clocks: what belongs together for certain, and nothing else.

use truegrind_calibration::measurement::dataset::{Dataset, Reading};
use truegrind_calibration::measurement::import::{ImportError, Options, TimeMatching, read_joined_by_time};

fn read(log: &str, points: &str, within_s: f64, ahead_s: f64) -> Result<Dataset, ImportError> {
    let clocks = TimeMatching { within_s, ahead_s };
    read_joined_by_time(
        ("log.csv", log.as_bytes()),
        ("points.txt", points.as_bytes()),
        &clocks,
        &Options::default(),
    )
}

fn complaint(log: &str, points: &str, within_s: f64) -> String {
    read(log, points, within_s, 0.0).map(|_| ()).unwrap_err().to_string()
}

/// Rows at these times, each pose a degree further than the one before.
fn log(times: &[&str]) -> String {
    let row = |(k, time): (usize, &&str)| format!("{time},{},20,30,40,50,60\n", 10 + k);
    "time,q1,q2,q3,q4,q5,q6\n".to_owned() + &times.iter().enumerate().map(row).collect::<String>()
}

/// Points at these times, the first at x = 100 mm, the next at 200 mm.
fn points(times: &[&str]) -> String {
    let line =
        |(k, time): (usize, &&str)| format!("Main p{k} {}.5 -20.25 900.0 0.012 {time}\n", 100 * (k + 1));
    "// Units: Millimeters\n".to_owned() + &times.iter().enumerate().map(line).collect::<String>()
}

/// The first joint (°) and x (mm) of each row.
fn pairs(data: &Dataset) -> Vec<(f64, f64)> {
    let pair = |row: &truegrind_calibration::measurement::dataset::Row| match row.reading {
        Reading::Position(place) => (row.joints[0].to_degrees().round(), place.x),
        _ => panic!("a position"),
    };
    data.rows.iter().map(pair).collect()
}

#[test]
fn a_point_joins_the_row_nearest_in_time_and_the_rest_is_noted() {
    let log = log(&["10:15:30", "10:15:40.5", "10:15:50", "10:16:00"]);
    // Not in the order of the log, with a point without a row and a row without a point.
    let points = points(&["10:15:49.8", "10:15:30.3", "10:20:00", "10:15:40.4"]);
    let data = read(&log, &points, 0.5, 0.0).unwrap();
    assert_eq!(pairs(&data), [(10.0, 200.5), (11.0, 400.5), (12.0, 100.5)]);
    assert_eq!(data.rows.iter().map(|row| row.line).collect::<Vec<_>>(), [2, 3, 4]);
    let note =
        |part: &str| assert!(data.notes.iter().any(|note| note.contains(part)), "{part}: {:?}", data.notes);
    note("3 rows joined by time with 4 measured points, at most 0.300 s apart (0.5 s were allowed)");
    note("1 points without a row at their time are left out: `p2`");
    note("1 rows without a point at their time are left out: 5");
}

/// Dates, halves of the day, ISO 8601, one file with dates and the other without, and clocks that differ.
#[test]
fn clocks_write_as_they_like() {
    let expected = [(10.0, 100.5), (11.0, 200.5)];
    for (of_log, of_points) in [
        (
            ["2026-11-23T10:15:30Z", "2026-11-23T22:15:30.25Z"],
            ["11/23/2026 10:15:30 AM", "11/23/2026 10:15:30 PM"],
        ),
        (["23.11.2026 10:15:30", "24.11.2026 10:15:30"], ["2026-11-23 10:15:30", "2026-11-24 10:15:30"]),
        (["12:00:00 AM", "12:00:00pm"], ["11/23/2026 0:00:00", "11/23/2026 12:00:00.1"]),
        (["2026-02-28 23:59:59.9", "2026-03-01 12:00:00"], ["03/01/2026 00:00:00", "03/01/2026 12:00:00"]),
    ] {
        let data = read(&log(&of_log), &points(&of_points), 0.5, 0.0).unwrap();
        assert_eq!(pairs(&data), expected, "{of_log:?}");
    }
    let late = points(&["11:15:42", "11:15:52.2"]);
    let early = log(&["10:15:30", "10:15:40"]);
    let data = read(&early, &late, 0.5, 3612.0).unwrap();
    assert_eq!(pairs(&data), expected);
    assert!(data.notes[0].contains("3612 s ahead"), "{:?}", data.notes);
    // Without the offset, the message states the time difference.
    let said = complaint(&early, &late, 0.5);
    assert!(
        said.contains("no row lies within 0.5 s") && said.contains("3602.000 to 3612.200 s away"),
        "{said}"
    );
    assert!(said.contains("--points-ahead"), "{said}");
}

/// What could be meant for several is not guessed, whichever side is the denser.
#[test]
fn what_is_ambiguous_is_refused() {
    // The arm moves between two rows, both near.
    let said = complaint(&log(&["10:15:30", "10:15:31"]), &points(&["10:15:30.4"]), 1.0);
    assert!(
        said.starts_with("points.txt, row 2") && said.contains("`p0` is ambiguous: 2 rows of log.csv"),
        "{said}"
    );
    assert!(
        said.contains("rows 2 to 3") && said.contains("1.000°") && said.contains("--points-within"),
        "{said}"
    );
    // Two points at one row.
    let said = complaint(&log(&["10:15:30", "10:16:30"]), &points(&["10:15:30.4", "10:15:29.5"]), 1.0);
    assert!(
        said.starts_with("log.csv, row 2") && said.contains("`p0` (points.txt, row 2, 0.400 s away)"),
        "{said}"
    );
    assert!(said.contains("and `p1`"), "{said}");
    // A dense log of an arm at rest is not ambiguous: two readings of one pose, each with its own row.
    let row = |k: usize| format!("10:15:30.{k},{},20,30,40,50,60\n", 10.0 + 0.001 * k as f64);
    let dense = "time,q1,q2,q3,q4,q5,q6\n".to_owned() + &(0..10).map(row).collect::<String>();
    let data = read(&dense, &points(&["10:15:30.21", "10:15:30.69"]), 1.0, 0.0).unwrap();
    assert_eq!(data.rows.iter().map(|row| row.line).collect::<Vec<_>>(), [4, 9]);
}

#[test]
fn a_time_that_is_none_is_told_with_its_place() {
    let good = points(&["10:15:30"]);
    let bad = |time: &str| complaint(&log(&["10:15:20", time]), &good, 0.5);
    // 23/11 is no month, and with a dash nobody can say which is the month; an hour that there is not, minutes alone, a zone, nothing.
    for time in [
        "23/11/2026 10:15:30",
        "11-12-2026 10:15:30",
        "25:15:30",
        "10:15",
        "10:15:30+02:00",
        "noon",
        "30",
        "13:00:00 PM",
    ] {
        let said = bad(time);
        assert!(said.starts_with("log.csv, row 3, column time") && said.contains(time), "{said}");
        assert!(said.contains("a time such as 10:15:30.25"), "{said}");
    }
    let said = complaint(&log(&["10:15:30"]), "Main p1 1.5 2.5 3.5 0.012\n", 0.5);
    assert!(
        said.starts_with("points.txt, row 1") && said.contains("`p1`") && said.contains("time stamps"),
        "{said}"
    );
    let said = complaint("q1,q2,q3,q4,q5,q6\n1,2,3,4,5,6\n", &good, 0.5);
    assert!(said.contains("no column with the time") && said.contains("`time`"), "{said}");
    // Dates in some lines, and dates of several days against none.
    let said = complaint(&log(&["2026-11-23 10:15:30", "10:15:40"]), &good, 0.5);
    assert!(said.starts_with("log.csv") && said.contains("1 of 2 times have a date"), "{said}");
    let said = complaint(&log(&["2026-11-23 10:15:30", "2026-11-25 10:15:40"]), &good, 0.5);
    assert!(said.starts_with("log.csv") && said.contains("3 days"), "{said}");
}
