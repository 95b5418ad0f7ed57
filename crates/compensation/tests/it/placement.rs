//! Shape and position of a path, and the probability that a correction does harm: compared with arms drawn from the model's
//! covariance.

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use truegrind_arm::estimated::{Estimated, EstimatedParameter};
use truegrind_arm::model::{Joints, Model};
use truegrind_arm::parameter::{LinkCoordinate, Parameter};
use truegrind_compensation::cell::{Cell, CellFrame, FrameOrigin};
use truegrind_compensation::deviation::{MotionStatus, PathPoint, PathReport};
use truegrind_compensation::options::Options;
use truegrind_compensation::plan::Plan;
use truegrind_compensation::plan::reason::OutcomeReason;
use truegrind_compensation::risk::cut_risk::CutRisk;
use truegrind_compensation::risk::placement::Placement;

use super::{blade, estimated, nominal, perturbed, rewritten, run_on, worst};

/// The blade, whose passes are set apart by air moves: the first motion behind each stop is one.
fn passes() -> (Vec<u8>, Vec<Joints>) {
    let (source, joints) = blade();
    let mut stopped = false;
    let lines = std::str::from_utf8(&source).unwrap().lines().map(|line| {
        let out = if stopped { line.replace("MoveL ", "MoveJ ") } else { line.to_owned() };
        stopped = if line.contains("Move") { line.contains(",fine,") } else { stopped };
        out + "\n"
    });
    (lines.collect::<String>().into_bytes(), joints)
}

/// A correct model whose data did not determine the zero of joint 1.
fn placed_somewhere(seed: u64, joints: &[Joints]) -> Estimated {
    placed_to(0.02, seed, joints)
}

/// A correct model that knows the zero of joint 1 to `sigma_rad`.
fn placed_to(sigma_rad: f64, seed: u64, joints: &[Joints]) -> Estimated {
    let mut known = estimated(perturbed(seed, 1.0), joints);
    let turn = Parameter::Link { joint: 0, coordinate: LinkCoordinate::Theta };
    let k = known.order.iter().position(|p| *p == turn).unwrap();
    known.covariance[(k, k)] = sigma_rad.powi(2);
    known
}

fn with(placement: Placement) -> Options {
    Options { placement, ..Options::default() }
}

/// The part of displacements that a rigid motion of the points explains.
pub(super) fn rigid(points: &[Vector3<f64>]) -> DMatrix<f64> {
    let centre = points.iter().sum::<Vector3<f64>>() / points.len() as f64;
    let mut motions = DMatrix::zeros(3 * points.len(), 6);
    for (k, p) in points.iter().enumerate() {
        motions.view_mut((3 * k, 0), (3, 3)).copy_from(&Matrix3::identity());
        motions.view_mut((3 * k, 3), (3, 3)).copy_from(&(-((p - centre) / 100.0).cross_matrix()));
    }
    let basis = motions.svd(true, false).u.unwrap();
    &basis * basis.transpose()
}

fn cut_points(report: &PathReport) -> Vec<&PathPoint> {
    report.points.iter().filter(|p| p.cutting).collect()
}

fn deviations(points: &[&PathPoint], after: bool) -> DVector<f64> {
    let of = |p: &&PathPoint| if after { p.after.unwrap() } else { p.before.unwrap() };
    DVector::from_iterator(3 * points.len(), points.iter().flat_map(|p| of(p).vector_mm.as_slice().to_vec()))
}

