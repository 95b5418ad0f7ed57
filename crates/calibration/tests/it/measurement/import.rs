//! Reading measurement files: what is understood, and what each fault is answered with.

use truegrind_calibration::measurement::dataset::{Dataset, Reading, Row, Sensor};
use truegrind_calibration::measurement::import::{self, ImportError, Options, template};

fn read(text: &str) -> Result<Dataset, ImportError> {
    import::read("rows.csv", text.as_bytes(), &Options::default())
}

/// The message for a file that cannot be used.
fn complaint(text: &str) -> String {
    match read(text) {
        Ok(_) => panic!("was read: {text}"),
        Err(error) => error.to_string(),
    }
}

const HEADER: &str = "q1,q2,q3,q4,q5,q6,L";

/// A cable whose days were named in the column station lost them, and with them the refusal that they differ.
#[test]
fn the_stations_of_a_cable_are_sessions() {
    let read_as = |header: &str| {
        let text = format!("L,q1,q2,q3,q4,q5,q6,{header}\n500.5,1,2,3,4,5,6,a,1\n501.5,2,3,4,5,6,7,b,1\n");
        read(&text).unwrap()
    };
    let named = read_as("station,anchor");
    let sessions: Vec<Option<&str>> = named.rows.iter().map(|row| row.session()).collect();
    assert_eq!(sessions, [Some("a"), Some("b")]);
    assert!(named.notes.iter().any(|note| note.starts_with("column station is read as session")));
    let both = read_as("session,station");
    assert_eq!(both.rows[1].session(), Some("b"));
    assert!(both.notes.iter().any(|note| note == "columns kept but not used: `station`"), "{:?}", both.notes);
}

#[test]
fn a_header_may_state_its_unit() {
    let plain = read(&format!("{HEADER},t\n10,20,30,40,50,60,500.5,0.5\n")).unwrap();
    for header in [
        "q1 [deg],q2 (deg),q3[°],q4_deg,q5 [Degrees],q6 ( deg ),L [mm],t (h)",
        "J1 [deg],J2 [deg],J3 [deg],J4 [deg],J5 [deg],J6 [deg],L_mm,t [hours]",
    ] {
        let stated = read(&format!("{header}\n10,20,30,40,50,60,500.5,0.5\n")).unwrap();
        assert_eq!(stated.rows, plain.rows, "{header}");
        assert!(stated.other_columns.is_empty() && stated.notes.is_empty(), "{header}: {:?}", stated.notes);
    }
    // Another unit is named where the column is needed, and its column is not used where it is not.
    for (header, column, said) in [
        ("q1,q2 [rad],q3,q4,q5,q6,L", "q2", "states `rad`; expected deg"),
        ("q1,q2,q3,q4,q5,q6_rad,L", "q6", "states `rad`; expected deg"),
        ("q1,q2,q3,q4,q5,q6,L (m)", "L", "states `m`; expected mm"),
        ("q1,q2,q3,q4,q5,q6,L [in]", "L", "states `in`; expected mm"),
    ] {
        let message = complaint(&format!("{header}\n10,20,30,40,50,60,500.5\n"));
        assert!(message.starts_with(&format!("rows.csv, row 1, column {column}: ")), "{message}");
        assert!(message.contains(said), "{message}");
    }
    let seconds = read(&format!("{HEADER},t [s]\n10,20,30,40,50,60,500.5,1800\n")).unwrap();
    assert_eq!(
        (seconds.rows[0].condition.time_h, seconds.other_columns.as_slice()),
        (None, &["t [s]".to_owned()][..])
    );
    assert!(seconds.notes.iter().any(|note| note.contains("`t [s]`")), "{:?}", seconds.notes);
}

