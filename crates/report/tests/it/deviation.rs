//! Deviation tables, the summary block and pages.

use nalgebra::{Translation3, UnitQuaternion, Vector3};
use truegrind_arm::region::Outside;
use truegrind_compensation::deviation::{
    After, BetweenTargets, Deviation, MissingMotion, MissingMotions, MotionStatus, PathPoint, PathReport,
};
use truegrind_compensation::plan::Plan;
use truegrind_math::se3::Pose;
use truegrind_programs::motion::MotionKind;
use truegrind_programs::rapid::Task;
use truegrind_report::compensation;
use truegrind_report::deviation as view;
use truegrind_report::format::{csv, html, markdown, terminal};
use truegrind_report::status::Status as ViewStatus;
use truegrind_report::table::Cell;

use super::examples::leave;

/// A work object off the base, turned by a quarter about z.
fn base_from_object() -> Pose {
    Pose::from_parts(
        Translation3::new(300.0, 50.0, 100.0),
        UnitQuaternion::from_axis_angle(&Vector3::z_axis(), std::f64::consts::FRAC_PI_2),
    )
}

fn deviation(vector_mm: [f64; 3], surface: bool) -> Deviation {
    let vector_mm = Vector3::from(vector_mm);
    Deviation { vector_mm, angle_rad: 0.1_f64.to_radians(), normal_mm: surface.then_some(vector_mm.z) }
}

fn point(
    index: usize,
    at: [f64; 3],
    before: Option<[f64; 3]>,
    after: Option<[f64; 3]>,
    surface: bool,
) -> PathPoint {
    PathPoint {
        index,
        file: 0,
        line: 10 + index as u32,
        instruction: "MoveL".to_owned(),
        kind: MotionKind::Linear,
        cutting: true,
        base_from_object: base_from_object(),
        part: 0,
        part_from_object: base_from_object(),
        flange_from_tool: Pose::identity(),
        intended: base_from_object() * Pose::translation(at[0], at[1], at[2]),
        normal: surface.then(Vector3::z),
        joints_before: None,
        joints_after: None,
        before: before.map(|v| deviation(v, surface)),
        after: after.map(|v| deviation(v, surface)),
        sigma_mm: Some(0.12),
        shape_sigma_mm: None,
        outside: None,
        status: MotionStatus::Changed,
        reason: None,
    }
}

fn report(model: &str, points: Vec<PathPoint>) -> PathReport {
    PathReport {
        program: "blade.mod".to_owned(),
        files: Vec::new(),
        model: model.to_owned(),
        after: After::PredictedRemainder,
        points,
        missing: None,
        differences: Vec::new(),
        between: None,
        held_out_mm: Some(0.46),
        turn_sigma_rad: Some(0.002),
        assumptions: Vec::new(),
    }
}

/// Three points: one as it should be, one flagged, one of which little is known.
fn three(surface: bool) -> PathReport {
    let mut points = vec![
        point(0, [1.0, 2.0, 3.0], Some([0.3, -0.4, 1.2]), Some([0.0, 0.0, -0.0004]), surface),
        point(1, [2.0, 2.0, 3.0], Some([0.0, 0.0, -1.0]), Some([0.003, 0.004, 0.0]), surface),
        point(2, [3.0, 2.0, 3.0], None, None, false),
    ];
    points[1].status = MotionStatus::Flagged;
    points[1].reason = Some("joint 5 is 5.0° outside the range in which the arm was measured".to_owned());
    points[1].outside = Some(Outside::Joint { joint: 4, by_deg: 5.0 });
    points[2].status = MotionStatus::Refused;
    points[2].reason = Some("target is out of reach".to_owned());
    points[2].line = 0;
    points[2].sigma_mm = None;
    report("model.toml", points)
}

/// A raster of passes over a part with approaches, its deviation a smooth field.
fn raster(model: &str, after: After, remains: f64) -> PathReport {
    let mut points = Vec::new();
    for pass in 0..14 {
        for step in 0..42 {
            let along = if pass % 2 == 0 { step } else { 41 - step };
            let (x, y) = (5.0 * f64::from(along), 8.0 * f64::from(pass));
            let cutting = step != 0 && step != 41;
            let z = if cutting { 20.0 * (x / 70.0).sin() } else { 60.0 };
            let before = [0.6 + 0.002 * x, -0.3 + 0.004 * y, 1.1 * (x / 60.0).cos() + 0.004 * y + 0.3];
            let rest = before.map(|v| v * remains * (1.0 + 0.3 * (f64::from(step) * 1.7).sin()));
            let mut point = point(points.len(), [x, y, z], Some(before), Some(rest), true);
            point.cutting = cutting;
            point.sigma_mm = Some(0.09 + 0.0006 * x);
            if pass == 13 && step > 25 {
                point.status = MotionStatus::Flagged;
                point.reason =
                    Some("no measured pose is near: 1.4 times the distance of measured poses".to_owned());
            }
            points.push(point);
        }
    }
    PathReport { after, ..report(model, points) }
}