#[test]
fn a_place_that_is_not_known_stays_and_the_shape_is_corrected() {
    let (source, joints) = blade();
    for seed in 0..3 {
        let known = placed_somewhere(seed, &joints);
        let (plan, program) = rewritten(&source, &known, &Cell::default(), &with(Placement::Auto));
        let [placement] = plan.placements.as_slice() else { panic!("{:?}", plan.placements) };
        assert_eq!(placement.applied, Placement::Shape);
        assert!(placement.sigma_mm > placement.deviation_mm && !placement.taught);
        let report = run_on(&known.model, &source, &program, &Cell::default());
        let points = cut_points(&report);
        let places: Vec<Vector3<f64>> = points.iter().map(|p| p.intended.translation.vector).collect();
        let projector = rigid(&places);
        let (before, after) = (deviations(&points, false), deviations(&points, true));
        // What remains is the position of the path as a whole, and nothing of its shape.
        let shape = |d: &DVector<f64>| (d - &projector * d).amax();
        assert!(shape(&before) > 0.02, "{}", shape(&before));
        assert!(shape(&after) < 2e-3, "{}", shape(&after));
        let moved = (&projector * &before - &after).amax();
        assert!(moved < 5e-3, "the place moved by {moved} mm");
        assert!(
            (after.norm() / (points.len() as f64).sqrt() - placement.deviation_mm).abs()
                < 0.02 * placement.deviation_mm
        );
    }
}

/// A pattern and the same one displaced by the program lie on one part: each had a place of its own, and the distance between them kept
/// its error, or got a worse one where one of the two was corrected.
#[test]
fn patterns_that_the_program_displaces_keep_their_distance() {
    let (_, joints) = blade();
    let pattern: String = [[380.0, -120.0], [420.0, -120.0], [420.0, -80.0], [380.0, -80.0]]
        .map(|[x, y]| {
            format!("MoveL [[{x},{y},300],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v20,fine,tool0;\n")
        })
        .concat();
    let displaced = format!("PDispSet [[0,200,0],[1,0,0,0]];\n{pattern}PDispOff;\n");
    let source = format!("MODULE M\nPROC main()\nConfL\\Off;\n{pattern}{displaced}ENDPROC\nENDMODULE\n");
    for seed in 0..3 {
        let mut known = placed_somewhere(seed, &joints);
        (known.region.min_deg, known.region.max_deg) = ([-400.0; 6], [400.0; 6]);
        known.region.spacing_deg = 1e6;
        let options = Options { max_risk: 1.0, ..with(Placement::Shape) };
        let (plan, program) = rewritten(source.as_bytes(), &known, &Cell::default(), &options);
        let [placement] = plan.placements.as_slice() else { panic!("{:?}", plan.placements) };
        assert_eq!(placement.applied, Placement::Shape);
        let report = run_on(&known.model, source.as_bytes(), &program, &Cell::default());
        let points = cut_points(&report);
        assert_eq!(points.len(), 8);
        let places: Vec<Vector3<f64>> = points.iter().map(|p| p.intended.translation.vector).collect();
        let projector = rigid(&places);
        let shape = |d: &DVector<f64>| (d - &projector * d).amax();
        let (before, after) = (deviations(&points, false), deviations(&points, true));
        assert!(shape(&before) > 0.02, "{}", shape(&before));
        assert!(shape(&after) < 2e-3, "{}", shape(&after));
    }
}

/// A square of lines over each of two work objects that stand 200 mm apart. `frames`: their user and object frames.
fn two_objects(frames: [[[f64; 3]; 2]; 2]) -> String {
    let frame = |[x, y, z]: [f64; 3]| format!("[[{x},{y},{z}],[1,0,0,0]]");
    let declared = |name: &str, [user, object]: [[f64; 3]; 2]| {
        format!("PERS wobjdata {name}:=[FALSE,TRUE,\"\",{},{}];\n", frame(user), frame(object))
    };
    let square = |name: &str| -> String {
        let corners = [[0.0, 0.0], [40.0, 0.0], [40.0, 40.0], [0.0, 40.0]].map(|[x, y]| {
            format!("MoveL [[{x},{y},0],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v20,fine,tool0\\WObj:={name};\n")
        });
        // No path joins the squares.
        corners.concat().replacen("MoveL", "MoveJ", 1)
    };
    let data = declared("wA", frames[0]) + &declared("wB", frames[1]);
    format!(
        "MODULE M\n{data}PROC main()\nConfL\\Off;\nConfJ\\Off;\n{}{}ENDPROC\nENDMODULE\n",
        square("wA"),
        square("wB")
    )
}

