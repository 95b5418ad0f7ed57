//! Simulated measurements: what a recipe says is what the file holds.

use std::path::Path;

use nalgebra::Vector3;
use truegrind_arm::condition::Condition;
use truegrind_arm::robots;
use truegrind_calibration::measurement::dataset::{Dataset, Reading, Sensor};
use truegrind_calibration::measurement::import::{self, Options};
use truegrind_calibration::measurement::sensor::residual;
use truegrind_calibration::measurement::simulation::recipe::Recipe;
use truegrind_calibration::measurement::simulation::{RecipeError, Simulation};
use truegrind_math::statistics::ErrorSummary;

/// Measures as a recipe says and reads the file back.
pub(super) fn measure(recipe: &str) -> (Simulation, Dataset) {
    let simulation = try_measure(recipe).unwrap();
    let data = import::read("simulated.csv", simulation.csv.as_bytes(), &Options::default()).unwrap();
    assert_eq!(data.rows.len(), simulation.rows.len());
    (simulation, data)
}

fn try_measure(recipe: &str) -> Result<Simulation, RecipeError> {
    Recipe::parse(recipe, "recipe.toml")?
        .simulate(|name| robots::load(name).map(|robot| robot.model).map_err(|error| error.to_string()))
}

pub(super) const CABLE: &str = "[sensor]\nkind = \"cable\"\noutlets_mm = [[700, 0, 100]]\nzeros_mm = [12.5]\n\
    hook_mm = [5, -3, 40]\n";
pub(super) const TRACKER: &str = "[sensor]\nkind = \"position\"\nreflector_mm = [30, 10, 60]\n\
    frame = { position_mm = [2000, -500, 300], wxyz = [0.2, 0.1, -0.3, 0.9] }\n";
pub(super) const SIX: &str = "[sensor]\nkind = \"pose\"\nframe = { position_mm = [2000, -500, 300], wxyz = [0.2, 0.1, -0.3, 0.9] }\n\
    target = { position_mm = [30, 10, 60], wxyz = [0.5, -0.1, 0.3, 0.2] }\n";

/// A recipe of so many random poses with extra text.
pub(super) fn random(count: usize, rest: &str) -> String {
    format!("robot = \"abb-irb-120\"\nseed = 5\n[poses]\nkind = \"random\"\ncount = {count}\n{rest}")
}

#[test]
fn shipped_files_are_what_their_recipes_give() {
    for name in ["irb120-cable", "irb120-tracker", "irb120-rounded"] {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/data");
        let recipe = std::fs::read_to_string(folder.join(format!("{name}.toml"))).unwrap();
        let (simulation, data) = measure(&recipe);
        let path = folder.join(format!("{name}.csv"));
        if std::env::var_os("TRUEGRIND_REGENERATE").is_some() {
            std::fs::write(&path, &simulation.csv).unwrap();
        }
        assert!(std::fs::read_to_string(&path).unwrap() == simulation.csv, "{name}: the file differs");
        assert_eq!(data.notes, Vec::<String>::new());
    }
}

#[test]
fn a_perfect_sensor_on_a_nominal_arm_reads_the_forward_map() {
    for sensor in [CABLE, TRACKER, SIX] {
        let (simulation, data) = measure(&random(20, sensor));
        assert_eq!(simulation.actual, simulation.nominal);
        for row in &data.rows {
            let flange = simulation.nominal.forward(&row.joints, &Condition::default());
            let predicted = simulation.rig.predict(&flange, row.anchor).unwrap();
            // Six decimals of the angles, four of the lengths.
            assert!(residual(&row.reading, &predicted).iter().all(|r| r.abs() < 2e-4), "{sensor}");
            let limits = &simulation.nominal.limits;
            assert!(limits.violated(&row.joints).is_none());
        }
    }
}

#[test]
fn cable_reads_the_distance_plus_zero() {
    let (simulation, data) = measure(&random(1, CABLE));
    let flange = simulation.nominal.forward(&simulation.rows[0].joints, &Condition::default());
    let hook = flange * nalgebra::Point3::new(5.0, -3.0, 40.0);
    let length = (hook.coords - Vector3::new(700.0, 0.0, 100.0)).norm() + 12.5;
    let Reading::Cable(read) = data.rows[0].reading else { panic!() };
    assert!((read - length).abs() < 1e-4, "{read} {length}");
}