#[test]
fn the_table_stands_in_the_work_object_with_every_column() {
    let table = view::table(&three(true));
    let text = csv::table(&table);
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(
        lines[0],
        "index,line,instruction,x_mm,y_mm,z_mm,before_dx_mm,before_dy_mm,before_dz_mm,before_norm_mm,before_normal_mm,\
         predicted_remainder_dx_mm,predicted_remainder_dy_mm,predicted_remainder_dz_mm,predicted_remainder_norm_mm,\
         predicted_remainder_normal_mm,sigma_mm,sigma_of,status,reason,before_turn_deg,predicted_remainder_turn_deg"
    );
    // Intended is turned back from the base into the work object.
    let number = |row: usize, column: usize| match table.rows[row][column] {
        Cell::Number(value) => value,
        ref other => panic!("{other:?}"),
    };
    for (column, expected) in
        [(3, 1.0), (4, 2.0), (5, 3.0), (6, 0.3), (7, -0.4), (8, 1.2), (9, 1.3), (10, 1.2)]
    {
        assert!((number(0, column) - expected).abs() < 1e-12, "column {column}");
    }
    assert!((number(1, 14) - 0.005).abs() < 1e-12);
    // What is not known is empty in a file and a dash on paper, the line that no program holds too.
    assert!(lines[3].starts_with("2,,MoveL,3,"), "{}", lines[3]);
    assert!(lines[3].contains(",,,,,,,,,,,refused,target is out of reach"), "{}", lines[3]);
    assert!(table.rows[2][6..17].iter().all(|cell| *cell == Cell::Missing));
    assert!(table.title.contains("held-out error 0.460 mm RMSE"), "{}", table.title);
    assert!(table.notes.join(" ").contains("does not predict the deviation of the real arm"));
}

/// Where only the shape of a cut is corrected its points have the σ of the shape; two numbers with one name are told apart.
#[test]
fn motions_without_a_point_stand_at_their_place_with_their_reason() {
    let without = |points_before, file, line| MissingMotion {
        points_before,
        file,
        line,
        instruction: "MoveJ".to_owned(),
        status: MotionStatus::Refused,
        reason: Some("target is out of reach".to_owned()),
    };
    let motions = vec![without(0, 1, 3), without(1, 0, 7), without(1, 0, 8), without(3, 0, 9)];
    let missing = Some(MissingMotions { motions, lines: "lines 3, 7, 8, 9".to_owned() });
    let mut report = PathReport { missing, ..three(true) };
    let places = |text: String| -> Vec<String> {
        let place = |line: &str| line.split(',').take(3).collect::<Vec<_>>().join(",");
        text.lines().skip(1).map(place).collect()
    };
    let text = csv::table(&view::table(&report));
    assert!(text.lines().all(|line| line.split(',').count() == 22), "{text}");
    assert!(text.contains("\n,7,MoveJ,,,,,,,,,,,,,,,,refused,target is out of reach"), "{text}");
    assert_eq!(
        places(text),
        [",3,MoveJ", "0,10,MoveL", ",7,MoveJ", ",8,MoveJ", "1,11,MoveL", "2,,MoveL", ",9,MoveJ"]
    );
    // Of several files, each row names its own.
    report.files = vec!["main.mod".to_owned(), "data.sys".to_owned()];
    let of_files = csv::table(&view::table(&report));
    assert_eq!(places(of_files)[..2], [",data.sys,3", "0,main.mod,10"]);
    // A file of several programs: no row says what "after" is where there is none.
    let other = PathReport { program: "other.mod".to_owned(), files: Vec::new(), ..three(true) };
    let text = csv::table(&view::whole_table(&[report, other]));
    assert!(text.contains("\nblade.mod,model.toml,,0.46,,data.sys,3,MoveJ,"), "{text}");
    assert!(text.contains("\nother.mod,model.toml,predicted remainder,0.46,0,,10,MoveL,"), "{text}");
}