/// Two work objects in one user frame lie on one fixture: their placement was decided for each, so that the distance between them got the whole
/// error of the placement where one of them was corrected.
#[test]
fn work_objects_in_one_user_frame_are_placed_together() {
    let (_, joints) = blade();
    const FIXTURE: [f64; 3] = [380.0, -120.0, 300.0];
    let together = two_objects([[FIXTURE, [0.0; 3]], [FIXTURE, [0.0, 200.0, 0.0]]]);
    let separate = two_objects([[FIXTURE, [0.0; 3]], [[380.0, 80.0, 300.0], [0.0; 3]]]);
    // Given in the base, they are two places of their own as well.
    let in_base = two_objects([[[0.0; 3], FIXTURE], [[0.0; 3], [380.0, 80.0, 300.0]]]);
    let mut seen = 0;
    for seed in 0..8 {
        // The shape is known well, the zero of joint 1 so well that the place of each object could be corrected or not.
        let mut known = placed_to(1.2e-3, seed, &joints);
        (known.region.min_deg, known.region.max_deg) = ([-400.0; 6], [400.0; 6]);
        known.region.spacing_deg = 1e6;
        let placed = |source: &str, cell: &Cell, max_risk: f64| {
            let options = Options { max_risk, ..with(Placement::Auto) };
            rewritten(source.as_bytes(), &known, cell, &options)
        };
        let none = Cell::default();
        let harm = placed(&separate, &none, 1.0)
            .0
            .placements
            .iter()
            .map(|p| p.probability_of_harm)
            .collect::<Vec<_>>();
        // Half of the accepted risk lies between the two.
        let between = harm[0] + harm[1];
        if !(harm[0] - harm[1] > 1e-6 || harm[1] - harm[0] > 1e-6) {
            continue;
        }
        let applied = |plan: &Plan| plan.placements.iter().map(|p| p.applied).collect::<Vec<_>>();
        for source in [&separate, &in_base] {
            let (plan, _) = placed(source, &none, between);
            seen += usize::from(applied(&plan)[0] != applied(&plan)[1]);
        }
        let (plan, program) = placed(&together, &none, between);
        let [placement] = plan.placements.as_slice() else { panic!("{:?}", plan.placements) };
        assert_eq!((placement.work_object.as_str(), &placement.others), ("wA", &vec!["wB".to_owned()]));
        let report = run_on(&known.model, together.as_bytes(), &program, &none);
        let points = cut_points(&report);
        let places: Vec<Vector3<f64>> = points.iter().map(|p| p.intended.translation.vector).collect();
        let projector = rigid(&places);
        let shape = |d: &DVector<f64>| (d - &projector * d).amax();
        let (before, after) = (deviations(&points, false), deviations(&points, true));
        assert!(shape(&before) > 0.005, "{}", shape(&before));
        assert!(shape(&after) < 2e-3, "{}", shape(&after));
        // One that was taught has a place that its own touches tell.
        let taught = Cell { wobj: vec![CellFrame::of("wB", FrameOrigin::Taught)], ..Cell::default() };
        assert_eq!(placed(&together, &taught, between).0.placements.len(), 2);
    }
    assert!(seen > 3, "{seen}");
}

