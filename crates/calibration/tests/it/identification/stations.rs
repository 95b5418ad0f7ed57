//! A tracker that was set up in three places: one arm is fitted to all rows, and the places are nobody's fault.

use nalgebra::{Point3, UnitQuaternion, Vector3};
use truegrind_arm::model::Model;
use truegrind_arm::robots;
use truegrind_calibration::acceptance::{Options as AcceptOptions, accept};
use truegrind_calibration::diagnosis::diagnose::{Options as DiagnoseOptions, diagnose};
use truegrind_calibration::diagnosis::finding::Confidence;
use truegrind_calibration::identification::identify::{Identification, Options, identify};
use truegrind_calibration::identification::register::starting_frames;
use truegrind_calibration::identification::tolerance::Tolerance;
use truegrind_calibration::measurement::convention::AngleConvention;
use truegrind_calibration::measurement::dataset::{Dataset, Reading};
use truegrind_calibration::measurement::matching::{Mismatch, prepare_rows};
use truegrind_calibration::measurement::simulation::recipe::Recipe;
use truegrind_calibration::measurement::{import, split};
use truegrind_calibration::tracking::{Options as TrackOptions, Tracker};
use truegrind_math::se3::Pose;

fn arm() -> Model {
    robots::load("abb-irb-120").unwrap().model
}

/// An IRB 120 whose links are off and whose joints 2 and 3 yield, measured from one place, and its true arm.
fn measured(sensor: &str, count: usize) -> (Dataset, Model) {
    let (target, noise) = if sensor == "pose" {
        ("target = { position_mm = [38.2, 12.6, 61.3], wxyz = [0.9, 0.3, 0.1, 0.2] }", "sigma_deg = 0.002\n")
    } else {
        ("reflector_mm = [38.2, 12.6, 61.3]", "")
    };
    let recipe = format!(
        "robot = \"abb-irb-120\"\nseed = 5\n[arm.random]\nseed = 8\na_mm = 0.5\nd_mm = 0.5\nalpha_deg = 0.05\nbeta_deg = 0.05\n\
         theta_deg = 0.1\n[[arm.effect]]\neffect = \"joint-compliance\"\njoint = 1\ncompliance_rad_per_nm = 8e-6\n\
         [poses]\nkind = \"random\"\ncount = {count}\nmin_deg = [-90.0, -50.0, -60.0, -120.0, -100.0, -150.0]\n\
         max_deg = [90.0, 60.0, 50.0, 120.0, 100.0, 150.0]\n[sensor]\nkind = \"{sensor}\"\n\
         frame = {{ position_mm = [2310.5, -640.2, 512.7], wxyz = [0.12, 0.02, -0.03, 0.99] }}\n{target}\n\
         [noise]\nsigma_mm = 0.01\n{noise}"
    );
    let load = |name: &str| robots::load(name).map(|r| r.model).map_err(|e| e.to_string());
    let simulation = Recipe::parse(&recipe, "case").unwrap().simulate(load).unwrap();
    let rows = import::read("case.csv", simulation.csv.as_bytes(), &import::Options::default()).unwrap();
    (rows, simulation.actual)
}

/// Where each station stands in the frame of the first.
fn places() -> [Pose; 3] {
    let turned = |x, y, z, angle: f64| {
        let turn = UnitQuaternion::from_euler_angles(0.03, -0.05, angle);
        Pose::from_parts(Vector3::new(x, y, z).into(), turn)
    };
    [Pose::identity(), turned(-4100.0, 2600.0, 310.0, 2.2), turned(900.0, -3800.0, -220.0, -1.3)]
}

/// The same measurement, its rows read from the three places in turn: a third each.
fn moved(mut rows: Dataset) -> Dataset {
    let each = rows.rows.len().div_ceil(3);
    for (index, row) in rows.rows.iter_mut().enumerate() {
        row.anchor = index / each;
        let from_place = places()[row.anchor].inverse();
        match &mut row.reading {
            Reading::Position(place) => *place = (from_place * Point3::from(*place)).coords,
            Reading::Pose(pose) => **pose = from_place * **pose,
            Reading::Cable(_) => unreachable!(),
        }
    }
    rows
}

/// The same from so many places in turn, wherever they are.
fn moved_often(mut rows: Dataset, stations: usize) -> Dataset {
    let count = rows.rows.len();
    for (index, row) in rows.rows.iter_mut().enumerate() {
        row.anchor = index * stations / count;
        let k = row.anchor as f64;
        let turn = UnitQuaternion::from_euler_angles(0.01 * k, -0.02 * k, 0.7 * k);
        let place = Pose::from_parts(Vector3::new(300.0 * k, -200.0 * k, 10.0 * k).into(), turn);
        match &mut row.reading {
            Reading::Position(at) => *at = (place * Point3::from(*at)).coords,
            _ => unreachable!(),
        }
    }
    rows
}