#[test]
fn noise_has_the_stated_size() {
    let sigma = |noise: &str| {
        let (simulation, data) = measure(&random(2000, &format!("{TRACKER}[noise]\n{noise}")));
        let errors = data
            .rows
            .iter()
            .zip(&simulation.rows)
            .flat_map(|(row, truth)| residual(&row.reading, &truth.reading))
            .collect::<Vec<_>>();
        let summary = ErrorSummary::of(errors);
        (summary.standard_deviation, summary.max)
    };
    // 6000 values: the deviation is known to 1 %.
    let (normal, normal_max) = sigma("sigma_mm = 0.5");
    assert!((normal - 0.5).abs() < 0.02, "{normal}");
    let (heavy, heavy_max) = sigma("sigma_mm = 0.5\nstudent_t = 4.0");
    assert!((heavy - 0.5).abs() < 0.06 && heavy_max > 1.5 * normal_max, "{heavy} {heavy_max}");
    let (far, _) = sigma("per_metre_mm = 0.5");
    assert!((0.7..1.4).contains(&far), "a tracker some 2 m away: {far}");
}

#[test]
fn rounding_leaves_its_steps() {
    let text =
        std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/data/irb120-rounded.toml"))
            .unwrap();
    let (simulation, data) = measure(&text);
    assert_eq!(data.angle_step_rad, Some(0.1f64.to_radians()));
    assert_eq!((data.readout_step_mm, data.reading_step_mm), (Some(0.1), Some(0.01)));
    for (row, truth) in data.rows.iter().zip(&simulation.rows) {
        assert!((row.joints - truth.joints).amax() <= 0.05f64.to_radians() * 1.0001);
        let exact = simulation.nominal.forward(&truth.joints, &Condition::default()).translation.vector;
        assert!((row.readout_mm().unwrap() - exact).amax() <= 0.05 * 1.0001);
    }
}

#[test]
fn circumstances_are_logged_and_felt() {
    let recipe = random(
        40,
        "repeats = 2\n[circumstances]\nhours = 4.0\napproach = \"both\"\npayload_kg = [0.0, 2.0]\npayload_centre_mm = [10.0, 0.0, 80.0]\n\
         temperature = { start_c = 20.0, end_c = 32.0, time_constant_h = 1.0 }\n\
         [[arm.effect]]\neffect = \"backlash\"\njoint = 0\nplay_rad = 0.002\n",
    ) + TRACKER;
    let (_, data) = measure(&recipe);
    assert_eq!(data.rows.len(), 160);
    let last = *data.rows.last().unwrap().condition;
    assert_eq!((last.time_h, last.payload_kg), (Some(4.0), Some(2.0)));
    assert_eq!(last.payload_centre_mm, [10.0, 0.0, 80.0]);
    assert!((last.temperature_c.unwrap() - (32.0 - 12.0 * (-4f64).exp())).abs() < 1e-3);
    let mut widest = 0f64;
    for pair in data.rows.iter().collect::<Vec<_>>().chunks(2) {
        assert_eq!((pair[0].condition.approach, pair[1].condition.approach), ([-1; 6], [1; 6]));
        let [Reading::Position(a), Reading::Position(b)] = [&pair[0].reading, &pair[1].reading] else {
            panic!()
        };
        let moved = (a - b).norm();
        assert!(moved < 1.5, "play of 0.002 rad within reach of the arm: {moved}");
        widest = widest.max(moved);
    }
    assert!(widest > 0.5, "{widest}");
    assert_eq!(data.rows[0].joints, data.rows[80].joints, "the second round repeats the first");
}

#[test]
fn faults_touch_their_rows_only() {
    let plain = measure(&random(30, CABLE)).1;
    let faults = [
        ("fault = \"sensor-zero-shift\"\nrows = [10, 19]\noffset_mm = 1.5", 10..20),
        ("fault = \"sensor-frame-shift\"\nrows = [5, 9]\nshift_mm = [3, 4, 5]", 5..10),
        ("fault = \"tool-shift\"\nrows = [20, 29]\nshift_mm = [5, 5, 5]", 20..30),
        ("fault = \"outliers\"\nrow_list = [7]\nsize_mm = 50.0", 7..8),
        ("fault = \"sensor-scale\"\nerror = 0.01", 0..30),
        ("fault = \"cable-sag\"\nweight_over_tension_per_m = 0.5", 0..30),
    ];
    for (fault, rows) in faults {
        let data = measure(&format!("{}[[fault]]\n{fault}\n", random(30, CABLE))).1;
        for (i, (a, b)) in plain.rows.iter().zip(&data.rows).enumerate() {
            assert_eq!(a.reading != b.reading, rows.contains(&i), "{fault}, row {i}");
        }
    }
}