/// A path through three work objects in user frames of their own, the first of which an air move leads to in `wobj0`. `start`: that move.
fn one_path(start: &str) -> String {
    let at = |[x, y]: [i32; 2]| format!("[[{x},{y},0],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]");
    let line = |to: [i32; 2], zone: &str, object: &str| {
        format!("MoveL {},v20,{zone},tool0\\WObj:={object};\n", at(to))
    };
    let lines = [
        line([0, 0], "z1", "wA"),
        line([60, 0], "z1", "wA"),
        line([0, 0], "z1", "wB"),
        line([60, 30], "fine", "wB"),
        line([40, 40], "z1", "wC"),
        line([-40, 60], "fine", "wC"),
    ];
    let frame = |name: &str, y: f64| {
        format!("PERS wobjdata {name}:=[FALSE,TRUE,\"\",[[380,{y},300],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];\n")
    };
    let data = frame("wA", -120.0) + &frame("wB", -40.0) + &frame("wC", 60.0);
    format!(
        "MODULE M\n{data}PROC main()\nConfL\\Off;\nConfJ\\Off;\n{start}{}ENDPROC\nENDMODULE\n",
        lines.concat()
    )
}

/// A path through several work objects got a placement, and where only the shape was corrected a registration, in each of them: it had a step
/// where they meet, and at a start that was reached in `wobj0` or by a joint target.
#[test]
fn one_path_has_one_placement() {
    let (_, joints) = blade();
    let by_air =
        one_path("MoveJ [[330,-120,300],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tool0;\n");
    for seed in 0..3 {
        let mut known = placed_somewhere(seed, &joints);
        (known.region.min_deg, known.region.max_deg) = ([-400.0; 6], [400.0; 6]);
        known.region.spacing_deg = 1e6;
        let planned = |source: &str| {
            let options = Options { max_risk: 1.0, joint_targets: true, ..with(Placement::Shape) };
            rewritten(source.as_bytes(), &known, &Cell::default(), &options)
        };
        let start = planned(&by_air).0.points[0].joints_before.unwrap();
        let start: Vec<String> = start.iter().map(|q| format!("{:.9}", q.to_degrees())).collect();
        let by_joints = one_path(&format!(
            "MoveAbsJ [[{}],[9E9,9E9,9E9,9E9,9E9,9E9]]\\NoEOffs,v100,fine,tool0;\n",
            start.join(",")
        ));
        for source in [&by_air, &by_joints] {
            let (plan, program) = planned(source);
            let [placement] = plan.placements.as_slice() else { panic!("{:?}", plan.placements) };
            assert_eq!(1 + placement.others.len(), 4, "{placement:?}");
            let report = run_on(&known.model, source.as_bytes(), &program, &Cell::default());
            // With the start.
            let points: Vec<&PathPoint> = report.points.iter().collect();
            assert_eq!(points.len(), 7);
            let places: Vec<Vector3<f64>> = points.iter().map(|p| p.intended.translation.vector).collect();
            let projector = rigid(&places);
            let shape = |d: &DVector<f64>| (d - &projector * d).amax();
            let (before, after) = (deviations(&points, false), deviations(&points, true));
            assert!(shape(&before) > 0.01, "{}", shape(&before));
            assert!(shape(&after) < 2e-3, "{}", shape(&after));
        }
        // What holds for one of them holds for all: nobody knows where one stands that was taught by unknown points.
        let taught = Cell { wobj: vec![CellFrame::of("wB", FrameOrigin::Taught)], ..Cell::default() };
        let options = Options { max_risk: 1.0, ..with(Placement::Auto) };
        let (plan, _) = rewritten(by_air.as_bytes(), &known, &taught, &options);
        let [placement] = plan.placements.as_slice() else { panic!("{:?}", plan.placements) };
        assert_eq!((placement.applied, placement.unlocated), (Placement::Shape, true));
    }
}

#[test]
fn a_place_that_is_known_is_corrected_and_can_be_asked_for() {
    let (source, joints) = blade();
    for (known, placement) in [
        (estimated(perturbed(1, 1.0), &joints), Placement::Auto),
        (placed_somewhere(1, &joints), Placement::Absolute),
    ] {
        let options = Options { max_risk: 1.0, ..with(placement) };
        let (plan, program) = rewritten(&source, &known, &Cell::default(), &options);
        assert_eq!(plan.placements[0].applied, Placement::Absolute);
        let report = run_on(&known.model, &source, &program, &Cell::default());
        assert!(worst(&report, true) < 5e-4, "{}", worst(&report, true));
    }
}