#[test]
fn a_point_says_what_its_sigma_is_of() {
    let mut judged = three(true);
    judged.points[0].shape_sigma_mm = Some(0.04);
    (judged.points[1].sigma_mm, judged.points[1].shape_sigma_mm) = (Some(0.04), Some(0.04));
    judged.points[2].sigma_mm = None;
    let table = view::table(&judged);
    let of = table.columns.iter().position(|column| column.key == "sigma_of").unwrap();
    let words: Vec<_> = table.rows.iter().map(|row| row[of].clone()).collect();
    assert_eq!(words, [Cell::Text("position".into()), Cell::Text("shape".into()), Cell::Missing]);
}

#[test]
fn only_an_acting_arm_makes_it_achieved() {
    let mut judged = three(true);
    judged.after = After::Achieved;
    let table = view::table(&judged);
    assert_eq!(table.columns[11].key, "achieved_dx_mm");
    assert_eq!(table.columns[11].label(), "achieved dx [mm]");
    assert!(!table.notes.join(" ").contains("remainder"));
    assert_eq!(view::table(&three(true)).columns[11].label(), "remainder dx [mm]");
    let page = terminal::document(&view::document(&[judged]), 200);
    assert!(page.contains("(achieved)") && !page.contains("predicted remainder"), "{page}");
}

#[test]
fn the_block_is_that_of_table_8() {
    // Signed deviations 1 … 9 before, a tenth of them after: five points at the middles of five equal sections.
    let points = (1..=9)
        .map(|k| {
            let v = f64::from(k) - 3.0;
            point(k as usize, [f64::from(k), 0.0, 0.0], Some([0.0, 0.0, v]), Some([0.0, 0.0, 0.1 * v]), true)
        })
        .collect();
    let table = view::block_table(&[report("lm.toml", points)]);
    let text = terminal::table(&table, 200);
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines[0], "Deviation of path points before and after compensation [mm]");
    assert_eq!(
        lines[1],
        "Path                              P1     P2     P3     P4     P5   mean  mean |d|     SD    max     1σ  held-out"
    );
    // Values −2 … 6: mean 2, mean size (2 + 1 + 0 + … + 6)/9 = 24/9, SD √7.5.
    assert_eq!(
        lines[3],
        "before                        -2.000  0.000  2.000  3.000  5.000  2.000     2.667  2.739  6.000  0.120     0.460"
    );
    assert_eq!(
        lines[4],
        "lm.toml, predicted remainder  -0.200  0.000  0.200  0.300  0.500  0.200     0.267  0.274  0.600  0.120     0.460"
    );
    let notes = table.notes.join(" ");
    assert!(
        notes.contains("along the outward surface normal") && notes.contains("mean is signed"),
        "{notes}"
    );
}

#[test]
fn models_that_agree_about_the_path_before_share_its_row() {
    let one = three(true);
    let mut two = three(true);
    two.model = "other.toml".to_owned();
    let path =
        |row: &Vec<Cell>| if let Cell::Text(text) = &row[0] { text.clone() } else { panic!("{row:?}") };
    let names = |reports: &[PathReport]| view::block_table(reports).rows.iter().map(path).collect::<Vec<_>>();
    assert_eq!(
        names(&[one.clone(), two.clone()]),
        ["before", "model.toml, predicted remainder", "other.toml, predicted remainder"]
    );
    two.points[0].before = Some(deviation([0.0, 0.0, 2.0], true));
    assert_eq!(
        names(&[one.clone(), two.clone()]),
        [
            "before, under model.toml",
            "before, under other.toml",
            "model.toml, predicted remainder",
            "other.toml, predicted remainder"
        ]
    );
    // A second program brings a column for the program, and a path that nobody rewrote has no row after.
    two.program = "other.mod".to_owned();
    two.points.iter_mut().for_each(|point| point.after = None);
    let table = view::block_table(&[one, two]);
    assert_eq!(table.columns[0].key, "program");
    assert_eq!(table.rows.len(), 3);
    assert_eq!(table.rows[2][0], Cell::Text("other.mod".to_owned()));
}

#[test]
fn without_a_surface_nothing_is_signed() {
    let table = view::table(&three(false));
    assert!(table.rows.iter().all(|row| row[10] == Cell::Missing && row[15] == Cell::Missing));
    assert!(table.notes.join(" ").contains("No surface is given"));
    let block = view::block_table(&[three(false)]);
    assert!(block.notes[0].contains("deviations are unsigned"), "{}", block.notes[0]);
    assert!(view::short_table(&three(false)).columns.iter().all(|column| !column.key.contains("normal")));
}