/// The centre of what the arm carried could not be stated: 90 mm in front of the flange made the wrist 2.5 times too compliant.
#[test]
fn the_centre_of_a_payload_is_read() {
    let of =
        |header: &str, cells: &str| read(&format!("{HEADER},{header}\n10,20,30,40,50,60,500.5,{cells}\n"));
    let data = of("payload,payload_x [mm],payload_y,payload_z_mm", "3,10,-20,90\n11,21,31,41,51,61,501,3,,,")
        .unwrap();
    let condition =
        |row: usize| (data.rows[row].condition.payload_kg, data.rows[row].condition.payload_centre_mm);
    assert_eq!(condition(0), (Some(3.0), [10.0, -20.0, 90.0]));
    assert_eq!(condition(1), (Some(3.0), [0.0; 3]), "at the flange");
    assert!(data.notes.is_empty() && data.other_columns.is_empty(), "{:?}", data.notes);
    let part = of("payload,payload_z", "3,90").unwrap();
    assert_eq!(part.rows[0].condition.payload_centre_mm, [0.0; 3]);
    assert!(
        part.notes.iter().any(|note| note.contains("payload_x, payload_y and payload_z")),
        "{:?}",
        part.notes
    );
    let message = of("payload,payload_x,payload_y,payload_z", "3,0,,90").unwrap_err().to_string();
    assert!(message.contains("column payload_y"), "{message}");
}

#[test]
fn columns_in_any_order_with_others_between() {
    let data = read(
        "\u{feff}L,operator,q6,q5,q4,q3,q2,q1,t,session,approach2\n\
         500.25,Ann,60,50,40,30,20,10,0.5,monday,-1\n\
         501.5,,-60,-50,-40,-30,-20,-10,,,\n\n",
    )
    .unwrap();
    assert_eq!(data.sensor, Sensor::Cable);
    assert_eq!(data.rows.len(), 2);
    let row = &data.rows[0];
    for j in 0..6 {
        assert!((row.joints[j].to_degrees() - 10.0 * (j + 1) as f64).abs() < 1e-12);
    }
    assert_eq!(row.reading, Reading::Cable(500.25));
    assert_eq!((row.number, row.line), (2, 2));
    assert_eq!(row.condition.time_h, Some(0.5));
    assert_eq!(row.condition.approach, [0, -1, 0, 0, 0, 0]);
    assert_eq!(row.session(), Some("monday"));
    assert_eq!(data.other_columns, ["operator"]);
    assert_eq!(row.other(), ["Ann"]);
    assert_eq!((data.rows[1].condition.time_h, data.rows[1].session()), (None, None));
    assert!(data.notes.iter().any(|n| n.contains("`operator`")));
    assert!(data.notes.iter().any(|n| n == "1 blank row skipped"));
    assert_eq!(data.sha256.len(), 64);
}

#[test]
fn full_pose_scalar_first() {
    let data = read(
        "q1,q2,q3,q4,q5,q6,measured_x,measured_y,measured_z,measured_qw,measured_qx,measured_qy,measured_qz\n\
         0,0,0,0,90,0,1,2,3,0.7071068,0.7071068,0,0\n",
    )
    .unwrap();
    assert_eq!(data.sensor, Sensor::Pose);
    let Reading::Pose(pose) = &data.rows[0].reading else { panic!() };
    let turned = pose.rotation.scaled_axis();
    assert!((turned.x - std::f64::consts::FRAC_PI_2).abs() < 1e-6 && turned.y == 0.0);
    assert_eq!(pose.translation.vector.z, 3.0);
}