#[test]
fn a_place_is_corrected_within_half_of_the_accepted_risk() {
    let (source, joints) = blade();
    let known = Drawn::about(3, &joints, 0.7).known;
    let applied = |max_risk: f64| {
        let options = Options { max_risk, ..with(Placement::Auto) };
        let (plan, _) = rewritten(&source, &known, &Cell::default(), &options);
        plan.placements[0].clone()
    };
    let place = applied(1.0);
    assert!(place.sigma_mm < place.deviation_mm && place.probability_of_harm > 1e-4, "{place:?}");
    assert_eq!(applied(1.9 * place.probability_of_harm).applied, Placement::Shape);
    assert_eq!(applied(2.1 * place.probability_of_harm).applied, Placement::Absolute);
}

#[test]
fn what_was_taught_by_unknown_points_stays_in_place() {
    let (source, joints) = blade();
    let known = estimated(perturbed(1, 1.0), &joints);
    let cell = Cell { wobj: vec![CellFrame::of("wobjBlade", FrameOrigin::Taught)], ..Cell::default() };
    for (placement, applied) in
        [(Placement::Auto, Placement::Shape), (Placement::Absolute, Placement::Absolute)]
    {
        let (plan, _) = rewritten(&source, &known, &cell, &with(placement));
        let [found] = plan.placements.as_slice() else { panic!("{:?}", plan.placements) };
        assert_eq!((found.applied, found.unlocated), (applied, true));
    }
    let (plan, _) = rewritten(&source, &known, &Cell::default(), &with(Placement::Auto));
    assert_eq!((plan.placements[0].applied, plan.placements[0].unlocated), (Placement::Absolute, false));
}

/// Arms drawn about the estimated one with covariance F Fᵀ.
struct Drawn {
    known: Estimated,
    factor: DMatrix<f64>,
    random: ChaCha8Rng,
}

impl Drawn {
    /// Uncertain by some hundredths of a millimetre, more or less in each direction.
    fn about(seed: u64, joints: &[Joints], scale: f64) -> Self {
        let mut known = estimated(perturbed(seed, 0.15), joints);
        let n = known.order.len();
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut factor = DMatrix::from_fn(n, n, |_, _| random.random_range(-1.0..1.0) * scale);
        for (k, parameter) in known.order.iter().enumerate() {
            let Parameter::Link { coordinate, .. } = parameter else { continue };
            factor.row_mut(k).scale_mut(if coordinate.is_length() { 0.02 } else { 5e-5 });
        }
        known.covariance = &factor * factor.transpose();
        Self { known, factor, random }
    }

    fn arm(&mut self) -> Model {
        let z = DVector::from_fn(self.factor.ncols(), |_, _| StandardNormal.sample(&mut self.random));
        let by: DVector<f64> = &self.factor * z;
        let mut model = self.known.model.clone();
        for (parameter, by) in self.known.order.iter().zip(by.iter()) {
            let Parameter::Link { joint, coordinate } = *parameter else { continue };
            let link = &mut model.links[joint];
            link.set(coordinate, link.get(coordinate) + by);
        }
        model
    }
}

/// Position of an arm's tool at the motions of all cuts, in their order.
fn reached(model: &Model, plan: &Plan) -> (Vec<Vector3<f64>>, DVector<f64>) {
    let arm = model.at_condition(&truegrind_arm::condition::Condition::default());
    assert_eq!(plan.points.len(), plan.outcomes.len(), "every motion has a pose");
    let of = |motion: &u32| {
        let p = &plan.points[*motion as usize];
        (arm.forward(&p.joints_before.unwrap()) * p.flange_from_tool).translation.vector
    };
    let all: Vec<Vector3<f64>> = plan.cuts.iter().flat_map(|cut| &cut.motions).map(of).collect();
    let values = all.iter().flat_map(|v| v.as_slice().to_vec()).collect::<Vec<f64>>();
    (all, DVector::from_vec(values))
}