#[test]
fn a_shift_of_the_whole_path_is_no_shape_error() {
    let corners = [[0.0, 0.0, 0.0], [100.0, 0.0, 0.0], [100.0, 80.0, 0.0], [0.0, 80.0, 10.0]];
    let points = corners
        .iter()
        .enumerate()
        .map(|(k, at)| point(k, *at, Some([3.0, 4.0, 0.0]), Some([0.0, 0.0, 0.0]), false))
        .collect();
    let table = view::registered_table(&[report("m", points)]);
    let (Cell::Number(as_it_stands), Cell::Number(registered)) = (&table.rows[0][1], &table.rows[0][2])
    else {
        panic!("{:?}", table.rows)
    };
    assert!((as_it_stands - 5.0).abs() < 1e-12 && *registered < 1e-9);
    // Two points have no shape.
    let mut short = three(false);
    short.points.truncate(2);
    assert_eq!(view::registered_table(&[short]).rows[0][2], Cell::Missing);
}

#[test]
fn flags_are_listed_by_line_with_their_reasons() {
    let rows = |report: &PathReport| -> Vec<String> {
        csv::table(&view::flag_table(report)).lines().skip(1).map(str::to_owned).collect()
    };
    assert_eq!(
        rows(&three(true)),
        [
            "11,1,1,flagged,joint 5 is 5.0° outside the range in which the arm was measured",
            ",2,1,refused,target is out of reach",
        ]
    );
    // Neighbours of a kind share a row; another joint or another fate does not.
    let mut long = report("m", (0..6).map(|k| point(k, [k as f64, 0.0, 0.0], None, None, false)).collect());
    for (k, (joint, by)) in [(5, "5.0"), (5, "5.5"), (5, "6.0"), (6, "6.0"), (6, "6.0")].iter().enumerate() {
        long.points[k].status = MotionStatus::Flagged;
        long.points[k].reason = Some(format!("joint {joint} is {by}° outside"));
    }
    assert_eq!(
        rows(&long),
        [
            "10–12,0–2,3,flagged,joint 5 is 5.0° outside (the first)",
            "13–14,3–4,2,flagged,joint 6 is 6.0° outside",
        ]
    );
}

#[test]
fn the_json_names_what_after_is_and_holds_every_point() {
    let json = view::json(&[three(true)]);
    assert_eq!(json["schema"], "truegrind.deviation/1");
    let model = &json["programs"][0]["models"][0];
    assert_eq!(json["programs"][0]["program"], "blade.mod");
    assert_eq!(model["after_is"], "predicted-remainder");
    assert_eq!(model["model_held_out_rmse_mm"], 0.46);
    let points = model["points"].as_array().unwrap();
    assert_eq!(points.len(), 3);
    assert!((points[0]["intended_mm"][1].as_f64().unwrap() - 2.0).abs() < 1e-12);
    assert_eq!(points[0]["before"]["dz_mm"], 1.2);
    assert!((points[0]["before"]["turn_deg"].as_f64().unwrap() - 0.1).abs() < 1e-12);
    assert_eq!(points[1]["status"], "flagged");
    assert_eq!(points[1]["outside"]["joint"], 5);
    assert!(points[2]["line"].is_null() && points[2]["before"].is_null() && points[2]["sigma_mm"].is_null());
    assert_eq!(model["summary"]["before"]["points"], 2);
    assert!((model["summary"]["before"]["mean_mm"].as_f64().unwrap() - 0.1).abs() < 1e-12);
}

#[test]
fn one_file_holds_all_programs_and_models() {
    let mut second = three(true);
    second.program = "other.mod".to_owned();
    second.after = After::Achieved;
    second.held_out_mm = None;
    let text = csv::table(&view::whole_table(&[three(true), second]));
    let lines: Vec<&str> = text.lines().collect();
    assert!(
        lines[0].starts_with("program,model,after_is,model_held_out_rmse_mm,index,line,"),
        "{}",
        lines[0]
    );
    assert!(lines[0].contains(",after_norm_mm,"), "{}", lines[0]);
    assert_eq!(lines.len(), 7);
    assert!(lines[1].starts_with("blade.mod,model.toml,predicted remainder,0.46,0,10,"), "{}", lines[1]);
    assert!(lines[4].starts_with("other.mod,model.toml,achieved,,0,10,"), "{}", lines[4]);
    assert!(lines[6].starts_with("other.mod,model.toml,,,2,,"), "nothing was achieved there: {}", lines[6]);
}