#[test]
fn semicolons_tabs_and_decimal_commas() {
    for (separator, comma) in [(";", true), ("\t", true), (";", false), (",", false)] {
        let row = "10.5|20|30|40|50|60.125|512.75".replace('|', separator);
        let row = if comma { row.replace('.', ",") } else { row };
        let data = read(&format!("{}\n{row}\n", HEADER.replace(',', separator))).unwrap();
        assert_eq!(data.rows[0].reading, Reading::Cable(512.75));
        assert!((data.rows[0].joints[5].to_degrees() - 60.125).abs() < 1e-12);
    }
    // UTF-16, as spreadsheets export "Unicode text".
    let text = format!("{}\r\n10\t20\t30\t40\t50\t60\t1,5\r\n", HEADER.replace(',', "\t"));
    let bytes: Vec<u8> = [0xfeff].into_iter().chain(text.encode_utf16()).flat_map(u16::to_le_bytes).collect();
    let data = import::read("rows.txt", &bytes, &Options::default()).unwrap();
    assert_eq!(data.rows[0].reading, Reading::Cable(1.5));
    // Decimal commas between commas split the cells.
    let message = complaint(&format!("{HEADER}\n1,5,20,5,30,5,40,5,50,5,60,5,512,75\n"));
    assert!(message.contains("rows.csv, row 2: found 14 cells under a header of 7"), "{message}");
    assert!(message.contains("decimal comma"), "{message}");
    let message = complaint(&format!("{HEADER}\n10,20,30,40,50,60,\"512,75\"\n"));
    assert!(
        message.contains("row 2, column L: found `512,75`") && message.contains("decimal point"),
        "{message}"
    );
}

#[test]
fn rounding_steps() {
    let file = |q: &str, l: &str| {
        read(&format!("{HEADER}\n{q},20,30,40,50,60,{l}\n11,21,31,41,51,61,500\n")).unwrap()
    };
    let data = file("10.3", "500.003");
    assert_eq!(data.angle_step_rad, Some(0.1f64.to_radians()));
    assert_eq!(data.reading_step_mm, Some(0.001));
    assert_eq!(data.readout_step_mm, None);
    assert_eq!(file("10.27", "500.00001").angle_step_rad, Some(0.01f64.to_radians()));
    assert_eq!(file("-10.123", "500.00001").angle_step_rad, Some(0.001f64.to_radians()));
    assert_eq!(file("10.123456", "500.00001").angle_step_rad, None);
    assert_eq!(file("10", "500.00001").angle_step_rad, None, "whole degrees were commanded, not rounded");
    assert_eq!(file("10", "500.000013").reading_step_mm, None);
    assert_eq!(file("10.25", "512").reading_step_mm, Some(1.0), "no one commands a reading");
    let steps =
        read(&format!("{HEADER}\n10.35,20.05,30,40,50,60,500.1\n11,21,31,41.15,51,61,500\n")).unwrap();
    assert_eq!(steps.angle_step_rad, Some(0.05_f64.to_radians()));
}

#[test]
fn anchors_count_from_zero_inside() {
    let file = |a: u32, b: u32| {
        let data = read(&format!("{HEADER},anchor\n10,20,30,40,50,60,500,{a}\n11,21,31,41,51,61,501,{b}\n"))
            .unwrap();
        (data.rows[0].anchor, data.rows[1].anchor, data.anchors(), data.notes.len())
    };
    assert_eq!(file(1, 2), (0, 1, 2, 0));
    assert_eq!(file(1, 0), (1, 0, 2, 0));
    assert_eq!(file(7, 3), (1, 0, 2, 1));
}