/// What a frame that four poses place makes of a fifth was told as the arm's error, a hundred times as large.
#[test]
fn a_station_of_few_poses_neither_makes_nor_hides_an_error() {
    let (all, _) = measured("position", 280);
    let part = |from: usize, to: usize| all.subset(&(from..to).collect::<Vec<_>>());
    let [fitted, mut further] = [part(0, 160), part(160, 280)];
    further.sha256.clear();
    let held_out = |rows: Dataset| identified(&matched(rows)).estimated.calibrated.held_out.rmse;
    let one = held_out(fitted.clone());
    for stations in [8, 20, 30] {
        let several = held_out(moved_often(fitted.clone(), stations));
        assert!((0.6..1.6).contains(&(several / one)), "{stations} stations: {several} against {one}");
    }
    let model = identified(&matched(fitted)).estimated;
    let options = AcceptOptions {
        tolerance_mm: 1.0,
        uncertainty_mm: Some(0.02),
        tolerance_rad: None,
        uncertainty_rad: None,
        frames: None,
        seed: 0,
    };
    let accepted = |rows: Dataset| accept(&matched(rows), &model, &options).unwrap();
    let one = accepted(further.clone());
    assert_eq!(one.uncounted, None);
    for stations in [8, 20, 28] {
        let several = accepted(moved_often(further.clone(), stations));
        let ratios = [several.model.rmse / one.model.rmse, several.model.max / one.model.max];
        assert!(ratios.iter().all(|ratio| (0.6..1.7).contains(ratio)), "{stations} stations: {ratios:?}");
        let left = several.uncounted.map_or(0, |left| left.rows);
        assert!(
            several.errors_mm.len() + left == 120 && left < 60,
            "{stations} stations: {left} rows left out"
        );
    }
}

#[test]
fn a_small_station_makes_no_held_out_error_of_a_diagnosis() {
    let (mut rows, _) = measured("position", 120);
    rows = moved_often(rows, 24);
    // One large station and two of five poses.
    rows.rows.iter_mut().filter(|row| row.anchor < 22).for_each(|row| row.anchor = 0);
    let (rest, _) = measured("position", 120);
    for (row, seen) in rows.rows.iter_mut().zip(rest.rows.iter()).filter(|(row, _)| row.anchor == 0) {
        row.reading = seen.reading.clone();
    }
    rows.rows.iter_mut().filter(|row| row.anchor > 0).for_each(|row| row.anchor -= 21);
    let rows = matched(rows);
    let frames = starting_frames(&rows, &arm(), &Tolerance::default(), true).unwrap();
    let found =
        diagnose(&rows, "abb-irb-120", &arm(), &frames, &DiagnoseOptions::default(), &|_| {}).unwrap();
    assert!(found.diagnosis.fits.extended.cv_rmse_mm < 0.03, "{}", found.diagnosis.fits.extended.cv_rmse_mm);
}

fn matched(rows: Dataset) -> Dataset {
    prepare_rows(rows, "abb-irb-120", &arm(), AngleConvention::Logged, false).unwrap()
}

fn identified(rows: &Dataset) -> Identification {
    let options = Options::default();
    let frames = starting_frames(rows, &arm(), &options.tolerance, true).unwrap();
    identify(rows, "abb-irb-120", &arm(), &frames, &|rows| split::random(rows, 0.2, 0), &options).unwrap()
}

#[test]
fn three_stations_give_the_arm_that_one_gives() {
    for sensor in ["position", "pose"] {
        let (rows, _) = measured(sensor, 180);
        let one = identified(&matched(rows.clone()));
        let several = matched(moved(rows));
        assert_eq!(several.stations(), 3);
        assert!(several.notes.iter().any(|note| note.starts_with("3 stations with 60, 60 and 60 rows")));
        let found = identified(&several);
        let held_out = |of: &Identification| of.estimated.calibrated.held_out.rmse;
        assert!(held_out(&found) < 1.2 * held_out(&one), "{sensor}: {} {}", held_out(&found), held_out(&one));
        for (a, b) in found.estimated.parameters.iter().zip(&one.estimated.parameters) {
            // Twelve more unknowns: wider, but never another arm.
            assert_eq!(a.name, b.name);
            assert!(a.sigma >= 0.8 * b.sigma, "{sensor} {}: {} {}", a.name, a.sigma, b.sigma);
            let off = (a.value - b.value).abs() / a.sigma;
            assert!(off < 3.0, "{sensor} {}: {off:.1} standard deviations", a.name);
        }
        let names: Vec<&str> = found.parameters.iter().map(|p| p.name.as_str()).collect();
        assert!(names.contains(&"station2.x") && names.contains(&"station3.rz"), "{names:?}");
    }
}