#[test]
fn pages_of_one_model_of_several_and_of_nothing() {
    let one = view::document(&[raster("model.toml", After::PredictedRemainder, 2e-4)]);
    let text = leave("deviation-one.html", &one);
    assert_eq!(text.matches("<figure>").count(), 3);
    assert!(text.contains("16 points flagged: corrected with a warning"), "one count per point");
    // Only the curve shows the remainder of the solver, inside its band; the plan view shows what to expect.
    assert_eq!(text.matches(">after (predicted remainder)<").count(), 1);
    assert_eq!(text.matches(">after (expected, 1σ)<").count(), 1);
    assert!(!text.contains("NaN"));
    let several = view::document(&[
        raster("lm", After::Achieved, 0.12),
        raster("ltlm", After::Achieved, 0.11),
        raster("lm-as-printed", After::Achieved, 0.3),
    ]);
    let text = leave("deviation-several.html", &several);
    // The best and the worst by name: a range without names says nothing.
    assert!(text.contains("mm under ltlm, worst") && text.contains("mm under lm-as-printed ("));
    assert_eq!(text.matches("<figure>").count(), 4);
    assert_eq!(
        several,
        view::document(&[
            raster("lm", After::Achieved, 0.12),
            raster("ltlm", After::Achieved, 0.11),
            raster("lm-as-printed", After::Achieved, 0.3),
        ])
    );
    // Coinciding curves are drawn once, and the legend names them all.
    let twins = [raster("lm", After::Achieved, 0.12), raster("ltlm", After::Achieved, 0.12)];
    let text = leave("deviation-twins.html", &view::document(&twins));
    assert!(text.contains(">lm, achieved = ltlm, achieved<"), "legend");
    // A program of which no point is known, and no program at all.
    let empty = markdown::document(&view::document(&[report("m", Vec::new())]));
    assert!(empty.contains("unknown"), "{empty}");
    assert!(markdown::document(&view::document(&[])).contains("No program has a path"));
}

/// Under several models only the motions that the first one lacked were counted.
#[test]
fn motions_without_a_deviation_are_counted_under_each_model() {
    let missing = |lines: &[u32]| {
        let one = |line: &u32| MissingMotion {
            points_before: 0,
            file: 0,
            line: *line,
            instruction: "MoveJ".to_owned(),
            status: MotionStatus::Left,
            reason: None,
        };
        let listed: Vec<String> = lines.iter().map(u32::to_string).collect();
        let lines_of = format!("lines {}", listed.join(", "));
        Some(MissingMotions { motions: lines.iter().map(one).collect(), lines: lines_of })
    };
    let of = |model: &str, lines: &[u32]| PathReport {
        missing: missing(lines).filter(|missing| !missing.motions.is_empty()),
        ..raster(model, After::PredictedRemainder, 0.0)
    };
    let page = |reports: &[PathReport]| {
        let page = terminal::document(&view::summary("blade.mod", reports), 200);
        page.split_whitespace().collect::<Vec<_>>().join(" ")
    };
    let text = page(&[of("a.toml", &[]), of("b.toml", &[3]), of("c.toml", &[3, 7]), of("d.toml", &[3, 7])]);
    assert!(text.contains("- b.toml: 1 motion has no known deviation"), "{text}");
    assert!(text.contains("- c.toml, d.toml: 2 motions have no known deviation"), "{text}");
    let text = page(&[of("a.toml", &[3]), of("b.toml", &[3])]);
    assert!(
        text.contains("- 1 motion has no known deviation") && text.matches("motion has").count() == 1,
        "{text}"
    );
}

#[test]
fn a_correction_smaller_than_its_sigma_is_called_so() {
    let mut unsure = raster("m", After::PredictedRemainder, 1e-4);
    unsure.points.iter_mut().for_each(|point| (point.status, point.reason) = (MotionStatus::Changed, None));
    let page = |report: &PathReport| terminal::document(&view::document(std::slice::from_ref(report)), 200);
    assert!(page(&unsure).contains("[ok] Largest deviation"));
    unsure.points.iter_mut().for_each(|point| point.sigma_mm = Some(4.0));
    let text = page(&unsure);
    assert!(text.contains("[warning] Largest deviation"), "{text}");
    assert!(text.contains("predicted 1σ, 4.000 mm, exceeds the deviation to correct"), "{text}");
    // Beside the probability that a correction does harm, which knows the direction of the uncertainty, the σ alone says nothing else.
    let listing = Task::read(&[("blade.mod", b"")]).listing;
    let of_plan = |probability_of_harm: Option<f64>| {
        let plan = Plan { probability_of_harm, ..Plan::default() };
        let reports = std::slice::from_ref(&unsure);
        terminal::document(&compensation::document(&plan, &listing, &[], reports), 200)
    };
    assert!(of_plan(None).contains("exceeds the deviation to correct"));
    assert!(!of_plan(Some(4e-4)).contains("exceeds the deviation"), "{}", of_plan(Some(4e-4)));
}