#[test]
fn the_sigma_of_the_shape_is_the_scatter_of_arms_that_are_drawn() {
    let (source, joints) = passes();
    let mut drawn = Drawn::about(4, &joints, 1.0);
    let options = Options { max_risk: 1.0, ..with(Placement::Shape) };
    let (plan, _) = rewritten(&source, &drawn.known, &Cell::default(), &options);
    assert!(plan.cuts.len() > 5);
    let arms: Vec<Model> = (0..300).map(|_| drawn.arm()).collect();
    // The path over the part is registered as a whole.
    let (places, middle) = reached(&drawn.known.model, &plan);
    let projector = rigid(&places);
    let mut all_squares = DVector::zeros(middle.len());
    for arm in &arms {
        let off = reached(arm, &plan).1 - &middle;
        let shape = &off - &projector * &off;
        all_squares += shape.component_mul(&shape);
    }
    let mut first = 0;
    for cut in &plan.cuts {
        let squares = all_squares.rows(first, 3 * cut.motions.len());
        first += squares.len();
        let found = (squares.sum() / arms.len() as f64 / cut.motions.len() as f64).sqrt();
        assert!((found / cut.shape_sigma_mm - 1.0).abs() < 0.12, "{found} against {}", cut.shape_sigma_mm);
        for (k, motion) in cut.motions.iter().enumerate().step_by(7) {
            let said = plan.outcomes[*motion as usize].shape_sigma_mm.get().unwrap();
            let found = (squares.rows(3 * k, 3).sum() / arms.len() as f64).sqrt();
            assert!((found / said - 1.0).abs() < 0.25, "motion {motion}: {found} against {said}");
        }
    }
}

#[test]
fn the_chance_that_a_cut_gets_worse_is_the_share_of_drawn_arms_on_which_it_does() {
    let (source, joints) = passes();
    for (placement, scale) in [(Placement::Shape, 0.7), (Placement::Absolute, 3.0)] {
        let mut drawn = Drawn::about(7, &joints, scale);
        let options = Options { max_risk: 1.0, ..with(placement) };
        let (plan, _) = rewritten(&source, &drawn.known, &Cell::default(), &options);
        let arms: Vec<Model> = (0..400).map(|_| drawn.arm()).collect();
        let telling: Vec<&CutRisk> =
            plan.cuts.iter().filter(|c| (0.02..0.45).contains(&c.probability_of_harm)).collect();
        let (places, estimate) = reached(&drawn.known.model, &plan);
        let (_, told) = reached(&nominal(), &plan);
        let projector = rigid(&places);
        let counts = |d: DVector<f64>| if placement == Placement::Shape { &d - &projector * &d } else { d };
        // Deviation of each arm from the estimate and from the nominal arm, of all cuts.
        let off: Vec<[DVector<f64>; 2]> = arms
            .iter()
            .map(|arm| {
                let truth = reached(arm, &plan).1;
                [counts(&truth - &estimate), counts(&truth - &told)]
            })
            .collect();
        let first = |cut: &CutRisk| -> usize {
            let before = plan.cuts.iter().take_while(|other| other.motions != cut.motions);
            before.map(|other| 3 * other.motions.len()).sum()
        };
        let chances: Vec<f64> = plan.cuts.iter().map(|c| c.probability_of_harm).collect();
        assert!(telling.len() > 2, "{placement:?}: {chances:?} show nothing");
        for cut in telling {
            let (first, count) = (first(cut), 3 * cut.motions.len());
            let worse = off
                .iter()
                .filter(|[after, before]| after.rows(first, count).norm() > before.rows(first, count).norm());
            let share = worse.count() as f64 / arms.len() as f64;
            let sigma =
                (cut.probability_of_harm * (1.0 - cut.probability_of_harm) / arms.len() as f64).sqrt();
            assert!(
                (share - cut.probability_of_harm).abs() < 3.5 * sigma + 0.01,
                "{placement:?}: {share} against {}",
                cut.probability_of_harm
            );
        }
    }
}

