//! Whether what is said of a correction is right: on simulated arms, how often the true error of shape and of placement lies
//! within one, two and three predicted sigma, axis by axis, and how often a cut gets worse against the chance that was stated.
//!
//! Every arm is drawn with tolerances of its own (lengths, twists and joint zeros each within a factor of ten), measured by a
//! cable or a tracker with the target on the axis of joint 6 or beside it, and corrected for as a user would: rows → model →
//! program → program. The true arm then runs the corrected program. Programs lie inside the measured region.
//!
//! `cargo bench --no-default-features --bench uncertainty [-- ARMS [CAUSES [SEEDS]]]`: so many arms without causes (identified), and
//! so many with (diagnosed), their seeds counted from SEEDS on. With `TRUEGRIND_DRAWN=1` arms without causes are identified under
//! the very tolerances that they were drawn with: what one would say who knows them.
//! With `TRUEGRIND_SWEEP=FILE` every arm as a line of CSV in that file, and every cut in `FILE.cuts`.
//!
//! Cuts of one arm share its model's error, so they get worse together. Whether as many get worse as was said is therefore asked
//! arm by arm: z is the sum of (found − said) over the root of the sum of its squares by arm. Beside it stands the z that would
//! hold if every cut were an arm of its own (binomial), which is too large where they are not.

// A benchmark says what it measured.
#![allow(clippy::print_stdout, clippy::unwrap_used, missing_docs)]

use std::collections::BTreeMap;
use std::fmt::Write as _;