#[test]
fn a_point_that_is_not_corrected_keeps_its_deviation() {
    let mut unsure = raster("m", After::PredictedRemainder, 1e-4);
    for point in &mut unsure.points {
        (point.status, point.sigma_mm, point.after) = (MotionStatus::Left, Some(4.0), point.before);
    }
    let largest = unsure.cut().filter_map(|p| p.before.map(|d| d.norm_mm())).reduce(f64::max);
    assert_eq!(unsure.expected_mm(), largest);
}

#[test]
fn a_correction_that_makes_it_worse_is_called_so() {
    let mut worse = three(true);
    worse.after = After::Achieved;
    worse.points[0].after = Some(deviation([0.0, 0.0, 3.0], true));
    let text = terminal::document(&view::document(&[worse]), 200);
    assert!(
        text.contains(
            "[failed] Largest deviation along the normal 1.200 mm before, 3.000 mm after (achieved)"
        ),
        "{text}"
    );
}

/// `compensate` corrects the shape alone where the placement is not known: the path as a whole stays where it was, and is not worse.
#[test]
fn a_corrected_shape_at_an_uncorrected_place_is_no_failure() {
    let place = [2.0, 1.0, -0.5];
    let bent = |k: usize| [place[0], place[1] + 0.3 * [1.0, -1.0, -1.0, 1.0][k], place[2]];
    let at = |k: usize| [[0.0, 0.0, 0.0], [50.0, 0.0, 0.0], [50.0, 40.0, 0.0], [0.0, 40.0, 5.0]][k];
    let points = (0..4).map(|k| {
        // Farther off than before in one place, with the shape right.
        let after = place.map(|v| 1.2 * v);
        point(k, at(k), Some(bent(k)), Some(after), false)
    });
    let moved = report("arm", points.collect());
    let page = terminal::document(&view::summary("blade.mod", std::slice::from_ref(&moved)), 100);
    for words in ["Shape of the path", "its placement is not corrected, with it 2.750 mm RMS"] {
        assert!(page.split_whitespace().collect::<Vec<_>>().join(" ").contains(words), "{words}: {page}");
    }
    assert!(!page.contains("worse"), "{page}");
    // Under two models too, where the largest deviation is farther off than before.
    let two = [moved.clone(), PathReport { model: "other".to_owned(), ..moved.clone() }];
    let page = terminal::document(&view::summary("blade.mod", &two), 100);
    let page = page.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(page.contains("Shape of the path (RMS) 0.") && !page.contains("Largest deviation"), "{page}");
    assert!(page.contains("arm: the shape of the path is corrected"), "{page}");
    // A path that is bent more than before is.
    let worse = (0..4).map(|k| point(k, at(k), Some(place), Some(bent(k).map(|v| 1.2 * v)), false));
    let bent_more = report("arm", worse.collect());
    let page = terminal::document(&view::summary("blade.mod", std::slice::from_ref(&bent_more)), 100);
    assert!(page.contains("worse"), "{page}");
}

/// A line of fifteen points of which the first four were left: the other eleven are where they shall be, and the part has a step.
#[test]
fn a_path_that_is_corrected_in_part_is_judged_as_a_whole() {
    let before = |k: usize| [-0.9, 0.9 - 0.01 * k as f64, 1.6];
    let path = |corrected: fn(usize) -> bool| {
        let points = (0..15).map(|k| {
            let after = if corrected(k) { [0.0; 3] } else { before(k) };
            let mut point =
                point(k, [20.0 * k as f64, 100.0, 3.0 * (k % 3) as f64], Some(before(k)), Some(after), false);
            point.status = if corrected(k) { MotionStatus::Changed } else { MotionStatus::Left };
            point
        });
        report("arm", points.collect())
    };
    let page = |report: &PathReport| {
        let page = terminal::document(&view::summary("blade.mod", std::slice::from_ref(report)), 100);
        page.split_whitespace().collect::<Vec<_>>().join(" ")
    };
    let mut part = path(|k| k > 3);
    let text = page(&part);
    assert!(text.contains("[failed]"), "{text}");
    assert!(text.contains("bends the path: its shape goes from 0.0"), "{text}");
    assert!(
        text.contains("steps by up to 2.0") && text.contains("uncorrected neighbours (line 14)"),
        "{text}"
    );
    let table = view::registered_table(std::slice::from_ref(&part));
    let Cell::Number(registered) = table.rows[1][2] else { panic!("{:?}", table.rows) };
    assert!(registered > 0.5, "{registered}");
    // Nothing is said of neighbours that a motion without a point separates, but the whole is still bent.
    let motion = MissingMotion {
        points_before: 4,
        file: 0,
        line: 13,
        instruction: "MoveL".to_owned(),
        status: MotionStatus::Left,
        reason: None,
    };
    part.missing = Some(MissingMotions { motions: vec![motion], lines: "line 13".to_owned() });
    let text = page(&part);
    assert!(!text.contains("steps of") && text.contains("[failed]"), "{text}");
    // All of them, and none.
    let text = page(&path(|_| true));
    assert!(text.contains("[ok]") && !text.contains("steps"), "{text}");
    let text = page(&path(|_| false));
    assert!(text.contains("[warning]") && text.contains("no cut is corrected"), "{text}");
}