/// Each fault with what its message must say.
#[test]
fn faults_are_named_with_place_and_remedy() {
    let rows = |rows: &str| format!("{HEADER}\n10,20,30,40,50,60,500\n{rows}\n");
    let wide = |columns: &str| format!("{columns}\n{}\n", vec!["10"; columns.split(',').count()].join(","));
    let pose =
        "q1,q2,q3,q4,q5,q6,measured_x,measured_y,measured_z,measured_qw,measured_qx,measured_qy,measured_qz";
    let cases: Vec<(String, Vec<&str>)> = vec![
        (String::new(), vec!["rows.csv", "no rows"]),
        (format!("{HEADER}\n"), vec!["no rows", "header"]),
        (
            rows("10,20,30,40,,60,500"),
            vec!["row 3, column q5", "empty cell", "finite number", "delete the row"],
        ),
        (rows("10,20,30,40,nan,60,500"), vec!["row 3, column q5", "`NaN`"]),
        (rows("10,20,30,40,50,60,inf"), vec!["row 3, column L", "`inf`"]),
        (rows("10,20,abc,40,50,60,500"), vec!["row 3, column q3", "`abc`", "finite number"]),
        (rows("10,20,30"), vec!["row 3, column q4", "empty cell"]),
        (rows("\n\n10,20,30,40,50,6O,500"), vec!["row 5, column q6", "`6O`"]),
        (wide("q1,q2,q3,q4,q6,L"), vec!["row 1", "column q5 is missing", "`q6`"]),
        (wide("q1,q2,q3,q4,q 5,q6,L"), vec!["found `q 5`, expected q5"]),
        (wide("q1,q2,q3,q4,Q5,q6,L"), vec!["found `Q5`, expected q5"]),
        (wide("q1,q2,q3,q4,qq5,q6,L"), vec!["found `qq5`, expected q5"]),
        (wide("q1,q2,q3,q4,J5,q6,L"), vec!["found `J5`, expected q5"]),
        (wide("A1,A2,A3,A4,A5,A6,L"), vec!["found `A1`, expected q1", "found `A6`, expected q6"]),
        (wide("q1,q2,q3,q4,q5,q6"), vec!["no sensor's column", "L (cable length)", "measured_x"]),
        (wide("q1,q2,q3,q4,q5,q6,l"), vec!["found `l`, did you mean L?"]),
        (
            wide("q1,q2,q3,q4,q5,q6,L,measured_x,measured_y,measured_z"),
            vec!["two sensors", "a cable (L) and a tracker (measured_x, measured_y, measured_z)"],
        ),
        (wide("q1,q2,q3,q4,q5,q6,measured_x,measured_z"), vec!["measured_y is missing"]),
        (wide(&pose[..pose.len() - 12]), vec!["measured_qz is missing"]),
        (wide("q1,q2,q3,q4,q5,q6,q7,L"), vec!["column q7", "joint 7", "six-axis"]),
        (wide("q1,q2,q3,q2,q4,q5,q6,L"), vec!["column q2", "twice"]),
        (
            format!("{pose}\n10,20,30,40,50,60,1,2,3,1,1,0,0\n"),
            vec![
                "row 2, column measured_qw to measured_qz",
                "length 1.4142",
                "unit quaternion, scalar first",
            ],
        ),
        (
            format!("{HEADER},approach1\n10,20,30,40,50,60,500,2\n"),
            vec!["row 2, column approach1", "-1, 0 or 1"],
        ),
        (format!("{HEADER},anchor\n10,20,30,40,50,60,500,1.5\n"), vec!["row 2, column anchor", "`1.5`"]),
        (
            format!("{HEADER},anchor\n10,20,30,40,50,60,500,1\n11,21,31,41,51,61,501,\n"),
            vec!["row 3, column anchor", "found an empty cell", "in every row, or in none"],
        ),
        (format!("{HEADER},x,y,z\n10,20,30,40,50,60,500,1,,3\n"), vec!["row 2, column y", "empty cell"]),
        ("PK\u{3}\u{4}not a zip".into(), vec!["rows.csv", "cannot be read", "again"]),
        ("\0\0\0".into(), vec!["neither a text table nor a workbook"]),
    ];
    for (text, wanted) in cases {
        let message = complaint(&text);
        for part in wanted {
            assert!(message.contains(part), "{text:?}\n gave: {message}\n without: {part}");
        }
    }
}

#[test]
fn optional_columns_misspelt_are_noted() {
    let data =
        read(&format!("{HEADER},Temperature,approach 1,x,y\n10,20,30,40,50,60,500,21,1,5,6\n")).unwrap();
    let has = |part: &str| assert!(data.notes.iter().any(|n| n.contains(part)), "{part}: {:?}", data.notes);
    has("`Temperature` is not used; did you mean temperature?");
    has("`approach 1` is not used; did you mean approach1?");
    has("read-out needs x, y and z");
    assert_eq!(data.rows[0].condition.temperature_c, None);
}