#[test]
fn grids_lists_and_views() {
    let grid = "robot = \"universal-robots-ur5\"\nseed = 1\n[poses]\nkind = \"grid\"\nsteps = [3, 2, 1, 1, 1, 2]\n\
                min_deg = [-90, -90, 0, 0, 0, 0]\nmax_deg = [90, -30, 60, 0, 0, 90]\n";
    let (_, data) = measure(&format!("{grid}{CABLE}"));
    assert_eq!(data.rows.len(), 12);
    let degrees = |i: usize| data.rows[i].joints.map(|q| q.to_degrees().round());
    assert_eq!(degrees(0).as_slice(), [-90.0, -90.0, 30.0, 0.0, 0.0, 0.0]);
    assert_eq!(degrees(7).as_slice(), [0.0, -30.0, 30.0, 0.0, 0.0, 90.0]);
    let seen = random(
        50,
        "[view]\ndistance_mm = [300, 600]\ntilt_deg = 60.0\nbox_mm = [[0,-400,0],[900,400,900]]\n",
    );
    let (simulation, _) = measure(&format!("{seen}{CABLE}"));
    for row in &simulation.rows {
        let Reading::Cable(length) = row.reading else { panic!() };
        assert!((312.5..=612.5).contains(&length));
    }
    let nowhere = random(5, "[view]\ndistance_mm = [9000, 9001]\n") + CABLE;
    let error = try_measure(&nowhere).unwrap_err().to_string();
    assert!(error.contains("0 of 5 poses") && error.contains("view.distance_mm"), "{error}");
}

#[test]
fn recipes_that_cannot_be_meant_are_refused() {
    let cases = [
        (random(5, CABLE).replace("irb-120", "irb-12"), "robot: unknown robot"),
        (random(5, &format!("colour = 3\n{CABLE}")), "recipe.toml: not a recipe: line 3"),
        (
            random(5, &format!("{CABLE}[noise]\nstudent_t = 1.5\n")),
            "noise.student_t: found 1.5, expected more than 2",
        ),
        (random(5, &format!("{CABLE}[noise]\nsigma_mm = -1.0\n")), "noise.sigma_mm: found -1"),
        (random(5, &format!("{CABLE}[[arm.link]]\njoint = 6\n")), "arm.link.joint: found 6"),
        (random(5, &format!("{CABLE}[rounding]\nangles_deg = 0.0\n")), "rounding.angles_deg: found 0"),
        (random(5, &format!("margin_deg = 170.0\n{CABLE}")), "inside the joint limits"),
        (random(5, CABLE).replace("[[700, 0, 100]]", "[]"), "sensor.outlets_mm"),
    ];
    for (recipe, wanted) in cases {
        let error = try_measure(&recipe).unwrap_err().to_string();
        assert!(error.contains(wanted), "{error}\n without {wanted}");
    }
}

#[test]
fn same_seed_same_bytes() {
    let recipe = random(50, &format!("{CABLE}[noise]\nsigma_mm = 0.1\n"));
    let first = measure(&recipe).0;
    assert_eq!(first, measure(&recipe).0);
    assert_ne!(first.csv, measure(&recipe.replace("seed = 5", "seed = 6")).0.csv);
    // Noise is a stream of its own: another sensor does not change the poses.
    assert_eq!(first.rows[9].joints, measure(&random(50, TRACKER)).0.rows[9].joints);
}

#[test]
fn several_outlets_are_told_apart() {
    let sensor = CABLE.replace("[[700, 0, 100]]", "[[700, 0, 100], [0, 700, 100]]");
    let (_, data) = measure(&random(10, &sensor));
    assert_eq!((data.rows.len(), data.anchors(), data.sensor), (20, 2, Sensor::Cable));
    assert_eq!((data.rows[0].anchor, data.rows[1].anchor), (0, 1));
}

/// The class: a recipe's number that is none, or that asks for more than anyone measures, gives NaN in a file that says
/// nothing of it, or a run that does not end.
#[test]
fn a_tracker_that_was_set_up_in_several_places_sees_its_share_of_the_poses_from_each() {
    let further = "[[station]]\nposition_mm = [-1800, 900, 250]\nwxyz = [0.9, 0, 0, 0.4]\n\
        [[station]]\nposition_mm = [300, 2100, 400]\n";
    // No place sees the target all around.
    let view = "[view]\ntilt_deg = 70\n";
    for sensor in [TRACKER, SIX] {
        let (simulation, mut data) = measure(&random(30, &format!("{sensor}{further}{view}")));
        assert_eq!(data.stations(), 3);
        let stations: Vec<usize> = simulation.rows.iter().map(|row| row.station).collect();
        assert_eq!(stations, (0..30).map(|row| row / 10).collect::<Vec<_>>());
        assert_eq!(stations, data.rows.iter().map(|row| row.anchor).collect::<Vec<_>>());
        let recipe = Recipe::parse(&random(30, &format!("{sensor}{further}{view}")), "recipe.toml").unwrap();
        for (row, read) in simulation.rows.iter().zip(&data.rows) {
            let flange = simulation.actual.forward(&row.joints, &row.condition);
            let rig = &recipe.rigs()[row.station];
            assert!(rig.sees(&recipe.view.limits(), &flange, 0));
            let seen = rig.predict(&flange, 0).unwrap();
            assert!(residual(&read.reading, &seen).iter().all(|off| off.abs() < 1e-3));
        }
        // What `identify` reads: all rows in the frame of the first place.
        data = truegrind_calibration::measurement::rows_of_robot::rows_of_robot(
            data,
            &robots::load("abb-irb-120").unwrap(),
            None,
            false,
        )
        .unwrap();
        let first = &recipe.rigs()[0];
        for (row, read) in simulation.rows.iter().zip(&data.rows) {
            let flange = simulation.actual.forward(&row.joints, &row.condition);
            let off = residual(&read.reading, &first.predict(&flange, 0).unwrap());
            assert!(off.iter().all(|off| off.abs() < 2e-3), "{off:?}");
        }
    }
    // One place gives the bytes of a recipe that knows of none.
    assert!(!measure(&random(5, TRACKER)).0.csv.contains("station"));
    let cable = try_measure(&random(5, &format!("{CABLE}{further}"))).unwrap_err().to_string();
    assert!(cable.contains("station") && cable.contains("outlets_mm"), "{cable}");
}