/// Figures of a program that is not the intended one with corrected targets are not its figures.
#[test]
fn a_program_that_differs_by_more_than_a_correction_fails_with_its_lines() {
    let mut report = raster("arm", After::PredictedRemainder, 0.0);
    report.points.iter_mut().for_each(|point| (point.status, point.reason) = (MotionStatus::Changed, None));
    let status = |report: &PathReport| view::status(std::slice::from_ref(report));
    assert_eq!(status(&report), ViewStatus::Good);
    report.differences = (0..14).map(|k| format!("line {k}: MoveJ here, MoveL in the original")).collect();
    assert_eq!(status(&report), ViewStatus::Bad);
    let page = terminal::document(&view::summary("blade.mod", std::slice::from_ref(&report)), 100);
    assert!(page.contains("[failed] The program differs from the original"), "{page}");
    assert!(page.contains("line 0: MoveJ") && page.contains("and 4 more differences"), "{page}");
    let json = view::json(std::slice::from_ref(&report));
    assert_eq!(json["programs"][0]["models"][0]["differences"].as_array().unwrap().len(), 14);
    // Nothing was corrected: nothing is judged.
    let mut plain = raster("arm", After::PredictedRemainder, 0.0);
    plain.points.iter_mut().for_each(|point| (point.after, point.status) = (None, MotionStatus::Left));
    assert_eq!(status(&plain), ViewStatus::Good);
}

/// The expected deviation has no sign. On one scale with a signed one, small corrected deviations would have the colour of the largest.
#[test]
fn the_map_of_an_expected_deviation_shows_sizes() {
    let map = |after: After| {
        let page = html::document(&view::document(&[raster("m", after, 1e-4)]));
        page.split_once("Where on the part").unwrap().1.split_once("</figure>").unwrap().0.to_owned()
    };
    let (expected, achieved) = (map(After::PredictedRemainder), map(After::Achieved));
    assert!(expected.contains("size of the deviation") && !expected.contains("along the normal"));
    assert!(achieved.contains("deviation along the normal"));
}

/// A program that was compared with itself has no σ of a correction, and a deviation that stays is none either.
#[test]
fn what_stays_is_not_called_a_standard_deviation() {
    let headline = |report: &PathReport| {
        let page = terminal::document(&view::summary("blade.mod", std::slice::from_ref(report)), 300);
        page.lines().find(|line| line.starts_with('[')).unwrap().to_owned()
    };
    let mut report = raster("m", After::PredictedRemainder, 1e-4);
    report
        .points
        .iter_mut()
        .for_each(|point| (point.status, point.sigma_mm) = (MotionStatus::Changed, Some(0.05)));
    assert!(headline(&report).contains("a standard deviation (1σ) of at most 0.050 mm is expected;"));
    let stays = report.points[20].before.unwrap().norm_mm();
    (report.points[20].status, report.points[20].after) = (MotionStatus::Left, report.points[20].before);
    let words = format!(
        "of at most 0.050 mm is expected, and points that are not corrected deviate by up to {stays:.3} mm"
    );
    assert!(headline(&report).contains(&words), "{}", headline(&report));
    for point in &mut report.points {
        (point.status, point.after) = (MotionStatus::Left, point.before);
    }
    assert!(headline(&report).contains("Nothing was corrected: both programs state the same targets"));
    assert!(!headline(&report).contains('σ'), "{}", headline(&report));
}