use nalgebra::{DMatrix, DVector, UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use truegrind::arm::inverse::Inverse;
use truegrind::calibration::identification::start::candidate_frames;
use truegrind::calibration::measurement::import;
use truegrind::compensation::risk::placement::Placement;
use truegrind::compensation::verify::{ActingArm, VerificationTask, verify};
use truegrind::programs::rapid::Task;
use truegrind::{
    CompensateOptions, Condition, DiagnoseOptions, Estimated, IdentifyOptions, Joints, Model, Pose, Program,
    Recipe, Simulation, compensate, diagnose, identify, split,
};

const ROBOTS: [&str; 3] = ["abb-irb-120", "universal-robots-ur10", "fanuc-m-20ia"];
/// Programs for each arm.
const PROGRAMS: usize = 4;
const TOOL_MM: [f64; 3] = [20.0, -10.0, 150.0];

fn widths(within: &mut dyn FnMut(f64, f64) -> f64) -> [f64; 3] {
    [within(0.1, 1.0), within(0.02, 0.2), within(0.03, 0.3)]
}

/// One arm, and how it is measured.
#[derive(Debug, Clone, Copy)]
struct Case {
    robot: &'static str,
    cable: bool,
    beside: bool,
    causes: bool,
    seed: u64,
}

impl Case {
    fn all(arms: usize, causes: bool, from: u64) -> Vec<Self> {
        (0..arms)
            .map(|k| Self {
                robot: ROBOTS[k % 3],
                cable: k / 3 % 2 == 0,
                beside: k / 6 % 2 == 0,
                causes,
                seed: from + k as u64 + if causes { 100_000 } else { 0 },
            })
            .collect()
    }

    /// Standard deviations of lengths (mm), twists and joint zeros [°] that the arm is drawn with.
    fn widths(&self) -> [f64; 3] {
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
        let mut within = |low: f64, high: f64| low * (high / low).powf(rng.random::<f64>());
        widths(&mut within)
    }

    fn recipe(&self) -> String {
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
        let mut within = |low: f64, high: f64| low * (high / low).powf(rng.random::<f64>());
        let [length, twist, zero] = widths(&mut within);
        let rows = within(120.0, 400.0).round();
        let noise = within(0.02, 0.1);
        let target = if self.beside { "38.2, 12.6, 61.3" } else { "0.0, 0.0, 61.3" };
        let sensor = if self.cable {
            format!(
                "kind = \"cable\"\noutlets_mm = [[900.0, 250.0, 60.0]]\nzeros_mm = [14.0]\nhook_mm = [{target}]"
            )
        } else {
            format!(
                "kind = \"position\"\nframe = {{ position_mm = [2310.5, -640.2, 512.7], wxyz = [0.12, 0.02, -0.03, 0.99] }}\n\
                 reflector_mm = [{target}]"
            )
        };
        let mut effects = String::new();
        if self.causes {
            let (yields, gear) = (within(1e-5, 4e-5), within(1e-4, 4e-4));
            let _ = write!(
                effects,
                "[[arm.effect]]\neffect = \"joint-compliance\"\njoint = 1\ncompliance_rad_per_nm = {yields}\n\
                 [[arm.effect]]\neffect = \"gear-eccentricity\"\njoint = 0\norder = 1.0\nsine_rad = {gear}\ncosine_rad = {}\n",
                0.6 * gear
            );
        }
        format!(
            "robot = \"{}\"\nseed = {}\n[arm.random]\nseed = {}\na_mm = {length}\nd_mm = {length}\nalpha_deg = {twist}\n\
             beta_deg = {twist}\ntheta_deg = {zero}\n{effects}[poses]\nkind = \"random\"\ncount = {rows}\n\
             min_deg = [-90.0, -50.0, -60.0, -120.0, -100.0, -150.0]\nmax_deg = [90.0, 60.0, 50.0, 120.0, 100.0, 150.0]\n\
             [sensor]\n{sensor}\n[noise]\nsigma_mm = {noise}\njoints_deg = 0.0005\n",
            self.robot,
            self.seed + 7,
            self.seed + 900_000
        )
    }
}

fn model_of(case: &Case, simulation: &Simulation) -> Option<Estimated> {
    let rows = import::read("case.csv", simulation.csv.as_bytes(), &import::Options::default()).unwrap();
    let nominal = &simulation.nominal;
    let frames = candidate_frames(&rows, nominal).ok()?;
    if case.causes {
        let frames = frames.first()?;
        let found = diagnose(&rows, case.robot, nominal, frames, &DiagnoseOptions::default(), &|_| {});
        return found.ok().map(|d| d.estimated);
    }
    let mut options = IdentifyOptions::default();
    if std::env::var_os("TRUEGRIND_DRAWN").is_some() {
        let [length, twist, zero] = case.widths();
        options.tolerance = truegrind::Tolerance {
            length_mm: length,
            angle_rad: twist.to_radians(),
            zero_rad: zero.to_radians(),
            learn_widths: false,
            ..options.tolerance
        };
    }
    let share = |rows: &truegrind::Dataset| split::random(rows, options.held_out, options.seed);
    frames
        .iter()
        .filter_map(|frames| identify(&rows, case.robot, nominal, frames, &share, &options).ok())
        .map(|found| found.estimated)
        .min_by(|a, b| a.registered.fitted.rmse.total_cmp(&b.registered.fitted.rmse))
}

/// A raster over a slightly bent patch inside the measured region: targets with the joints that the controller takes.
fn raster(nominal: &Model, estimated: &Estimated, rng: &mut ChaCha8Rng) -> Option<Vec<(Pose, Joints)>> {
    let still = Condition::default();
    let inverse = Inverse::new(nominal, &still, nominal);
    let arm = nominal.at_condition(&still);
    let tool = Pose::translation(TOOL_MM[0], TOOL_MM[1], TOOL_MM[2]);
    'tries: for _ in 0..200 {
        let samples = &estimated.region.samples_deg;
        let start = samples[rng.random_range(0..samples.len())];
        let mut near = Joints::from_fn(|i, _| start[i].to_radians());
        if near[4].abs() < 0.35 {
            continue;
        }
        let middle = arm.forward(&near) * tool;
        let (long, wide) = (rng.random_range(60.0..250.0), rng.random_range(30.0..120.0));
        let bend = rng.random_range(0.0..0.25);
        let mut out = Vec::new();
        for row in 0..4 {
            for column in 0..6 {
                let along = if row % 2 == 0 { column } else { 5 - column };
                let (u, v) = (f64::from(along) / 5.0 - 0.5, f64::from(row) / 3.0 - 0.5);
                let turn = UnitQuaternion::from_scaled_axis(Vector3::new(-bend * v, bend * u, 0.0));
                let at = Pose::from_parts(Vector3::new(long * u, wide * v, 10.0 * bend * u * u).into(), turn);
                let pose = middle * at;
                let Ok(found) = inverse.solve_near(&(pose * tool.inverse()), &near) else { continue 'tries };
                if estimated.region.outside(&found.joints).is_some()
                    || nominal.limits.violated(&found.joints).is_some()
                    || found.joints[4].abs() < 0.25
                    || (0..6).any(|j| (found.joints[j] - near[j]).abs() > 0.9)
                {
                    continue 'tries;
                }
                near = found.joints;
                out.push((pose, near));
            }
        }
        return Some(out);
    }
    None
}

fn module(path: &[(Pose, Joints)], inverse: &Inverse<'_>) -> String {
    let numbers = |values: &[f64], decimals: usize| {
        values.iter().map(|v| format!("{v:.decimals$}")).collect::<Vec<_>>().join(",")
    };
    let mut text = format!(
        "MODULE Cut\nTASK PERS tooldata disc:=[TRUE,[[{}],[1,0,0,0]],[1,[0,0,50],[1,0,0,0],0,0,0]];\n\
         TASK PERS wobjdata part:=[FALSE,TRUE,\"\",[[0,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];\nPROC main()\n",
        numbers(&TOOL_MM, 3)
    );
    for (k, (pose, joints)) in path.iter().enumerate() {
        let q = pose.rotation.quaternion();
        let conf = inverse.configuration(joints);
        let _ = writeln!(
            text,
            "{} [[{}],[{}],[{},{},{},{}],[9E9,9E9,9E9,9E9,9E9,9E9]],v50,z0,disc\\WObj:=part;",
            if k == 0 { "MoveJ" } else { "MoveL" },
            numbers(pose.translation.vector.as_slice(), 5),
            numbers(&[q.w, q.i, q.j, q.k], 8),
            conf.cf1,
            conf.cf4,
            conf.cf6,
            conf.cfx
        );
    }
    text + "ENDPROC\nENDMODULE\n"
}

/// The rigid part of displacements at points, by least squares over the six motions.
fn rigid(points: &[Vector3<f64>]) -> DMatrix<f64> {
    let centre = points.iter().sum::<Vector3<f64>>() / points.len() as f64;
    let mut motions = DMatrix::zeros(3 * points.len(), 6);
    for (k, p) in points.iter().enumerate() {
        let r = (p - centre) / 100.0;
        motions.view_mut((3 * k, 0), (3, 3)).copy_from(&nalgebra::Matrix3::identity());
        motions.view_mut((3 * k, 3), (3, 3)).copy_from(&-r.cross_matrix());
    }
    let basis = motions.svd(true, false).u.unwrap();
    &basis * basis.transpose()
}

/// Counts of axes within 1, 2 and 3 sigma, and of all.
type Within = [usize; 4];

/// A cut: chance of worse that was stated, RMS before and after as the true arm runs it.
#[derive(Debug, Clone, Copy)]
struct Cut {
    /// Seed of its arm: cuts of one arm get worse together.
    arm: u64,
    placement: Placement,
    /// Predicted sigma of the correction, as a whole (RMS, mm).
    sigma_mm: f64,
    chance: f64,
    off_mm: [f64; 2],
    auto_takes: bool,
}

#[derive(Default)]
struct Outcome {
    /// Effects of the model that is handed on.
    effects: String,
    shape: Within,
    placement: Within,
    squares: [f64; 2],
    cuts: Vec<Cut>,
    failed: usize,
}

fn count(within: &mut Within, error: f64, sigma: f64) {
    (0..3).for_each(|k| within[k] += usize::from(error.abs() <= (k + 1) as f64 * sigma));
    within[3] += 1;
}

fn outcome(case: &Case) -> Option<Outcome> {
    let recipe = Recipe::parse(&case.recipe(), "case").unwrap();
    let resolve = |name: &str| truegrind::robots::load(name).map(|r| r.model).map_err(|e| e.to_string());
    let simulation = recipe.simulate(resolve).ok()?;
    let estimated = model_of(case, &simulation)?;
    let (nominal, actual) = (&simulation.nominal, &simulation.actual);
    let still = Condition::default();
    let (known, real) = (estimated.model.at_condition(&still), actual.at_condition(&still));
    let inverse = Inverse::new(nominal, &still, nominal);
    let tool = Pose::translation(TOOL_MM[0], TOOL_MM[1], TOOL_MM[2]);
    let mut rng = ChaCha8Rng::seed_from_u64(case.seed + 31);
    let effects =
        estimated.model.effects.iter().map(|e| format!("{e:?}").chars().take(22).collect::<String>());
    let mut out = Outcome { effects: effects.collect::<Vec<_>>().join(" | "), ..Outcome::default() };
    for _ in 0..PROGRAMS {
        let Some(path) = raster(nominal, &estimated, &mut rng) else {
            out.failed += 1;
            continue;
        };
        let n = path.len();
        let (mut error, mut jacobian) = (DVector::zeros(3 * n), DMatrix::zeros(3 * n, estimated.order.len()));
        let mut points = Vec::new();
        for (k, (pose, q)) in path.iter().enumerate() {
            let off =
                (known.forward(q) * tool).translation.vector - (real.forward(q) * tool).translation.vector;
            error.rows_mut(3 * k, 3).copy_from(&off);
            jacobian.rows_mut(3 * k, 3).copy_from(&estimated.position_jacobian(&known, q, &tool));
            points.push(pose.translation.vector);
        }
        let projector = rigid(&points);
        for of_shape in [true, false] {
            let part = |whole: &DMatrix<f64>| {
                let placed = &projector * whole;
                if of_shape { whole - placed } else { placed }
            };
            let error = part(&DMatrix::from_column_slice(3 * n, 1, error.as_slice()));
            let jacobian = part(&jacobian);
            let covariance = &jacobian * &estimated.covariance;
            for row in 0..3 * n {
                let sigma = covariance.row(row).dot(&jacobian.row(row)).max(0.0).sqrt();
                let within = if of_shape { &mut out.shape } else { &mut out.placement };
                count(within, error[(row, 0)], sigma);
                if of_shape && sigma > 0.0 {
                    out.squares[0] += (error[(row, 0)] / sigma).powi(2);
                } else if sigma > 0.0 {
                    out.squares[1] += (error[(row, 0)] / sigma).powi(2);
                }
            }
        }
        cuts(&module(&path, &inverse), &estimated, actual, case.seed, &mut out);
    }
    Some(out)
}

/// Corrects a program for its shape and as a whole, and lets the true arm run it.
fn cuts(text: &str, estimated: &Estimated, actual: &Model, arm: u64, out: &mut Outcome) {
    let program = Program::Rapid(Task::read(&[("cut.mod", text.as_bytes())]));
    let cell = truegrind::Cell::default();
    let options = |placement, max_risk| CompensateOptions {
        placement,
        max_risk,
        max_correction_mm: 50.0,
        max_rotation_rad: 0.2,
        ..CompensateOptions::default()
    };
    // With the default chance, below which a place is corrected and above which the shape is.
    let auto = compensate(&program, estimated, &cell, &options(Placement::Auto, 0.1), None).unwrap();
    for placement in [Placement::Shape, Placement::Absolute] {
        let done = compensate(&program, estimated, &cell, &options(placement, 1.0), None).unwrap();
        let ([cut], Ok(bytes)) =
            (done.plan.cuts.as_slice(), done.rewritten.files[0].edits.apply(text.as_bytes()))
        else {
            out.failed += 1;
            continue;
        };
        let after = Task::read(&[("cut.mod", bytes.as_slice())]);
        let judged = VerificationTask {
            original: program.listing(),
            rewritten: Some(&after.listing),
            cell: &cell,
            surface: None,
            program: "cut.mod",
            name: "",
            after: truegrind::After::Achieved,
            tolerance_mm: CompensateOptions::default().tolerance_mm,
            loads: [None, None],
        };
        let acting = ActingArm {
            nominal: &estimated.nominal,
            model: actual,
            knowledge: None,
            condition: Condition::default(),
        };
        let report = verify(&judged, &acting);
        let lines: Vec<_> = report.points.iter().filter(|p| p.cutting).collect();
        if lines.iter().any(|p| p.after.is_none()) || !done.changed() {
            out.failed += 1;
            continue;
        }
        let points: Vec<Vector3<f64>> = lines.iter().map(|p| p.intended.translation.vector).collect();
        let projector = rigid(&points);
        let rms = |of: &dyn Fn(&truegrind::PathPoint) -> Vector3<f64>| {
            let all: Vec<f64> = lines.iter().flat_map(|p| of(p).as_slice().to_vec()).collect();
            let all = DVector::from_vec(all);
            let left = if placement == Placement::Shape { &all - &projector * &all } else { all };
            (left.norm_squared() / points.len() as f64).sqrt()
        };
        let off_mm = [rms(&|p| p.before.unwrap().vector_mm), rms(&|p| p.after.unwrap().vector_mm)];
        let auto_takes = auto.plan.placements[0].applied == placement;
        out.cuts.push(Cut {
            arm,
            placement,
            sigma_mm: cut.sigma_mm,
            chance: cut.probability_of_harm,
            off_mm,
            auto_takes,
        });
    }
}

fn main() {
    let mut numbers = std::env::args().skip(1).filter_map(|a| a.parse::<usize>().ok());
    let (arms, with) = (numbers.next().unwrap_or(60), numbers.next().unwrap_or(0));
    let from = numbers.next().unwrap_or(0) as u64;
    let cases: Vec<Case> =
        Case::all(arms, false, from).into_iter().chain(Case::all(with, true, from)).collect();
    if let Some(folder) = std::env::var_os("TRUEGRIND_RECIPES") {
        let folder = std::path::Path::new(&folder);
        for case in &cases {
            std::fs::write(folder.join(format!("{}.toml", case.seed)), case.recipe()).unwrap();
        }
        return;
    }
    let outcomes: Vec<(Case, Option<Outcome>)> =
        cases.into_par_iter().map(|case| (case, outcome(&case))).collect();
    let mut groups: BTreeMap<String, Outcome> = BTreeMap::new();
    for (case, outcome) in &outcomes {
        let sensor = if case.cable { "cable" } else { "tracker" };
        let target = if case.beside { "beside axis 6" } else { "on axis 6" };
        let causes = if case.causes { "with causes" } else { "without causes" };
        for key in [
            "all".to_owned(),
            causes.to_owned(),
            format!("{sensor}, {target}, {causes}"),
            case.robot.to_owned(),
        ] {
            let into = groups.entry(key).or_default();
            let Some(outcome) = outcome else {
                into.failed += PROGRAMS;
                continue;
            };
            for k in 0..4 {
                into.shape[k] += outcome.shape[k];
                into.placement[k] += outcome.placement[k];
            }
            (0..2).for_each(|k| into.squares[k] += outcome.squares[k]);
            into.cuts.extend(&outcome.cuts);
            into.failed += outcome.failed;
        }
    }
    if let Some(path) = std::env::var_os("TRUEGRIND_SWEEP") {
        std::fs::write(&path, csv(&outcomes)).unwrap();
        let mut of_cuts = path;
        of_cuts.push(".cuts");
        std::fs::write(of_cuts, csv_of_cuts(&outcomes)).unwrap();
    }
    println!(
        "{:44} {:>26}   {:>26}  {:>6}",
        "share within 1, 2, 3 sigma (rms z) [%]", "shape", "placement", "failed"
    );
    for (key, o) in &groups {
        let text = |w: &Within, square: f64| {
            let share = |k: usize| 100.0 * w[k] as f64 / w[3].max(1) as f64;
            format!(
                "{:5.1} {:5.1} {:5.1} ({:4.2})",
                share(0),
                share(1),
                share(2),
                (square / w[3].max(1) as f64).sqrt()
            )
        };
        println!(
            "{key:44} {:>26}   {:>26}  {:>6}",
            text(&o.shape, o.squares[0]),
            text(&o.placement, o.squares[1]),
            o.failed
        );
    }
    for (key, o) in &groups {
        risks(key, &o.cuts);
    }
}

fn csv(outcomes: &[(Case, Option<Outcome>)]) -> String {
    let mut out = String::from("robot,cable,beside,causes,seed,shape_rms_z,placement_rms_z,effects\n");
    for (case, outcome) in outcomes {
        let Case { robot, cable, beside, causes, seed } = case;
        let Some(o) = outcome else { continue };
        let z = |square: f64, w: &Within| (square / w[3].max(1) as f64).sqrt();
        let (shape, placement) = (z(o.squares[0], &o.shape), z(o.squares[1], &o.placement));
        let _ =
            writeln!(out, "{robot},{cable},{beside},{causes},{seed},{shape:.2},{placement:.2},{}", o.effects);
    }
    out
}

fn csv_of_cuts(outcomes: &[(Case, Option<Outcome>)]) -> String {
    let mut out = String::from("arm,placement,chance,before_mm,after_mm,sigma_mm,auto_takes\n");
    for cut in outcomes.iter().filter_map(|(_, o)| o.as_ref()).flat_map(|o| &o.cuts) {
        let Cut { arm, placement, chance, off_mm: [before, after], sigma_mm, auto_takes } = cut;
        let _ = writeln!(
            out,
            "{arm},{placement:?},{chance:.5},{before:.5},{after:.5},{sigma_mm:.5},{auto_takes}"
        );
    }
    out
}

/// How far what was found lies from what was said, in sigma: cuts of one arm taken as one draw, and each as its own.
fn apart(cuts: &[&Cut]) -> [f64; 2] {
    let (mut sums, mut variance) = (BTreeMap::<u64, f64>::new(), 0.0);
    for cut in cuts {
        let worse = f64::from(cut.off_mm[1] > cut.off_mm[0]);
        *sums.entry(cut.arm).or_default() += worse - cut.chance;
        variance += cut.chance * (1.0 - cut.chance);
    }
    let sum: f64 = sums.values().sum();
    let by_arm: f64 = sums.values().map(|s| s * s).sum();
    let z = |variance: f64| if variance > 0.0 { sum / variance.sqrt() } else { 0.0 };
    [z(by_arm), z(variance)]
}

/// Whether cuts get worse as often as was said.
fn risks(key: &str, cuts: &[Cut]) {
    println!("\n{key}: cuts that get worse, said and found");
    for placement in [Placement::Shape, Placement::Absolute] {
        for (low, high) in [(0.0, 0.01), (0.01, 0.1), (0.1, 0.2), (0.2, 0.35), (0.35, 0.51)] {
            let here: Vec<&Cut> = cuts
                .iter()
                .filter(|c| c.placement == placement && c.chance >= low && c.chance < high)
                .collect();
            let said: f64 = here.iter().map(|c| c.chance).sum();
            let found = here.iter().filter(|c| c.off_mm[1] > c.off_mm[0]).count();
            println!(
                "  {placement:?} {low:4.2}..{high:4.2}: {:5} cuts, said {said:6.1}, found {found}",
                here.len()
            );
        }
        let all: Vec<&Cut> = cuts.iter().filter(|c| c.placement == placement).collect();
        let said: f64 = all.iter().map(|c| c.chance).sum();
        let found = all.iter().filter(|c| c.off_mm[1] > c.off_mm[0]).count();
        let [by_arm, binomial] = apart(&all);
        println!(
            "  {placement:?} all: {:5} cuts, said {said:6.1}, found {found}, z {by_arm:.2} by arm ({binomial:.2} binomial)",
            all.len()
        );
        let written: Vec<&Cut> =
            cuts.iter().filter(|c| c.placement == placement && c.chance <= 0.1).collect();
        let worse = written.iter().filter(|c| c.off_mm[1] > c.off_mm[0]).count();
        let mean = |k: usize| written.iter().map(|c| c.off_mm[k]).sum::<f64>() / written.len().max(1) as f64;
        println!(
            "  {placement:?} with --max-risk 0.1: {} written, {worse} worse ({:.1} %), mean {:.3} -> {:.3} mm",
            written.len(),
            100.0 * worse as f64 / written.len().max(1) as f64,
            mean(0),
            mean(1)
        );
    }
    let auto: Vec<&Cut> = cuts.iter().filter(|c| c.auto_takes && c.chance <= 0.1).collect();
    let worse = auto.iter().filter(|c| c.off_mm[1] > c.off_mm[0]).count();
    let share = |count: f64| 100.0 * count / auto.len().max(1) as f64;
    let said: f64 = auto.iter().map(|c| c.chance).sum();
    println!(
        "  auto: {} written, {worse} worse ({:.1} %), said {said:.1} ({:.1} %)",
        auto.len(),
        share(worse as f64),
        share(said)
    );
}