#[test]
fn a_recipe_with_any_number_wrong_is_refused_or_gives_finite_rows() {
    use rayon::prelude::*;
    let effects = "[[arm.effect]]\neffect = \"gear-eccentricity\"\njoint = 0\norder = 1.0\nsine_rad = 3e-4\ncosine_rad = 1e-4\n\
        [[arm.effect]]\neffect = \"thermal-drift\"\ngrowth = 1e-4\ntime_constant_h = 1.5\ngrowth_per_k = 1e-5\nreference_c = 20\n";
    let rest = format!(
        "{SIX}[noise]\nsigma_mm = 0.02\nper_metre_mm = 0.01\nsigma_deg = 0.01\nstudent_t = 5.0\njoints_deg = 0.001\n\
         [rounding]\nangles_deg = 0.01\nreading_mm = 0.001\n\
         [view]\nbox_mm = [[-900, -900, -900], [900, 900, 1500]]\ndistance_mm = [100, 9000]\ntilt_deg = 179\n\
         [circumstances]\nhours = 4.0\npayload_kg = [1.0, 2.0]\npayload_centre_mm = [1, 2, 30]\n\
         temperature = {{ start_c = 20, end_c = 30, time_constant_h = 1.5 }}\n\
         [arm.random]\nseed = 7\na_mm = 0.3\nd_mm = 0.3\nalpha_deg = 0.03\nbeta_deg = 0.03\ntheta_deg = 0.1\n\
         [[arm.link]]\njoint = 1\na_mm = 0.1\ntheta_deg = 0.2\n{effects}\
         [[fault]]\nfault = \"sensor-frame-shift\"\nrows = [2, 3]\nshift_mm = [1, 2, 3]\nturn_deg = [1, 2, 3]\n\
         [[fault]]\nfault = \"sensor-scale\"\nerror = 0.001\n\
         [[fault]]\nfault = \"outliers\"\nrow_list = [1, 4]\nsize_mm = 5\n\
         [[fault]]\nfault = \"payload-change\"\nrows = [1, 2]\npayload_kg = 3\n"
    );
    for poses in [
        "kind = \"random\"\ncount = 5\nmargin_deg = 4\nmin_deg = [-90, -90, -60, -90, -90, -90]\nmax_deg = [90, 90, 60, 90, 90, 90]\nrepeats = 2\n",
        "kind = \"grid\"\nmin_deg = [-40, -30, -20, 10, 20, 30]\nmax_deg = [40, 30, 20, 60, 70, 80]\nsteps = [2, 1, 2, 1, 1, 1]\n",
    ] {
        let text = format!("robot = \"abb-irb-120\"\nseed = 5\n[poses]\n{poses}{rest}");
        try_measure(&text).unwrap();
        truegrind_testing::absurd::each(&text).par_bridge().for_each(|(said, text)| {
            match try_measure(&text) {
                Err(error) => assert!(!error.to_string().is_empty()),
                Ok(simulation) => {
                    assert!(!simulation.csv.contains("NaN") && !simulation.csv.contains("inf"), "{said}");
                }
            }
        });
    }
    for (from, to) in
        [("count = 5", "count = 1000000000000"), ("repeats = 2", "repeats = 9000000000000000000")]
    {
        let text = random(5, CABLE).replace("count = 5\n", "count = 5\nrepeats = 2\n").replace(from, to);
        let error = try_measure(&text).unwrap_err().to_string();
        assert!(error.contains("at most 1,000,000 rows in all"), "{error}");
    }
}