/// What a program that was corrected for another arm, twice or by hand leaves of a correction is known: it was called a σ, and the verdict was ok.
#[test]
fn a_remainder_that_the_model_knows_is_no_standard_deviation() {
    let page = |report: &PathReport| {
        terminal::document(&view::summary("blade.mod", std::slice::from_ref(report)), 300)
    };
    let mut report = raster("m", After::PredictedRemainder, 1e-4);
    for (k, point) in report.points.iter_mut().enumerate() {
        let bent = 0.05 * (k % 3) as f64;
        (point.status, point.sigma_mm) = (MotionStatus::Changed, Some(0.05));
        point.before = Some(deviation([4.0, bent, 0.0], false));
        point.after = Some(deviation([1.0, 0.2 * bent, 0.0], false));
    }
    let text = page(&report);
    assert!(text.contains("[warning] Largest deviation"), "{text}");
    assert!(text.contains("after correction 1.000 mm, known to ± 0.050 mm (1σ)"), "{text}");
    assert!(text.contains("targets are not corrected as this model would"), "{text}");
    // Within three σ, and where only the shape was to be corrected, nothing is.
    for point in &mut report.points {
        point.sigma_mm = Some(0.5);
    }
    assert!(!page(&report).contains("not corrected as this model would"));
    for point in &mut report.points {
        (point.sigma_mm, point.after) = (Some(0.05), Some(deviation([4.0, 0.0, 0.0], false)));
    }
    let text = page(&report);
    assert!(text.contains("[ok] Shape of the path") && !text.contains("as this model would"), "{text}");
}

/// Points of two parts, or in two axes on one, were registered as if their numbers were of one frame.
#[test]
fn the_shape_is_that_of_each_part() {
    let turned = Pose::from_parts(
        Translation3::new(400.0, 0.0, 0.0),
        UnitQuaternion::from_axis_angle(&Vector3::z_axis(), std::f64::consts::PI),
    );
    let at = [[0.0, 0.0, 0.0], [40.0, 0.0, 0.0], [40.0, 30.0, 0.0], [0.0, 30.0, 0.0]];
    // One displacement in the base: of the second work object in its own axes the opposite one.
    let points = |part: u32| -> Vec<PathPoint> {
        let of = |object: usize, k: usize| {
            let shift = [[1.0, 0.5, 0.2], [-1.0, -0.5, 0.2]][object];
            let mut point = point(4 * object + k, at[k], Some(shift), Some(shift), false);
            if object == 1 {
                let from_object = turned * base_from_object();
                point.intended = from_object * Pose::translation(at[k][0], at[k][1], at[k][2]);
                (point.base_from_object, point.part_from_object, point.part) =
                    (from_object, from_object, part);
            }
            point
        };
        (0..2).flat_map(|object| (0..4).map(move |k| (object, k))).map(|(object, k)| of(object, k)).collect()
    };
    let shape = |points: Vec<PathPoint>| report("m", points).registered_rms_mm(|p| p.before).unwrap();
    assert!(shape(points(0)) < 1e-9, "{}", shape(points(0)));
    assert!(shape(points(1)) < 1e-9);
    // Two parts that are displaced against each other have their shape all the same, one part has not.
    let apart = |part: u32| {
        let mut points = points(part);
        for point in &mut points[4..] {
            point.before = point.before.map(|d| Deviation { vector_mm: -d.vector_mm, ..d });
        }
        shape(points)
    };
    assert!(apart(1) < 1e-9 && apart(0) > 0.1, "{} {}", apart(1), apart(0));
}

/// A line that nobody checked was a remark beside "[ok]".
#[test]
fn a_line_that_is_not_checked_is_a_warning() {
    let mut report = raster("m", After::PredictedRemainder, 1e-4);
    report.points.iter_mut().for_each(|point| (point.status, point.reason) = (MotionStatus::Changed, None));
    let judged = |unchecked_lines: Option<&str>, first_lines: Option<&str>| {
        let between = BetweenTargets {
            tolerance_mm: 0.05,
            largest_mm: Some(0.01),
            beyond: 0,
            beyond_lines: None,
            unchecked: usize::from(unchecked_lines.is_some()),
            unchecked_lines: unchecked_lines.map(str::to_owned),
            first_lines: first_lines.map(str::to_owned),
        };
        let report = PathReport { between: Some(between), ..report.clone() };
        terminal::document(&view::summary("blade.mod", &[report]), 400)
    };
    assert!(judged(None, None).contains("[ok]"), "{}", judged(None, None));
    assert!(judged(None, Some("line 5")).contains("[ok]"));
    assert!(judged(None, Some("line 5")).contains("the path to its end is not checked (line 5)"));
    let text = judged(Some("line 8"), None);
    assert!(text.contains("[warning]") && text.contains("is not checked (line 8)"), "{text}");
}