#[test]
fn a_diagnosis_names_the_cause_and_no_shift_of_the_sensor() {
    let (rows, actual) = measured("position", 180);
    let rows = matched(moved(rows));
    let frames = starting_frames(&rows, &arm(), &Tolerance::default(), true).unwrap();
    let found =
        diagnose(&rows, "abb-irb-120", &arm(), &frames, &DiagnoseOptions::default(), &|_| {}).unwrap();
    let told: Vec<String> = found.diagnosis.findings.iter().map(|f| f.effect.to_string()).collect();
    assert_eq!(told, ["joint-compliance"]);
    assert_eq!(found.diagnosis.findings[0].confidence, Confidence::Identified);
    // The parameters of the cause are its own, beside those of the stations.
    let [truth, cause] = [&actual, &found.extended.model].map(|arm| arm.effects[0].parameters()[0].value);
    assert!((cause / truth - 1.0).abs() < 0.1, "{cause} {truth}");
    assert_eq!(found.extended.parameter_indices(0).len(), 1);
    assert!(found.diagnosis.fits.extended.cv_rmse_mm < 0.03);
}

#[test]
fn a_station_with_too_few_rows_is_refused_by_name() {
    let (rows, _) = measured("position", 90);
    let mut rows = moved(rows);
    let kept: Vec<usize> = (0..rows.rows.len()).filter(|&i| rows.rows[i].anchor != 1 || i < 32).collect();
    rows = rows.subset(&kept);
    let refusal =
        |rows| prepare_rows(rows, "abb-irb-120", &arm(), AngleConvention::Logged, false).unwrap_err();
    let refused = refusal(rows.clone());
    assert!(matches!(&refused, Mismatch::Station(why) if (&*why.station, why.rows) == ("2", 2)), "{refused}");
    // As typed, with its rows: an "s1" among "S1".
    rows.station_names = ["S1", "s1", "S2"].map(str::to_owned).to_vec();
    let [a, b] = [30, 31].map(|row| rows.rows[row].number);
    let refused = refusal(rows).to_string();
    assert!(refused.contains(&format!("station s1 (column station: rows {a} and {b})")), "{refused}");
}

#[test]
fn a_track_follows_the_stations() {
    for sensor in ["position", "pose"] {
        let (rows, _) = measured(sensor, 120);
        let model = identified(&matched(rows.clone())).estimated;
        let moved = moved(rows);
        let mut tracker = Tracker::begin(&model, "hash", &moved, &TrackOptions::default()).unwrap();
        let alarms = tracker.process_file(&moved).unwrap();
        assert!(alarms.is_empty(), "{sensor}: {alarms:#?}");
        assert_eq!((tracker.state().poses, tracker.state().outliers), (120, 0), "{sensor}");
        assert!(!tracker.departure().unwrap().is_significant, "{sensor}");
    }
}

#[test]
fn the_column_station_holds_names() {
    let head = "q1,q2,q3,q4,q5,q6,measured_x,measured_y,measured_z,station\n";
    let read = |rows: &str| {
        import::read("case.csv", format!("{head}{rows}").as_bytes(), &import::Options::default())
    };
    let rows =
        read("1,2,3,4,5,6,700,800,900,door\n2,3,4,5,6,7,701,801,901,window\n3,4,5,6,7,8,702,802,902,door\n");
    let rows = rows.unwrap();
    assert_eq!(rows.rows.iter().map(|row| row.anchor).collect::<Vec<_>>(), [0, 1, 0]);
    assert_eq!((rows.stations(), rows.anchors()), (2, 1));
    assert_eq!(rows.station_names, ["door", "window"]);
    let refused = read("1,2,3,4,5,6,700,800,900,door\n2,3,4,5,6,7,701,801,901,\n").unwrap_err();
    assert!(refused.to_string().contains("the name of a station in every row, or in none"), "{refused}");
    // Of a cable it names sessions: outlets are numbered.
    let cable = "q1,q2,q3,q4,q5,q6,L,station\n1,2,3,4,5,6,700,door\n2,3,4,5,6,7,701,\n";
    let cable = import::read("case.csv", cable.as_bytes(), &import::Options::default()).unwrap();
    assert_eq!((cable.stations(), cable.anchors()), (1, 1));
    assert_eq!([0, 1].map(|row| cable.rows[row].session()), [Some("door"), None]);
    assert!(cable.other_columns.is_empty(), "{:?}", cable.other_columns);
}