/// The class of fault: a correction that is as likely to follow the noise of the measurement as the arm.
#[test]
fn a_cut_that_would_too_likely_get_worse_is_left_whole_with_that_reason() {
    let (source, joints) = passes();
    let drawn = Drawn::about(7, &joints, 2.0);
    let (plan, program) = rewritten(&source, &drawn.known, &Cell::default(), &with(Placement::Shape));
    let left: Vec<&CutRisk> = plan.cuts.iter().filter(|cut| cut.left_for_risk).collect();
    assert!(left.len() > 3, "{:?}", plan.cuts.iter().map(|c| c.probability_of_harm).collect::<Vec<_>>());
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).lines().map(str::to_owned).collect::<Vec<_>>();
    let (before, after) = (text(&source), text(&program));
    let task = truegrind_programs::rapid::Task::read(&[("p.mod", source.as_slice())]);
    for cut in &left {
        assert!(cut.probability_of_harm > 0.1);
        for motion in &cut.motions {
            let outcome = &plan.outcomes[*motion as usize];
            assert_eq!(
                (outcome.status, outcome.reason()),
                (MotionStatus::Left, Some(OutcomeReason::Risk { chance: cut.probability_of_harm }))
            );
            let line = &before[task.listing.motions[*motion as usize].place.line as usize - 1];
            assert!(after.contains(line), "{line}");
        }
    }
    // A higher risk can be accepted.
    let largest = left.iter().map(|cut| cut.probability_of_harm).fold(0.0, f64::max);
    let options = Options { max_risk: largest + 0.01, ..with(Placement::Shape) };
    let (taken, _) = rewritten(&source, &drawn.known, &Cell::default(), &options);
    assert!(
        taken.outcomes.iter().all(|outcome| !matches!(outcome.reason(), Some(OutcomeReason::Risk { .. })))
    );
    assert!(taken.probability_of_harm.unwrap() < 0.5);
}

/// Whether σ is what the readings scatter or a tolerance of which they show nothing makes a difference to who has to measure again.
#[test]
fn sigma_that_no_reading_has_seen_is_told_as_such() {
    let (source, joints) = passes();
    let mut drawn = Drawn::about(7, &joints, 3.0);
    let said = |known: &Estimated| {
        let options = Options { max_risk: 1.0, ..with(Placement::Absolute) };
        let (plan, _) = rewritten(&source, known, &Cell::default(), &options);
        let note = plan.notes.iter().find(|note| note.contains("did not determine")).cloned();
        (plan.cuts.iter().map(|cut| cut.sigma_mm).fold(0.0, f64::max), note)
    };
    let names: Vec<String> = drawn.known.order.iter().map(ToString::to_string).collect();
    drawn.known.parameters = names
        .iter()
        .map(|name| EstimatedParameter {
            name: name.clone(),
            unit: String::new(),
            nominal: 0.0,
            value: 0.0,
            sigma: 1.0,
            prior_sigma: None,
            determined: 0.99,
        })
        .collect();
    let (sigma_mm, note) = said(&drawn.known);
    assert_eq!(note, None);
    drawn.known.parameters.iter_mut().for_each(|one| one.determined = 0.1);
    let (same_mm, note) = said(&drawn.known);
    assert_eq!(sigma_mm, same_mm);
    let note = note.unwrap();
    assert!(
        note.contains(&format!("the {sigma_mm:.3} mm (1σ) stated for a cut come from parameters")),
        "{note}"
    );
    assert!(names.iter().any(|name| note.contains(name)), "{note}");
}