#[test]
fn wrong_units_are_noticed_and_named() {
    let table = |header: &str, angle: f64, length: f64| {
        let mut text = format!("{header}\n");
        for i in 0..5 {
            let q: Vec<String> = (0..6).map(|j| (angle * (17 * (i + j) % 90) as f64).to_string()).collect();
            let readings = header.matches(',').count() - 5;
            let r: Vec<String> =
                (0..readings).map(|k| (length * (400 + 60 * i + k) as f64).to_string()).collect();
            text += &format!("{},{}\n", q.join(","), r.join(","));
        }
        text
    };
    let position = "q1,q2,q3,q4,q5,q6,measured_x,measured_y,measured_z";
    assert!(read(&table(HEADER, 1.0, 1.0)).is_ok());
    assert!(read(&table(position, 1.0, 1.0)).is_ok());
    let radians = table(HEADER, 1f64.to_radians(), 1.0);
    assert!(complaint(&radians).contains("these look like radians; expected degrees; convert"));
    for header in [HEADER, position] {
        let metres = table(header, 1.0, 1e-3);
        assert!(
            complaint(&metres).contains("these look like metres; expected millimetres; multiply"),
            "{header}"
        );
    }
    let allowed = Options { allow_odd_units: true, ..Options::default() };
    assert!(import::read("rows.csv", radians.as_bytes(), &allowed).is_ok());
}

#[test]
fn a_sheet_of_a_text_table_is_refused() {
    let options = Options { sheet: Some("Sheet2".into()), ..Options::default() };
    let error = import::read("rows.csv", HEADER.as_bytes(), &options).unwrap_err().to_string();
    assert!(error.contains("Sheet2") && error.contains("without sheets"), "{error}");
}

proptest::proptest! {
    /// Whatever the bytes, the answer is a data set or a message, and every number in a data set is finite.
    #[test]
    fn no_file_panics(
        cells in proptest::collection::vec("[0-9eE+.,;\"\t \n\r#qL-]{0,12}|nan|1e999|q[1-7]|\u{fffd}", 0..60),
        head in proptest::bool::ANY,
    ) {
        let text = format!("{}{}", if head { "q1,q2,q3,q4,q5,q6,L\n" } else { "" }, cells.join(","));
        if let Ok(data) = read(&text) {
            for row in &data.rows {
                proptest::prop_assert!(row.joints.iter().all(|q| q.is_finite()));
            }
        }
    }
}

#[test]
fn a_template_has_every_column_that_is_read_and_the_optional_ones_may_stay_empty() {
    for sensor in [Sensor::Cable, Sensor::Position, Sensor::Pose] {
        let columns = template::columns(sensor);
        let names: Vec<&str> = columns.iter().map(|column| column.name).collect();
        let needed = names.iter().position(|name| *name == "anchor" || *name == "t").unwrap();
        let row = |k: usize, all: bool| {
            let cell = |(at, name): (usize, &&str)| match *name {
                _ if at >= needed && !all => String::new(),
                "measured_qw" | "anchor" | "cycle" => "1".to_owned(),
                "measured_qx" | "measured_qy" | "measured_qz" => "0".to_owned(),
                name if name.starts_with("approach") => "-1".to_owned(),
                "sample" => k.to_string(),
                _ => (100 + 7 * at + 30 * k).to_string(),
            };
            names.iter().enumerate().map(cell).collect::<Vec<_>>().join(",")
        };
        let table = |all| format!("{}\n{}\n{}\n", names.join(","), row(0, all), row(1, all));
        let bare = read(&table(false)).unwrap();
        assert!(bare.notes.is_empty() && bare.rows[1].extra.is_none(), "{:?}", bare.notes);
        assert_eq!((bare.rows[1].condition.payload_kg, bare.anchors()), (None, 1));
        let full = read(&table(true)).unwrap();
        assert!(full.notes.is_empty() && full.other_columns.is_empty(), "{:?}", full.notes);
        let Row { condition, extra: Some(extra), .. } = &full.rows[1] else {
            panic!("a row with everything")
        };
        assert!(condition.temperature_c.and(condition.time_h).and(condition.payload_kg).is_some());
        assert_eq!(condition.approach, [-1; 6]);
        assert!(extra.readout_mm.is_some() && extra.session.is_some());
        assert_eq!(extra.path.is_some(), sensor != Sensor::Cable);
    }
}
